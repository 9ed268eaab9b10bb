#pragma once
// From a report to the data of its page. Private to study.

#include <nlohmann/json.hpp>
#include <string>

#include "asperity/study/report.h"

namespace asperity {

/// The page's data in the units that it shows (mm, N, us, mJ); not-a-number becomes null. Columns must be equally long.
nlohmann::json run_data(const RunReport& report);
nlohmann::json compare_data(const CompareReport& report);

/// A number of a page at five digits, which no plot can tell from all of them; null where it is not finite.
nlohmann::json significant(double value);

/// Errors: bad_value when the columns of a series differ in length.
Status check_series(const RunSeries& series, const std::string& place);

}  // namespace asperity
