#include "asperity/io/recorded_path.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

#include "asperity/io/detail/file_reading.h"

namespace asperity {
namespace {

constexpr std::size_t max_file_bytes = std::size_t{1} << 30U;

std::string line_place(std::size_t line) {
  return fmt::format("line {}", line);
}

/// Where one of time, x, y, z stands, and what turns its numbers into SI.
struct Source {
  std::size_t column = 0;
  double to_si = 1.0;
};
using Sources = std::array<Source, 4>;

constexpr std::array<const char*, 4> wanted{"time", "x", "y", "z"};
constexpr std::array<const char*, 4> aliases{"t", "position_x", "position_y", "position_z"};

Result<double> unit_scale(std::string_view unit, bool is_time, std::size_t line) {
  if (unit.empty()) return 1.0;
  const Dimension dimension = is_time ? Dimension::time : Dimension::length;
  Result<double> scale = parse_quantity(fmt::format("1 {}", unit), dimension);
  if (scale) return *scale;
  return bad_value(fmt::format("unit \"{}\" is not known", unit), line_place(line), accepted_units(dimension));
}

Result<Sources> parse_header(std::string_view line, std::size_t number) {
  const std::vector<std::string_view> cells = csv_cells(line);
  Sources sources{};
  std::array<bool, 4> found{};
  for (std::size_t column = 0; column < cells.size(); ++column) {
    const auto bracket = cells[column].find('[');
    const std::string_view name = csv_trimmed(cells[column].substr(0, bracket));
    std::string_view unit;
    if (bracket != std::string_view::npos) {
      unit = cells[column].substr(bracket + 1);
      unit = csv_trimmed(unit.substr(0, unit.find(']')));
    }
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      if (found[k] || (name != wanted[k] && name != aliases[k])) continue;
      ASPERITY_TRY(const double scale, unit_scale(unit, k == 0, number));
      sources[k] = {column, scale};
      found[k] = true;
    }
  }
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (found[k]) continue;
    return refused(ErrorCode::file_malformed, fmt::format("header has no column \"{}\"", wanted[k]), line_place(number),
                   "columns time, x, y, z, each with an optional unit: time [s],x [mm],y [mm],z [mm]");
  }
  return sources;
}

Result<double> parse_cell(const std::vector<std::string_view>& cells, std::size_t k, const Source& source,
                          std::size_t line) {
  if (source.column >= cells.size()) {
    return refused(ErrorCode::file_malformed, fmt::format("has {} cells, none for \"{}\"", cells.size(), wanted[k]),
                   line_place(line), fmt::format("{} cells or more", source.column + 1));
  }
  const std::string_view cell = cells[source.column];
  double value = 0.0;
  const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (code != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value * source.to_si)) {
    return bad_value(fmt::format("\"{}\" in column \"{}\" is not a finite number", cell, wanted[k]), line_place(line),
                     "a decimal number");
  }
  return value * source.to_si;
}

Result<TimedPoint> parse_row(std::string_view line, const Sources& sources, std::size_t number) {
  const std::vector<std::string_view> cells = csv_cells(line);
  std::array<double, 4> values{};
  for (std::size_t k = 0; k < values.size(); ++k) {
    ASPERITY_TRY(values[k], parse_cell(cells, k, sources[k], number));
  }
  return TimedPoint{Seconds(values[0]), Vec3(values[1], values[2], values[3])};
}

/// Lets the first time be zero.
void start_at_zero(std::vector<TimedPoint>& points) {
  const Seconds begin = points.front().time;
  for (TimedPoint& point : points) point.time -= begin;
}

Result<std::string> read_text(const std::string& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) {
    return refused_file(ErrorCode::file_unsupported, "is a folder", path, "a CSV file or a trace");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) return refused_file(ErrorCode::file_missing, "cannot be read", path, "a CSV file or a trace");
  if (const auto size = std::filesystem::file_size(path, code); !code && size > max_file_bytes)
    return refused_file(ErrorCode::too_large, fmt::format("has {} bytes", size), path, "1 GiB at most");
  return std::string(std::istreambuf_iterator<char>(file), {});
}

}  // namespace

Result<std::vector<TimedPoint>> parse_recorded_path(std::string_view text) {
  std::vector<TimedPoint> points;
  std::optional<Sources> sources;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = csv_trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    if (!sources) {
      ASPERITY_TRY(sources, parse_header(line, number));
      continue;
    }
    ASPERITY_TRY(const TimedPoint point, parse_row(line, *sources, number));
    if (!points.empty() && point.time <= points.back().time) {
      return bad_value(fmt::format("time {} s is not after {} s", point.time.count(), points.back().time.count()),
                       line_place(number), "times that increase");
    }
    points.push_back(point);
  }
  if (!sources) return refused(ErrorCode::file_empty, "has no header line", {}, "a CSV with columns time, x, y, z");
  if (points.size() < 2) {
    return refused(ErrorCode::file_malformed, fmt::format("has {} rows", points.size()), {}, "two rows or more");
  }
  start_at_zero(points);
  return points;
}

Result<std::vector<TimedPoint>> recorded_path_from(const Trace& trace) {
  if (trace.records.size() < 2) {
    return refused(ErrorCode::mismatch, fmt::format("the trace has {} ticks", trace.records.size()), {}, "two or more");
  }
  std::vector<TimedPoint> points;
  for (const TraceRecord& record : trace.records) {
    const TimedPoint point{record.probe.time, record.probe.pose.position};
    const bool later = points.empty() || point.time > points.back().time;
    if (!later || !std::isfinite(point.time.count()) || !point.position.allFinite()) {
      return bad_value("has no finite position, or a time that does not increase", fmt::format("tick {}", record.tick),
                       "finite positions at increasing times");
    }
    points.push_back(point);
  }
  start_at_zero(points);
  return points;
}

Result<std::vector<TimedPoint>> read_recorded_path(const std::string& path) {
  if (is_trace_file(path)) {
    ASPERITY_TRY(const Trace trace, read_trace(path));
    return in_file(recorded_path_from(trace), path);
  }
  ASPERITY_TRY(const std::string text, read_text(path));
  return in_file(parse_recorded_path(text), path);
}

std::string_view csv_trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

std::vector<std::string_view> csv_cells(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const auto comma = line.find(',');
    cells.push_back(csv_trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace asperity
