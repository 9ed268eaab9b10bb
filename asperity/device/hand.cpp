#include "asperity/device/hand.h"

#include <array>

#include "asperity/device/detail/checks.h"

namespace asperity {
namespace {

const std::array<HandImpedance, 4>& hand_table() {
  static const std::array<HandImpedance, 4> hands{
      HandImpedance{"default", 0.15, 6.0, 400.0, 4.0},
      HandImpedance{"light", 0.05, 2.0, 100.0, 4.0},
      HandImpedance{"firm", 0.30, 10.0, 800.0, 4.0},
      HandImpedance{"paper", 0.25, 6.5, 400.0, 4.0},
  };
  return hands;
}

}  // namespace

std::span<const HandImpedance> hand_presets() {
  return hand_table();
}

std::vector<std::string> hand_preset_names() {
  return names_in(hand_presets());
}

Result<HandImpedance> find_hand(std::string_view name) {
  return find_in(hand_presets(), name, "hand");
}

Status validate_hand(const HandImpedance& hand) {
  ASPERITY_CHECK(require(hand.mass > 0.0, "mass", hand.mass, "a mass above 0 (kg)"));
  ASPERITY_CHECK(require(hand.damping >= 0.0, "damping", hand.damping, "a damping of 0 or more (N s/m)"));
  ASPERITY_CHECK(require(hand.stiffness > 0.0, "stiffness", hand.stiffness, "a stiffness above 0 (N/m)"));
  return require(hand.lateral_limit > 0.0, "lateral_limit", hand.lateral_limit, "a force above 0 (N)");
}

}  // namespace asperity
