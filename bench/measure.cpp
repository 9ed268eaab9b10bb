#include "bench/measure.h"

#include <algorithm>
#include <cmath>

// By this name scripts/instructions tells the tool that counts where counting starts and ends: never inlined.
extern "C" [[gnu::noinline]] std::size_t asperity_counted_ticks(asperity::bench::Row& row, std::size_t begin,
                                                                std::size_t end) {
  return row.plain(begin, end);
}

namespace asperity::bench {

namespace {

/// `sorted` is ascending and not empty; nearest rank.
double percentile(const std::vector<double>& sorted, double share) {
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[std::max<std::size_t>(1, static_cast<std::size_t>(rank)) - 1];
}

std::vector<RowResult> count(std::vector<Row>& rows, const Effort& effort) {
  std::vector<RowResult> results;
  for (Row& row : rows) {
    row.plain(0, effort.warm);
    const std::size_t answers = asperity_counted_ticks(row, effort.warm, effort.warm + effort.counted);
    results.push_back({row.name(), {}, {}, static_cast<double>(answers) / static_cast<double>(effort.counted)});
  }
  return results;
}

}  // namespace

double clock_cost_ns() {
  std::vector<double> times(10001);
  for (double& time : times) {
    const Clock::time_point start = Clock::now();
    time = std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  }
  std::sort(times.begin(), times.end());
  return percentile(times, 0.5);
}

double Samples::answered_share() const {
  return nanoseconds_.empty() ? 0.0 : static_cast<double>(answered_) / static_cast<double>(nanoseconds_.size());
}

Latency Samples::summary(double clock_cost) const {
  Latency latency;
  latency.updates = nanoseconds_.size();
  if (nanoseconds_.empty()) return latency;
  std::vector<double> sorted = nanoseconds_;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double share) { return std::max(0.0, percentile(sorted, share) - clock_cost); };
  latency.p50 = at(0.5);
  latency.p99 = at(0.99);
  latency.p999 = at(0.999);
  latency.max = at(1.0);
  return latency;
}

void CacheSweep::run() {
  for (std::size_t i = 0; i < bytes_.size(); i += 64) bytes_[i] = static_cast<unsigned char>(bytes_[i] + 1U);
  // The compiler must not see that nobody reads them.
  asm volatile("" : : "r"(bytes_.data()) : "memory");
}

std::vector<RowResult> measure(std::vector<Row>& rows, const Effort& effort, double clock_cost) {
  if (effort.counted > 0) return count(rows, effort);
  const auto turns = [&](std::size_t first, std::size_t count, const auto& run) {
    for (std::size_t round = 0; round < effort.rounds; ++round) {
      const std::size_t begin = first + count * round / effort.rounds;
      const std::size_t end = first + count * (round + 1) / effort.rounds;
      for (Row& row : rows) run(row, begin, end);
    }
  };
  CacheSweep sweep;
  turns(0, effort.warm, [](Row& row, std::size_t begin, std::size_t end) { row.warm(begin, end); });
  turns(effort.warm, effort.cold, [&](Row& row, std::size_t begin, std::size_t end) { row.cold(begin, end, sweep); });

  std::vector<RowResult> results;
  for (const Row& row : rows) {
    const double share = std::min(row.warm_samples().answered_share(), row.cold_samples().answered_share());
    results.push_back(
        {row.name(), row.warm_samples().summary(clock_cost), row.cold_samples().summary(clock_cost), share});
  }
  return results;
}

}  // namespace asperity::bench
