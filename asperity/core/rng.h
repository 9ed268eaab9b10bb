#pragma once

#include <cstdint>

namespace asperity {

/// PCG32 (O'Neill 2014): small, seeded, the same numbers on every platform, unlike std distributions. [any]
class Rng {
 public:
  explicit constexpr Rng(std::uint64_t seed) : state_(seed + increment_) { next(); }

  constexpr std::uint32_t next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
  }
  /// Uniform in [0, 1).
  constexpr double uniform() { return next() * 0x1p-32; }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0 … count - 1; count > 0.
  constexpr std::uint32_t below(std::uint32_t count) {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * count) >> 32U);
  }

 private:
  std::uint64_t state_ = 0;
  static constexpr std::uint64_t increment_ = 1442695040888963407ULL;
};

}  // namespace asperity
