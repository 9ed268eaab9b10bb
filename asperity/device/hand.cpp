#include "asperity/device/hand.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>

#include "asperity/core/suggest.h"

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

Status require_of_hand(bool good, const char* field, double value, const char* accepted) {
  if (good && std::isfinite(value)) return success();
  return bad_value(fmt::format("is {}", value), field, accepted);
}

}  // namespace

std::span<const HandImpedance> hand_presets() {
  return hand_table();
}

std::vector<std::string> hand_preset_names() {
  std::vector<std::string> names;
  for (const HandImpedance& hand : hand_table()) names.push_back(hand.name);
  return names;
}

Result<HandImpedance> find_hand(std::string_view name) {
  for (const HandImpedance& hand : hand_table()) {
    if (edit_distance(name, hand.name) == 0) return hand;
  }
  const std::vector<std::string> names = hand_preset_names();
  const std::string near = nearest_name(name, names);
  const std::string hint = near.empty() ? std::string() : fmt::format("; did you mean \"{}\"?", near);
  return bad_value(fmt::format("hand \"{}\" is not known{}", name, hint), "",
                   fmt::format("{}", fmt::join(names, ", ")));
}

Status validate_hand(const HandImpedance& hand) {
  ASPERITY_CHECK(require_of_hand(hand.mass > 0.0, "mass", hand.mass, "a mass above 0 (kg)"));
  ASPERITY_CHECK(require_of_hand(hand.damping >= 0.0, "damping", hand.damping, "a damping of 0 or more (N s/m)"));
  ASPERITY_CHECK(require_of_hand(hand.stiffness > 0.0, "stiffness", hand.stiffness, "a stiffness above 0 (N/m)"));
  return require_of_hand(hand.lateral_limit > 0.0, "lateral_limit", hand.lateral_limit, "a force above 0 (N)");
}

}  // namespace asperity
