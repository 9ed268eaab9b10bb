#include "asperity/study/friction_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numeric>
#include <regex>
#include <string_view>
#include <system_error>

#include "asperity/io/recorded_path.h"
#include "asperity/study/spectrum.h"

namespace asperity {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t fewest_samples = 200;
constexpr std::uintmax_t largest_file = 256U << 20U;
constexpr const char* accepted = "a CSV file with the columns t_s and friction_over_load";
constexpr std::size_t phases = 64;

Error malformed(const fs::path& path, std::size_t line, std::string what) {
  return Error{ErrorCode::file_malformed, std::move(what), path.string(), fmt::format("line {}", line), accepted};
}
Error refused_trace(const fs::path& path, ErrorCode code, std::string what, std::string wanted = accepted) {
  return refused(code, std::move(what), {}, std::move(wanted)).in_file(path.string());
}

/// The line's cell of a column as a number.
Result<double> number_in(const std::vector<std::string_view>& cells, std::size_t column, const char* name,
                         const fs::path& path, std::size_t line) {
  if (column >= cells.size()) return malformed(path, line, fmt::format("has no {}", name));
  const std::string_view cell = cells[column];
  double value = 0.0;
  const auto [end, problem] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (problem != std::errc() || end != cell.data() + cell.size())
    return malformed(path, line, fmt::format("{} is no number (\"{}\")", name, cell.substr(0, 40)));
  if (!std::isfinite(value)) return malformed(path, line, fmt::format("{} is not finite", name));
  return value;
}

Status check_file(const fs::path& path) {
  std::error_code problem;
  const fs::file_status status = fs::status(path, problem);
  if (!fs::exists(status)) return refused_trace(path, ErrorCode::file_missing, "no such file");
  if (fs::is_directory(status)) return refused_trace(path, ErrorCode::file_missing, "is a folder");
  const std::uintmax_t size = fs::is_regular_file(status) ? fs::file_size(path, problem) : 0;
  if (!problem && size > largest_file)
    return refused_trace(path, ErrorCode::too_large, fmt::format("has {} bytes", size), "256 MiB at most");
  return success();
}

struct Columns {
  std::vector<double> time;
  std::vector<double> friction;
};

Result<Columns> read_columns(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return refused_trace(path, ErrorCode::file_missing, "cannot be read");
  std::string line;
  if (!std::getline(stream, line)) return refused_trace(path, ErrorCode::file_empty, "is empty");
  const std::vector<std::string_view> names = csv_cells(line);
  const auto column_of = [&](std::string_view name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const std::size_t time_column = column_of("t_s");
  const std::size_t friction_column = column_of("friction_over_load");
  for (const auto& [column, name] : {std::pair(time_column, "t_s"), std::pair(friction_column, "friction_over_load")}) {
    if (column == names.size()) return malformed(path, 1, fmt::format("has no column {}", name));
  }
  Columns columns;
  for (std::size_t number = 2; std::getline(stream, line); ++number) {
    if (csv_trimmed(line).empty()) continue;
    const std::vector<std::string_view> cells = csv_cells(line);
    ASPERITY_TRY(const double time, number_in(cells, time_column, "t_s", path, number));
    ASPERITY_TRY(const double friction, number_in(cells, friction_column, "friction_over_load", path, number));
    if (!columns.time.empty() && time <= columns.time.back()) return malformed(path, number, "t_s does not increase");
    columns.time.push_back(time);
    columns.friction.push_back(friction);
  }
  if (columns.time.size() < fewest_samples) {
    return refused_trace(path, ErrorCode::bad_value, fmt::format("has {} samples", columns.time.size()),
                         fmt::format("{} samples or more", fewest_samples));
  }
  return columns;
}

/// The number after `pattern`'s letter in a file's name, where it is above 0.
std::optional<double> number_of_name(const std::string& name, const char* pattern) {
  std::smatch match;
  if (!std::regex_search(name, match, std::regex(pattern))) return std::nullopt;
  const std::string digits = match[1];
  double value = 0.0;
  std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return value > 0.0 ? std::optional<double>(value) : std::nullopt;
}

Error drive_unknown(const fs::path& path, const char* what, const char* in_name, const char* option) {
  return refused_trace(path, ErrorCode::bad_value, fmt::format("its name does not say the {}", what),
                       fmt::format("\"{}\" in the name, or {}", in_name, option));
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// Mean and standard deviation.
std::pair<double, double> mean_and_spread(const std::vector<double>& values) {
  if (values.empty()) return {0.0, 0.0};
  const auto count = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return {mean, std::sqrt(sum / count)};
}

struct Event {
  std::size_t peak = 0;
  std::size_t valley = 0;
};

/// Peaks with the valleys that follow them, where the signal turned by the threshold. What the record's ends cut off
/// is left out.
std::vector<Event> events_of(const std::vector<double>& y, double threshold) {
  std::vector<Event> events;
  std::size_t high = 0;
  std::size_t low = 0;
  bool falling = false;
  bool known = false;
  bool whole = false;
  for (std::size_t i = 1; i < y.size(); ++i) {
    if (y[i] > y[high]) high = i;
    if (y[i] < y[low]) low = i;
    if ((!known || !falling) && y[high] - y[i] >= threshold) {
      // Unless it rose to this peak within the record, the peak may lie before it.
      whole = known;
      known = true;
      falling = true;
      low = i;
    } else if ((!known || falling) && y[i] - y[low] >= threshold) {
      if (known && whole) events.push_back({high, low});
      known = true;
      falling = false;
      high = i;
    }
  }
  return events;
}

std::vector<double> median_cycle(const std::vector<double>& y, const std::vector<Event>& events) {
  // Cycles follow each other at drifting levels, so each is told from its own.
  std::vector<double> levels;
  for (std::size_t e = 0; e + 1 < events.size(); ++e) {
    const auto begin = y.begin() + static_cast<std::ptrdiff_t>(events[e].valley);
    const auto end = y.begin() + static_cast<std::ptrdiff_t>(events[e + 1].valley);
    levels.push_back(std::accumulate(begin, end, 0.0) / static_cast<double>(end - begin));
  }
  std::vector<double> cycle;
  for (std::size_t p = 0; p < phases; ++p) {
    std::vector<double> column;
    for (std::size_t e = 0; e + 1 < events.size(); ++e) {
      const auto begin = static_cast<double>(events[e].valley);
      const double length = static_cast<double>(events[e + 1].valley) - begin;
      const double at = begin + length * static_cast<double>(p) / static_cast<double>(phases);
      const auto i = static_cast<std::size_t>(at);
      const double share = at - static_cast<double>(i);
      column.push_back((1.0 - share) * y[i] + share * y[i + 1] - levels[e]);
    }
    cycle.push_back(percentile(std::move(column), 0.5));
  }
  const double mean = std::accumulate(cycle.begin(), cycle.end(), 0.0) / static_cast<double>(cycle.size());
  for (double& value : cycle) value -= mean;
  return cycle;
}

}  // namespace

Result<FrictionTrace> read_friction_trace(const fs::path& path, const FrictionTraceSettings& settings) {
  ASPERITY_CHECK(check_file(path));
  FrictionTrace trace;
  trace.name = path.stem().string();
  const std::optional<double> stiffness = number_of_name(trace.name, "k([0-9]+(\\.[0-9]+)?)Nm");
  const std::optional<double> speed = number_of_name(trace.name, "(?:^|[^a-zA-Z])v([0-9]+(\\.[0-9]+)?)");
  ASPERITY_TRY(const Columns columns, read_columns(path));
  if (!stiffness && !settings.stiffness)
    return drive_unknown(path, "spring's stiffness", "k168Nm", "--stiffness 168N/m");
  if (!speed && !settings.speed) return drive_unknown(path, "drive's speed (um/s)", "v42", "--speed 0.042mm/s");
  trace.stiffness = stiffness ? *stiffness : *settings.stiffness;
  trace.speed = speed ? micrometres(*speed) : *settings.speed;
  std::vector<double> steps(columns.time.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = columns.time[i + 1] - columns.time[i];
  trace.spacing = percentile(steps, 0.5);
  const double largest = *std::max_element(steps.begin(), steps.end());
  const double smallest = *std::min_element(steps.begin(), steps.end());
  if (largest - smallest < 0.05 * trace.spacing) {
    trace.spacing = (columns.time.back() - columns.time.front()) / static_cast<double>(steps.size());
    trace.friction = columns.friction;
    return trace;
  }
  // A gap in the middle of dense samples must not become a huge series.
  const double span = columns.time.back() - columns.time.front();
  if (span / trace.spacing > 10.0 * static_cast<double>(columns.time.size())) {
    return refused_trace(path, ErrorCode::bad_value, "has gaps that are longer than all of its samples",
                         "samples that are about evenly spaced");
  }
  trace.friction = resample(columns.time, columns.friction, trace.spacing);
  return trace;
}

std::vector<double> running_median(const std::vector<double>& values, std::size_t width) {
  const std::size_t half = width / 2;
  std::vector<double> result(values.size());
  std::vector<double> window(values.begin(),
                             values.begin() + static_cast<std::ptrdiff_t>(std::min(half, values.size())));
  std::sort(window.begin(), window.end());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i + half < values.size())
      window.insert(std::upper_bound(window.begin(), window.end(), values[i + half]), values[i + half]);
    if (i > half) window.erase(std::lower_bound(window.begin(), window.end(), values[i - half - 1]));
    result[i] = window[window.size() / 2];
  }
  return result;
}

std::vector<double> filtered(const FrictionTrace& trace, const StickSlipSettings& settings) {
  const auto half = static_cast<std::size_t>(std::max(0.0, 0.5 * settings.filter.count() / trace.spacing));
  return running_median(trace.friction, 2 * half + 1);
}

StickSlip measure_stick_slip(const FrictionTrace& trace, const StickSlipSettings& settings) {
  StickSlip result;
  if (trace.friction.size() < 2) return result;
  const std::vector<double> y = filtered(trace, settings);
  result.threshold = settings.threshold;
  if (result.threshold <= 0.0) {
    std::vector<double> noise(y.size());
    for (std::size_t i = 0; i < y.size(); ++i) noise[i] = std::abs(trace.friction[i] - y[i]);
    constexpr double deviation_of_median = 1.4826;  // of a normal distribution
    result.threshold = std::max(0.15 * (percentile(y, 0.95) - percentile(y, 0.05)),
                                3.0 * deviation_of_median * percentile(noise, 0.5));
  }
  result.level = mean_and_spread(y).first;
  result.swing = percentile(y, 0.98) - percentile(y, 0.02);
  result.still = result.sliding = result.level;
  const std::vector<Event> events = result.threshold > 0.0 ? events_of(y, result.threshold) : std::vector<Event>();
  result.events = events.size();
  if (events.size() < 3) return result;
  std::vector<double> periods;
  std::vector<double> drops;
  std::vector<double> peaks;
  for (std::size_t e = 0; e < events.size(); ++e) {
    if (e > 0) periods.push_back(static_cast<double>(events[e].peak - events[e - 1].peak) * trace.spacing);
    drops.push_back(y[events[e].peak] - y[events[e].valley]);
    peaks.push_back(y[events[e].peak]);
  }
  std::tie(result.period, result.period_spread) = mean_and_spread(periods);
  std::tie(result.amplitude, result.amplitude_spread) = mean_and_spread(drops);
  result.still = mean_and_spread(peaks).first;
  result.sliding = result.still - 0.5 * result.amplitude;
  result.cycle = median_cycle(y, events);
  return result;
}

double load_of_sticking(const FrictionTrace& trace, const StickSlipSettings& settings) {
  const StickSlip found = measure_stick_slip(trace, settings);
  if (found.steady()) return 0.0;
  const std::vector<double> y = filtered(trace, settings);
  const auto stretch = static_cast<std::size_t>(std::max(2.0, 0.1 * found.period / trace.spacing));
  std::vector<double> slopes;
  for (std::size_t i = 0; i + stretch < y.size(); i += std::max<std::size_t>(1, stretch / 2))
    slopes.push_back((y[i + stretch] - y[i]) / (static_cast<double>(stretch) * trace.spacing));
  // The steepest are of noise, and of the slider swinging back.
  const double slope = percentile(slopes, 0.9);
  return slope > 0.0 ? trace.stiffness * trace.speed / slope : 0.0;
}

}  // namespace asperity
