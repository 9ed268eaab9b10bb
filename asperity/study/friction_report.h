#pragma once
// The page of friction laws against measured stick-slip.

#include <filesystem>
#include <string>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/study/friction_fit.h"
#include "asperity/study/report.h"

namespace asperity {

/// A fit and what it was of. Each law has one comparison for each of `traces`.
struct FrictionReport {
  ReportOrigin origin;
  std::vector<FitTrace> traces;
  std::vector<LawFit> laws;
  StickSlipSettings stick_slip;
};

/// A fitted parameter by name, SI: "mass", "load", "static_friction", "dynamic_friction", and the members of
/// FrictionLaw. Not-a-number where the law does not read it. [any]
double friction_parameter(const LawFit& fit, const std::string& name);
/// What the numbers of a law say: how far off it is, and where it slides although stick-slip was measured. [main]
std::string verdict(const LawFit& fit, const std::vector<FitTrace>& traces);
/// "+12 %", "-3 %", "none" where one of the two has none. [any]
std::string error_words(double measured, double predicted);

/// The page; plots show as much of each measured trace as was predicted.
/// Errors: bad_value for a law without a comparison for each trace. [main]
Result<std::string> friction_report_html(const FrictionReport& report);
/// Writes it, aside first, then renamed. Errors: those above, file_unwritable. [main]
Status write_friction_report(const std::filesystem::path& path, const FrictionReport& report);

}  // namespace asperity
