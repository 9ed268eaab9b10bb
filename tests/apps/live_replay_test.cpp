// Traces of live sessions: everything that happened comes again, from the start and from every key frame.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "asperity/device/ideal_probe.h"
#include "asperity/io/experiment.h"
#include "asperity/io/live_trace.h"
#include "asperity/io/scene_edit_json.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/step.h"

namespace asperity::live_replay_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string sheet_scene(const char* height) {
  return std::string(R"({"name":"live","surfaces":[{"name":"sheet","mesh":{"generator":"M_a"},"coat":{"height_map":
      {"generator":"H_3","size":64},"height":")") +
         height + R"("},"material":{"static_friction":0.3}}],"probe":{"radius":0},
      "stroke":{"type":"line","start":["40%","100%","30%"],"end":["60%","100%","30%"],"speed":"10mm/s",
      "depth":"1mm","approach_height":"1mm","approach_speed":"20mm/s"}})";
}

/// A session as a loop runs it, without a clock: what it touches, feels and is told goes into a trace.
class Session {
 public:
  Session(const std::string& path, const SafetySettings& settings)
      : experiment_(parse_experiment(sheet_scene("1mm"), ".", "live").value()),
        scene_(experiment_.scene),
        safety_(SafetyStage::build(settings).value()),
        probe_(IdealProbe::build(experiment_.path, experiment_.ideal).value()) {
    TraceMetadata metadata;
    metadata.scene = experiment_.canonical_json;
    metadata.device = experiment_.device.name;
    metadata.program = "test";
    metadata.rate = 1000.0;
    metadata.extra[trace_safety_key] = to_json(settings);
    writer_.emplace(TraceWriter::open(path, metadata).value());
  }
  void tell(const std::string& kind, const std::string& text = {}) {
    ASSERT_TRUE(writer_->event({tick_, kind, text}).ok());
  }
  void edit(const SceneEdit& edit) {
    scene_ = edited(scene_, edit).value();
    tell("edit", to_json(edit));
  }
  void touch_anew(const char* height) {
    const Experiment next = parse_experiment(sheet_scene(height), ".", "live").value();
    scene_ = next.scene;
    tell("scene", next.canonical_json);
  }
  void raise(Fault fault) {
    safety_.raise(fault);
    tell("raise", to_string(fault));
  }
  void acknowledge() {
    safety_.acknowledge();
    tell("acknowledge");
  }
  void release() {
    safety_.released();
    tell("released");
  }
  void stop() {
    safety_.withhold();
    tell("stopping");
  }
  void key_frame() { ASSERT_TRUE(writer_->key_frame({tick_, save_loop_state(state_, safety_.memory(), scene_)}).ok()); }
  /// Ticks of uneven length; those that are not kept are lost.
  void run(int count, bool kept = true) {
    for (int i = 0; i < count; ++i) {
      TraceRecord record;
      record.tick = tick_++;
      record.dt = Seconds(1e-3 * (1.0 + 0.3 * std::sin(0.7 * static_cast<double>(record.tick))));
      record.probe = probe_.read();
      // It leaves the surface now and then: only a free tick lets force in again.
      if (record.tick % 200 >= 32 && record.tick % 200 < 50) record.probe.pose.position.y() += 5e-3;
      record.rendered = step(scene_, state_, cache_, record.probe, record.dt);
      record.commanded = safety_.apply(record.rendered, record.probe, record.dt).force;
      probe_.apply(record.commanded, record.dt);
      felt_ = felt_ || !record.commanded.isZero(0.0);
      if (kept) {
        ASSERT_TRUE(writer_->append(record).ok());
      }
    }
    if (!kept) tell("lost", std::to_string(count));
  }
  void finish() { ASSERT_TRUE(writer_->finish().ok()); }
  [[nodiscard]] bool felt() const { return felt_; }

 private:
  Experiment experiment_;
  Scene scene_;
  SafetyStage safety_;
  IdealProbe probe_;
  ProxyState state_;
  ProxyCache cache_;
  std::optional<TraceWriter> writer_;
  std::uint64_t tick_ = 0;
  bool felt_ = false;
};

struct Answer {
  int code = -1;
  std::string out;
  std::string err;
};

class LiveReplay : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-live-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream stream(at(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] Answer run(const std::string& arguments) const {
    const std::string line =
        "cd '" + folder_.string() + "' && '" ASPERITY_PROGRAM "' " + arguments + " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(".out"), read(".err")};
  }
  static bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

  fs::path folder_;
};

/// Everything that there is: key frames at ticks 0, 150, 300, 450 and 700.
void write_session(const std::string& path, bool with_loss, bool finished = true) {
  SafetySettings settings;
  settings.max_force = 2.0;
  settings.slew_limit = 100.0;
  settings.engage = Seconds(0.05);
  settings.latches = true;
  Session session(path, settings);
  session.key_frame();
  session.run(150);
  session.key_frame();
  session.edit({SceneEditKind::stiffness, "sheet", 600.0});
  session.run(150);
  session.touch_anew("0.6mm");
  session.key_frame();
  session.run(60);
  session.release();
  session.run(40);
  session.raise(Fault::stalled);
  session.run(30);
  session.acknowledge();
  session.run(20);
  session.key_frame();
  session.edit({SceneEditKind::law, "", 0.0, "height-field"});
  session.tell("note", "the law was changed");
  session.run(100);
  if (with_loss) session.run(50, false);
  session.run(150);
  session.key_frame();
  session.run(50);
  session.stop();
  session.run(30);
  ASSERT_TRUE(session.felt());
  if (finished) session.finish();
}

TEST_F(LiveReplay, IsBitEqualFromTheStartAndFromEachKeyFrame) {
  write_session(at("a.asptrace"), false);
  const Answer all = run("replay a.asptrace");
  EXPECT_EQ(all.code, 0) << all.err;
  EXPECT_TRUE(has(all.out, "780 ticks replayed, every force bit-equal")) << all.out;
  EXPECT_TRUE(has(all.out, "5 key frames, each goes on bit-equal")) << all.out;
  EXPECT_FALSE(has(all.out, "judged")) << all.out;
  const json told = json::parse(run("replay a.asptrace --json").out);
  EXPECT_EQ(told["judged"], 780);
  EXPECT_EQ(told["key_frames"], 5);
  EXPECT_EQ(told["key_frames_different"], 0);
  EXPECT_EQ(told["events"]["edit"], 2);
  EXPECT_EQ(told["events"]["scene"], 1);
  const int ticks_from[] = {780, 630, 480, 330, 80};
  for (int k = 1; k <= 5; ++k) {
    const Answer from = run("replay a.asptrace --json --from " + std::to_string(k));
    EXPECT_EQ(from.code, 0) << from.err;
    EXPECT_EQ(json::parse(from.out)["judged"], ticks_from[k - 1]) << k;
    EXPECT_EQ(json::parse(from.out)["different"], 0) << k;
  }
  const Answer beyond = run("replay a.asptrace --from 6");
  EXPECT_EQ(beyond.code, 2);
  EXPECT_TRUE(has(beyond.err, "--from")) << beyond.err;
}

TEST_F(LiveReplay, EveryEventMatters) {
  write_session(at("a.asptrace"), false);
  const Trace trace = read_trace(at("a.asptrace")).value();
  std::size_t notes = 0;
  for (std::size_t left_out = 0; left_out < trace.events.size(); ++left_out) {
    TraceWriter writer = TraceWriter::open(at("b.asptrace"), trace.metadata).value();
    std::size_t event = 0;
    for (const TraceRecord& record : trace.records) {
      for (; event < trace.events.size() && trace.events[event].tick <= record.tick; ++event)
        if (event != left_out) {
          ASSERT_TRUE(writer.event(trace.events[event]).ok());
        }
      ASSERT_TRUE(writer.append(record).ok());
    }
    ASSERT_TRUE(writer.finish().ok());
    const bool note = trace.events[left_out].kind == "note";
    notes += note ? 1U : 0U;
    EXPECT_EQ(run("replay b.asptrace").code, note ? 0 : 1) << trace.events[left_out].kind;
  }
  EXPECT_EQ(notes, 1U);
  TraceMetadata other = trace.metadata;
  other.extra.erase(trace_safety_key);
  TraceWriter writer = TraceWriter::open(at("c.asptrace"), other).value();
  for (const TraceRecord& record : trace.records) {
    if (record.tick < 150) {
      ASSERT_TRUE(writer.append(record).ok());
    }
  }
  ASSERT_TRUE(writer.finish().ok());
  EXPECT_EQ(run("replay c.asptrace").code, 1) << "the device's own safety settings are others";
}

TEST_F(LiveReplay, AGapIsGoneOverAtTheNextKeyFrame) {
  write_session(at("a.asptrace"), true);
  const Answer all = run("replay a.asptrace");
  EXPECT_EQ(all.code, 0) << all.err;
  EXPECT_TRUE(has(all.out, "200 ticks could not be judged: 50 were lost")) << all.out;
  const json told = json::parse(run("replay a.asptrace --json").out);
  EXPECT_EQ(told["lost"], 50);
  EXPECT_EQ(told["not_judged"], 150);
  EXPECT_EQ(told["judged"], 630);
}

TEST_F(LiveReplay, AKeyFrameThatGoesOnDifferentlyIsFound) {
  write_session(at("a.asptrace"), false);
  const Trace trace = read_trace(at("a.asptrace")).value();
  // The state of the second key frame in place of the third one's.
  TraceWriter writer = TraceWriter::open(at("b.asptrace"), trace.metadata).value();
  std::size_t event = 0;
  std::size_t key = 0;
  for (const TraceRecord& record : trace.records) {
    for (; event < trace.events.size() && trace.events[event].tick <= record.tick; ++event)
      ASSERT_TRUE(writer.event(trace.events[event]).ok());
    for (; key < trace.key_frames.size() && trace.key_frames[key].tick <= record.tick; ++key)
      ASSERT_TRUE(writer.key_frame({record.tick, trace.key_frames[key == 2 ? 1 : 0].state}).ok());
    ASSERT_TRUE(writer.append(record).ok());
  }
  ASSERT_TRUE(writer.finish().ok());
  const Answer all = run("replay b.asptrace");
  EXPECT_EQ(all.code, 1);
  EXPECT_TRUE(has(all.out, "780 ticks replayed, every force bit-equal")) << all.out;
  EXPECT_TRUE(has(all.err, "of 5 key frames do not go on")) << all.err;
}

TEST_F(LiveReplay, WhatNobodyKnowsIsRefusedWithItsPlace) {
  write_session(at("a.asptrace"), false);
  const Trace trace = read_trace(at("a.asptrace")).value();
  const auto refused = [&](const TraceEvent& event, const char* part) {
    TraceWriter writer = TraceWriter::open(at("b.asptrace"), trace.metadata).value();
    for (std::uint64_t n = 0; n < 5; ++n) {
      if (n == event.tick) {
        ASSERT_TRUE(writer.event(event).ok());
      }
      ASSERT_TRUE(writer.append(trace.records[n]).ok());
    }
    ASSERT_TRUE(writer.finish().ok());
    const Answer answer = run("replay b.asptrace");
    EXPECT_EQ(answer.code, 2) << answer.err;
    EXPECT_TRUE(has(answer.err, part)) << answer.err;
    EXPECT_TRUE(has(answer.err, "before tick 3")) << answer.err;
  };
  refused({3, "dance", ""}, "does not know");
  refused({3, "raise", "headache"}, "headache");
  refused({3, "edit", "{}"}, "kind");
  refused({3, "edit", R"({"kind":"stiffness","instance":"nobody","value":1})"}, "nobody");
  refused({3, "scene", "{"}, "scene");
  // A gap that nothing tells.
  TraceWriter writer = TraceWriter::open(at("b.asptrace"), trace.metadata).value();
  ASSERT_TRUE(writer.append(trace.records[0]).ok());
  ASSERT_TRUE(writer.append(trace.records[2]).ok());
  ASSERT_TRUE(writer.finish().ok());
  const Answer gap = run("replay b.asptrace");
  EXPECT_EQ(gap.code, 2);
  EXPECT_TRUE(has(gap.err, "tells of no loss")) << gap.err;
}

TEST_F(LiveReplay, ASessionThatWasKilledIsReplayedAsFarAsItIs) {
  write_session(at("a.asptrace"), false, false);
  const Answer all = run("replay a.asptrace");
  EXPECT_EQ(all.code, 1);
  EXPECT_TRUE(has(all.out, "780 ticks replayed, every force bit-equal")) << all.out;
  EXPECT_TRUE(has(all.err, "not whole")) << all.err;
}

TEST_F(LiveReplay, OnTheServoThreadItIsBitEqualToo) {
  for (const bool with_loss : {false, true}) {
    write_session(at("a.asptrace"), with_loss);
    const Answer live = run("replay a.asptrace --live");
    EXPECT_EQ(live.code, 0) << live.err;
    EXPECT_TRUE(has(live.out, "every force bit-equal")) << live.out;
    EXPECT_TRUE(has(live.out, "late by")) << live.out;
    const json told = json::parse(run("replay a.asptrace --live --json").out);
    EXPECT_EQ(told["different"], 0);
    EXPECT_EQ(told["judged"], with_loss ? 630 : 780);
    EXPECT_GE(told["lateness"]["max_s"].get<double>(), told["lateness"]["p50_s"].get<double>());
    EXPECT_TRUE(told["missed"].is_number());
  }
}

/// What a fault leaves: the scene as it is then, the last key frame and the ticks from there.
void write_fault(const std::string& from, const std::string& to) {
  const Trace trace = read_trace(from).value();
  const TraceKeyFrame& key = trace.key_frames.back();
  TraceMetadata metadata = trace.metadata;
  metadata.extra[trace_fault_key] = "a tick took longer than the loop may be blind";
  TraceWriter writer = TraceWriter::open(to, metadata).value();
  std::size_t event = 0;
  for (; event < key.events_before; ++event)
    if (trace.events[event].kind == "scene" || trace.events[event].kind == "edit") {
      ASSERT_TRUE(writer.event({key.tick, trace.events[event].kind, trace.events[event].text}).ok());
    }
  ASSERT_TRUE(writer.key_frame(key).ok());
  for (const TraceRecord& record : trace.records) {
    if (record.tick < key.tick) continue;
    for (; event < trace.events.size() && trace.events[event].tick <= record.tick; ++event)
      ASSERT_TRUE(writer.event(trace.events[event]).ok());
    ASSERT_TRUE(writer.append(record).ok());
  }
  ASSERT_TRUE(writer.finish().ok());
}

TEST_F(LiveReplay, WhatAFaultLeavesIsReplayedFromItsFirstTick) {
  write_session(at("a.asptrace"), false);
  write_fault(at("a.asptrace"), at("fault.asptrace"));
  const Answer all = run("replay fault.asptrace");
  EXPECT_EQ(all.code, 0) << all.err;
  EXPECT_TRUE(has(all.out, "80 ticks replayed, every force bit-equal")) << all.out;
  EXPECT_FALSE(has(all.out, "judged")) << all.out;
}

TEST_F(LiveReplay, InspectTellsWhatHappenedAndOfAFaultItsSentenceFirst) {
  write_session(at("a.asptrace"), true);
  const Answer whole = run("inspect a.asptrace");
  EXPECT_EQ(whole.code, 0) << whole.err;
  for (const char* part : {"events: 1 acknowledge, 2 edit, 1 lost, 1 note, 1 raise, 1 released, 1 scene, 1 stopping",
                           "key frames: 5, before ticks 0 to 750", "before tick 300: scene \"live\"",
                           "before tick 400: raise stalled", "50 ticks are missing, in 1 gap(s)"})
    EXPECT_TRUE(has(whole.out, part)) << part << "\n" << whole.out;
  EXPECT_FALSE(has(whole.out, "fault")) << whole.out;
  write_fault(at("a.asptrace"), at("fault.asptrace"));
  const Answer fault = run("inspect fault.asptrace --report fault.html");
  EXPECT_EQ(fault.code, 0) << fault.err;
  const std::size_t sentence = fault.out.find("  fault: a tick took longer than the loop may be blind\n");
  ASSERT_NE(sentence, std::string::npos) << fault.out;
  EXPECT_LT(sentence, fault.out.find("  ticks:"));
  EXPECT_TRUE(has(fault.out, "The last ticks:\n  80 ticks in ")) << fault.out;
  EXPECT_TRUE(has(fault.out, "tick 829: ")) << fault.out;
  const std::string page = read("fault.html");
  EXPECT_TRUE(has(page, "a tick took longer than the loop may be blind"));
  EXPECT_TRUE(has(page, "the last 80 of the trace")) << page.size();
  const json told = json::parse(run("inspect fault.asptrace --json").out);
  EXPECT_EQ(told["fault"], "a tick took longer than the loop may be blind");
  EXPECT_EQ(told["last"]["ticks"], 80);
  EXPECT_EQ(told["last"]["last_ticks"].size(), 12U);
  EXPECT_EQ(told["last"]["last_ticks"][11]["tick"], 829);
  EXPECT_EQ(told["event_counts"]["edit"], 2);
  const Answer other = run("inspect icosphere --report page.html");
  EXPECT_EQ(other.code, 2);
  EXPECT_FALSE(fs::exists(at("page.html")));
}

// --- asperity run ---

TEST_F(LiveReplay, WhatRunHasRecordedReplaysBitEqual) {
  const Answer ran =
      run("run icosphere --seconds 1.3 --priority 0 --edit 300ms:stiffness=300 --edit 600ms:zoom=2 --out o");
  ASSERT_EQ(ran.code, 0) << ran.err << ran.out;
  for (const char* part : {"ticks    1", "scenes   3 handed over, 3 felt", "faults   none", "0 lost"})
    EXPECT_TRUE(has(ran.out, part)) << part << ran.out;
  const Answer again = run("replay o/live.asptrace");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_TRUE(has(again.out, "every force bit-equal")) << again.out;
  EXPECT_TRUE(has(again.out, "1 key frames, each goes on bit-equal")) << again.out;
}

TEST_F(LiveReplay, ARunThatIsInterruptedEndsInGoodOrder) {
  for (const char* signal : {"INT", "TERM"}) {
    const Answer ran = run(
        std::string("run icosphere --seconds 60 --priority 0 --json --out o > out.txt 2> err.txt & sleep 1.5; kill -") +
        signal + " $!; wait $!");
    EXPECT_EQ(ran.code, 0) << read("err.txt");
    EXPECT_TRUE(json::accept(read("out.txt"))) << read("out.txt");
    const Answer again = run("replay o/live.asptrace");
    EXPECT_EQ(again.code, 0) << "the recording is whole" << again.err;
  }
}

TEST_F(LiveReplay, ADeviceThatIsKilledEndsTheRunAndLeavesItsLastSeconds) {
  const Answer ran = run(
      "run icosphere --seconds 60 --priority 0 --out o > out.txt 2> err.txt & sleep 1.5; pkill -KILL -P $!; wait $!");
  EXPECT_EQ(ran.code, 1);
  EXPECT_TRUE(has(read("err.txt"), "fault: the device no longer answers")) << read("err.txt");
  const Answer told = run("inspect o/fault-1.asptrace");
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_TRUE(has(told.out, "fault: the device no longer answers")) << told.out;
  EXPECT_EQ(run("replay o/fault-1.asptrace").code, 0);
}

TEST_F(LiveReplay, RunRefusesWhatItCannotDo) {
  const auto refused = [&](const std::string& arguments, const char* part) {
    const Answer answer = run("run icosphere --out o " + arguments);
    EXPECT_EQ(answer.code, 2) << arguments;
    EXPECT_TRUE(has(answer.err, part)) << answer.err;
    EXPECT_FALSE(fs::exists(folder_ / "o" / "live.asptrace")) << arguments;
  };
  refused("--device haply:inverse3", "simulated:PROFILE");
  refused("--device simulated:omega.8", "omega.7");
  refused("--edit stiffness=3", "2s:stiffness=800");
  refused("--edit 1s:stiffness=-3", "above 0");
  refused("--edit 1s:cube.stiffness=3", "cube");
  refused("--rate 100", "500 Hz to 40 kHz");
}

}  // namespace
}  // namespace asperity::live_replay_test
