#include "asperity/io/detail/volume_assembly.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "asperity/core/suggest.h"

namespace asperity::volume_assembly {
namespace {

constexpr std::array<const char*, 3> axis_names{"x", "y", "z"};
using Counts = std::array<std::size_t, 3>;

Error at_axis(std::size_t axis, std::string what, std::string accepted) {
  return bad_value(std::move(what), fmt::format("axis {}", axis_names[axis]), std::move(accepted));
}

/// Turns an axis that descends; answers whether it did.
Result<bool> ascend(std::vector<double>& nodes, std::size_t axis) {
  const char* accepted = "two or more coordinates that increase, or decrease, all along";
  if (nodes.size() < 2) return at_axis(axis, fmt::format("has {} nodes", nodes.size()), accepted);
  const bool descends = nodes[1] < nodes[0];
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i])) return at_axis(axis, fmt::format("node {} is not finite", i), accepted);
    if (i == 0) continue;
    if (nodes[i] == nodes[i - 1]) return at_axis(axis, fmt::format("nodes {} and {} are equal", i - 1, i), accepted);
    if ((nodes[i] < nodes[i - 1]) != descends) return at_axis(axis, fmt::format("turns back at node {}", i), accepted);
  }
  if (descends) std::reverse(nodes.begin(), nodes.end());
  return descends;
}

/// Files keep even axes in float32, whose rounding makes them look stretched; those are made even again, which is
/// searched faster. Nodes move by less than their own rounding.
void undo_rounding(std::vector<double>& nodes) {
  const std::size_t cells = nodes.size() - 1;
  const double first = nodes.front();
  const double step = (nodes.back() - first) / static_cast<double>(cells);
  const double rounding = 1.2e-7 * std::max(std::abs(first), std::abs(nodes.back()));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool single = static_cast<double>(static_cast<float>(nodes[i])) == nodes[i];
    if (!single || std::abs(nodes[i] - (first + step * static_cast<double>(i))) > rounding) return;
  }
  for (std::size_t i = 1; i < cells; ++i) nodes[i] = first + step * static_cast<double>(i);
}

template <class T>
void reverse_along(std::vector<T>& samples, const Counts& counts, std::size_t components, std::size_t axis) {
  std::size_t inner = components;
  for (std::size_t a = 0; a < axis; ++a) inner *= counts[a];
  const std::size_t line = inner * counts[axis];
  for (std::size_t start = 0; start < samples.size(); start += line) {
    for (std::size_t i = 0; i < counts[axis] / 2; ++i) {
      const auto low = samples.begin() + static_cast<std::ptrdiff_t>(start + i * inner);
      const auto high = samples.begin() + static_cast<std::ptrdiff_t>(start + (counts[axis] - 1 - i) * inner);
      std::swap_ranges(low, low + static_cast<std::ptrdiff_t>(inner), high);
    }
  }
}

/// Infinite samples are an error, those that are not numbers are counted (a vector once).
Result<std::size_t> count_unknown(const SampleArray& samples, const Counts& counts, std::size_t components) {
  const auto* floats = std::get_if<std::vector<float>>(&samples);
  if (floats == nullptr) return std::size_t{0};
  std::size_t unknown = 0;
  for (std::size_t at = 0; at < floats->size(); at += components) {
    bool known = true;
    for (std::size_t c = 0; c < components; ++c) {
      const float value = (*floats)[at + c];
      if (std::isinf(value)) {
        const std::size_t i = at / components;
        return bad_value(
            "is infinite",
            fmt::format("sample [{}, {}, {}]", i % counts[0], i / counts[0] % counts[1], i / (counts[0] * counts[1])),
            "finite samples, or NaN where nothing is known");
      }
      known = known && !std::isnan(value);
    }
    if (!known) ++unknown;
  }
  return unknown;
}

template <class T>
std::vector<T> one_component(const std::vector<T>& samples, std::size_t components, std::size_t component) {
  std::vector<T> picked(samples.size() / components);
  for (std::size_t i = 0; i < picked.size(); ++i) picked[i] = samples[i * components + component];
  return picked;
}

/// `name` becomes that of the component.
Status pick_component(RawVolume& raw, const VolumeRequest& request, std::string& name) {
  if (request.component >= raw.components) {
    return bad_value(fmt::format("has no component {}", request.component), fmt::format("array \"{}\"", raw.array),
                     fmt::format("0 to {}", raw.components - 1));
  }
  if (raw.components == 1) return success();
  if (request.component < 0) {
    if (raw.components == 3) return success();
    return bad_value(fmt::format("has {} components, and none was chosen", raw.components),
                     fmt::format("array \"{}\"", raw.array), fmt::format("a component, 0 to {}", raw.components - 1));
  }
  raw.samples = std::visit(
      [&](const auto& samples) {
        return SampleArray(one_component(samples, static_cast<std::size_t>(raw.components),
                                         static_cast<std::size_t>(request.component)));
      },
      raw.samples);
  name += fmt::format("[{}]", request.component);
  raw.components = 1;
  return success();
}

Result<GridAxes> build_axes(RawVolume& raw, Counts& counts, std::array<bool, 3>& turned) {
  GridAxes axes;
  for (std::size_t a = 0; a < 3; ++a) {
    ASPERITY_TRY(turned[a], ascend(raw.nodes[a], a));
    undo_rounding(raw.nodes[a]);
    Result<GridAxis> axis = GridAxis::build(std::move(raw.nodes[a]));
    if (axis && raw.cell_data) axis = axis->centres();
    if (!axis) {
      Error error = std::move(axis).error();
      return at_axis(a, error.what + (error.place.empty() ? "" : " (" + error.place + ")"), error.accepted);
    }
    axes[a] = std::move(*axis);
    counts[a] = axes[a].size();
  }
  return axes;
}

std::string nodes_or_cells(const VolumeArray& array) {
  return array.association == Association::cell ? "cells" : "nodes";
}

std::string list_of(const std::vector<VolumeArray>& arrays) {
  constexpr std::size_t most_listed = 40;
  std::vector<std::string> names;
  for (const VolumeArray& array : arrays) {
    if (names.size() == most_listed) {
      names.push_back(fmt::format("and {} more", arrays.size() - most_listed));
      break;
    }
    names.push_back(fmt::format("\"{}\" ({}{} on {})", array.name, array.components > 1 ? "vectors, " : "", array.type,
                                nodes_or_cells(array)));
  }
  return names.empty() ? "a file that holds an array" : fmt::format("{}", fmt::join(names, ", "));
}

Error unknown_array(const std::vector<VolumeArray>& arrays, const VolumeRequest& request) {
  std::vector<std::string> names;
  for (const VolumeArray& array : arrays) {
    if (array.name == request.array) {
      return bad_value(fmt::format("the array \"{}\" sits on {}, not on {}s", array.name, nodes_or_cells(array),
                                   to_string(request.association)),
                       "", fmt::format("association \"{}\"", to_string(array.association)));
    }
    names.push_back(array.name);
  }
  const std::string near = nearest_name(request.array, names);
  return bad_value(fmt::format("holds no array \"{}\"{}", request.array,
                               near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
                   "", list_of(arrays));
}

}  // namespace

std::vector<double> even_nodes(double origin, double spacing, std::size_t count) {
  std::vector<double> nodes(count);
  for (std::size_t i = 0; i < count; ++i) nodes[i] = origin + spacing * static_cast<double>(i);
  return nodes;
}

Result<std::size_t> sample_count(const std::array<std::uint64_t, 3>& size, std::size_t bytes_each,
                                 std::size_t most_bytes) {
  std::uint64_t count = 1;
  for (const std::uint64_t n : size) {
    if (n > std::numeric_limits<std::uint32_t>::max() || (n != 0 && count > most_bytes / n)) count = 0;
    count *= n;
    if (count == 0) break;
  }
  if (count == 0 || count > most_bytes / bytes_each) {
    return refused(ErrorCode::too_large,
                   fmt::format("{} x {} x {} samples of {} bytes", size[0], size[1], size[2], bytes_each), {},
                   fmt::format("at least one sample, and at most {} MiB", most_bytes >> 20U));
  }
  return static_cast<std::size_t>(count);
}

Result<VolumeSource> assemble(RawVolume raw, const VolumeRequest& request) {
  Counts counts{};
  std::array<bool, 3> turned{};
  ASPERITY_TRY(GridAxes axes, build_axes(raw, counts, turned));
  const std::size_t held = std::visit([](const auto& s) { return s.size(); }, raw.samples);
  const std::size_t needed = counts[0] * counts[1] * counts[2] * static_cast<std::size_t>(raw.components);
  if (held != needed) {
    return refused(ErrorCode::mismatch, fmt::format("has {} samples, its axes ask for {}", held, needed),
                   fmt::format("array \"{}\"", raw.array), "one sample for each node or cell");
  }
  std::string name = raw.array;
  ASPERITY_CHECK(pick_component(raw, request, name));
  const auto components = static_cast<std::size_t>(raw.components);
  std::vector<std::string> notes;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!turned[a]) continue;
    std::visit([&](auto& samples) { reverse_along(samples, counts, components, a); }, raw.samples);
    notes.push_back(fmt::format("the {} axis descends: turned round, with its samples", axis_names[a]));
  }
  ASPERITY_TRY(const std::size_t unknown, count_unknown(raw.samples, counts, components));
  const std::size_t all = counts[0] * counts[1] * counts[2];
  if (unknown == all) {
    return bad_value("holds no sample that is a number", fmt::format("array \"{}\"", raw.array),
                     "an array with values");
  }
  if (unknown > 0) {
    notes.push_back(
        fmt::format("{} of {} samples are not numbers: nothing is known there, and surfaces have holes", unknown, all));
  }
  VolumeSource source{VectorGrid{}, raw.array, std::move(raw.unit), raw.cell_data, 0.0, 0.0, {}, std::move(notes)};
  if (components == 3) {
    std::vector<float> floats = std::visit(
        [](auto& samples) {
          if constexpr (std::is_same_v<std::decay_t<decltype(samples)>, std::vector<float>>)
            return std::move(samples);
          else
            return std::vector<float>(samples.begin(), samples.end());
        },
        raw.samples);
    source.data = VectorGrid{std::move(axes), std::move(floats), std::move(name)};
    return source;
  }
  ASPERITY_TRY(source.data, ScalarGrid::build(std::move(axes), std::move(raw.samples), std::move(name)));
  return source;
}

Result<std::size_t> choose_array(const std::vector<VolumeArray>& arrays, const VolumeRequest& request,
                                 std::vector<std::string>& notes) {
  const auto fits = [&](const VolumeArray& array) {
    return request.association == Association::any || array.association == request.association;
  };
  std::size_t chosen = arrays.size();
  int best = -1;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const VolumeArray& array = arrays[i];
    if (!fits(array)) continue;
    if (!request.array.empty()) {
      const int rank = array.association == Association::node ? 1 : 0;
      if (array.name == request.array && rank > best) {
        best = rank;
        chosen = i;
      }
      continue;
    }
    // What is wanted, if it says anything: a constant array has no surface.
    const bool wanted = request.vectors
                            ? array.components == 3
                            : array.components == 1 || (request.component >= 0 && request.component < array.components);
    const bool varies = array.highest > array.lowest;
    const int rank = (wanted ? 4 : 0) + (varies ? 2 : 0) + (array.association == Association::node ? 1 : 0);
    const bool usable = wanted || array.components == 1 || array.components == 3;
    if (usable && rank > best) {
      best = rank;
      chosen = i;
    }
  }
  if (chosen == arrays.size()) {
    if (!request.array.empty()) return unknown_array(arrays, request);
    return bad_value(request.association == Association::any
                         ? std::string("holds no array that can be used")
                         : fmt::format("holds no array on {}s", to_string(request.association)),
                     "", list_of(arrays));
  }
  if (request.array.empty() && arrays.size() > 1) {
    notes.push_back(
        fmt::format("holds {} arrays, none was asked for: \"{}\" was taken", arrays.size(), arrays[chosen].name));
  }
  return chosen;
}

void measure(const SampleArray& samples, VolumeArray& array) {
  std::visit(
      [&](const auto& values) {
        bool any = false;
        array.unknown = 0;
        for (const auto value : values) {
          const auto number = static_cast<double>(value);
          if (std::isnan(number)) {
            ++array.unknown;
            continue;
          }
          array.lowest = any ? std::min(array.lowest, number) : number;
          array.highest = any ? std::max(array.highest, number) : number;
          any = true;
        }
      },
      samples);
}

}  // namespace asperity::volume_assembly
