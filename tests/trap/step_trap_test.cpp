// Proves that `step` neither allocates, locks, throws nor touches a file, for every law: the functions that would do so
// are replaced in this program, and count while the trap is armed.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdarg>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "asperity/field/height/detail_pyramid.h"
#include "asperity/field/mesostructure/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/step.h"
#include "tests/field/sparse_grids.h"
#include "tests/field/volumes.h"
#include "tests/trap/trap.h"

namespace {

thread_local bool armed = false;
std::atomic<int> allocations{0};
std::atomic<int> locks{0};
std::atomic<int> throws{0};
std::atomic<int> files{0};

void count(std::atomic<int>& what) {
  if (armed) ++what;
}

template <class F>
F* next(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);  // NOLINT: glibc's own names
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  count(allocations);
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count(allocations);
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  count(allocations);
  return __libc_realloc(p, size);
}
void free(void* p) {
  if (p != nullptr) count(allocations);
  __libc_free(p);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  count(locks);
  static auto* real = next<int(pthread_mutex_t*)>("pthread_mutex_lock");
  return real(mutex);
}
int pthread_cond_signal(pthread_cond_t* condition) {
  count(locks);
  static auto* real = next<int(pthread_cond_t*)>("pthread_cond_signal");
  return real(condition);
}
int pthread_cond_broadcast(pthread_cond_t* condition) {
  count(locks);
  static auto* real = next<int(pthread_cond_t*)>("pthread_cond_broadcast");
  return real(condition);
}
int open(const char* path, int flags, ...) {
  count(files);
  va_list arguments;
  va_start(arguments, flags);
  const unsigned mode = va_arg(arguments, unsigned);
  va_end(arguments);
  static auto* real = next<int(const char*, int, unsigned)>("open");
  return real(path, flags, mode);
}
ssize_t write(int descriptor, const void* data, std::size_t size) {
  count(files);
  static auto* real = next<ssize_t(int, const void*, std::size_t)>("write");
  return real(descriptor, data, size);
}
void __cxa_throw(void* object, void* type, void (*destroy)(void*)) {  // NOLINT
  count(throws);
  static auto* real = next<void(void*, void*, void (*)(void*))>("__cxa_throw");
  real(object, type, destroy);
  __builtin_unreachable();
}
}

namespace asperity::trap {

void arm(bool on) noexcept {
  armed = on;
}
Counts counts() noexcept {
  return {allocations, locks, throws, files};
}
void forget() noexcept {
  allocations = locks = throws = files = 0;
}

}  // namespace asperity::trap

namespace asperity::step_trap_test {
namespace {

using trap::Counts;

template <class F>
Counts trapped(F&& work) {
  trap::forget();
  trap::arm(true);
  work();
  trap::arm(false);
  return trap::counts();
}

TEST(Trap, CatchesWhatItShould) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  std::mutex mutex;
  std::condition_variable told;
  const Counts counts = trapped([&] {
    std::vector<int> grown(100);
    const std::lock_guard<std::mutex> guard(mutex);
    told.notify_one();
    EXPECT_EQ(::write(-1, "", 0), -1);
    try {
      throw std::runtime_error("expected");
    } catch (const std::runtime_error&) {
    }
  });
  EXPECT_GE(counts.allocations, 2);
  EXPECT_GE(counts.locks, 2);
  EXPECT_GE(counts.throws, 1);
  EXPECT_GE(counts.files, 1);
  // What a shared pointer that threads share would do.
  std::shared_ptr<int> shared = std::make_shared<int>(1);
  const Counts by_pointer = trapped([&] { static_cast<void>(*std::atomic_load(&shared)); });
  EXPECT_GE(by_pointer.locks, 1);
}

Scene scene_with(const Law& law, SearchStructure structure, double probe_radius) {
  TriangleMesh mesh = TriangleMesh::build(icosphere(3, 0.05)).value();
  Instance instance;
  instance.name = "sphere";
  instance.law = law;
  instance.sides = Sides::front;
  instance.material.damping = 1.0;
  MesostructureSpec spec;
  spec.kind = MesostructureKind::rings;
  spec.size = 128;
  auto maps = std::make_shared<const Mesostructure>(
      Mesostructure::build(generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline).value(),
                           Vec2(0.01, 0.01))
          .value());
  Coat coat = Coat::build(mesh, maps, {Mapping::triplanar, Vec2::Ones()}).value();
  instance.surface = std::make_shared<const ReliefSurface>(
      MeshSurface(TriangleIndex::build(std::move(mesh), structure)), std::move(coat));
  return Scene::build({instance}, probe_radius).value();
}

/// A sphere of 30 mm as an isosurface, the volume felt by every effect besides.
Scene volume_scene(const Law& law, CellReconstruction reconstruction, double probe_radius, double threshold) {
  static const auto smooth = test::sphere_field(33);
  static const auto trilinear = test::sphere_field(33, CellReconstruction::trilinear);
  const auto& field = reconstruction == CellReconstruction::smooth ? smooth : trilinear;
  Instance instance;
  instance.name = "sphere";
  instance.law = law;
  instance.material.damping = 1.0;
  instance.material.static_friction = 0.3;
  instance.material.dynamic_friction = 0.2;
  instance.surface = std::make_shared<const IsoSurface>(IsoSurface::build(field, threshold, Inside::low).value());
  std::vector<FieldEffect> effects;
  for (std::size_t kind = 0; kind < field_effect_names().size(); ++kind) {
    FieldEffect effect;
    effect.name = field_effect_names()[kind];
    effect.field = field;
    effect.kind = static_cast<FieldEffectKind>(kind);
    effect.transfer = TransferFunction::build({{0.0, 0.1}, {0.02, 0.3}, {0.04, 0.0}}).value();
    effects.push_back(effect);
  }
  return Scene::build({instance}, probe_radius, effects).value();
}

/// A ball of 30 mm as a potential with local materials.
Scene potential_scene(const Law& law, CellReconstruction reconstruction, double probe_radius) {
  static const auto grid = [] {
    SparseSource source = test::sparse_ball(0.001, 0.006)->source();
    for (std::size_t b = 0; b < source.blocks.size(); b += 2) {
      source.blocks[b].material.resize(SparseBlock::points);
      for (PointMaterial& m : source.blocks[b].material) m.stiffness = 700.0F;
    }
    return std::make_shared<const SparseGrid>(SparseGrid::build(std::move(source)).value());
  }();
  static const auto mesh =
      std::make_shared<const MeshSurface>(TriangleIndex::build(TriangleMesh::build(icosphere(3, 0.03)).value()));
  Instance instance;
  instance.name = "ball";
  instance.law = law;
  instance.sides = Sides::front;
  instance.material.damping = 1.0;
  instance.material.static_friction = 0.3;
  instance.material.dynamic_friction = 0.2;
  instance.surface =
      std::make_shared<const ImplicitSurface>(ImplicitSurface::build({grid, grid, mesh, reconstruction, 0.0}).value());
  return Scene::build({instance}, probe_radius).value();
}

/// A tick of a probe with its cache, and now and then without one.
ForceSample tick(const Scene& scene, ProxyState& state, ProxyCache& cache, const ProbeSample& probe, int i) {
  constexpr Seconds dt(1e-3);
  return i % 16 == 15 ? step(scene, state, probe, dt) : step(scene, state, cache, probe, dt);
}

/// Slides in and out of a ball of 30 mm, through its middle now and then, with what is no number among the probes and
/// states begun anew; `scene_at` tells what is felt at a tick.
template <class SceneAt>
void expect_clean(const char* name, int ticks, double radius, const SceneAt& scene_at) {
  ProxyState state;
  ProxyCache cache;
  int touching = 0;
  const Counts counts = trapped([&] {
    for (int i = 0; i < ticks; ++i) {
      const double s = i * 1e-3;
      const double reach = i % 500 < 20 ? 0.04 : (i % 700 == 30 ? 0.0 : 0.0295 + 0.001 * std::sin(20.0 * s));
      ProbeSample probe;
      probe.pose.position = (reach + radius) * Vec3(std::cos(s), std::sin(1.7 * s), std::sin(s)).normalized();
      probe.twist.linear = Vec3(0.01, 0.0, -0.02);
      if (i % 333 == 332) probe.pose.position.x() = std::nan("");
      if (i % 1000 == 999) state = ProxyState{};
      touching += tick(scene_at(i), state, cache, probe, i).flags.has(TickFlag::contact) ? 1 : 0;
    }
  });
  EXPECT_GT(touching, ticks / 8) << name;
  EXPECT_EQ(counts.allocations, 0) << name;
  EXPECT_EQ(counts.locks, 0) << name;
  EXPECT_EQ(counts.throws, 0) << name;
  EXPECT_EQ(counts.files, 0) << name;
}

TEST(PotentialTrap, NeitherAllocatesLocksThrowsNorTouchesFiles) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  for (const char* name : {"proxy", "virtual-contact-point", "virtual-contact-point-literal", "magnetic",
                           "magnetic-literal", "normal-perturbation", "avila", "cross-uncross"}) {
    const Law law = law_by_name(name).value();
    for (const CellReconstruction reconstruction : {CellReconstruction::trilinear, CellReconstruction::smooth}) {
      for (const double radius : {0.0, 0.002}) {
        if (radius > 0.0 && !law.takes_ball()) continue;
        const Scene scene = potential_scene(law, reconstruction, radius);
        expect_clean(name, radius > 0.0 ? 300 : 4000, radius, [&](int) -> const Scene& { return scene; });
      }
    }
  }
}

TEST(VolumeTrap, NeitherAllocatesLocksThrowsNorTouchesFiles) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  for (const char* name : {"proxy", "avila", "avila-literal", "cross-uncross", "cross-uncross-literal"}) {
    const Law law = law_by_name(name).value();
    for (const CellReconstruction reconstruction : {CellReconstruction::trilinear, CellReconstruction::smooth}) {
      for (const double radius : {0.0, 0.002}) {
        if (radius > 0.0 && !law.takes_ball()) continue;
        const Scene scene = volume_scene(law, reconstruction, radius, 0.03);
        const Scene other = volume_scene(law, reconstruction, radius, 0.0305);
        // The threshold changes under the probe now and then.
        expect_clean(name, radius > 0.0 ? 150 : 4000, radius,
                     [&](int i) -> const Scene& { return i % 400 < 200 ? scene : other; });
      }
    }
  }
}

/// A ball of 30 mm with every kind of feature, an anisotropic friction law and a map of coefficients.
Scene fine_scene(FrictionKind friction, IntermediateSurface by, Formulation formulation) {
  static const auto mesh =
      std::make_shared<const MeshSurface>(TriangleIndex::build(TriangleMesh::build(icosphere(4, 0.03)).value()));
  constexpr double around = 2.0 * 3.141592653589793 * 0.03;
  FeatureMappingSettings mapping;
  mapping.surface = by;
  if (by == IntermediateSurface::cylinder || by == IntermediateSurface::sphere) mapping.radius = 0.03;
  if (by == IntermediateSurface::box) mapping.half_extent = Vec3::Constant(0.03);
  FineSettings settings;
  settings.mapping = FeatureMapping::build(mapping).value();
  settings.formulation = formulation;
  for (const FeatureKind kind :
       {FeatureKind::grating, FeatureKind::grid, FeatureKind::triangular, FeatureKind::serrated, FeatureKind::noise}) {
    FeatureSpec spec;
    spec.kind = kind;
    if (kind == FeatureKind::noise) {
      spec.roughness = 20e-6;
      spec.correlation_length = 1e-3;
      spec.period = {around, around};
    } else {
      spec.amplitude = 20e-6;
      spec.wavelength = {around / 60.0, kind == FeatureKind::grid ? around / 40.0 : 0.0};
    }
    settings.texture.push_back(SurfaceFeature::build(spec).value());
  }
  settings.lay.still_ratio = settings.lay.sliding_ratio = 0.5;
  settings.lay.formulation = formulation;
  settings.friction_map.factors = std::make_shared<const HeightMap>(
      HeightMap::build({0.5F, 1.0F, 1.0F, 0.5F}, 2, 2, Wrap::repeat, Reconstruction::quadratic_bspline).value());
  settings.friction_map.tile = Vec2::Constant(around / 8.0);
  Instance instance;
  instance.name = "ball";
  instance.surface = mesh;
  instance.sides = Sides::front;
  instance.fine = std::make_shared<const FineFeatures>(FineFeatures::build(std::move(settings)).value());
  instance.material.static_friction = 0.3;
  instance.material.dynamic_friction = 0.2;
  instance.material.friction.kind = friction;
  instance.material.friction.formulation = formulation;
  instance.material.friction_named = true;
  return Scene::build({instance}, 0.0).value();
}

TEST(FineTrap, NeitherAllocatesLocksThrowsNorTouchesFiles) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  for (const std::string& name : friction_names()) {
    for (const IntermediateSurface by : {IntermediateSurface::plane, IntermediateSurface::cylinder,
                                         IntermediateSurface::sphere, IntermediateSurface::box}) {
      for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
        const Scene scene = fine_scene(friction_by_name(name).value(), by, formulation);
        expect_clean(name.c_str(), 1500, 0.0, [&](int) -> const Scene& { return scene; });
      }
    }
  }
}

/// A sphere of 30 mm in a coat of all that a coat may have, moving and turning, seen and felt larger.
Scene changing_scene(const Law& law, double zoom, double height) {
  static const auto base = MeshSurface(TriangleIndex::build(TriangleMesh::build(icosphere(3, 0.03)).value()));
  MesostructureSpec spec;
  spec.kind = MesostructureKind::rings;
  spec.size = 64;
  spec.amplitude = height;
  const HeightMap heights = generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline).value();
  const Vec2 tile(0.01, 0.01);
  const auto detail =
      std::make_shared<const DetailPyramid>(DetailPyramid::build(heights, tile, {DetailKind::low_pass}).value());
  CoatParts parts;
  parts.maps.push_back(
      std::make_shared<const Mesostructure>(Mesostructure::build(heights, tile).value().with_detail(detail)));
  SolidSpec waves;
  waves.kind = SolidKind::waves;
  waves.frequency = 3.0;
  SolidSpec noise;
  noise.drift = Vec3(1e-3, 0.0, 0.0);
  for (const SolidSpec& solid : {waves, noise}) {
    CoatLayer layer;
    layer.solid = std::make_shared<const SolidMesostructure>(SolidMesostructure::build(solid).value());
    parts.layers.push_back(layer);
  }
  const auto values = [&](float low, float high) {
    return std::make_shared<const HeightMap>(
        HeightMap::build(std::vector<float>{low, high}, 2, 1, Wrap::repeat, Reconstruction::bilinear).value());
  };
  MaterialMaps::Parts maps;
  maps.channels = {values(500.0F, 900.0F), values(0.0F, 2.0F),     values(0.0F, 2.0F),
                   values(0.5F, 1.0F),     values(100.0F, 300.0F), nullptr};
  maps.lay_s = values(0.0F, 0.5F);
  maps.lay_t = values(0.2F, 0.0F);
  parts.materials = std::make_shared<const MaterialMaps>(MaterialMaps::build(std::move(maps)).value());
  CoatSettings laid;
  laid.mapping = Mapping::triplanar;
  Instance instance;
  instance.name = "sphere";
  instance.law = law;
  instance.sides = Sides::front;
  instance.material.damping = 1.0;
  instance.material.static_friction = instance.material.dynamic_friction = 0.3;
  instance.material.stickiness = law.is<ProxyLaw>() ? 0.1 : 0.0;
  instance.motion.velocity.angular = Vec3(0.0, 0.5, 0.1);
  instance.motion.horizon = Seconds(100.0);
  instance.surface =
      std::make_shared<const ReliefSurface>(base, Coat::build(base.mesh(), std::move(parts), laid).value());
  SceneSettings settings;
  settings.view.zoom = zoom;
  settings.view.camera.pixels = 500;
  settings.change_power = 0.01;
  return Scene::build({instance}, settings).value();
}

TEST(ChangeTrap, NeitherAllocatesLocksThrowsNorTouchesFiles) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  for (const char* name : {"proxy", "mesostructure", "height-field"}) {
    const Law law = law_by_name(name).value();
    const std::vector<Scene> scenes{changing_scene(law, 1.0, 2e-4), changing_scene(law, 1.1, 2e-4),
                                    changing_scene(law, 1.0, 4e-4)};
    expect_clean(name, 3000, 0.0, [&](int i) -> const Scene& { return scenes[static_cast<std::size_t>(i / 100) % 3]; });
  }
}

class StepTrap : public ::testing::TestWithParam<std::string> {};

TEST_P(StepTrap, NeitherAllocatesLocksThrowsNorTouchesFiles) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  const Law law = law_by_name(GetParam()).value();
  for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
    for (const double radius : {0.0, 0.002}) {
      if (radius > 0.0 && !law.takes_ball()) continue;
      const Scene scene = scene_with(law, structure, radius);
      ProxyState state;
      ProxyCache cache(scene);
      int touching = 0;
      // A ball on a relief takes longer where nothing is kept: fewer of them.
      const int ticks = radius > 0.0 && law_name(law) == "proxy" ? 1000 : 4000;
      // In the air, into contact, sliding, jumping through, not finite, a fresh state: all of it trapped.
      const Counts counts = trapped([&] {
        for (int i = 0; i < ticks; ++i) {
          const double s = i * 1e-3;
          const double reach = i % 500 < 20 ? 0.07 : (i % 700 == 30 ? 0.0 : 0.0495 + 0.001 * std::sin(20.0 * s));
          ProbeSample probe;
          probe.pose.position = (reach + radius) * Vec3(std::cos(s), std::sin(1.7 * s), std::sin(s)).normalized();
          probe.twist.linear = Vec3(0.01, 0.0, -0.02);
          if (i % 333 == 332) probe.pose.position.x() = std::nan("");
          if (i % 1000 == 999) state = ProxyState{};
          touching += tick(scene, state, cache, probe, i).flags.has(TickFlag::contact) ? 1 : 0;
        }
      });
      EXPECT_GT(touching, ticks / 8);
      EXPECT_EQ(counts.allocations, 0);
      EXPECT_EQ(counts.locks, 0);
      EXPECT_EQ(counts.throws, 0);
      EXPECT_EQ(counts.files, 0);
    }
  }
}

/// The others are felt on volumes: VolumeTrap, PotentialTrap.
std::vector<std::string> laws_of_meshes() {
  std::vector<std::string> names;
  for (const std::string& name : law_names()) {
    const Law law = law_by_name(name).value();
    if (law.facts().needs < LawNeeds::field) names.push_back(name);
  }
  return names;
}

INSTANTIATE_TEST_SUITE_P(EveryLaw, StepTrap, ::testing::ValuesIn(laws_of_meshes()), [](const auto& parameter) {
  std::string name = parameter.param;
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
});

}  // namespace
}  // namespace asperity::step_trap_test
