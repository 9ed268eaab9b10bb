#pragma once
// How a row of the latency table is measured.

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace asperity::bench {

using Clock = std::chrono::steady_clock;
inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Times of many updates, in nanoseconds.
struct Latency {
  std::size_t updates = 0;
  double p50 = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double max = 0.0;
};

/// What one reading of the clock costs (ns), the median of many.
double clock_cost_ns();

/// Times of single updates, as they are measured.
class Samples {
 public:
  void reserve(std::size_t updates) { nanoseconds_.reserve(updates); }
  void add(Clock::duration time, bool answered) {
    nanoseconds_.push_back(std::chrono::duration<double, std::nano>(time).count());
    answered_ += answered ? 1U : 0U;
  }
  /// Share of the updates that answered: touched something, found something.
  [[nodiscard]] double answered_share() const;
  /// Percentiles, with `clock_cost` (ns) taken off every time.
  [[nodiscard]] Latency summary(double clock_cost) const;

 private:
  std::vector<double> nanoseconds_;
  std::size_t answered_ = 0;
};

/// Drives what an update reads out of the caches by writing to 64 MB.
class CacheSweep {
 public:
  CacheSweep() : bytes_(std::size_t{64} << 20U, 1) {}
  void run();

 private:
  std::vector<unsigned char> bytes_;
};

/// One way of answering, whose updates are timed one by one: update(tick) answers whether it touched or found
/// something.
class Row {
 public:
  template <class Update>
  Row(std::string name, Update update)
      : name_(std::move(name)),
        block_(
            [update = std::move(update)](std::size_t begin, std::size_t end, CacheSweep* sweep, Samples* out) mutable {
              std::size_t answers = 0;
              if (out == nullptr) {
                for (std::size_t tick = begin; tick < end; ++tick) answers += update(tick) ? 1U : 0U;
                return answers;
              }
              for (std::size_t tick = begin; tick < end; ++tick) {
                if (sweep != nullptr) sweep->run();
                const Clock::time_point start = Clock::now();
                const bool answered = update(tick);
                out->add(Clock::now() - start, answered);
                answers += answered ? 1U : 0U;
              }
              return answers;
            }) {}

  void warm(std::size_t begin, std::size_t end) { block_(begin, end, nullptr, &warm_); }
  void cold(std::size_t begin, std::size_t end, CacheSweep& sweep) { block_(begin, end, &sweep, &cold_); }
  /// The updates and nothing else: no clock. Answers how many of them answered.
  std::size_t plain(std::size_t begin, std::size_t end) { return block_(begin, end, nullptr, nullptr); }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const Samples& warm_samples() const { return warm_; }
  [[nodiscard]] const Samples& cold_samples() const { return cold_; }

 private:
  std::string name_;
  std::function<std::size_t(std::size_t, std::size_t, CacheSweep*, Samples*)> block_;
  Samples warm_;
  Samples cold_;
};

/// How many updates are measured.
struct Effort {
  std::size_t warm = 100000;
  std::size_t cold = 200;
  std::size_t rounds = 5;  ///< the rows take turns, so that what else the machine does meets all of them alike
  /// Instead of timing: after `warm` updates so many in asperity_counted_ticks(), for a tool that counts. 0: timed.
  std::size_t counted = 0;
  [[nodiscard]] std::size_t ticks() const { return warm + cold + counted; }
};

/// A finished row.
struct RowResult {
  std::string name;
  Latency warm;
  Latency cold;
  double answered_share = 0.0;  ///< of all updates
};

/// Measures the rows in turns: first all warm updates, then all cold ones. With effort.counted, one after the other and
/// without a clock.
std::vector<RowResult> measure(std::vector<Row>& rows, const Effort& effort, double clock_cost);

}  // namespace asperity::bench
