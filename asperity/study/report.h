#pragma once
// Reports: one HTML file each, which holds all it needs (plots, picture, numbers) and asks no network for anything.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/study/loop_rate.h"
#include "asperity/study/metrics.h"
#include "asperity/study/picture.h"

namespace asperity {

/// What both kinds of report say about where they come from. Plain text throughout; it is escaped on the way out.
struct ReportOrigin {
  std::string title;                  ///< the scene's name, or what else the page should be called
  std::string command;                ///< the command line that makes it again
  std::string machine;                ///< processor and system, one line; may be empty
  std::string date;                   ///< as it should stand on the page; the report reads no clock
  std::string program;                ///< name and version
  std::vector<std::string> warnings;  ///< shown first
  std::vector<std::string> notes;     ///< what was decided for the user
};

/// Name and value as the page lists them ("device": "omega.7").
struct ReportFact {
  std::string name;
  std::string value;
};

/// One run of one law.
struct RunReport {
  ReportOrigin origin;
  std::string law;                ///< law_name of what was touched; several joined by ", "
  std::vector<ReportFact> setup;  ///< surface, device, probe, stroke: in this order on the page
  RunSeries series;
  RunMetrics metrics;
  std::optional<Picture> picture;
};

/// One law of a comparison.
struct CompareEntry {
  std::string law;
  RunSeries series;
  RunMetrics metrics;
};

/// Several laws on the same scene and stroke.
struct CompareReport {
  ReportOrigin origin;
  std::vector<ReportFact> setup;
  std::vector<CompareEntry> entries;
  std::optional<Picture> picture;
  std::vector<LoopRateRow> loop_rates;  ///< one p50 for each of `entries`; empty where no isosurface is touched
  std::vector<DetectionRow> detection;  ///< one share for each of `entries`; empty where no isosurface is touched
};

/// One paragraph in plain words: how long, how strong, how true, how safe. For the page and the terminal. [main]
std::string summarise(const RunReport& report);
/// What the numbers of one law say, and nothing else ("follows the relief within 0.4 %; feeds no energy"). [main]
std::string verdict(const RunMetrics& metrics);

/// The page. Long series are thinned to the extremes of each stretch, and the page says so.
/// Errors: bad_value for a series whose columns differ in length, or a comparison without entries. [main]
Result<std::string> run_report_html(const RunReport& report);
Result<std::string> compare_report_html(const CompareReport& report);

/// Writes the page, aside first, then renamed. Errors: those above, file_unwritable. [main]
Status write_run_report(const std::filesystem::path& path, const RunReport& report);
Status write_compare_report(const std::filesystem::path& path, const CompareReport& report);

}  // namespace asperity
