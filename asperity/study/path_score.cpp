#include "asperity/study/path_score.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <system_error>

#include "asperity/core/units.h"
#include "asperity/io/recorded_path.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/step.h"
#include "asperity/study/series.h"

namespace asperity {
namespace {

namespace fs = std::filesystem;

constexpr double not_scored = std::numeric_limits<double>::quiet_NaN();
constexpr double least_scored_force = 1e-3;  // N: weaker ones have no direction worth comparing
constexpr std::uintmax_t largest_path_file = 256U << 20U;
constexpr double most_resampled = 5e6;
constexpr const char* columns_accepted =
    "a header with time, x, y, z, fx, fy, fz, each with an optional unit: time_s,x_mm,y_mm,z_mm,fx,fy,fz";

struct ColumnName {
  const char* name;
  std::array<const char*, 3> aliases;
  Dimension dimension;
};
constexpr std::array<ColumnName, 7> wanted{{{"time", {"t", "time", "time"}, Dimension::time},
                                            {"x", {"position_x", "px", "x"}, Dimension::length},
                                            {"y", {"position_y", "py", "y"}, Dimension::length},
                                            {"z", {"position_z", "pz", "z"}, Dimension::length},
                                            {"fx", {"force_x", "f_x", "fx"}, Dimension::force},
                                            {"fy", {"force_y", "f_y", "fy"}, Dimension::force},
                                            {"fz", {"force_z", "f_z", "fz"}, Dimension::force}}};

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

Error at_line(ErrorCode code, std::string what, std::size_t line, std::string accepted) {
  return refused(code, std::move(what), fmt::format("line {}", line), std::move(accepted));
}

/// The factor to SI of a unit in any case; nothing where it is none.
std::optional<double> unit_scale(std::string_view unit, Dimension dimension) {
  if (unit.empty()) return 1.0;
  if (auto scale = parse_quantity(fmt::format("1 {}", unit), dimension)) return *scale;
  if (dimension == Dimension::force) {
    // "fx_n", "fx_mn": a suffix is often written small.
    if (lower(unit) == "n") return 1.0;
    if (lower(unit) == "mn") return 1e-3;
  }
  if (auto scale = parse_quantity("1 " + lower(unit), dimension)) return *scale;
  return std::nullopt;
}

bool names(const ColumnName& column, const std::string& name) {
  return name == column.name || std::find(column.aliases.begin(), column.aliases.end(), name) != column.aliases.end();
}

struct Source {
  std::size_t column = 0;
  double to_si = 1.0;
};
using Sources = std::array<Source, wanted.size()>;

/// A header's cell as name and unit: "x [mm]", "x_mm", "position_x".
struct HeaderCell {
  std::string name;
  std::string_view unit;
};
HeaderCell header_cell(std::string_view cell) {
  const auto bracket = cell.find_first_of("[(");
  if (bracket != std::string_view::npos) {
    const std::string_view unit = cell.substr(bracket + 1);
    return {lower(csv_trimmed(cell.substr(0, bracket))), csv_trimmed(unit.substr(0, unit.find_first_of("])")))};
  }
  const std::string whole = lower(cell);
  for (const ColumnName& column : wanted) {
    if (names(column, whole)) return {whole, {}};
  }
  const auto mark = cell.rfind('_');
  if (mark == std::string_view::npos) return {whole, {}};
  return {lower(cell.substr(0, mark)), cell.substr(mark + 1)};
}

Result<Sources> parse_header(std::string_view line, std::size_t number) {
  const std::vector<std::string_view> cells = csv_cells(line);
  Sources sources{};
  std::array<bool, wanted.size()> found{};
  for (std::size_t column = 0; column < cells.size(); ++column) {
    const HeaderCell cell = header_cell(cells[column]);
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      if (found[k] || !names(wanted[k], cell.name)) continue;
      const std::optional<double> scale = unit_scale(cell.unit, wanted[k].dimension);
      if (!scale) {
        return at_line(ErrorCode::bad_value,
                       fmt::format("unit \"{}\" of column \"{}\" is not known", cell.unit, wanted[k].name), number,
                       accepted_units(wanted[k].dimension));
      }
      sources[k] = {column, *scale};
      found[k] = true;
    }
  }
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (!found[k]) {
      return at_line(ErrorCode::file_malformed, fmt::format("header has no column \"{}\"", wanted[k].name), number,
                     columns_accepted);
    }
  }
  return sources;
}

Result<MeasuredSample> parse_row(std::string_view line, const Sources& sources, std::size_t number) {
  const std::vector<std::string_view> cells = csv_cells(line);
  std::array<double, wanted.size()> values{};
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (sources[k].column >= cells.size()) {
      return at_line(ErrorCode::file_malformed,
                     fmt::format("has {} cells, none for \"{}\"", cells.size(), wanted[k].name), number,
                     fmt::format("{} cells or more", sources[k].column + 1));
    }
    const std::string_view cell = cells[sources[k].column];
    const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), values[k]);
    values[k] *= sources[k].to_si;
    if (code != std::errc() || end != cell.data() + cell.size() || !std::isfinite(values[k])) {
      return at_line(ErrorCode::bad_value,
                     fmt::format("\"{}\" in column \"{}\" is not a finite number", cell.substr(0, 40), wanted[k].name),
                     number, "a decimal number");
    }
  }
  return MeasuredSample{Seconds(values[0]), Vec3(values[1], values[2], values[3]),
                        Vec3(values[4], values[5], values[6])};
}

void start_at_zero(std::vector<MeasuredSample>& samples) {
  const Seconds begin = samples.front().time;
  for (MeasuredSample& sample : samples) sample.time -= begin;
}

Error too_many() {
  return refused(ErrorCode::too_large, fmt::format("has more than {} samples", most_measured_samples), {},
                 fmt::format("{} samples or fewer", most_measured_samples));
}

Result<std::string> read_text(const fs::path& file) {
  const auto refuse = [&](ErrorCode code, std::string what,
                          const char* accepted = "a CSV file or a trace (asperity score --synthesise writes one)") {
    return refused(code, std::move(what), {}, accepted).in_file(file.string());
  };
  std::error_code problem;
  const fs::file_status status = fs::status(file, problem);
  if (!fs::exists(status)) return refuse(ErrorCode::file_missing, "no such file");
  if (fs::is_directory(status)) return refuse(ErrorCode::file_unsupported, "is a folder");
  const std::uintmax_t size = fs::is_regular_file(status) ? fs::file_size(file, problem) : 0;
  if (!problem && size > largest_path_file)
    return refuse(ErrorCode::too_large, fmt::format("has {} bytes", size), "256 MiB at most");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return refuse(ErrorCode::file_missing, "cannot be read");
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

double angle_between(const Vec3& a, const Vec3& b) {
  // The two-argument form keeps small angles, which an arc cosine would round away.
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Drives a scene from place to place.
class Driver {
 public:
  explicit Driver(const Scene& scene) : scene_(scene), cache_(scene) {}

  /// To `place` in `steps` equal ticks over `duration`. The last tick as a record.
  Result<TraceRecord> go(const Vec3& place, Seconds duration, int steps) {
    TraceRecord record;
    const Vec3 from = started_ ? place_ : place;
    const Seconds dt = duration / steps;
    for (int i = 1; i <= steps; ++i) {
      record.tick = tick_++;
      record.dt = dt;
      record.probe.pose.position = i == steps ? place : Vec3(from + (static_cast<double>(i) / steps) * (place - from));
      record.probe.twist.linear = (place - from) / duration.count();
      time_ += dt;
      record.probe.time = time_;
      ASPERITY_CHECK(fetch_volumes(scene_, state_, record.probe));
      record.rendered = step(scene_, state_, cache_, record.probe, dt);
    }
    record.commanded = record.rendered.wrench.force;
    place_ = place;
    started_ = true;
    return record;
  }

 private:
  const Scene& scene_;
  ProxyState state_;
  ProxyCache cache_;
  Vec3 place_ = Vec3::Zero();
  Seconds time_{0.0};
  std::uint64_t tick_ = 0;
  bool started_ = false;
};

Status check(const MeasuredPath& path, const ScoreSettings& settings) {
  if (path.samples.size() < 2)
    return bad_value(fmt::format("has {} samples", path.samples.size()), "samples", "two or more");
  if (path.samples.size() > most_measured_samples) return too_many();
  if (!(settings.rate > 0.0) || !std::isfinite(settings.rate))
    return bad_value(fmt::format("is {}", settings.rate), "rate", "a rate above 0 (Hz)");
  if (!(settings.stiffness >= 0.0) || !std::isfinite(settings.stiffness))
    return bad_value(fmt::format("is {}", settings.stiffness), "stiffness", "a stiffness above 0 (N/m)");
  if (!(settings.lead_in >= 0.0) || !std::isfinite(settings.lead_in))
    return bad_value(fmt::format("is {}", settings.lead_in), "lead_in", "a length of 0 or more");
  const double steps = path.samples.back().time.count() * settings.rate + static_cast<double>(path.samples.size());
  if (steps > most_resampled) {
    return refused(ErrorCode::too_large, fmt::format("takes {:.0f} ticks at {:g} Hz", steps, settings.rate), "rate",
                   fmt::format("{:.0f} ticks at most: a lower rate or a shorter path", most_resampled));
  }
  return success();
}

/// Ticks between two samples, so that none is longer than the rate's.
int steps_between(Seconds duration, double rate) {
  return std::max(1, static_cast<int>(std::ceil(duration.count() * rate - 1e-3)));
}

void penetrations_of(std::span<const TraceRecord> records, PathScore& score) {
  std::vector<double> depths;
  double sum = 0.0;
  for (const TraceRecord& record : records) {
    if (!record.rendered.flags.has(TickFlag::contact)) continue;
    depths.push_back(record.rendered.contact.penetration);
    sum += depths.back();
  }
  if (depths.empty()) return;
  score.mean_penetration = sum / static_cast<double>(depths.size());
  score.p99_penetration = percentile(depths, 0.99);
  score.largest_penetration = *std::max_element(depths.begin(), depths.end());
}

}  // namespace

Result<MeasuredPath> parse_measured_path(std::string_view text) {
  MeasuredPath path;
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
    ASPERITY_TRY(const MeasuredSample sample, parse_row(line, *sources, number));
    if (!path.samples.empty() && sample.time <= path.samples.back().time) {
      return at_line(
          ErrorCode::bad_value,
          fmt::format("time {:g} s is not after {:g} s", sample.time.count(), path.samples.back().time.count()), number,
          "times that increase");
    }
    if (path.samples.size() == most_measured_samples) return too_many();
    path.samples.push_back(sample);
  }
  if (!sources) return refused(ErrorCode::file_empty, "has no header line", {}, columns_accepted);
  if (path.samples.size() < 2)
    return refused(ErrorCode::file_malformed, fmt::format("has {} rows", path.samples.size()), {}, "two rows or more");
  start_at_zero(path.samples);
  return path;
}

Result<MeasuredPath> measured_path_from(std::span<const TraceRecord> records, PathPlace place, double stiffness) {
  if (records.size() < 2)
    return refused(ErrorCode::mismatch, fmt::format("has {} ticks", records.size()), {}, "two or more");
  if (records.size() > most_measured_samples) return too_many();
  MeasuredPath path;
  path.place = place;
  for (const TraceRecord& record : records) {
    const Vec3& force = record.rendered.wrench.force;
    MeasuredSample sample{record.probe.time, record.probe.pose.position, force};
    if (place == PathPlace::surface) sample.position += force / stiffness;
    const bool later = path.samples.empty() || sample.time > path.samples.back().time;
    if (!later || !std::isfinite(sample.time.count()) || !sample.position.allFinite() || !sample.force.allFinite()) {
      return bad_value("has no finite position and force, or a time that does not increase",
                       fmt::format("tick {}", record.tick), "finite numbers at increasing times");
    }
    path.samples.push_back(sample);
  }
  start_at_zero(path.samples);
  return path;
}

Result<MeasuredPath> read_measured_path(const fs::path& file) {
  const auto named = [&](Result<MeasuredPath> path) -> Result<MeasuredPath> {
    if (!path) return std::move(path).error().in_file(file.string());
    path->name = file.stem().string();
    return path;
  };
  std::error_code ignored;
  if (fs::is_regular_file(file, ignored) && is_trace_file(file.string())) {
    ASPERITY_TRY(const Trace trace, read_trace(file.string()));
    return named(measured_path_from(trace.records, PathPlace::probe, 1.0));
  }
  ASPERITY_TRY(const std::string text, read_text(file));
  return named(parse_measured_path(text));
}

std::string measured_path_csv(const MeasuredPath& path) {
  std::string text = "time_s,x_m,y_m,z_m,fx_N,fy_N,fz_N\n";
  for (const MeasuredSample& s : path.samples) {
    text += fmt::format("{},{},{},{},{},{},{}\n", s.time.count(), s.position.x(), s.position.y(), s.position.z(),
                        s.force.x(), s.force.y(), s.force.z());
  }
  return text;
}

std::vector<Vec3> subsurface_path(const MeasuredPath& path, double k) {
  std::vector<Vec3> driven;
  driven.reserve(path.samples.size());
  for (const MeasuredSample& s : path.samples)
    driven.emplace_back(path.place == PathPlace::surface ? Vec3(s.position - s.force / k) : s.position);
  return driven;
}

ForceErrors compare_forces(std::span<const Vec3> measured, std::span<const Vec3> rendered) {
  ForceErrors e;
  e.samples = std::min(measured.size(), rendered.size());
  double squares = 0.0;
  double error_squares = 0.0;
  double angles = 0.0;
  std::size_t both = 0;
  std::size_t touched = 0;
  std::size_t missed = 0;
  std::size_t added = 0;
  for (std::size_t i = 0; i < e.samples; ++i) {
    const double error = (rendered[i] - measured[i]).norm();
    const double felt = measured[i].norm();
    const double answered = rendered[i].norm();
    e.error.push_back(error);
    e.angle.push_back(not_scored);
    e.peak_measured = std::max(e.peak_measured, felt);
    e.peak_rendered = std::max(e.peak_rendered, answered);
    touched += felt >= least_scored_force ? 1U : 0U;
    missed += felt >= least_scored_force && answered < least_scored_force ? 1U : 0U;
    added += felt < least_scored_force && answered >= least_scored_force ? 1U : 0U;
    if (felt < least_scored_force && answered < least_scored_force) continue;
    ++e.compared;
    squares += felt * felt;
    error_squares += error * error;
    e.mean_error += error;
    if (error > e.largest_error) {
      e.largest_error = error;
      e.largest_at = i;
    }
    if (felt < least_scored_force || answered < least_scored_force) continue;
    ++both;
    e.angle.back() = angle_between(measured[i], rendered[i]);
    angles += e.angle.back();
    e.largest_angle = std::max(e.largest_angle, e.angle.back());
  }
  const auto compared = static_cast<double>(std::max<std::size_t>(1, e.compared));
  e.rms_measured = std::sqrt(squares / compared);
  e.rms_error = std::sqrt(error_squares / compared);
  e.relative = squares > 0.0 ? e.rms_error / e.rms_measured : not_scored;
  e.mean_error /= compared;
  e.mean_angle = both > 0 ? angles / static_cast<double>(both) : not_scored;
  if (both == 0) e.largest_angle = not_scored;
  if (touched > 0) e.missed = static_cast<double>(missed) / static_cast<double>(touched);
  if (e.samples > touched) e.added = static_cast<double>(added) / static_cast<double>(e.samples - touched);
  return e;
}

Result<double> common_stiffness(const Scene& scene) {
  double stiffness = 0.0;
  for (const Instance& instance : scene.instances()) {
    if (stiffness == 0.0) stiffness = instance.material.stiffness;
    if (instance.material.stiffness == stiffness) continue;
    return refused(ErrorCode::mismatch,
                   fmt::format("surfaces of {:g} and {:g} N/m: the path's correction F / k has no one k", stiffness,
                               instance.material.stiffness),
                   "stiffness", "one stiffness for all surfaces (--stiffness)");
  }
  if (stiffness == 0.0) return refused(ErrorCode::mismatch, "holds no surface", "scene", "a scene with a surface");
  return stiffness;
}

Result<PathScore> score_path(const Scene& scene, const MeasuredPath& path, const ScoreSettings& settings,
                             const Progress& progress) {
  ASPERITY_CHECK(check(path, settings));
  PathScore score;
  score.stiffness = settings.stiffness;
  if (score.stiffness == 0.0) {
    ASPERITY_TRY(score.stiffness, common_stiffness(scene));
  }
  for (const Instance& instance : scene.instances())
    score.law += (score.law.empty() ? "" : ", ") + law_name(instance.law);
  const std::vector<Vec3> driven = subsurface_path(path, score.stiffness);
  Driver driver(scene);
  const Vec3& first = path.samples.front().force;
  const Seconds tick(1.0 / settings.rate);
  if (first.norm() >= least_scored_force && settings.lead_in > 0.0) {
    constexpr int ticks = 64;
    const Vec3 outside = driven.front() + first / score.stiffness + settings.lead_in * first.normalized();
    ASPERITY_CHECK(driver.go(outside, tick, 1));
    ASPERITY_CHECK(driver.go(driven.front(), ticks * tick, ticks));
  }
  std::vector<TraceRecord> records;
  records.reserve(driven.size());
  std::vector<Vec3> measured;
  for (std::size_t i = 0; i < driven.size(); ++i) {
    const Seconds since = i == 0 ? tick : path.samples[i].time - path.samples[i - 1].time;
    ASPERITY_TRY(TraceRecord record, driver.go(driven[i], since, steps_between(since, settings.rate)));
    record.probe.time = path.samples[i].time;
    measured.push_back(path.samples[i].force);
    score.rendered.push_back(record.rendered.wrench.force);
    records.push_back(record);
    if (progress && i % 1000 == 0)
      progress("scoring " + score.law, static_cast<double>(i) / static_cast<double>(driven.size()));
  }
  score.force = compare_forces(measured, score.rendered);
  score.normal = measure_angles(derive_series(records, scene, StrokePath()).direction_error);
  penetrations_of(records, score);
  return score;
}

std::vector<double> distance_along(const MeasuredPath& path) {
  std::vector<double> distance;
  double sum = 0.0;
  for (std::size_t i = 0; i < path.samples.size(); ++i) {
    if (i > 0) sum += (path.samples[i].position - path.samples[i - 1].position).norm();
    distance.push_back(sum);
  }
  return distance;
}

std::string scores_csv(const MeasuredPath& path, std::span<const PathScore> scores) {
  std::string text = "time_s,distance_m,measured_fx,measured_fy,measured_fz";
  for (const PathScore& score : scores)
    text += fmt::format(",\"{0} fx\",\"{0} fy\",\"{0} fz\",\"{0} error\"", score.law);
  text += '\n';
  const std::vector<double> distance = distance_along(path);
  for (std::size_t i = 0; i < path.samples.size(); ++i) {
    const MeasuredSample& s = path.samples[i];
    text += fmt::format("{},{},{},{},{}", s.time.count(), distance[i], s.force.x(), s.force.y(), s.force.z());
    for (const PathScore& score : scores) {
      const Vec3& f = score.rendered[i];
      text += fmt::format(",{},{},{},{}", f.x(), f.y(), f.z(), score.force.error[i]);
    }
    text += '\n';
  }
  return text;
}

}  // namespace asperity
