// Proves that `step` neither allocates, locks, throws nor touches a file, for every law: the functions that would do so
// are replaced in this program, and count while the trap is armed.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cmath>
#include <cstdarg>
#include <cstdlib>
#include <mutex>
#include <stdexcept>

#include "asperity/field/mesostructure_generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/render/step.h"

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

namespace asperity {
namespace {

struct Counts {
  int allocations, locks, throws, files;
};

template <class F>
Counts trapped(F&& work) {
  allocations = locks = throws = files = 0;
  armed = true;
  work();
  armed = false;
  return {allocations, locks, throws, files};
}

TEST(Trap, CatchesWhatItShould) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  std::mutex mutex;
  const Counts counts = trapped([&] {
    std::vector<int> grown(100);
    const std::lock_guard<std::mutex> guard(mutex);
    EXPECT_EQ(::write(-1, "", 0), -1);
    try {
      throw std::runtime_error("expected");
    } catch (const std::runtime_error&) {
    }
  });
  EXPECT_GE(counts.allocations, 2);
  EXPECT_GE(counts.locks, 1);
  EXPECT_GE(counts.throws, 1);
  EXPECT_GE(counts.files, 1);
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

class StepTrap : public ::testing::TestWithParam<std::string> {};

TEST_P(StepTrap, NeitherAllocatesLocksThrowsNorTouchesFiles) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers replace the same functions";
#endif
  const Law law = law_by_name(GetParam()).value();
  for (const SearchStructure structure : {SearchStructure::bvh, SearchStructure::octree}) {
    for (const double radius : {0.0, 0.002}) {
      if (radius > 0.0 && !constrains(law)) continue;
      const Scene scene = scene_with(law, structure, radius);
      ProxyState state;
      int touching = 0;
      // A ball on a relief takes milliseconds a tick: fewer of them.
      const int ticks = radius > 0.0 && law_name(law) == "proxy" ? 200 : 4000;
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
          touching += step(scene, state, probe, Seconds(1e-3)).flags.has(TickFlag::contact) ? 1 : 0;
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

INSTANTIATE_TEST_SUITE_P(EveryLaw, StepTrap, ::testing::ValuesIn(law_names()), [](const auto& parameter) {
  std::string name = parameter.param;
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
});

}  // namespace
}  // namespace asperity
