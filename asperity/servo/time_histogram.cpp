#include "asperity/servo/time_histogram.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

constexpr double per_second = 1e9;
constexpr std::uint64_t parts = 1U << TimeCounts::parts_bits;
constexpr std::uint64_t longest_told = (std::uint64_t{1} << (TimeCounts::octaves + TimeCounts::parts_bits - 1)) - 1;

/// Below 32 ns a bucket each; then 32 in each octave.
std::size_t bucket_of(std::uint64_t ns) noexcept {
  ns = std::min(ns, longest_told);
  if (ns < parts) return ns;
  const auto octave = static_cast<unsigned>(std::bit_width(ns)) - TimeCounts::parts_bits - 1;
  return ((octave + 1) << TimeCounts::parts_bits) + static_cast<std::size_t>((ns >> octave) - parts);
}

/// The longest time that falls into a bucket (ns).
std::uint64_t last_of(std::size_t bucket) noexcept {
  if (bucket < parts) return bucket;
  const auto octave = static_cast<unsigned>(bucket >> TimeCounts::parts_bits) - 1;
  const std::uint64_t part = bucket % parts;
  return ((parts + part + 1) << octave) - 1;
}

}  // namespace

double TimeCounts::quantile(double of) const noexcept {
  if (total == 0) return 0.0;
  const double wanted = std::clamp(of, 0.0, 1.0) * static_cast<double>(total);
  double seen = 0.0;
  for (std::size_t i = 0; i < buckets; ++i) {
    seen += static_cast<double>(counts[i]);
    if (seen > 0.0 && seen >= wanted) return std::min(static_cast<double>(last_of(i)) / per_second, longest);
  }
  return longest;
}

void TimeHistogram::add(double seconds) noexcept {
  const double ns = std::clamp(seconds * per_second, 0.0, static_cast<double>(longest_told));
  const auto whole = static_cast<std::uint64_t>(std::isnan(ns) ? 0.0 : ns);
  std::atomic<std::uint64_t>& count = counts_[bucket_of(whole)];
  count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if (whole > longest_ns_.load(std::memory_order_relaxed)) longest_ns_.store(whole, std::memory_order_relaxed);
}

TimeCounts TimeHistogram::counts() const noexcept {
  TimeCounts now;
  for (std::size_t i = 0; i < now.counts.size(); ++i) {
    now.counts[i] = counts_[i].load(std::memory_order_relaxed);
    now.total += now.counts[i];
  }
  now.longest = static_cast<double>(longest_ns_.load(std::memory_order_relaxed)) / per_second;
  return now;
}

}  // namespace asperity
