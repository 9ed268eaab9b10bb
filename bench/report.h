#pragma once

#include <string>
#include <vector>

#include "bench/rays_rows.h"
#include "bench/rows.h"

namespace asperity::bench {

/// Two medians of one run, divided.
struct Ratio {
  std::string what;
  double value = 0.0;
  double bar = 0.0;     ///< what the project owes (performance.md); 0: nothing owed
  double margin = 0.0;  ///< above this, --check fails: far above the bar, as timings on shared machines scatter
};

/// Everything that one run found.
struct Report {
  std::string machine;
  std::string date;
  std::string command;
  double clock_cost = 0.0;  ///< ns, already taken off every time
  std::vector<Group> groups;
  std::vector<RayRow> rays;

  [[nodiscard]] std::vector<Ratio> ratios() const;
  /// What does not hold, one sentence each: a row that did not answer, distances that disagree, a ratio over its
  /// margin, what ray_failures() says.
  [[nodiscard]] std::vector<std::string> failures() const;
  [[nodiscard]] std::string text() const;
  [[nodiscard]] std::string json() const;
};

/// The processor's name and the number of its cores.
std::string machine_name();

}  // namespace asperity::bench
