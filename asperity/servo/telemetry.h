#pragma once
// What a live loop tells, brought from the servo thread to any number of readers that it never waits for.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "asperity/core/ring_queue.h"
#include "asperity/core/trace_record.h"
#include "asperity/servo/servo_thread.h"

namespace asperity {

/// A tick as readers get it.
struct TelemetryTick {
  TraceRecord record;
  TickNotes notes;
  Fault fault = Fault::none;  ///< that stays after this tick
  std::uint64_t scene = 0;    ///< number of what was touched, as whoever handed it over counts
  std::uint64_t lost = 0;     ///< ticks right before this one that found no room
};

/// All that the next tick goes by, as it was after a tick.
template <class State>
struct TelemetryKeyFrame {
  std::uint64_t tick = 0;   ///< the next one
  std::uint64_t scene = 0;  ///< what was touched until then
  State state;
  SafetyMemory safety;
};

/// One reader's own queue: what it does not take in time is lost to it alone, and counted.
template <class State>
class TelemetryReader {
 public:
  struct Batch {
    std::vector<TelemetryTick> ticks;
    std::vector<TelemetryKeyFrame<State>> key_frames;  ///< each belongs before the tick with its number
  };

  explicit TelemetryReader(std::size_t most) : most_(most) {}

  /// Moves all there is into `batch`, after at most `longest` of waiting. False: there is nothing, and never will be.
  /// [main]
  bool take(Batch& batch, std::chrono::milliseconds longest) {
    batch.ticks.clear();
    batch.key_frames.clear();
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, longest, [&] { return !coming_.ticks.empty() || ended_; });
    std::swap(batch, coming_);
    return !batch.ticks.empty() || !ended_;
  }
  /// Ticks that have not come to this reader: that it, or the hub, had no room for. [any]
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

  // --- the hub's ---
  void put(const Batch& batch) {
    {
      const std::lock_guard lock(mutex_);
      for (const auto& frame : batch.key_frames) {
        if (coming_.key_frames.size() < most_key_frames) coming_.key_frames.push_back(frame);
      }
      for (const TelemetryTick& tick : batch.ticks) put(tick);
    }
    changed_.notify_one();
  }
  void end() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_one();
  }

 private:
  static constexpr std::size_t most_key_frames = 64;

  void put(const TelemetryTick& tick) {
    const bool room = coming_.ticks.size() < most_;
    lost_.fetch_add(tick.lost + (room ? 0 : 1), std::memory_order_relaxed);
    skipped_ += tick.lost + (room ? 0 : 1);
    if (!room) return;
    coming_.ticks.push_back(tick);
    coming_.ticks.back().lost = std::exchange(skipped_, 0);
  }

  std::size_t most_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Batch coming_;
  std::uint64_t skipped_ = 0;
  std::atomic<std::uint64_t> lost_ = 0;
  bool ended_ = false;
};

/// How much of what a loop tells is kept until somebody has taken it.
struct TelemetrySettings {
  std::size_t ticks = 4096;              ///< between the servo thread and the hub, 1 or more
  std::uint64_t key_frame_every = 1000;  ///< ticks; 0 counts as 1
};

/// The hub: takes what the servo thread puts and hands it to every reader, on a thread of its own. The servo thread
/// neither waits nor wakes anybody.
template <class State>
class Telemetry {
 public:
  explicit Telemetry(const TelemetrySettings& settings = {})
      : ticks_(settings.ticks), key_frames_(8), key_frame_every_(std::max<std::uint64_t>(1, settings.key_frame_every)) {
    thread_ = std::thread([this] { hand_on(); });
  }
  /// What is left goes to the readers first.
  ~Telemetry() { end(); }
  Telemetry(const Telemetry&) = delete;
  Telemetry& operator=(const Telemetry&) = delete;

  /// A reader of its own, from now on and for as long as it is kept, with room for so many ticks. [main]
  std::shared_ptr<TelemetryReader<State>> read(std::size_t most) {
    auto reader = std::make_shared<TelemetryReader<State>>(most);
    const std::lock_guard lock(mutex_);
    readers_.push_back(reader);
    return reader;
  }
  /// Hands on what is left and tells the readers that this was all: once the loop has ended. [main]
  void end() {
    ending_.store(true, std::memory_order_release);
    if (thread_.joinable()) thread_.join();
  }
  /// Ticks that the hub was too late for. [any]
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

  /// A tick, with the state after it. [servo]
  template <class Felt, class Step>
  void put(const LiveTick<Felt, Step>& tick, std::uint64_t scene, const State& state) noexcept {
    const bool has_room = ticks_.push_with([&](TelemetryTick& slot) noexcept {
      slot.record = tick.record;
      slot.notes = tick.notes;
      slot.fault = tick.safety.fault();
      slot.scene = scene;
      slot.lost = skipped_;
    });
    if (has_room) {
      skipped_ = 0;
    } else {
      ++skipped_;
      lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }
    const std::uint64_t next = tick.record.tick + 1;
    // Where there is no room for one, the next one serves.
    if (next % key_frame_every_ == 0) key_frames_.push({next, scene, state, tick.safety.memory()});
  }

 private:
  using Batch = typename TelemetryReader<State>::Batch;

  void hand_to_all(const Batch& batch, bool last) {
    const std::lock_guard lock(mutex_);
    std::erase_if(readers_, [](const auto& reader) { return reader.use_count() == 1; });
    for (const auto& reader : readers_) {
      if (!batch.ticks.empty() || !batch.key_frames.empty()) reader->put(batch);
      if (last) reader->end();
    }
  }

  void hand_on() {
    Batch batch;
    for (bool last = false; !last;) {
      last = ending_.load(std::memory_order_acquire);
      batch.ticks.clear();
      batch.key_frames.clear();
      ticks_.pop_all([&](const TelemetryTick& tick) { batch.ticks.push_back(tick); });
      // After the ticks: so the key frame that belongs before one of them is here as well.
      key_frames_.pop_all([&](const TelemetryKeyFrame<State>& frame) { batch.key_frames.push_back(frame); });
      hand_to_all(batch, last);
      if (batch.ticks.empty() && !last) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  RingQueue<TelemetryTick> ticks_;
  RingQueue<TelemetryKeyFrame<State>> key_frames_;
  std::uint64_t key_frame_every_;
  std::uint64_t skipped_ = 0;  ///< the servo thread's
  std::atomic<std::uint64_t> lost_ = 0;
  std::atomic<bool> ending_ = false;
  std::mutex mutex_;
  std::vector<std::shared_ptr<TelemetryReader<State>>> readers_;
  std::thread thread_;
};

}  // namespace asperity
