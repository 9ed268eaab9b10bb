#pragma once
// What a tick looks at, counted, and how much of it it may.

#include <algorithm>
#include <cstdint>
#include <limits>

namespace asperity {

/// What queries of surfaces have looked at.
struct WorkCount {
  std::uint32_t evaluations = 0;  ///< of a surface at a place, with its derivatives
  std::uint32_t bounds = 0;       ///< of a part of a surface
  std::uint32_t frames = 0;       ///< faces, cells or patches that were made ready

  // About as long as they take against an evaluation.
  static constexpr std::uint32_t of_bound = 8;
  static constexpr std::uint32_t of_frame = 4;

  /// All of it, in evaluations.
  [[nodiscard]] constexpr std::uint32_t sum() const noexcept {
    return evaluations + of_bound * bounds + of_frame * frames;
  }
  constexpr WorkCount& operator+=(const WorkCount& other) noexcept {
    evaluations += other.evaluations;
    bounds += other.bounds;
    frames += other.frames;
    return *this;
  }
};

/// The work of one tick against its budget. It is counted, never timed, and whatever caches hold: a replay spends the
/// same. A query is told as a whole when it ends: a tick goes over its budget by one, or by a move and the look at what
/// is in its way. [servo]
class WorkMeter {
 public:
  /// `budget`: in evaluations; 0: no limit. [servo]
  void begin(std::uint32_t budget) noexcept {
    done_ = {};
    limit_ = budget == 0 ? unlimited : budget;
  }
  void add(const WorkCount& count) noexcept { done_ += count; }
  [[nodiscard]] const WorkCount& done() const noexcept { return done_; }
  /// [servo]
  [[nodiscard]] bool spent() const noexcept { return done_.sum() >= limit_; }
  /// Evaluations that are left of it. [servo]
  [[nodiscard]] std::uint32_t left() const noexcept { return limit_ - std::min(limit_, done_.sum()); }

 private:
  static constexpr std::uint32_t unlimited = std::numeric_limits<std::uint32_t>::max();
  WorkCount done_;
  std::uint32_t limit_ = unlimited;
};

/// Tells a meter, where there is one, what a query took. [servo]
inline void tell(WorkMeter* work, const WorkCount& count) noexcept {
  if (work != nullptr) work->add(count);
}

}  // namespace asperity
