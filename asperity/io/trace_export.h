#pragma once
// Traces for other programs: a CSV table, and a JSON sidecar that says what its columns are.

#include <string>
#include <string_view>
#include <vector>

#include "asperity/io/trace_file.h"

namespace asperity {

/// A column of the CSV table. `unit` is empty for counts, flags and unit vectors.
struct TraceColumn {
  std::string name;
  std::string unit;
};

/// The columns in the order they are written; the header shows each as `name [unit]`. [any]
std::vector<TraceColumn> trace_columns();

/// The CSV text: a header line, then a line a tick. Numbers are written with as many digits as bring the same double
/// back; ids without a value (no_index) are empty. [main]
std::string trace_csv(const Trace& trace);
/// The sidecar's text: columns with units, metadata, record count, force hash, completeness. [main]
std::string trace_sidecar_json(const Trace& trace);

/// Writes `path` (CSV) and the sidecar beside it, each aside and then renamed. The sidecar's name is `path` with its
/// extension replaced by ".json". Errors: file_unwritable; bad_value when `path` itself ends in ".json". [main]
Status export_trace(const Trace& trace, const std::string& path);

/// "out/run.csv" -> "out/run.json" [any]
std::string sidecar_path(std::string_view csv_path);

}  // namespace asperity
