#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/device/stroke.h"
#include "asperity/io/trace_file.h"

namespace asperity {

/// A cell of a CSV line without blanks and quotation marks around it. [any]
std::string_view csv_trimmed(std::string_view text);
/// The cells of a CSV line, trimmed; they point into it. [any]
std::vector<std::string_view> csv_cells(std::string_view line);

/// Reads a recorded probe path from CSV text: a header line that names time, x, y, z (position_x, position_y,
/// position_z of an exported trace count as well), each with an optional unit in brackets ("x [mm]"; without one: SI),
/// in any order; other columns are left out. Blank lines and lines that start with '#' are skipped. Times start at zero
/// in the answer. Errors: file_empty, file_malformed or bad_value with the line as place (column missing, unknown unit,
/// cell not a finite number, time not increasing, fewer than two rows). [build]
Result<std::vector<TimedPoint>> parse_recorded_path(std::string_view text);

/// The probe's path of a trace. Errors: mismatch when it has fewer than two ticks; bad_value naming the first tick
/// whose time or position cannot be used. [build]
Result<std::vector<TimedPoint>> recorded_path_from(const Trace& trace);

/// Reads `path`, a CSV file or a trace. Errors: those above and of reading the file, with the file's name. [build]
Result<std::vector<TimedPoint>> read_recorded_path(const std::string& path);

}  // namespace asperity
