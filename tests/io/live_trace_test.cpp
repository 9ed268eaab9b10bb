// What a live session leaves: the state at any tick, from which another process goes on to the last bit.

#include "asperity/io/live_trace.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "asperity/core/rng.h"
#include "asperity/device/ideal_probe.h"
#include "asperity/device/simulated_device.h"
#include "asperity/io/experiment.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/state_image.h"
#include "asperity/render/step.h"
#include "asperity/servo/session.h"

namespace asperity::live_trace_test {
namespace {

/// Pushes up by as much as its own ticks have counted, which is all that it remembers.
struct CountingLaw {
  static constexpr LawFacts facts{.name = "counting-up", .title = "counts", .source = "none"};
  struct State {
    double ticks = 0.0;
  };
  [[nodiscard]] LawForce force(const TouchedSurface&, const Material&, const Vec3& probe, const Vec3&, Seconds,
                               State& state) const noexcept {
    LawForce answer;
    answer.contact = true;
    answer.normal = Vec3::UnitY();
    answer.force = Vec3(0.0, 1e-3 * ++state.ticks, 0.0);
    answer.point = probe;
    return answer;
  }
};

/// A scene of the given JSON, built anew each time; its first surface felt by `law`, where one is named.
struct Case {
  const char* name;
  std::string json;
  std::string law = {};
};

std::string two_surfaces(const char* radius, const char* meshes) {
  return std::string(R"({"asperity":1,"probe":{"radius":")") + radius + R"("},"surfaces":[)" + meshes +
         R"(],"stroke":{"type":"line","start":["30%","100%","45%"],"end":["70%","100%","55%"],"speed":"40 mm/s",
         "depth":"0.8 mm"}})";
}

std::string builtin(const char* name) {
  return builtin_scene_json(name).value();
}

/// With a potential that is quickly made.
std::string coarse(const char* name) {
  std::string json = builtin(name);
  const std::size_t at = json.find("\"resolution\": 96");
  EXPECT_NE(at, std::string::npos) << name;
  return json.replace(at, 16, "\"resolution\": 48");
}

/// Two balls side by side, whose seam the probe is led over: both are touched at once.
constexpr const char* two_balls = R"(
  {"name":"a","mesh":{"generator":"icosphere","subdivisions":3,"radius":"30 mm"},"pose":{"position":["-10 mm",0,0]},
   "material":{"static_friction":0.3}},
  {"name":"b","mesh":{"generator":"icosphere","subdivisions":3,"radius":"30 mm"},"pose":{"position":["10 mm",0,0]}})";

std::vector<Case> cases() {
  return {{"relief and ball", builtin("icosphere-relief")},
          {"relief and point", builtin("cup")},
          {"mesh", builtin("icosphere")},
          {"isosurface", builtin("cavity")},
          {"crossing law", builtin("cavity"), "cross-uncross"},
          {"layer law", builtin("cavity"), "avila"},
          {"implicit", coarse("implicit-box")},
          {"magnet", coarse("implicit-magnetic")},
          {"implicit proxy", coarse("implicit-box"), "proxy"},
          {"parametric", builtin("vase")},
          {"stick and slip", builtin("stick-slip")},
          {"texture", builtin("gratings-5mm")},
          {"features by scale", builtin("features-by-scale")},
          {"moving", builtin("turntable")},
          {"moving coat", builtin("layers")},
          {"drawing coat", builtin("magnet")},
          {"zoomed", builtin("zoom")},
          {"two surfaces and point", two_surfaces("0", two_balls)},
          {"two surfaces and ball", two_surfaces("2 mm", two_balls)},
          {"dense mesh", builtin("M_b-H_1"), "dense-mesh"},
          {"generated geometry", builtin("M_b-H_1"), "generated-geometry"},
          {"law of one's own", builtin("icosphere"), "counting-up"}};
}

/// Nothing where this build has no readers for it.
std::optional<Experiment> build_case(const Case& of) {
  Result<Experiment> read = parse_experiment(of.json, ".", of.name);
  if (!read && read.error().message().find("OpenVDB") != std::string::npos) return std::nullopt;
  EXPECT_TRUE(read.ok()) << read.error().message();
  if (!read) return std::nullopt;
  if (of.law.empty()) return *read;
  std::vector<Instance> instances(read->scene.instances().begin(), read->scene.instances().end());
  instances[0].law = of.law == "counting-up" ? Law(CountingLaw{}) : law_by_name(of.law).value();
  SceneSettings settings = read->scene.settings();
  if (!instances[0].law.takes_ball()) settings.probe_radius = 0.0;
  read->scene = Scene::build(std::move(instances), settings).value();
  return *read;
}

/// The probes of its stroke, as the scene answers it.
std::vector<TraceRecord> probes_of(const Experiment& experiment, std::uint64_t most) {
  std::vector<TraceRecord> records;
  SafetyStage safety = SafetyStage::build(SafetySettings::from_profile(experiment.device)).value();
  ProxyState state;
  ProxyCache cache(experiment.scene);
  const auto render = [&](const ProbeSample& probe, Seconds dt) {
    return step(experiment.scene, state, cache, probe, dt);
  };
  const auto keep = [&](const TraceRecord& tick) { records.push_back(tick); };
  SessionSettings settings(Seconds(1.0 / experiment.rate));
  settings.max_ticks = most;
  if (experiment.probe == ProbeKind::ideal) {
    IdealProbe probe = IdealProbe::build(experiment.path, experiment.ideal).value();
    run_session(render, probe, safety, settings, keep);
  } else {
    SimulatedDevice device =
        SimulatedDevice::build(experiment.path, experiment.device, experiment.hand, experiment.simulated).value();
    run_session(render, device, safety, settings, keep);
  }
  return records;
}

/// Every bit of what a tick answers.
std::vector<std::uint64_t> bits_of(const ForceSample& sample) {
  std::vector<std::uint64_t> bits{sample.flags.bits(), sample.level, sample.contact.count, sample.contact.instance,
                                  sample.contact.element};
  const auto add = [&](double value) { bits.push_back(std::bit_cast<std::uint64_t>(value)); };
  for (const Vec3* v : {&sample.wrench.force, &sample.wrench.torque, &sample.proxy, &sample.parts.friction,
                        &sample.parts.texture, &sample.contact.point, &sample.contact.normal})
    for (int i = 0; i < 3; ++i) add((*v)[i]);
  for (const double value : {sample.parts.held, sample.contact.penetration, sample.contact.height}) add(value);
  return bits;
}

class StateImage : public testing::TestWithParam<Case> {};

TEST_P(StateImage, GoesOnInAnotherSceneOfTheSameFileToTheLastBit) {
  const std::optional<Experiment> here = build_case(GetParam());
  const std::optional<Experiment> there = build_case(GetParam());
  if (!here || !there) GTEST_SKIP() << "needs OpenVDB";
  ASSERT_NE(here->scene.epoch(), there->scene.epoch());
  constexpr std::uint64_t most = 1500;
  const std::vector<TraceRecord> ticks = probes_of(*here, most);
  ProxyState state;
  ProxyCache cache(here->scene);
  ProxyState branch;
  ProxyCache branch_cache(there->scene);
  Rng rng(7);
  std::size_t touched = 0;
  std::size_t branches = 0;
  for (const TraceRecord& tick : ticks) {
    if (tick.tick == 0 || rng.uniform(0.0, 1.0) < 0.03) {
      const std::vector<std::byte> image = save_state(state, here->scene);
      Result<ProxyState> restored = restore_state(image, there->scene);
      ASSERT_TRUE(restored.ok()) << "tick " << tick.tick << ": " << restored.error().message();
      ASSERT_EQ(save_state(*restored, there->scene), image);
      branch = *restored;
      branch_cache = ProxyCache(there->scene);
      ++branches;
    }
    const ForceSample expected = step(here->scene, state, cache, tick.probe, tick.dt);
    const ForceSample felt = step(there->scene, branch, branch_cache, tick.probe, tick.dt);
    ASSERT_EQ(bits_of(felt), bits_of(expected)) << "tick " << tick.tick;
    touched += felt.wrench.force.isZero(0.0) ? 0U : 1U;
  }
  EXPECT_GT(branches, 10U);
  EXPECT_GT(touched, ticks.size() / 10);
  EXPECT_EQ(save_state(branch, there->scene), save_state(state, here->scene));
}

INSTANTIATE_TEST_SUITE_P(Scenes, StateImage, testing::ValuesIn(cases()), [](const auto& of) {
  std::string name = of.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
});

TEST(StateImageCases, TwoSurfacesAreTouchedAtOnce) {
  for (const char* radius : {"0", "2 mm"}) {
    const std::optional<Experiment> both = build_case({"two", two_surfaces(radius, two_balls)});
    ASSERT_TRUE(both);
    std::size_t most = 0;
    ProxyState state;
    for (const TraceRecord& tick : probes_of(*both, 1500)) {
      step(both->scene, state, tick.probe, tick.dt);
      std::size_t touched = 0;
      for (const Contact& contact : state.contacts) touched += contact.touching ? 1U : 0U;
      most = std::max(most, touched);
    }
    EXPECT_GT(most, 1U) << radius;
  }
}

/// FNV-1a, by which an image ends.
void seal(std::vector<std::byte>& image) {
  std::uint64_t hash = hash_bytes(std::span(image).first(image.size() - 8));
  for (std::size_t i = image.size() - 8; i < image.size(); ++i, hash >>= 8U)
    image[i] = static_cast<std::byte>(hash & 0xFFU);
}

/// The probe pressed onto the relief and the two balls.
struct Pressed {
  Experiment experiment;
  ProxyState state;
  std::vector<TraceRecord> ticks;
};
Pressed pressed(const char* json) {
  Pressed out{build_case({"pressed", json}).value(), {}, {}};
  out.ticks = probes_of(out.experiment, 700);
  ProxyCache cache(out.experiment.scene);
  for (const TraceRecord& tick : out.ticks) step(out.experiment.scene, out.state, cache, tick.probe, tick.dt);
  return out;
}

TEST(StateImageDamage, AnyFlippedByteIsAnErrorAndSoIsAnyCut) {
  const Pressed here = pressed(builtin("icosphere-relief").c_str());
  const std::vector<std::byte> image = save_state(here.state, here.experiment.scene);
  ASSERT_GT(here.state.contacts.size(), 0U);
  for (std::size_t i = 0; i < image.size(); ++i) {
    std::vector<std::byte> bad = image;
    bad[i] ^= std::byte{0x10};
    ASSERT_FALSE(restore_state(bad, here.experiment.scene).ok()) << i;
    ASSERT_FALSE(restore_state(std::span(image).first(i), here.experiment.scene).ok()) << i;
  }
}

// What somebody has made up and sealed is refused, or is a state that ticks go on from.
TEST(StateImageDamage, NonsenseThatIsSealedNeverDoesHarm) {
  for (const std::string& json : {builtin("icosphere-relief"), two_surfaces("0", two_balls), builtin("cavity")}) {
    const Pressed here = pressed(json.c_str());
    const Scene& scene = here.experiment.scene;
    const std::vector<std::byte> image = save_state(here.state, scene);
    Rng rng(11);
    std::size_t refused = 0;
    std::size_t taken = 0;
    for (int n = 0; n < 3000; ++n) {
      std::vector<std::byte> bad = image;
      const int flips = 1 + static_cast<int>(rng.uniform(0.0, 3.0));
      for (int k = 0; k < flips; ++k) {
        const auto at = 8 + static_cast<std::size_t>(rng.uniform(0.0, static_cast<double>(bad.size() - 16)));
        bad[at] = static_cast<std::byte>(static_cast<int>(rng.uniform(0.0, 256.0)));
      }
      seal(bad);
      Result<ProxyState> state = restore_state(bad, scene);
      refused += state.ok() ? 0U : 1U;
      taken += state.ok() ? 1U : 0U;
      if (!state) {
        ASSERT_FALSE(state.error().place.empty());
        continue;
      }
      ProxyCache cache(scene);
      for (int i = 0; i < 5; ++i) step(scene, *state, cache, here.ticks.back().probe, here.ticks.back().dt);
    }
    EXPECT_GT(refused, 100U);
    EXPECT_GT(taken, 100U);
  }
}

TEST(StateImageDamage, AnotherScenesImageIsRefusedOrGoneOnFromAsInAnotherScene) {
  const Pressed relief = pressed(builtin("icosphere-relief").c_str());
  const Pressed balls = pressed(two_surfaces("0", two_balls).c_str());
  // A second surface, which the first scene has not.
  ProxyState of_second = balls.state;
  ASSERT_GT(of_second.contacts.size(), 1U);
  const Result<ProxyState> none = restore_state(save_state(of_second, balls.experiment.scene), relief.experiment.scene);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::mismatch);
  // Told to be of another scene, it is taken over as a tick takes it over.
  const Scene& here = relief.experiment.scene;
  ProxyState moved = restore_state(save_state(balls.state, here), here).value();
  ProxyState handed = balls.state;
  for (const TraceRecord& tick : relief.ticks)
    ASSERT_EQ(bits_of(step(here, moved, tick.probe, tick.dt)), bits_of(step(here, handed, tick.probe, tick.dt)));
}

TEST(StateImageDamage, ALawThatThereIsNotIsNamed) {
  const Experiment counting = build_case({"counting", builtin("icosphere"), "counting-up"}).value();
  const Experiment plain = build_case({"plain", builtin("icosphere")}).value();
  ProxyState state;
  for (const TraceRecord& tick : probes_of(plain, 500)) step(counting.scene, state, tick.probe, tick.dt);
  const Result<ProxyState> restored = restore_state(save_state(state, counting.scene), plain.scene);
  ASSERT_FALSE(restored.ok());
  EXPECT_EQ(restored.error().code, ErrorCode::mismatch);
  EXPECT_NE(restored.error().message().find("counting-up"), std::string::npos);
}

TEST(LoopState, HoldsTheSafetyStageToo) {
  const Pressed here = pressed(builtin("icosphere").c_str());
  const SafetyMemory safety{Vec3(1.0, -0.0, 5e-324), Seconds(0.25), Fault::overrun, true, true};
  const std::vector<std::byte> image = save_loop_state(here.state, safety, here.experiment.scene);
  const LoopState back = restore_loop_state(image, here.experiment.scene).value();
  EXPECT_EQ(save_loop_state(back.proxy, back.safety, here.experiment.scene), image);
  EXPECT_EQ(back.safety.fault, Fault::overrun);
  EXPECT_TRUE(back.safety.raised && back.safety.armed);
  EXPECT_EQ(back.safety.engaged, Seconds(0.25));
  EXPECT_TRUE(std::signbit(back.safety.last_force.y()));
  EXPECT_EQ(back.safety.last_force.z(), 5e-324);
  for (std::size_t size = 0; size < image.size(); ++size)
    ASSERT_FALSE(restore_loop_state(std::span(image).first(size), here.experiment.scene).ok()) << size;
  for (const std::size_t at : {0U, 4U, 5U, 6U}) {
    std::vector<std::byte> bad = image;
    bad[at] = std::byte{0x7F};
    EXPECT_FALSE(restore_loop_state(bad, here.experiment.scene).ok()) << at;
  }
}

TEST(SafetySettingsJson, EverySettingComesBack) {
  SafetySettings settings;
  settings.max_force = 1.0 / 3.0;
  settings.slew_limit = 123.25;
  settings.workspace = Vec3(0.1, -0.2, 0.3);
  settings.border = 0.25;
  settings.engage = Seconds(0.5);
  settings.enabling_button = 3;
  settings.latches = true;
  for (const bool limited : {false, true}) {
    if (limited) {
      settings.max_power = 2.5;
      settings.max_velocity = 3.5;
      settings.workspace_radius = 0.05;
      settings.longest_tick = Seconds(0.02);
    }
    const SafetySettings back = parse_safety_settings(to_json(settings)).value();
    EXPECT_EQ(to_json(back), to_json(settings));
    EXPECT_EQ(back.max_force, 1.0 / 3.0);
    EXPECT_EQ(back.slew_limit, 123.25);
    EXPECT_EQ(back.max_power, limited ? 2.5 : infinity);
    EXPECT_EQ(back.max_velocity, limited ? 3.5 : infinity);
    EXPECT_EQ(back.workspace, Vec3(0.1, -0.2, 0.3));
    EXPECT_EQ(back.workspace_radius, limited ? 0.05 : infinity);
    EXPECT_EQ(back.border, 0.25);
    EXPECT_EQ(back.engage, Seconds(0.5));
    EXPECT_EQ(back.enabling_button, 3);
    EXPECT_EQ(back.longest_tick, Seconds(limited ? 0.02 : infinity));
    EXPECT_TRUE(back.latches);
  }
}

TEST(SafetySettingsJson, EachBadTextHasItsError) {
  const auto code_of = [](const char* text) {
    const auto settings = parse_safety_settings(text);
    EXPECT_FALSE(settings.ok()) << text;
    return settings ? ErrorCode::mismatch : settings.error().code;
  };
  EXPECT_EQ(code_of("no"), ErrorCode::file_malformed);
  EXPECT_EQ(code_of(R"({"max_force":"much"})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"workspace":[1,2]})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"latches":1})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"largest_force":1})"), ErrorCode::bad_key);
  EXPECT_EQ(code_of(R"({"max_force":-1})"), ErrorCode::bad_value);
  EXPECT_EQ(code_of(R"({"max_force":"infinity"})"), ErrorCode::bad_value);
  EXPECT_EQ(code_of(R"({"enabling_button":50})"), ErrorCode::bad_value);
}

TEST(SafetySettingsJson, ATraceThatSaysNothingHasItsDevices) {
  const DeviceProfile device = find_profile("omega.7").value();
  TraceMetadata metadata;
  EXPECT_EQ(to_json(safety_of(metadata, device).value()), to_json(SafetySettings::from_profile(device)));
  metadata.extra[trace_safety_key] = R"({"max_force":0.5})";
  EXPECT_EQ(safety_of(metadata, device).value().max_force, 0.5);
}

TEST(TraceGaps, AreThoseThatEventsTell) {
  Trace trace;
  const auto ticks = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t n = from; n < to; ++n) trace.records.emplace_back().tick = n;
  };
  ticks(5, 8);
  trace.events.push_back({10, "lost", "2"});
  ticks(10, 12);
  const std::vector<TraceGap> gaps = trace_gaps(trace).value();
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_EQ(gaps[0].tick, 10U);
  EXPECT_EQ(gaps[0].lost, 2U);
  Trace untold = trace;
  untold.events[0].kind = "note";
  EXPECT_EQ(trace_gaps(untold).error().code, ErrorCode::file_malformed);
  Trace back = trace;
  back.records.emplace_back().tick = 3;
  EXPECT_FALSE(trace_gaps(back).ok());
  ticks(20, 21);
  EXPECT_FALSE(trace_gaps(trace).ok());
}

}  // namespace
}  // namespace asperity::live_trace_test
