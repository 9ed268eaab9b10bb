#include <algorithm>
#include <memory>
#include <vector>

#include "asperity/geometry/generators.h"
#include "asperity/render/step.h"
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

constexpr double still = 0.3;
constexpr double sliding = 0.2;

/// One way of feeling the sphere.
struct Fine {
  std::string name;
  bool has_friction = true;
  FrictionKind friction = FrictionKind::implicit_coulomb;
  std::shared_ptr<const FineFeatures> features;
};

/// The sphere felt in one way, and a probe that slides over it.
struct Touch {
  Scene scene;
  std::shared_ptr<const Slide> slide;
  ProxyState state = {};
  ProxyCache cache = {};
  ProbeSample probe = {};

  bool tick(std::size_t at) {
    const Vec3 before = probe.pose.position;
    probe.pose.position = slide->probe(at % slide->direction.size(), 0.0);
    probe.twist.linear = (probe.pose.position - before) / tick_seconds;
    return step(scene, state, cache, probe, Seconds(tick_seconds)).flags.has(TickFlag::contact);
  }
};

Result<Touch> touch_of(const Fine& fine, const std::shared_ptr<const MeshSurface>& surface,
                       const std::shared_ptr<const Slide>& slide) {
  Instance sphere;
  sphere.name = "sphere";
  sphere.surface = surface;
  sphere.sides = Sides::front;
  sphere.fine = fine.features;
  if (fine.has_friction) {
    sphere.material.static_friction = still;
    sphere.material.dynamic_friction = sliding;
    sphere.material.friction.kind = fine.friction;
    sphere.material.friction_named = true;
    // A spring of its own, so that the proxy does not hold the friction.
    if (fine.friction == FrictionKind::implicit_coulomb) sphere.material.friction.stiffness = 500.0;
    if (fine.friction == FrictionKind::viscous) sphere.material.friction.viscosity = 1.0;
  }
  ASPERITY_TRY(Scene scene, Scene::build({sphere}, 0.0));
  Touch touch{std::move(scene), slide};
  touch.probe.pose.position = 1.5 * sphere_radius * slide->direction.front();
  step(touch.scene, touch.state, touch.cache, touch.probe, Seconds(tick_seconds));
  return touch;
}

/// What one way of feeling costs more a tick than another (ns): both slide over the same places in turn, so that what
/// the machine does besides meets both alike.
double extra_ns(Touch bare, Touch fine, std::size_t updates) {
  constexpr std::size_t batch = 8;
  std::vector<double> differences;
  differences.reserve(updates / batch);
  const auto batch_ns = [](Touch& touch, std::size_t at) {
    const Clock::time_point start = Clock::now();
    for (std::size_t i = 0; i < batch; ++i) touch.tick(at + i);
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  };
  for (std::size_t at = 0; at < updates; at += batch) {
    // Who comes second finds the mesh in the caches: they take turns.
    const bool bare_first = (at / batch) % 2 == 0;
    const double first = batch_ns(bare_first ? bare : fine, at);
    const double second = batch_ns(bare_first ? fine : bare, at);
    differences.push_back((bare_first ? second - first : first - second) / batch);
  }
  // Of pairs of turns, so that the advantage of being second cancels.
  std::vector<double> pairs;
  for (std::size_t i = 0; i + 1 < differences.size(); i += 2)
    pairs.push_back(0.5 * (differences[i] + differences[i + 1]));
  if (pairs.empty()) return 0.0;
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(pairs.size() / 2);
  std::nth_element(pairs.begin(), middle, pairs.end());
  return *middle;
}

/// 20 um of amplitude on 2.5 mm: shallow, so that the pressed probe touches the relief throughout.
Result<std::shared_ptr<const FineFeatures>> texture_of(FeatureKind kind, IntermediateSurface surface,
                                                       double still_ratio) {
  constexpr double wavelength = 2.5e-3;
  FeatureSpec spec;
  spec.kind = kind;
  if (kind == FeatureKind::noise) {
    spec.roughness = 20e-6;
    spec.correlation_length = 0.6e-3;
  } else {
    spec.amplitude = 20e-6;
    spec.wavelength = kind == FeatureKind::grid ? Vec2(wavelength, wavelength) : Vec2(wavelength, 0.0);
  }
  FeatureMappingSettings mapping;
  mapping.surface = surface;
  // A hundred waves around.
  if (surface != IntermediateSurface::plane) mapping.radius = 100.0 * wavelength / (2.0 * 3.141592653589793);
  FineSettings settings;
  ASPERITY_TRY(settings.mapping, FeatureMapping::build(mapping));
  ASPERITY_TRY(SurfaceFeature feature, SurfaceFeature::build(spec));
  settings.texture.push_back(std::move(feature));
  settings.lay.still_ratio = settings.lay.sliding_ratio = still_ratio;
  ASPERITY_TRY(FineFeatures fine, FineFeatures::build(std::move(settings)));
  return std::make_shared<const FineFeatures>(std::move(fine));
}

}  // namespace

Result<Group> measure_fine(int subdivisions, const Effort& effort, double clock_cost) {
  Group group;
  group.kind = "fine";
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(icosphere(subdivisions, sphere_radius)));
  const auto surface = std::make_shared<const MeshSurface>(TriangleIndex::build(std::move(mesh)));
  group.triangles = surface->mesh().triangles().size();
  group.bytes_per_triangle =
      static_cast<double>(surface->index().memory_bytes()) / static_cast<double>(group.triangles);
  const auto slide = std::make_shared<const Slide>(make_slide(surface->index(), effort.ticks()));
  ASPERITY_TRY(const auto plane, texture_of(FeatureKind::grating, IntermediateSurface::plane, 1.0));
  ASPERITY_TRY(const auto cylinder, texture_of(FeatureKind::grating, IntermediateSurface::cylinder, 1.0));
  ASPERITY_TRY(const auto grid, texture_of(FeatureKind::grid, IntermediateSurface::plane, 1.0));
  ASPERITY_TRY(const auto noise, texture_of(FeatureKind::noise, IntermediateSurface::plane, 1.0));
  ASPERITY_TRY(const auto lay, texture_of(FeatureKind::grating, IntermediateSurface::cylinder, 0.5));
  using enum FrictionKind;
  const std::vector<Fine> all{
      {bare_contact, false, implicit_coulomb, nullptr},
      {"friction: implicit-coulomb", true, implicit_coulomb, nullptr},
      {"friction: viscous", true, viscous, nullptr},
      {"friction: coulomb", true, coulomb, nullptr},
      {"friction: karnopp", true, karnopp, nullptr},
      {"friction: dahl", true, dahl, nullptr},
      {"friction: hayward-armstrong", true, hayward_armstrong, nullptr},
      {"friction: lugre", true, lugre, nullptr},
      {"texture: grating by a plane", false, implicit_coulomb, plane},
      {"grating by a plane, implicit-coulomb", true, implicit_coulomb, plane},
      {"grating by a cylinder, implicit-coulomb", true, implicit_coulomb, cylinder},
      {"grid by a plane, karnopp", true, karnopp, grid},
      {"noise by a plane, lugre", true, lugre, noise},
      {"grating by a cylinder, elliptic implicit-coulomb", true, implicit_coulomb, lay},
  };
  std::vector<Row> rows;
  ASPERITY_TRY(const Touch bare, touch_of(all.front(), surface, slide));
  for (const Fine& fine : all) {
    ASPERITY_TRY(Touch touch, touch_of(fine, surface, slide));
    if (fine.name != bare_contact && effort.counted == 0)
      group.on_top.push_back({fine.name, extra_ns(bare, touch, effort.warm), fine.features == lay ? 120.0 : 80.0});
    rows.emplace_back(fine.name, [touch = std::move(touch)](std::size_t tick) mutable { return touch.tick(tick); });
  }
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
