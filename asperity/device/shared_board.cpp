#include "asperity/device/shared_board.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <system_error>

namespace asperity {
namespace {

/// The loop's word.
struct LoopWord {
  std::uint64_t beat = 0;
  std::uint64_t released = 0;
  std::array<double, 3> force{};
};

/// The device's.
struct DeviceWord {
  std::uint64_t beat = 0;
  std::uint64_t released = 0;
  std::uint64_t finished = 0;
  std::uint64_t buttons = 0;
  double time = 0.0;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{};  // w, x, y, z
  std::array<double, 3> linear{};
  std::array<double, 3> angular{};
};

std::array<double, 3> numbers(const Vec3& v) noexcept {
  return {v.x(), v.y(), v.z()};
}
Vec3 vector(const std::array<double, 3>& v) noexcept {
  return {v[0], v[1], v[2]};
}

DeviceWord word_of(const PortReading& reading) noexcept {
  const ProbeSample& probe = reading.probe;
  const Quat& q = probe.pose.orientation;
  return {reading.beat,
          reading.released,
          reading.finished ? 1U : 0U,
          probe.buttons,
          probe.time.count(),
          numbers(probe.pose.position),
          {q.w(), q.x(), q.y(), q.z()},
          numbers(probe.twist.linear),
          numbers(probe.twist.angular)};
}

PortReading reading_of(const DeviceWord& word) noexcept {
  PortReading reading;
  reading.beat = word.beat;
  reading.released = word.released;
  reading.finished = word.finished != 0;
  reading.probe.pose.position = vector(word.position);
  reading.probe.pose.orientation =
      Quat(word.orientation[0], word.orientation[1], word.orientation[2], word.orientation[3]);
  reading.probe.twist.linear = vector(word.linear);
  reading.probe.twist.angular = vector(word.angular);
  reading.probe.buttons = static_cast<std::uint32_t>(word.buttons);
  reading.probe.time = Seconds(word.time);
  return reading;
}

}  // namespace

struct SharedBoard::Layout {
  alignas(64) SharedValue<LoopWord> loop;
  alignas(64) SharedValue<DeviceWord> device;
  alignas(64) std::atomic<std::uint32_t> halted = 0;
  std::atomic<std::uint32_t> closed = 0;
  alignas(64) std::atomic<std::uint64_t> logged = 0;
  std::array<SharedValue<PutOut>, most_put_out> log;
};

Result<std::shared_ptr<SharedBoard>> SharedBoard::create() {
  void* const memory =
      ::mmap(nullptr, sizeof(Layout), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) {
    return Error{ErrorCode::too_large,
                 fmt::format("{} bytes of shared memory are refused ({})", sizeof(Layout),
                             std::generic_category().message(errno)),
                 {},
                 "shared memory",
                 "a system that has them"};
  }
  return std::shared_ptr<SharedBoard>(new SharedBoard(new (memory) Layout));
}

SharedBoard::~SharedBoard() {
  ::munmap(layout_, sizeof(Layout));
}

std::optional<PortReading> SharedBoard::read() const noexcept {
  DeviceWord word;
  if (!layout_->device.get(word)) return std::nullopt;
  return reading_of(word);
}

void SharedBoard::ask(const Asked& asked) noexcept {
  layout_->loop.put({asked.beat, asked.released, numbers(asked.force)});
}

void SharedBoard::halt() noexcept {
  layout_->halted.store(1, std::memory_order_release);
}
void SharedBoard::resume() noexcept {
  layout_->halted.store(0, std::memory_order_release);
}
void SharedBoard::close() noexcept {
  layout_->closed.store(1, std::memory_order_release);
}
bool SharedBoard::halted() const noexcept {
  return layout_->halted.load(std::memory_order_acquire) != 0;
}
bool SharedBoard::closed() const noexcept {
  return layout_->closed.load(std::memory_order_acquire) != 0;
}

std::optional<SharedBoard::Asked> SharedBoard::asked() const noexcept {
  LoopWord word;
  if (!layout_->loop.get(word)) return std::nullopt;
  return Asked{word.beat, vector(word.force), word.released};
}

void SharedBoard::tell(const PortReading& reading) noexcept {
  layout_->device.put(word_of(reading));
}

void SharedBoard::put_out(const PutOut& put) noexcept {
  const std::uint64_t count = layout_->logged.load(std::memory_order_relaxed);
  layout_->log[count % most_put_out].put(put);
  layout_->logged.store(count + 1, std::memory_order_release);
}

std::vector<PutOut> SharedBoard::last_put_out() const {
  const std::uint64_t end = layout_->logged.load(std::memory_order_acquire);
  std::vector<PutOut> all;
  for (std::uint64_t i = end - std::min<std::uint64_t>(end, most_put_out); i < end; ++i) {
    PutOut put;
    if (layout_->log[i % most_put_out].get(put)) all.push_back(put);
  }
  return all;
}

}  // namespace asperity
