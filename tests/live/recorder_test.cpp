// A live session on the disk: whole after a crash, bit-equal when it is replayed, and never in the loop's way.

#include "asperity/io/recorder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "asperity/device/shared_board.h"
#include "asperity/io/experiment.h"
#include "asperity/io/live_trace.h"
#include "asperity/io/scene_edit_json.h"
#include "asperity/render/step.h"

namespace asperity::recorder_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* scene_json =
    R"({"surfaces":[{"name":"ball","mesh":{"generator":"icosphere"},"law":"proxy"}],"probe":{"radius":0},"device":"ideal"})";

Experiment experiment() {
  return parse_experiment(scene_json, ".", "test").value();
}

fs::path empty_folder(const std::string& name) {
  const fs::path folder = fs::temp_directory_path() / ("asperity_recorder_" + name + "_" + std::to_string(::getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

/// Goes in and out of the sphere at its top, twice a second; tells a shared board how far it is.
struct Poking {
  double top = 0.0;
  std::shared_ptr<SharedBoard> board;
  std::shared_ptr<std::atomic<bool>> breaks = std::make_shared<std::atomic<bool>>(false);
  double time = 0.0;
  std::uint64_t ticks = 0;
  ProbeSample read() noexcept {
    ProbeSample sample;
    sample.time = Seconds(time);
    sample.pose.position = Vec3(1e-3 * std::sin(7.0 * time), top + 1e-3 * std::cos(4.0 * M_PI * time), 0.0);
    if (breaks->load()) sample.pose.position.x() = std::nan("");
    return sample;
  }
  void apply(const Vec3& force, Seconds dt) noexcept {
    time += dt.count();
    if (board) board->put_out({0, ++ticks, {force.x(), force.y(), force.z()}, 0});
  }
  [[nodiscard]] Vec3 aim() const noexcept { return Vec3::Zero(); }
  [[nodiscard]] bool finished() const noexcept { return false; }
};

using Loop = ServoThread<LiveScene, SceneStep, Poking, SceneFeed>;

/// A session that records itself.
struct Session {
  Experiment e = experiment();
  std::shared_ptr<SceneLog> scenes = std::make_shared<SceneLog>();
  std::shared_ptr<Telemetry<ProxyState>> telemetry =
      std::make_shared<Telemetry<ProxyState>>(TelemetrySettings{.ticks = 4096, .key_frame_every = 200});
  std::unique_ptr<Recorder> recorder;
  Poking probe;
  std::unique_ptr<Loop> loop;

  Session(const fs::path& trace, std::size_t room, const fs::path& fault = {},
          const std::shared_ptr<SharedBoard>& board = {}) {
    RecorderSettings settings;
    settings.path = trace.string();
    settings.fault_prefix = fault.string();
    settings.before = Seconds(0.5);
    settings.metadata.scene = e.canonical_json;
    settings.metadata.rate = 1000.0;
    ServoSettings servo;
    servo.realtime = {.priority = 0, .lock_memory = false, .cpu = -1};
    servo.safety = SafetySettings::for_hands(e.device);
    settings.metadata.extra[trace_safety_key] = to_json(servo.safety);
    recorder = Recorder::start(telemetry->read(room), scenes, settings).value();
    probe.top = e.scene.world_bounds().upper.y();
    probe.board = board;
    loop = Loop::start(scenes->begin(e.scene), {}, probe, {telemetry}, servo).value();
  }
  void edit(SceneEditKind kind, double value) { loop->put(scenes->edit({kind, "", value, ""}).value()); }
  SessionSummary end() {
    const SessionSummary summary = loop->stop();
    telemetry->end();
    return summary;
  }
};

template <class Holds>
bool comes(Holds&& holds) {
  for (int i = 0; i < 10'000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return holds();
}
std::uint64_t ticks_of(const Session& session) {
  return session.loop->meters().lateness.counts().total;
}

/// Replays from the start, or from a key frame; how many ticks were compared. Every force has to be the same.
std::size_t replay(const Trace& trace, std::size_t key_frame = SIZE_MAX) {
  const Experiment again = parse_experiment(trace.metadata.scene, ".", "trace").value();
  Scene scene = again.scene;
  SafetyStage safety = SafetyStage::build(safety_of(trace.metadata, again.device).value()).value();
  ProxyState state;
  ProxyCache cache(scene);
  bool knows = key_frame == SIZE_MAX;
  std::size_t event = 0;
  std::size_t compared = 0;
  for (const TraceRecord& record : trace.records) {
    if (!knows && trace.key_frames[key_frame].tick == record.tick) {
      const LoopState from = restore_loop_state(trace.key_frames[key_frame].state, scene).value();
      state = from.proxy;
      safety.restore(from.safety);
      knows = true;
    }
    for (; event < trace.events.size() && trace.events[event].tick <= record.tick; ++event) {
      const TraceEvent& happened = trace.events[event];
      if (happened.kind == "edit") scene = edited(scene, parse_scene_edit(happened.text).value()).value();
      if (happened.kind == "stopping") safety.withhold();
    }
    if (!knows) continue;
    const ForceSample rendered = step(scene, state, cache, record.probe, record.dt);
    const Vec3 commanded = safety.apply(rendered, record.probe, record.dt).force;
    EXPECT_EQ(rendered.wrench.force, record.rendered.wrench.force) << record.tick;
    EXPECT_EQ(commanded, record.commanded) << record.tick;
    if (rendered.wrench.force != record.rendered.wrench.force) return compared;
    ++compared;
  }
  return compared;
}

TEST(Recorder, WhatWasLiveReplaysBitEqualFromTheStartAndFromEveryKeyFrame) {
  const fs::path folder = empty_folder("replays");
  Session session(folder / "live.asptrace", 100'000);
  for (const double stiffness : {300.0, 800.0, 500.0}) {
    const std::uint64_t now = ticks_of(session);
    ASSERT_TRUE(comes([&] { return ticks_of(session) > now + 250; }));
    // Two at once: the first is never felt, and counts all the same.
    session.edit(SceneEditKind::friction, 1e-4 * stiffness);
    session.edit(SceneEditKind::stiffness, stiffness);
  }
  const std::uint64_t now = ticks_of(session);
  ASSERT_TRUE(comes([&] { return ticks_of(session) > now + 250; }));
  const SessionSummary summary = session.end();
  ASSERT_TRUE(session.recorder->finish());
  const RecorderStatus status = session.recorder->status();
  EXPECT_EQ(status.ticks, summary.ticks);
  EXPECT_EQ(status.lost, 0u);
  EXPECT_EQ(status.problem, "");

  const Trace trace = read_trace((folder / "live.asptrace").string()).value();
  EXPECT_TRUE(trace.complete) << trace.damage;
  ASSERT_EQ(trace.records.size(), summary.ticks);
  std::size_t edits = 0;
  for (const TraceEvent& event : trace.events) edits += event.kind == "edit" ? 1U : 0U;
  EXPECT_EQ(edits, 6u);
  EXPECT_EQ(trace.events.back().kind, "stopping");
  double largest = 0.0;
  for (const TraceRecord& record : trace.records) largest = std::max(largest, record.commanded.norm());
  EXPECT_GT(largest, 0.3) << "something was felt";
  EXPECT_EQ(replay(trace), summary.ticks);
  ASSERT_EQ(trace.key_frames.size(), (summary.ticks - 1) / 200);
  for (std::size_t i = 0; i < trace.key_frames.size(); ++i) {
    EXPECT_EQ(replay(trace, i), summary.ticks - trace.key_frames[i].tick);
  }
  fs::remove_all(folder);
}

TEST(Recorder, AKilledProgramLeavesAllButTheLastTenthOfASecond) {
  const fs::path folder = empty_folder("killed");
  const auto board = SharedBoard::create().value();
  const pid_t host = ::fork();
  if (host == 0) {
    const Session session(folder / "live.asptrace", 100'000, {}, board);
    std::this_thread::sleep_for(std::chrono::seconds(30));
    ::_exit(0);
  }
  const auto ticks = [&] {
    const std::vector<PutOut> all = board->last_put_out();
    return all.empty() ? std::uint64_t{0} : all.back().heard;
  };
  ASSERT_TRUE(comes([&] { return ticks() > 700; }));
  ::kill(host, SIGKILL);
  ::waitpid(host, nullptr, 0);
  const Trace trace = read_trace((folder / "live.asptrace").string()).value();
  EXPECT_FALSE(trace.complete);
  // A tick a millisecond, fewer where the machine was busy.
  EXPECT_GE(trace.records.size() + 100, ticks());
  EXPECT_GT(trace.records.size(), 600u);
  EXPECT_EQ(replay(trace), trace.records.size());
  fs::remove_all(folder);
}

TEST(Recorder, AFullDiskEndsTheRecordingAndNotTheSession) {
  const fs::path folder = empty_folder("full");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  Session session(folder / "live.asptrace", 100'000);
  rlimit small = before;
  small.rlim_cur = 100'000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_TRUE(comes([&] { return !session.recorder->status().problem.empty(); }));
  const std::uint64_t then = ticks_of(session);
  EXPECT_TRUE(comes([&] { return ticks_of(session) > then + 100; })) << "the loop goes on";
  const SessionSummary summary = session.end();
  const Status finished = session.recorder->finish();
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().code, ErrorCode::file_unwritable);
  const RecorderStatus status = session.recorder->status();
  EXPECT_NE(status.problem.find("live.asptrace"), std::string::npos) << status.problem;
  EXPECT_GT(status.lost, 90u);
  const Trace trace = read_trace((folder / "live.asptrace").string()).value();
  EXPECT_GT(trace.records.size(), 100u) << "whole up to then";
  EXPECT_LT(trace.records.size(), summary.ticks);
  EXPECT_EQ(replay(trace), trace.records.size());
  fs::remove_all(folder);
}

TEST(Recorder, ASlowDiskCostsTicksThatAreCountedAndTold) {
  const fs::path folder = empty_folder("slow");
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::atomic<bool> go_on = false;
  std::vector<std::byte> bytes;
  std::thread disk([&] {
    const int in = ::open(pipe.c_str(), O_RDONLY);
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::array<std::byte, 65536> some{};
    for (ssize_t count = 0; (count = ::read(in, some.data(), some.size())) > 0;)
      bytes.insert(bytes.end(), some.begin(), some.begin() + count);
    ::close(in);
  });
  Session session(pipe, 200);
  EXPECT_TRUE(comes(
      [&] { return session.recorder->status().lost + session.telemetry->lost() > 0 || ticks_of(session) > 2000; }));
  const std::uint64_t then = ticks_of(session);
  EXPECT_TRUE(comes([&] { return ticks_of(session) > then + 500; })) << "the loop goes on";
  go_on = true;
  const std::uint64_t now = ticks_of(session);
  EXPECT_TRUE(comes([&] { return ticks_of(session) > now + 500; }));
  const SessionSummary summary = session.end();
  EXPECT_TRUE(session.recorder->finish());
  disk.join();
  const RecorderStatus status = session.recorder->status();
  EXPECT_GT(status.lost, 100u);
  EXPECT_EQ(status.ticks + status.lost, summary.ticks);
  const Trace trace = parse_trace(bytes).value();
  EXPECT_TRUE(trace.complete);
  std::uint64_t told = 0;
  const std::vector<TraceGap> gaps = trace_gaps(trace).value();
  for (const TraceGap& gap : gaps) told += gap.lost;
  EXPECT_EQ(told, status.lost);
  // Behind the gap it goes on from a key frame.
  std::size_t key = 0;
  while (key < trace.key_frames.size() && trace.key_frames[key].tick < gaps.back().tick) ++key;
  ASSERT_LT(key, trace.key_frames.size());
  EXPECT_EQ(replay(trace, key), summary.ticks - trace.key_frames[key].tick);
  fs::remove_all(folder);
}

TEST(Recorder, AFaultLeavesTheTicksBeforeItWithItsCause) {
  const fs::path folder = empty_folder("fault");
  Session session(folder / "live.asptrace", 100'000, folder / "fault");
  session.edit(SceneEditKind::stiffness, 450.0);
  ASSERT_TRUE(comes([&] { return ticks_of(session) > 1300; }));
  session.edit(SceneEditKind::stiffness, 650.0);
  ASSERT_TRUE(comes([&] { return ticks_of(session) > 1500; }));
  session.probe.breaks->store(true);
  EXPECT_TRUE(comes([&] { return !session.recorder->status().faults.empty(); }));
  session.end();
  ASSERT_TRUE(session.recorder->finish());
  const RecorderStatus status = session.recorder->status();
  ASSERT_EQ(status.faults, std::vector<std::string>{(folder / "fault-1.asptrace").string()});
  EXPECT_EQ(status.fault_problem, "");
  const Trace trace = read_trace(status.faults[0]).value();
  EXPECT_TRUE(trace.complete);
  EXPECT_NE(trace.metadata.extra.at(trace_fault_key).find(fault_sentence(Fault::input_not_finite)), std::string::npos);
  std::size_t at = 0;
  while (at < trace.records.size() && trace.records[at].probe.pose.position.allFinite()) ++at;
  ASSERT_LT(at, trace.records.size());
  double before = 0.0;
  for (std::size_t i = 0; i < at; ++i) before += trace.records[i].dt.count();
  EXPECT_GE(before, 0.45) << "half a second, as it was asked for";
  EXPECT_LE(before, 1.2) << "and no more than from the key frame before that";
  EXPECT_GT(trace.records[0].tick, 0u);
  ASSERT_FALSE(trace.key_frames.empty());
  EXPECT_EQ(trace.key_frames[0].tick, trace.records[0].tick);
  EXPECT_EQ(replay(trace, 0), trace.records.size()) << "with what was edited before it";
  fs::remove_all(folder);
}

/// A tick of a session that was never run.
struct Told {
  TraceRecord record;
  TickNotes notes;
  LiveScene felt;
  SceneStep step;
  SafetyStage safety = SafetyStage::build({}).value();
  explicit Told(const std::shared_ptr<const LiveScene>& scene) : felt(*scene) { record.dt = Seconds(1e-3); }
  void tell(Telemetry<ProxyState>& telemetry, Fault fault) {
    SafetyMemory memory = safety.memory();
    memory.fault = fault;
    safety.restore(memory);
    telemetry.put(LiveTick<LiveScene, SceneStep>{record, notes, felt, step, safety}, felt.number, step.state);
    ++record.tick;
  }
};

TEST(Recorder, KeepsFewOfManyFaultsAndNeverMoreThanItNeeds) {
  const fs::path folder = empty_folder("many");
  const Experiment e = experiment();
  const auto scenes = std::make_shared<SceneLog>();
  // No key frame ever: what is held has to end all the same.
  auto telemetry =
      std::make_shared<Telemetry<ProxyState>>(TelemetrySettings{.ticks = 65536, .key_frame_every = 1u << 30});
  RecorderSettings settings;
  settings.path = (folder / "live.asptrace").string();
  settings.fault_prefix = (folder / "fault").string();
  settings.metadata.scene = e.canonical_json;
  settings.before = Seconds(0.1);
  settings.after = Seconds(0.005);
  const auto recorder = Recorder::start(telemetry->read(100'000), scenes, settings).value();
  Told told(scenes->begin(e.scene));
  for (int i = 0; i < 1000; ++i) told.tell(*telemetry, Fault::none);
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 10; ++k) told.tell(*telemetry, Fault::too_fast);
    for (int k = 0; k < 20; ++k) told.tell(*telemetry, Fault::none);
  }
  telemetry->end();
  ASSERT_TRUE(recorder->finish());
  const RecorderStatus status = recorder->status();
  EXPECT_EQ(status.ticks, told.record.tick);
  EXPECT_EQ(status.faults.size(), 32u);
  EXPECT_NE(status.fault_problem.find("more than 32"), std::string::npos) << status.fault_problem;
  const Trace first = read_trace(status.faults[0]).value();
  EXPECT_GE(first.records.size(), 100u);
  EXPECT_LE(first.records.size(), 410u) << "four times as long, where there are no key frames";
  EXPECT_NEAR(static_cast<double>(first.records.back().tick), 1005.0, 1.0) << "and what came within 5 ms of it";
  for (const auto& file : fs::directory_iterator(folder)) EXPECT_NE(file.path().extension(), ".part");
  fs::remove_all(folder);
}

TEST(Recorder, OfANumberThatIsTurnedAgainAndAgainAFaultsTraceHoldsTheLast) {
  const fs::path folder = empty_folder("turned");
  const Experiment e = experiment();
  const auto scenes = std::make_shared<SceneLog>();
  auto telemetry = std::make_shared<Telemetry<ProxyState>>(TelemetrySettings{.ticks = 65536, .key_frame_every = 50});
  RecorderSettings settings;
  settings.path = (folder / "live.asptrace").string();
  settings.fault_prefix = (folder / "fault").string();
  settings.metadata.scene = e.canonical_json;
  settings.before = Seconds(0.1);
  const auto recorder = Recorder::start(telemetry->read(100'000), scenes, settings).value();
  Told told(scenes->begin(e.scene));
  const auto change = [&](SceneEditKind kind, double value) {
    told.felt = *scenes->edit({kind, "", value, ""}).value();
    for (int k = 0; k < 5; ++k) told.tell(*telemetry, Fault::none);
  };
  for (int i = 0; i < 100; ++i) change(SceneEditKind::stiffness, 300.0 + i);
  change(SceneEditKind::zoom, 2.0);
  for (int i = 0; i < 100; ++i) change(SceneEditKind::stiffness, 500.0 + i);
  for (int k = 0; k < 500; ++k) told.tell(*telemetry, Fault::none);
  told.tell(*telemetry, Fault::too_fast);
  telemetry->end();
  ASSERT_TRUE(recorder->finish());
  ASSERT_EQ(recorder->status().faults.size(), 1u);
  const Trace trace = read_trace(recorder->status().faults[0]).value();
  std::vector<std::string> edits;
  for (const TraceEvent& event : trace.events) edits.push_back(event.text);
  EXPECT_EQ(edits, (std::vector<std::string>{to_json(SceneEdit{SceneEditKind::stiffness, "", 399.0, ""}),
                                             to_json(SceneEdit{SceneEditKind::zoom, "", 2.0, ""}),
                                             to_json(SceneEdit{SceneEditKind::stiffness, "", 599.0, ""})}));
  fs::remove_all(folder);
}

TEST(Recorder, RefusesAFileThatCannotBe) {
  const auto telemetry = std::make_shared<Telemetry<ProxyState>>();
  RecorderSettings settings;
  settings.path = "/nowhere/at/all.asptrace";
  const auto recorder = Recorder::start(telemetry->read(10), std::make_shared<SceneLog>(), settings);
  ASSERT_FALSE(recorder);
  EXPECT_EQ(recorder.error().code, ErrorCode::file_unwritable);
  settings.path = "/dev/null";
  settings.flush = std::chrono::milliseconds(1);
  EXPECT_EQ(Recorder::start(telemetry->read(10), std::make_shared<SceneLog>(), settings).error().place, "flush");
}

TEST(SceneLog, NumbersEveryStepAndForgetsWhatIsPast) {
  const Experiment e = experiment();
  SceneLog log;
  EXPECT_FALSE(log.edit({SceneEditKind::zoom, "", 2.0, ""}));
  const auto first = log.begin(e.scene);
  const auto second = log.edit({SceneEditKind::stiffness, "", 700.0, ""}).value();
  const auto third = log.replace(e.scene, e.canonical_json);
  EXPECT_EQ(first->number, 1u);
  EXPECT_EQ(second->number, 2u);
  EXPECT_EQ(second->cache, first->cache) << "the surfaces are the same";
  EXPECT_NE(third->cache, second->cache);
  EXPECT_FALSE(log.edit({SceneEditKind::stiffness, "no such", 700.0, ""}));
  const std::vector<SceneLog::Step> all = log.steps(0, 3);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].kind, "");
  EXPECT_EQ(all[1].kind, "edit");
  EXPECT_EQ(all[2].kind, "scene");
  EXPECT_EQ(all[2].text, e.canonical_json);
  EXPECT_EQ(log.steps(2, 3).size(), 1u);
  EXPECT_FALSE(log.scene(1).has_value()) << "forgotten";
  EXPECT_TRUE(log.scene(2).has_value());
}

}  // namespace
}  // namespace asperity::recorder_test
