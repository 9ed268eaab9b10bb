#pragma once
// The numbers of a run by their names, in the JSON of its metrics and on its page. Internal to study.

#include <nlohmann/json.hpp>
#include <vector>

#include "asperity/study/metrics.h"

namespace asperity {

/// One number.
struct MetricRow {
  const char* path;      ///< in the JSON of the metrics; nullptr: not there
  const char* shown;     ///< on the page, ends in its unit; nullptr: not there
  nlohmann::json value;  ///< SI, or a count
  double scale = 1.0;    ///< from SI to the page's unit
};

/// All of them but flags, loops and the histogram. [any]
std::vector<MetricRow> metric_rows(const RunMetrics& m);

}  // namespace asperity
