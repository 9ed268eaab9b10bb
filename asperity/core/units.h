#pragma once
// SI everywhere. Other units exist at the edge only: in scene files ("2mm") and on the screen.

#include <chrono>
#include <string>
#include <string_view>

#include "asperity/core/result.h"

namespace asperity {

/// A duration or a time since the start of a run (s). A type of its own, so that no rate is ever implied.
using Seconds = std::chrono::duration<double>;

/// mm to m. [any]
constexpr double millimetres(double value) {
  return value * 1e-3;
}
/// um to m. [any]
constexpr double micrometres(double value) {
  return value * 1e-6;
}
/// Newton per millimetre to N/m, the unit the field speaks for stiffness. [any]
constexpr double newtons_per_millimetre(double value) {
  return value * 1e3;
}

/// What a quantity measures; each has its own units.
enum class Dimension { length, force, stiffness, damping, mass, time, frequency, speed, ratio, angle };

/// Reads "2mm", "0.5 N/mm", "15 mm/s", "1kHz", "10%": a number with a unit of `dimension`, converted to SI.
/// Without a unit the number is SI already. Errors: bad_value, naming the units that would be accepted. [any]
Result<double> parse_quantity(std::string_view text, Dimension dimension);

/// The units `parse_quantity` accepts for `dimension`, for messages and documentation ("m, cm, mm, um, in"). [any]
std::string accepted_units(Dimension dimension);

/// `metres` written for people, with the unit that suits its size: "2.00 mm", "350 um". [any]
std::string format_length(double metres);

}  // namespace asperity
