#include "asperity/core/units.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

#include "asperity/core/option.h"

namespace asperity {
namespace {

struct Unit {
  std::string_view name;
  double to_si;
};

const std::vector<Unit>& units_of(Dimension dimension) {
  static const std::vector<Unit> length{{"m", 1.0},   {"cm", 1e-2}, {"mm", 1e-3},  {"um", 1e-6},
                                        {"µm", 1e-6}, {"nm", 1e-9}, {"in", 0.0254}};
  static const std::vector<Unit> force{{"N", 1.0}, {"mN", 1e-3}};
  static const std::vector<Unit> stiffness{{"N/m", 1.0}, {"N/mm", 1e3}};
  static const std::vector<Unit> damping{
      {"N s/m", 1.0}, {"Ns/m", 1.0}, {"N·s/m", 1.0}, {"N s/mm", 1e3}, {"Ns/mm", 1e3}};
  static const std::vector<Unit> mass{{"kg", 1.0}, {"g", 1e-3}};
  static const std::vector<Unit> time{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"µs", 1e-6}};
  static const std::vector<Unit> frequency{{"Hz", 1.0}, {"kHz", 1e3}};
  static const std::vector<Unit> speed{{"m/s", 1.0}, {"cm/s", 1e-2}, {"mm/s", 1e-3}};
  static const std::vector<Unit> ratio{{"", 1.0}, {"%", 1e-2}};
  static const std::vector<Unit> angle{{"rad", 1.0}, {"deg", std::numbers::pi / 180.0}};
  switch (dimension) {
    case Dimension::length: return length;
    case Dimension::force: return force;
    case Dimension::stiffness: return stiffness;
    case Dimension::damping: return damping;
    case Dimension::mass: return mass;
    case Dimension::time: return time;
    case Dimension::frequency: return frequency;
    case Dimension::speed: return speed;
    case Dimension::ratio: return ratio;
    case Dimension::angle: return angle;
  }
  return ratio;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

std::string accepted_units(Dimension dimension) {
  std::string list;
  for (const Unit& unit : units_of(dimension)) {
    if (unit.name.empty() || unit.name.find("µ") != std::string_view::npos) continue;
    if (!list.empty()) list += ", ";
    list += unit.name;
  }
  return list;
}

std::vector<std::string> unit_names(Dimension dimension) {
  std::vector<std::string> names;
  for (const Unit& unit : units_of(dimension)) {
    if (!unit.name.empty()) names.emplace_back(unit.name);
  }
  return names;
}

Result<double> parse_quantity(std::string_view text, Dimension dimension) {
  const std::string_view whole = trimmed(text);
  const auto fail = [&](std::string what) {
    return bad_value(fmt::format("\"{}\" {}", whole, what), "",
                     "a number, SI or with one of the units " + accepted_units(dimension));
  };
  double value = 0.0;
  const std::string_view digits = !whole.empty() && whole.front() == '+' ? whole.substr(1) : whole;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (failure != std::errc{}) return fail("does not start with a number");
  if (!std::isfinite(value)) return fail("is not finite");
  const std::string_view unit = trimmed(digits.substr(static_cast<std::size_t>(end - digits.data())));
  if (unit.empty()) return value;
  for (const Unit& known : units_of(dimension)) {
    if (unit == known.name) return value * known.to_si;
  }
  return fail(fmt::format("has the unknown unit \"{}\"", unit));
}

std::string format_length(double metres) {
  const double size = std::abs(metres);
  if (size == 0.0) return "0 mm";
  // Three digits that round up to 1000 belong to the next unit.
  if (size >= 0.9995) return fmt::format("{:.3g} m", metres);
  if (size >= 0.9995e-3) return fmt::format("{:.3g} mm", metres * 1e3);
  if (size >= 0.9995e-6) return fmt::format("{:.3g} um", metres * 1e6);
  return fmt::format("{:.3g} nm", metres * 1e9);
}

}  // namespace asperity
