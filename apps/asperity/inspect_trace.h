#pragma once
// What a trace is: its ticks, what happened between them, and of one that a fault has left, what it was.

#include <string>
#include <vector>

#include "apps/asperity/command.h"
#include "asperity/study/report.h"

namespace asperity::program {

/// What there is to say of a trace.
struct TraceFindings {
  std::vector<ReportFact> facts;  ///< a fault's sentence first
  std::vector<std::string> problems;
  std::vector<std::string> happened;  ///< a line each: events and key frames, up to a bound
  std::vector<std::string> last;      ///< of a fault: what the last ticks were like, a line each
  Json json = Json::object();         ///< the same for programs
};

/// Reads the file. Errors: of read_trace. [main]
Result<TraceFindings> inspect_trace_file(const std::string& file);

/// Writes the page of a trace's last two seconds, in the scene that was felt then. Errors: of the trace, its scenes and
/// the page; bad_value (a trace without ticks). [main]
Status write_trace_report(const std::string& trace_file, const std::string& page, const Console& console);

}  // namespace asperity::program
