#pragma once
// How long something takes, counted while it runs by one thread and read by any.

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

#include "asperity/core/math.h"

namespace asperity {

/// A histogram of times at one moment.
struct TimeCounts {
  static constexpr unsigned parts_bits = 5;  ///< of each octave: 32 parts, so that a time is told to 3 %
  static constexpr unsigned octaves = 36;    ///< up to 2^40 ns, a quarter of an hour
  static constexpr std::size_t buckets = octaves << parts_bits;

  std::array<std::uint64_t, buckets> counts{};
  std::uint64_t total = 0;
  double longest = 0.0;  ///< s, exact

  /// The time that a share `of` all (0 to 1) does not exceed, to 3 % and never too short; 0 where there are none.
  /// Bounded by the longest. [any]
  [[nodiscard]] double quantile(double of) const noexcept;
};

/// Counts times, one thread at it: no lock and no read-modify-write. Readers see each bucket whole; what is counted
/// while they read may be missing in some.
class TimeHistogram {
 public:
  /// Takes a time (s); below 0 counts as 0. [servo]
  void add(double seconds) noexcept;
  /// [any]
  [[nodiscard]] TimeCounts counts() const noexcept;

 private:
  std::array<std::atomic<std::uint64_t>, TimeCounts::buckets> counts_{};
  std::atomic<std::uint64_t> longest_ns_ = 0;
};

}  // namespace asperity
