#pragma once
// Rows on real meshes, maps and volumes: what a tick costs at its worst.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "bench/measure.h"

namespace asperity::bench {

/// What one stroke over one surface by one law took.
struct RealRow {
  std::string body;
  std::string stroke;
  std::string law;
  double radius = 0.0;            ///< m, of the probe
  Latency times;                  ///< ns, of each tick the least of all passes
  double worst_again = 0.0;       ///< ns: the slowest tick from its state, caches empty and cold, the least of 20 times
  double contact_share = 0.0;     ///< of the ticks
  std::uint32_t work_p999 = 0;    ///< evaluations, bounds and frames (WorkCount::sum)
  std::uint32_t work_max = 0;     ///< the same of the dearest tick
  std::size_t not_converged = 0;  ///< ticks
  std::size_t open = 0;           ///< ticks whose budget was spent before the proxy was at rest
  std::uint32_t longest_open = 0;  ///< of those, one after the other
  std::size_t limited = 0;         ///< ticks whose energy was limited
  double largest_jump = 0.0;       ///< N, between two ticks
};

/// How many ticks, and of what.
struct RealEffort {
  std::filesystem::path data = "../shared/data";  ///< meshes/, textures/, volumes/
  std::size_t ticks = 20000;                      ///< a row
  int passes = 3;                                 ///< that each tick is timed in, of which the least counts
  std::string only;                               ///< rows whose "body, stroke, law" holds this text; empty: all
  std::optional<std::uint32_t> budget;            ///< of each tick; 0: no limit
  /// m, of the probe, for rows by laws that take a ball; none: points, by all laws.
  std::vector<double> radii;
  bool every = false;  ///< all pairs of bodies, strokes and laws; otherwise each body meets some of them
};

/// Bodies of real data, each with strokes and laws that go together, in an order that is always the same; `told` hears
/// of each row as it is done. Bodies whose files are missing are told as skipped. Errors: of scenes. [build]
Result<std::vector<RealRow>> measure_real(const RealEffort& effort, double clock_cost,
                                          const std::function<void(std::string_view)>& told);

/// As a table; of balls beside the same rows by a point, where those are among them. [build]
std::string real_text(const std::vector<RealRow>& rows);

}  // namespace asperity::bench
