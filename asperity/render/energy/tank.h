#pragma once

#include <algorithm>

namespace asperity {

/// Energy that contact has dissipated and that a change of the scene may spend (formulation D6, amendment 6).
///
/// At a fixed probe the spring between probe and proxy may only lose energy when the proxy moves: that makes the
/// contact passive. Where a new scene, or a stiffer material, would make it gain, it pays from here; what the tank does
/// not hold is not rendered.
class EnergyTank {
 public:
  /// J: what a spring of 1 N/mm holds when it is stretched by about 3 mm.
  static constexpr double capacity = 5e-3;

  [[nodiscard]] double level() const noexcept { return level_; }  ///< J
  /// Takes in dissipated energy (J); what exceeds the capacity is lost. [servo]
  void fill(double energy) noexcept { level_ = std::min(capacity, level_ + std::max(0.0, energy)); }
  /// Pays up to `energy` (J) and answers how much it paid. [servo]
  double pay(double energy) noexcept {
    const double paid = std::clamp(energy, 0.0, level_);
    level_ -= paid;
    return paid;
  }

 private:
  double level_ = 0.0;
};

}  // namespace asperity
