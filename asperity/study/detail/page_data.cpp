#include "asperity/study/detail/page_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/study/detail/metric_rows.h"

namespace asperity {
namespace {

using nlohmann::json;

// A plot is about 1000 pixels wide: the extremes of somewhat more stretches lose nothing that could be seen. A page
// with several laws has to share.
constexpr std::size_t run_stretches = 1500;
constexpr std::size_t compare_stretches = 3000;
constexpr std::size_t fewest_stretches = 250;
// Finer detail than this share of a column's largest value cannot be seen, and need not be stored.
constexpr double resolution = 1e-6;

constexpr double milli = 1e3;
constexpr double micro = 1e6;
constexpr double percent = 1e2;
constexpr double degrees = 180.0 / std::numbers::pi;

/// One column on its way to the page.
struct Column {
  const char* name;
  const std::vector<double>* values;
  double scale;
};

json rounded(double value, double step) {
  if (!std::isfinite(value)) return nullptr;
  return step > 0.0 ? std::round(value / step) * step : value;
}

/// Step, a power of ten, that is fine enough for every value of a column.
double step_of(const Column& column) {
  double largest = 0.0;
  for (const double value : *column.values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value * column.scale));
  }
  return largest > 0.0 ? std::pow(10.0, std::floor(std::log10(largest * resolution))) : 0.0;
}

/// Indices of the ticks that are kept: of each stretch the ticks where some column is lowest or highest, and one where
/// it has no value, so that gaps stay open.
std::vector<std::size_t> kept_ticks(const std::vector<std::size_t>& ticks, const std::vector<Column>& columns,
                                    std::size_t stretches) {
  if (ticks.size() <= 4 * stretches) return ticks;
  std::vector<std::size_t> kept;
  for (std::size_t b = 0; b < stretches; ++b) {
    const std::size_t begin = b * ticks.size() / stretches;
    const std::size_t end = (b + 1) * ticks.size() / stretches;
    for (const Column& column : columns) {
      const auto value = [&](std::size_t i) { return (*column.values)[ticks[i]]; };
      std::size_t low = end;
      std::size_t high = end;
      std::size_t gap = end;
      for (std::size_t i = begin; i < end; ++i) {
        if (!std::isfinite(value(i))) {
          gap = i;
        } else {
          if (low == end || value(i) < value(low)) low = i;
          if (high == end || value(i) > value(high)) high = i;
        }
      }
      for (const std::size_t i : {low, high, gap}) {
        if (i < end) kept.push_back(ticks[i]);
      }
    }
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

/// Rows [x, y ...] of a plot: of all ticks, or of those of the contact phase.
json plot_rows(const RunSeries& series, const Column& x, const std::vector<Column>& columns, bool stroking_only,
               std::size_t stretches) {
  std::vector<std::size_t> ticks;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double at = (*x.values)[i];
    const bool advances = ticks.empty() || at > (*x.values)[ticks.back()];
    if (std::isfinite(at) && advances && (!stroking_only || series.stroking[i])) ticks.push_back(i);
  }
  const std::vector<std::size_t> kept = kept_ticks(ticks, columns, stretches);
  std::vector<double> steps;
  for (const Column& column : columns) steps.push_back(step_of(column));
  const double x_step = step_of(x);
  json labels = json::array({x.name});
  for (const Column& column : columns) labels.push_back(column.name);
  json rows = json::array();
  for (const std::size_t i : kept) {
    json row = json::array({rounded((*x.values)[i] * x.scale, x_step)});
    for (std::size_t k = 0; k < columns.size(); ++k)
      row.push_back(rounded((*columns[k].values)[i] * columns[k].scale, steps[k]));
    rows.push_back(std::move(row));
  }
  return {{"labels", labels}, {"rows", rows}, {"ticks", ticks.size()}, {"shown", kept.size()}};
}

/// Rows [frequency, amplitude density of each], in N per root of the frequency's unit.
json spectrum_rows(const char* unit, const Spectrum& normal, const Spectrum& tangential) {
  json rows = json::array();
  for (std::size_t i = 0; i < std::min(normal.frequency.size(), tangential.frequency.size()); ++i) {
    rows.push_back({significant(normal.frequency[i]), significant(std::sqrt(normal.density[i])),
                    significant(std::sqrt(tangential.density[i]))});
  }
  return {{"labels", {unit, "normal", "tangential"}}, {"rows", rows}};
}

/// The same with frequencies in 1/mm.
Spectrum per_millimetre(Spectrum spectrum) {
  for (double& frequency : spectrum.frequency) frequency /= milli;
  for (double& density : spectrum.density) density *= milli;
  return spectrum;
}

json histogram(const UpdateMetrics& update) {
  json edges = json::array();
  for (const double edge : update.edges) edges.push_back(significant(edge * micro));
  return {{"edges", edges}, {"counts", update.counts}};
}

/// The numbers of a run in the units of the page. Field names end in their unit.
json numbers(const RunMetrics& m) {
  json data;
  for (const MetricRow& row : metric_rows(m)) {
    if (row.shown == nullptr) continue;
    data[row.shown] = row.value.is_number_float() ? significant(row.value.get<double>() * row.scale) : row.value;
  }
  const auto unknown_without = [&](std::size_t samples, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (samples == 0) data[name] = nullptr;
    }
  };
  unknown_without(m.direction.samples, {"direction_mean_deg", "direction_p99_deg", "direction_max_deg"});
  unknown_without(m.direction_near.samples, {"direction_near_deg"});
  unknown_without(m.direction_far.samples, {"direction_far_deg"});
  unknown_without(m.height.samples, {"height_max_um"});
  data["loops_mj"] = json::array();
  for (const double energy : m.energy.loops) data["loops_mj"].push_back(significant(energy * milli));
  data["account"] = json::array();
  for (const EnergyMetrics::Asked& row : m.energy.account) {
    data["account"].push_back({row.giver, significant(row.asked * milli), significant(row.paid * milli),
                               significant((row.asked - row.paid) * milli)});
  }
  data["flags"] = json::object();
  for (std::size_t bit = 0; bit < m.ticks.flags.size(); ++bit) {
    if (m.ticks.flags[bit] > 0) data["flags"][flag_name(bit)] = m.ticks.flags[bit];
  }
  return data;
}

json origin_data(const ReportOrigin& origin, const std::vector<ReportFact>& setup) {
  json facts = json::array();
  for (const ReportFact& fact : setup) facts.push_back({fact.name, fact.value});
  return {
      {"title", origin.title},     {"command", origin.command},   {"machine", origin.machine}, {"date", origin.date},
      {"program", origin.program}, {"warnings", origin.warnings}, {"notes", origin.notes},     {"setup", facts}};
}

/// What the page needs to say about a picture; its pixels are in the page itself.
json picture_data(const std::optional<Picture>& picture) {
  if (!picture) return nullptr;
  json colours = json::array();
  for (int i = 0; i <= 16; ++i) {
    const auto c = force_colour(i / 16.0);
    colours.push_back(fmt::format("rgb({},{},{})", c[0], c[1], c[2]));
  }
  return {{"low_n", significant(picture->force_low)},
          {"high_n", significant(picture->force_high)},
          {"colours", colours},
          {"caption", picture->caption}};
}

/// Friction and texture in the tangential force, where a run has any.
json parts_rows(const RunSeries& s, std::size_t stretches) {
  const auto any = [](const std::vector<double>& values) {
    return std::any_of(values.begin(), values.end(), [](double v) { return std::abs(v) > 0.0; });
  };
  if (!any(s.friction) && !any(s.texture)) return nullptr;
  return plot_rows(s, {"distance", &s.distance, milli}, {{"friction", &s.friction, 1.0}, {"texture", &s.texture, 1.0}},
                   true, stretches);
}

/// What a comparison shows of a law.
json law_data(const std::string& law, const RunSeries& s, const RunMetrics& m, std::size_t stretches) {
  const Column distance{"distance", &s.distance, milli};
  const Column time{"time", &s.time, 1.0};
  std::vector<double> total(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) total[i] = s.work[i] + s.stored[i];
  const std::vector<Column> force{
      {"normal", &s.normal, 1.0}, {"tangential", &s.tangential, 1.0}, {"magnitude", &s.force, 1.0}};
  const std::vector<Column> heights{{"followed", &s.followed, milli}, {"relief", &s.relief, milli}};
  const std::vector<Column> energy{{"work", &s.work, milli}, {"stored", &s.stored, milli}, {"sum", &total, milli}};
  return {{"law", law},
          {"verdict", verdict(m)},
          {"numbers", numbers(m)},
          {"force_distance", plot_rows(s, distance, force, true, stretches)},
          {"parts_distance", parts_rows(s, stretches)},
          {"height_distance", plot_rows(s, distance, heights, true, stretches)},
          {"direction_distance", plot_rows(s, distance, {{"angle", &s.direction_error, degrees}}, true, stretches)},
          {"energy_time", plot_rows(s, time, energy, false, stretches)},
          {"follow_time",
           m.follow.samples > 0 ? plot_rows(s, time, {{"error", &s.follow, percent}}, true, stretches) : json(nullptr)},
          {"spectrum_distance", spectrum_rows("frequency", per_millimetre(m.spectrum.normal_distance),
                                              per_millimetre(m.spectrum.tangential_distance))}};
}

/// Rows [speed in m/s, layer in mm, expected of M1, share of each law ...].
json detection_data(const std::vector<DetectionRow>& rows) {
  json data = json::array();
  for (const DetectionRow& row : rows) {
    json entry{significant(row.speed), significant(row.layer * milli), significant(row.expected)};
    for (const double share : row.share) entry.push_back(significant(share));
    data.push_back(std::move(entry));
  }
  return data;
}

/// Rows [samples, MB of the volume, [bytes more of each law], microseconds a tick of each law ...].
json loop_rate_data(const std::vector<LoopRateRow>& rows) {
  json data = json::array();
  for (const LoopRateRow& row : rows) {
    json entry{row.samples, significant(row.bytes * 1e-6), row.law_bytes};
    for (const double p50 : row.p50) entry.push_back(significant(p50 * 1e6));
    data.push_back(std::move(entry));
  }
  return data;
}

}  // namespace

json significant(double value) {
  if (!std::isfinite(value)) return nullptr;
  return value == 0.0 ? json(0.0) : json(std::stod(fmt::format("{:.5g}", value)));
}

Status check_series(const RunSeries& series, const std::string& place) {
  const std::size_t n = series.time.size();
  const bool equal = series.distance.size() == n && series.force.size() == n && series.normal.size() == n &&
                     series.tangential.size() == n && series.friction.size() == n && series.texture.size() == n &&
                     series.followed.size() == n && series.relief.size() == n && series.direction_error.size() == n &&
                     series.work.size() == n && series.stored.size() == n && series.follow.size() == n &&
                     series.update.size() == n && series.near_step.size() == n && series.stroking.size() == n;
  if (equal) return success();
  return bad_value("has columns of different lengths", place, "columns with one value a tick");
}

json run_data(const RunReport& report) {
  json data = origin_data(report.origin, report.setup);
  data["kind"] = "run";
  data["summary"] = summarise(report);
  data["picture"] = picture_data(report.picture);
  const RunSeries& s = report.series;
  json law = law_data(report.law, s, report.metrics, run_stretches);
  law["force_time"] =
      plot_rows(s, {"time", &s.time, 1.0},
                {{"normal", &s.normal, 1.0}, {"tangential", &s.tangential, 1.0}, {"magnitude", &s.force, 1.0}}, false,
                run_stretches);
  law["spectrum_time"] =
      spectrum_rows("frequency", report.metrics.spectrum.normal_time, report.metrics.spectrum.tangential_time);
  law["update_histogram"] = histogram(report.metrics.update);
  data["laws"] = json::array({std::move(law)});
  return data;
}

json compare_data(const CompareReport& report) {
  json data = origin_data(report.origin, report.setup);
  data["kind"] = "compare";
  const bool follows = std::any_of(report.entries.begin(), report.entries.end(),
                                   [](const CompareEntry& entry) { return entry.metrics.follow.samples > 0; });
  data["summary"] = fmt::format(
      "{} laws on the same scene and stroke. Direction and height errors are against {}", report.entries.size(),
      follows
          ? "the isosurface; the follow error is of the probe itself, so it grows with the force and falls with the "
            "stiffness."
          : "the reconstructed relief; a law that does not render relief shows it here.");
  data["picture"] = picture_data(report.picture);
  data["loop_rate"] = loop_rate_data(report.loop_rates);
  data["detection"] = detection_data(report.detection);
  data["laws"] = json::array();
  const std::size_t stretches = std::max(fewest_stretches, compare_stretches / report.entries.size());
  for (const CompareEntry& entry : report.entries)
    data["laws"].push_back(law_data(entry.law, entry.series, entry.metrics, stretches));
  return data;
}

}  // namespace asperity
