#pragma once
// The page of laws scored on a measured trajectory.

#include <filesystem>
#include <string>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/study/path_score.h"
#include "asperity/study/report.h"

namespace asperity {

/// A trajectory and what laws made of it.
struct PathReport {
  ReportOrigin origin;
  MeasuredPath path;
  std::vector<PathScore> scores;
};

/// What the numbers of a law say. [any]
std::string verdict(const PathScore& score);
/// The page. Errors: bad_value where a score has another number of samples than the path. [main]
Result<std::string> path_report_html(const PathReport& report);
/// Writes it. Errors: those above, file_unwritable. [main]
Status write_path_report(const std::filesystem::path& file, const PathReport& report);

}  // namespace asperity
