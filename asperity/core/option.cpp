#include "asperity/core/option.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace asperity {

std::string Range::text() const {
  if (std::isfinite(low) && std::isfinite(high))
    return fmt::format("{}{:.4g} to {:.4g}", above_low ? "above " : "", low, high);
  if (std::isfinite(low)) return above_low ? fmt::format("above {:.4g}", low) : fmt::format("{:.4g} or more", low);
  if (std::isfinite(high)) return fmt::format("{:.4g} or less", high);
  return "of any size";
}

int Option::zoom_power() const {
  if (zooms) return *zooms;
  switch (type.kind == OptionKind::quantity ? type.dimension : Dimension::ratio) {
    case Dimension::force: return 1;
    case Dimension::stiffness:
    case Dimension::damping:
    case Dimension::mass: return 2;
    case Dimension::speed: return -1;
    case Dimension::length:
    case Dimension::time:
    case Dimension::frequency:
    case Dimension::ratio:
    case Dimension::angle: break;
  }
  return 0;
}

bool OptionType::takes(const OptionValue& value) const {
  if (const auto* number = std::get_if<double>(&value)) return kind == OptionKind::any || range.holds(*number);
  if (const auto* number = std::get_if<std::int64_t>(&value)) return range.holds(static_cast<double>(*number));
  return !std::holds_alternative<std::monostate>(value);
}

std::vector<std::string> OptionType::all_names() const {
  std::vector<std::string> all = names;
  if (more_names != nullptr) all.insert(all.end(), more_names().begin(), more_names().end());
  return all;
}

std::string OptionType::accepted() const {
  if (!said.empty()) return said;
  switch (kind) {
    case OptionKind::number: return fmt::format("a number {}", range.text());
    case OptionKind::quantity: {
      const std::string units = accepted_units(dimension);
      return fmt::format("a number {}{}{}", range.text(), units.empty() ? "" : " (" + units + ")",
                         share ? ", or a share (\"10 %\")" : "");
    }
    case OptionKind::integer: return fmt::format("a whole number, {} to {}", range.low, range.high);
    case OptionKind::seed: return "a whole number, 0 or more";
    case OptionKind::boolean: return "true or false";
    case OptionKind::text: return "a text";
    case OptionKind::choice: return fmt::format("\"{}\"", fmt::join(all_names(), "\", \""));
    case OptionKind::share: return "a share (\"50 %\")";
    case OptionKind::bytes: return "bytes, or a text with kB, MB, GB, KiB, MiB or GiB; 1 MiB to 1 TiB";
    case OptionKind::numbers: return "an object with a \"type\" and its numbers";
    case OptionKind::array:
      if (least == most) return fmt::format("{} {}", least, word);
      return fmt::format("an array of {} to {} {}", least, most, word);
    case OptionKind::object: return "an object";
    case OptionKind::any: break;
  }
  std::string list;
  for (const OptionType& part : parts) list += (list.empty() ? "" : ", or ") + part.accepted();
  return list;
}

OptionType OptionType::vector(Dimension dimension, Range range) {
  const bool lengths = dimension == Dimension::length;
  return array(quantity(dimension, range), 3, 3, lengths ? "numbers" : "quantities")
      .saying(lengths ? "three lengths [x, y, z] (m, or with a unit)" : "three quantities [x, y, z]");
}

OptionType OptionType::pair(OptionType entry) {
  const std::string what = entry.dimension == Dimension::length ? "length" : "number";
  OptionType two = array(entry, 2, 2, what + "s").saying("one " + what + ", or two [along u, along v]");
  return any({std::move(entry), std::move(two)});
}

}  // namespace asperity
