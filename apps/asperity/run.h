#pragma once
// One run of an experiment: probe, step, safety stage, trace.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/asperity/command.h"
#include "asperity/core/trace_record.h"
#include "asperity/io/experiment.h"
#include "asperity/io/trace_file.h"
#include "asperity/servo/realtime.h"
#include "asperity/servo/session.h"
#include "asperity/study/metrics.h"
#include "asperity/study/report.h"

namespace asperity::program {

/// What a run left behind.
struct RunResult {
  std::vector<TraceRecord> records;
  SessionSummary summary;
  std::uint64_t hash = 0;  ///< of the forces
  EnergyAccount account;   ///< as the run left it
};

/// Whether the stroke's ticks can be kept in memory. Errors: too_large. [main]
Status check_length(const Experiment& experiment);

/// Runs the whole stroke. `record` gets every tick as well (the trace); it may be empty. Errors: of the probe and the
/// safety stage; too_large when the stroke has more ticks than are kept in memory. [main]
Result<RunResult> run_experiment(const Experiment& experiment, const std::function<Status(const TraceRecord&)>& record,
                                 const Progress& progress);

/// The laws of a scene, joined: "mesostructure". [any]
std::string law_names_of(const Scene& scene);
/// What a law says of itself: "avila: a layer that pushes by the field's value at the probe (large-data-2008, M1 ...)".
/// [any]
std::string law_fact(const LawKind& kind);
/// That of every law that there is, a line each, for help. [any]
std::string words_of_laws();
/// Device, probe, surfaces and stroke as a report lists them. [any]
std::vector<ReportFact> setup_facts(const Experiment& experiment);
/// Where a report comes from: command, machine, date, program. [main]
ReportOrigin report_origin(const Experiment& experiment, const Console& console);

/// What the trace of an experiment is a trace of; `source`: the scene as the user gave it. [main]
TraceMetadata trace_metadata(const Experiment& experiment, const std::string& source, const Console& console);

/// Adds what a loop asks of the system: --priority, --cpu.
void add_realtime_options(Arguments& command, RealtimeSettings& settings);

/// Creates the folder of an output file set. Errors: file_unwritable. [main]
Status make_output_folder(const std::string& folder);

/// "1.23 us"
std::string format_seconds(double seconds);
/// "contact", "force_limited", ... of the flags that any tick had, without contact. "none" when there is none.
std::string flag_list(const TickMetrics& ticks);

}  // namespace asperity::program
