// The servo thread under all that a live session does around it: scenes handed over every ten milliseconds, readers
// that come and go, a watchdog, a device that lets go; it neither allocates, locks, throws nor touches a file.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "asperity/geometry/generators.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/scene_edit.h"
#include "asperity/render/step.h"
#include "asperity/servo/telemetry.h"
#include "tests/trap/trap.h"

namespace asperity::live_trap_test {
namespace {

/// What is touched. It counts on which threads it is given up: the servo thread's is none of them.
struct Touched {
  Scene scene;
  std::shared_ptr<ProxyCache> cache;
  std::uint64_t number = 0;
  std::thread::id* servo = nullptr;
  std::atomic<int>* freed_there = nullptr;
  ~Touched() {
    if (servo != nullptr && std::this_thread::get_id() == *servo) ++*freed_there;
  }
};

struct Step {
  ProxyState state = {};
  std::thread::id* servo = nullptr;
  ForceSample operator()(const Touched& felt, const ProbeSample& probe, Seconds dt) noexcept {
    *servo = std::this_thread::get_id();
    trap::arm(true);
    return step(felt.scene, state, *felt.cache, probe, dt);
  }
};

struct Feed {
  std::shared_ptr<Telemetry<ProxyState>> telemetry;
  std::atomic<std::uint64_t>* unchecked;
  double last = 0.0;
  bool ends = false;
  void operator()(const LiveTick<Touched, Step>& tick) noexcept {
    telemetry->put(tick, tick.felt.number, tick.step.state);
    // The safety stage has looked at it: what is sent is what it last let through.
    if (tick.record.commanded != tick.safety.last_force() || !tick.record.commanded.allFinite()) ++*unchecked;
    ends = ends || tick.notes.withheld;
    if (ends && tick.record.commanded.isZero()) trap::arm(false);
  }
};

/// Goes in and out of the sphere, and lets go of the force now and then as a device does that was left alone.
struct Poking {
  double time = 0.0;
  std::uint64_t ticks = 0;
  ProbeSample read() noexcept {
    ProbeSample sample;
    sample.time = Seconds(time);
    sample.pose.position = Vec3(1e-3 * std::sin(7.0 * time), 0.05 + 1e-3 * std::cos(12.0 * time), 0.0);
    return sample;
  }
  void apply(const Vec3&, Seconds dt) noexcept { time += dt.count(), ++ticks; }
  [[nodiscard]] Vec3 aim() const noexcept { return Vec3::Zero(); }
  [[nodiscard]] bool finished() const noexcept { return false; }
  [[nodiscard]] static bool lost() noexcept { return false; }
  [[nodiscard]] bool take_released() const noexcept { return ticks % 97 == 96; }
  static void halt() noexcept {}
  static void resume() noexcept {}
};

using Loop = ServoThread<Touched, Step, Poking, Feed>;

Scene sphere() {
  Instance instance;
  instance.name = "sphere";
  instance.law = law_by_name("proxy").value();
  instance.sides = Sides::front;
  instance.surface =
      std::make_shared<const MeshSurface>(TriangleIndex::build(TriangleMesh::build(icosphere(3, 0.05)).value()));
  return Scene::build({instance}).value();
}

TEST(LiveTrap, TheServoThreadNeitherAllocatesLocksThrowsTouchesFilesNorFreesScenes) {
#if defined(ASPERITY_SANITIZED)
  const bool counts_count = false;  // sanitizers replace the same functions; the rest holds
#else
  const bool counts_count = true;
#endif
  const char* const asked = std::getenv("ASPERITY_LIVE_SECONDS");
  const double seconds = asked != nullptr ? std::atof(asked) : 20.0;
  std::thread::id servo;
  std::atomic<int> freed_there = 0;
  std::atomic<std::uint64_t> unchecked = 0;
  const auto telemetry =
      std::make_shared<Telemetry<ProxyState>>(TelemetrySettings{.ticks = 4096, .key_frame_every = 100});
  const Scene first = sphere();
  const auto cache = std::make_shared<ProxyCache>(first);
  std::uint64_t number = 0;
  const auto touched = [&](const Scene& scene) {
    return std::make_shared<const Touched>(Touched{scene, cache, ++number, &servo, &freed_there});
  };
  ServoSettings settings;
  settings.realtime = {.priority = 0, .lock_memory = false, .cpu = -1};
  settings.safety.latches = true;
  settings.longest_step = Seconds(1.0);
  Step step;
  step.servo = &servo;
  trap::forget();
  auto loop = Loop::start(touched(first), step, {}, {telemetry, &unchecked}, settings).value();
  const auto begun = std::chrono::steady_clock::now();
  int swaps = 0;
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count() < seconds) {
    const double stiffness = 300.0 + swaps % 500;
    loop->put(touched(edited(first, {SceneEditKind::stiffness, "", stiffness, ""}).value()));
    if (++swaps % 50 == 0) {
      // A reader that is there for a moment, and never takes all.
      TelemetryReader<ProxyState>::Batch batch;
      telemetry->read(10)->take(batch, std::chrono::milliseconds(5));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const SessionSummary summary = loop->stop();
  telemetry->end();
  const trap::Counts counts = trap::counts();
  if (counts_count) {
    EXPECT_EQ(counts.allocations, 0);
    EXPECT_EQ(counts.locks, 0);
    EXPECT_EQ(counts.throws, 0);
    EXPECT_EQ(counts.files, 0);
  }
  EXPECT_EQ(unchecked.load(), 0u) << "safety checks";
  EXPECT_EQ(freed_there.load(), 0) << "scenes that the servo thread gave up";
  EXPECT_EQ(loop->device().ticks, summary.ticks);
  EXPECT_GT(summary.ticks, static_cast<std::uint64_t>(200.0 * seconds));
  EXPECT_GT(summary.max_force, 0.1);
  EXPECT_GT(loop->handed_over().taken, static_cast<std::uint64_t>(swaps / 2));
  RecordProperty("ticks", std::to_string(summary.ticks));
  std::printf("%llu ticks, %llu missed, %d scenes\n", static_cast<unsigned long long>(summary.ticks),
              static_cast<unsigned long long>(summary.missed), swaps);
}

}  // namespace
}  // namespace asperity::live_trap_test
