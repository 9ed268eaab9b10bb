#include "asperity/study/path_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "asperity/core/units.h"
#include "asperity/io/atomic_file.h"
#include "asperity/study/detail/page.h"
#include "asperity/study/detail/page_data.h"

namespace asperity {
namespace {

using nlohmann::json;

constexpr std::size_t path_script = 5;        // of report_assets()
constexpr std::size_t most_path_rows = 2000;  // of a plot
constexpr double degrees_a_radian = 57.29577951308232;

std::string words(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("–");
}

json table_row(const PathScore& score) {
  const ForceErrors& e = score.force;
  return {score.law,
          words(e.rms_error, "{:.4g}"),
          words(100.0 * e.relative, "{:.3g}"),
          words(e.largest_error, "{:.4g}"),
          words(e.peak_rendered - e.peak_measured, "{:+.3g}"),
          words(e.mean_angle * degrees_a_radian, "{:.3g}"),
          words(e.largest_angle * degrees_a_radian, "{:.3g}"),
          score.normal.samples > 0 ? words(score.normal.mean * degrees_a_radian, "{:.3g}") : std::string("–"),
          words(100.0 * e.missed, "{:.3g}"),
          words(100.0 * e.added, "{:.3g}"),
          words(1e3 * score.mean_penetration, "{:.3g}"),
          words(1e3 * score.largest_penetration, "{:.3g}")};
}

/// Rows [distance, measured, law ...] of one number a sample, thinned out.
template <class Value>
json rows_of(const PathReport& report, const Value& value) {
  const std::vector<double> distance = distance_along(report.path);
  const std::size_t stride = std::max<std::size_t>(1, (distance.size() + most_path_rows - 1) / most_path_rows);
  json rows = json::array();
  for (std::size_t i = 0; i < distance.size(); i += stride) {
    json row{significant(1e3 * distance[i])};
    value(i, row);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string summary_of(const PathReport& report) {
  std::string text = fmt::format("{} samples over {} with up to {:.3g} N, {}.", report.path.samples.size(),
                                 format_length(distance_along(report.path).back()),
                                 report.scores.empty() ? 0.0 : report.scores.front().force.peak_measured,
                                 report.path.place == PathPlace::surface
                                     ? "on the surface: laws are driven beneath it by force over stiffness"
                                     : "of the probe: laws are driven where it was");
  const auto best =
      std::min_element(report.scores.begin(), report.scores.end(),
                       [](const PathScore& a, const PathScore& b) { return a.force.rms_error < b.force.rms_error; });
  if (best != report.scores.end()) text += fmt::format(" {} comes nearest: {}.", best->law, verdict(*best));
  return text;
}

json page_data_of(const PathReport& report) {
  json laws = json::array();
  json table = json::array();
  for (const PathScore& score : report.scores) {
    laws.push_back(score.law);
    table.push_back(table_row(score));
  }
  const json force = rows_of(report, [&](std::size_t i, json& row) {
    row.push_back(significant(report.path.samples[i].force.norm()));
    for (const PathScore& score : report.scores) row.push_back(significant(score.rendered[i].norm()));
  });
  const json error = rows_of(report, [&](std::size_t i, json& row) {
    for (const PathScore& score : report.scores) row.push_back(significant(score.force.error[i]));
  });
  const json angle = rows_of(report, [&](std::size_t i, json& row) {
    for (const PathScore& score : report.scores) row.push_back(significant(score.force.angle[i] * degrees_a_radian));
  });
  return {{"title", report.origin.title},
          {"command", report.origin.command},
          {"date", report.origin.date},
          {"program", report.origin.program},
          {"summary", summary_of(report)},
          {"notes", report.origin.notes},
          {"laws", laws},
          {"columns",
           {"law", "RMS |dF| (N)", "of measured (%)", "largest |dF| (N)", "peak error (N)", "mean angle (deg)",
            "largest angle (deg)", "to the true normal (deg)", "missed (%)", "added (%)", "mean penetration (mm)",
            "largest (mm)"}},
          {"table", table},
          {"plots",
           {{{"title", "Force"}, {"y", "force (N)"}, {"measured", true}, {"rows", force}},
            {{"title", "Error |dF|"}, {"y", "error (N)"}, {"measured", false}, {"rows", error}},
            {{"title", "Angle to the measured force"}, {"y", "angle (deg)"}, {"measured", false}, {"rows", angle}}}}};
}

}  // namespace

std::string verdict(const PathScore& score) {
  const ForceErrors& e = score.force;
  if (e.compared == 0) return "neither measured nor rendered a force";
  std::string text = fmt::format("its force is off by {:.3g} N", e.rms_error);
  if (std::isfinite(e.relative)) text += fmt::format(" ({:.2g} %)", 100.0 * e.relative);
  if (std::isfinite(e.mean_angle))
    text += fmt::format(", its direction by {:.2g} degrees", e.mean_angle * degrees_a_radian);
  if (e.missed > 0.0) text += fmt::format("; it misses {:.2g} % of the contact", 100.0 * e.missed);
  if (e.added > 0.0) text += fmt::format("; it adds contact on {:.2g} % of the free path", 100.0 * e.added);
  return text;
}

Result<std::string> path_report_html(const PathReport& report) {
  for (const PathScore& score : report.scores) {
    if (score.rendered.size() == report.path.samples.size() && score.force.error.size() == score.rendered.size())
      continue;
    return bad_value(fmt::format("{} has {} samples", score.law, score.rendered.size()), "scores",
                     fmt::format("{}, those of the path", report.path.samples.size()));
  }
  if (report.path.samples.empty()) return bad_value("has no samples", "path", "two or more");
  return page_html(report.origin.title + " - Asperity", page_data_of(report), path_script, "");
}

Status write_path_report(const std::filesystem::path& file, const PathReport& report) {
  ASPERITY_TRY(const std::string html, path_report_html(report));
  return write_file_atomically(file, html);
}

}  // namespace asperity
