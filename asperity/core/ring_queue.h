#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace asperity {

/// A queue from one thread to another that neither ever waits for: bounded, no lock, no allocation after it was made.
/// What finds no room is refused, never written over. One thread pushes, one pops.
template <class T>
class RingQueue {
 public:
  /// Room for at least `capacity` values, 1 or more. [build]
  explicit RingQueue(std::size_t capacity)
      : mask_(std::bit_ceil(capacity < 1 ? std::size_t{1} : capacity) - 1),
        slots_(std::make_unique<T[]>(mask_ + 1)) {}  // NOLINT: as many as are asked for

  /// False where there is no room. [servo]
  bool push(const T& value) noexcept {
    return push_with([&](T& slot) noexcept { slot = value; });
  }
  /// fill(slot) where there is room: whatever was in the slot before is to be written over. [servo]
  template <class Fill>
  bool push_with(Fill&& fill) noexcept {
    const std::uint64_t end = end_.load(std::memory_order_relaxed);
    // The other thread's line is read only once what was seen of it is used up.
    if (end - seen_first_ > mask_) {
      seen_first_ = first_.load(std::memory_order_acquire);
      if (end - seen_first_ > mask_) return false;
    }
    fill(slots_[end & mask_]);
    end_.store(end + 1, std::memory_order_release);
    return true;
  }

  /// Calls use(value) for each value there is, oldest first, and answers how many. [any]
  template <class Use>
  std::size_t pop_all(Use&& use) {
    std::uint64_t first = first_.load(std::memory_order_relaxed);
    const std::uint64_t end = end_.load(std::memory_order_acquire);
    const std::uint64_t before = first;
    while (first != end) {
      use(static_cast<const T&>(slots_[first & mask_]));
      first_.store(++first, std::memory_order_release);
    }
    return static_cast<std::size_t>(end - before);
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return mask_ + 1; }

 private:
  static constexpr std::size_t line = 64;

  std::uint64_t mask_;
  std::unique_ptr<T[]> slots_;  // NOLINT: as above
  alignas(line) std::atomic<std::uint64_t> end_ = 0;
  std::uint64_t seen_first_ = 0;  ///< the pusher's
  alignas(line) std::atomic<std::uint64_t> first_ = 0;
};

}  // namespace asperity
