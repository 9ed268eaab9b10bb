// A volume larger than the memory it is given: a probe follows an isosurface of it at 1 kHz in real time while bricks
// are read ahead. No test: it needs gigabytes of disk and a quiet machine.

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/field/brick/file.h"
#include "asperity/field/volume/generators.h"
#include "asperity/render/step.h"

namespace {

using namespace asperity;
using Clock = std::chrono::steady_clock;

constexpr double tick = 1e-3;     // s
constexpr double depth = 0.5e-3;  // m below the surface
constexpr double margin = 6e-3;   // m that the walk keeps from the volume's border
constexpr double approach = 0.3;  // s standing still before the walk, as a hand that has come near

struct Options {
  std::string file;
  std::string kind = "gyroid";
  std::uint32_t nodes = 1024;
  std::size_t resident_megabytes = 448;
  std::vector<double> speeds{0.1, 0.25, 0.5};
  double seconds = 10.0;
  bool warm = false;
};

/// Field, memory and tick counts of one run.
struct Outcome {
  std::size_t ticks = 0;
  std::size_t coarse = 0;
  std::size_t touching = 0;
  std::size_t late = 0;
  std::size_t waits = 0;  ///< within step: voluntary switches to other threads and pages read from disk
  std::vector<double> microseconds;
  double longest_busy = 0.0;  ///< us of processor time, without what other programs took
  double megabytes_read = 0.0;
  double slowest_milliseconds = 0.0;  ///< of reading one brick
  double resident_megabytes = 0.0;
  double process_megabytes = 0.0;
};

VolumeGenerator generator_of(const Options& options, VolumeKind kind) {
  VolumeGenerator generator;
  generator.kind = kind;
  generator.size = {{options.nodes, options.nodes, options.nodes}};
  // Several times more surface than the resident bricks cover.
  if (kind == VolumeKind::gyroid) generator.wavelength = 0.05;
  return generator;
}

Status write_volume(const Options& options, const VolumeGenerator& generator) {
  ASPERITY_TRY(const VolumeFunction function, VolumeFunction::build(generator));
  ASPERITY_TRY(const GridAxes axes, volume_axes(generator));
  const auto slab = [&](std::uint32_t first, std::uint32_t last, SampleArray& out) {
    function.slab(axes, first, last, std::get<std::vector<float>>(out));
    return success();
  };
  const auto say = [](std::string_view what, double fraction) {
    if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{} {:3.0f} %", what, 100.0 * fraction);
  };
  const Clock::time_point begin = Clock::now();
  ASPERITY_TRY(const BrickFileSummary summary,
               write_brick_file(options.file, axes, SampleType::float32, options.kind, slab, say));
  fmt::print("\r{}: {:.2f} GB of samples, {:.2f} GB as {} bricks in {} levels, written in {:.0f} s\n", options.file,
             std::pow(options.nodes, 3) * 4e-9, static_cast<double>(summary.file_bytes) * 1e-9, summary.bricks,
             summary.levels, std::chrono::duration<double>(Clock::now() - begin).count());
  return success();
}

/// Takes the file's pages out of the system's cache, so that bricks come from the disk.
void drop_pages(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::posix_fadvise(descriptor, 0, 0, POSIX_FADV_DONTNEED);
  ::close(descriptor);
}

double process_megabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024.0;
  }
  return 0.0;
}

/// How often this thread has given the processor away to wait, or waited for a page.
std::size_t waits_so_far() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::size_t>(usage.ru_nvcsw + usage.ru_majflt);
}

double busy_microseconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e6 + static_cast<double>(time.tv_nsec) * 1e-3;
}

/// A walk on the isosurface at 0 of a formula: straight ahead on the surface, wandering, and back from the border.
class Walk {
 public:
  Walk(const VolumeFunction& function, const Vec3& extent, double speed)
      : function_(function), extent_(extent), step_(speed * tick), place_(0.4 * extent) {
    heading_ = Vec3(0.8, 0.5, 0.3);
    for (int n = 0; n < 50; ++n) settle();
    turn();
  }

  void advance() {
    wander_ += 0.2 * (rng_.below(2001) / 1000.0 - 1.0) - 0.02 * wander_;
    // Turning by at most a radian every few centimetres, whatever the speed.
    heading_ += heading_.cross(normal_) * (wander_ * step_ / 0.05);
    for (int a = 0; a < 3; ++a) {
      if (place_[a] < margin && heading_[a] < 0.0) heading_[a] = -heading_[a];
      if (place_[a] > extent_[a] - margin && heading_[a] > 0.0) heading_[a] = -heading_[a];
    }
    turn();
    place_ += step_ * heading_;
    settle();
  }

  /// So far below the surface (m).
  [[nodiscard]] Vec3 probe(double below) const { return place_ - below * normal_; }
  [[nodiscard]] Vec3 velocity() const { return heading_ * (step_ / tick); }

 private:
  void turn() {
    const Vec3 along = heading_ - heading_.dot(normal_) * normal_;
    heading_ = along.norm() > 1e-6 ? along.normalized() : normal_.unitOrthogonal();
  }
  /// Newton's steps back onto the surface. The inside is where values are high.
  void settle() {
    constexpr double h = 1e-6;
    Vec3 slope;
    for (int a = 0; a < 3; ++a) {
      const Vec3 off = h * Vec3::Unit(a);
      slope[a] = (function_.value(place_ + off) - function_.value(place_ - off)) / (2.0 * h);
    }
    const Vec3 back = function_.value(place_) / slope.squaredNorm() * slope;
    place_ -= back.norm() > 1e-3 ? Vec3(back.normalized() * 1e-3) : back;
    normal_ = -slope.normalized();
  }

  const VolumeFunction& function_;
  Vec3 extent_;
  double step_;
  Vec3 place_;
  Vec3 heading_ = Vec3::UnitX();
  Vec3 normal_ = Vec3::UnitZ();
  double wander_ = 0.0;
  Rng rng_{5};
};

Result<Outcome> touch(const Options& options, const VolumeFunction& function, const Vec3& extent, double speed) {
  BrickSettings settings;
  settings.resident_bytes = options.resident_megabytes << 20U;
  ASPERITY_TRY(std::unique_ptr<BrickStore> store, BrickStore::open(options.file, settings));
  const BrickStore& bricks = *store;
  const auto field = std::make_shared<const ScalarField>(std::move(store));
  ASPERITY_TRY(IsoSurface surface, IsoSurface::build(field, 0.0, Inside::high));
  std::vector<Instance> instances(1);
  instances[0].name = "isosurface";
  instances[0].surface = std::make_shared<const IsoSurface>(std::move(surface));
  ASPERITY_TRY(const Scene scene, Scene::build(std::move(instances), 0.0));

  Walk walk(function, extent, speed);
  ProxyState state;
  ProxyCache cache;
  Outcome outcome;
  const auto approach_ticks = static_cast<std::size_t>(approach / tick);
  const std::size_t ticks = approach_ticks + static_cast<std::size_t>(options.seconds / tick);
  outcome.microseconds.reserve(ticks);
  std::uint64_t read_before = 0;
  Clock::time_point next = Clock::now();
  for (std::size_t n = 0; n < ticks; ++n) {
    const bool walking = n >= approach_ticks;
    if (n == approach_ticks) read_before = bricks.traffic().bytes_read;
    ProbeSample probe;
    if (walking) walk.advance();
    // It comes from outside: the first half of the approach above the surface.
    const bool above = 2 * n < approach_ticks;
    probe.pose.position = walk.probe(above ? -depth : depth);
    if (walking) probe.twist.linear = walk.velocity();
    const std::size_t waits = waits_so_far();
    const double busy = busy_microseconds();
    const Clock::time_point begin = Clock::now();
    const ForceSample force = step(scene, state, cache, probe, Seconds(tick));
    const Clock::time_point end = Clock::now();
    if (walking) {
      ++outcome.ticks;
      outcome.longest_busy = std::max(outcome.longest_busy, busy_microseconds() - busy);
      outcome.waits += waits_so_far() - waits;
      outcome.coarse += force.flags.has(TickFlag::coarse_data) ? 1U : 0U;
      outcome.touching += force.flags.has(TickFlag::contact) ? 1U : 0U;
      outcome.microseconds.push_back(std::chrono::duration<double, std::micro>(end - begin).count());
    }
    next += std::chrono::microseconds(1000);
    outcome.late += end > next ? 1U : 0U;
    if (end > next + std::chrono::milliseconds(20)) next = end;  // the machine was away: no rush to make up for it
    std::this_thread::sleep_until(next);
  }
  ASPERITY_CHECK(bricks.status());
  outcome.megabytes_read = static_cast<double>(bricks.traffic().bytes_read - read_before) * 1e-6;
  outcome.slowest_milliseconds = bricks.traffic().slowest_read * 1e3;
  outcome.resident_megabytes = static_cast<double>(bricks.resident_bytes()) / 1048576.0;
  outcome.process_megabytes = process_megabytes();
  return outcome;
}

Result<int> run(const Options& options) {
  ASPERITY_TRY(const VolumeKind kind, parse_volume_kind(options.kind));
  const VolumeGenerator generator = generator_of(options, kind);
  ASPERITY_TRY(const VolumeFunction function, VolumeFunction::build(generator));
  if (!std::filesystem::exists(options.file)) ASPERITY_CHECK(write_volume(options, generator));
  constexpr const char* row = "{:>6} {:>7} {:>8} {:>9} {:>7} {:>8} {:>9} {:>9} {:>6} {:>7} {:>8} {:>7} {:>8} {:>6}\n";
  fmt::print(row, "speed", "ticks", "coarse", "touching", "p50", "p99.9", "longest", "busiest", "waits", "read",
             "slowest", "bricks", "process", "late");
  fmt::print(row, "m/s", "", "%", "%", "us", "us", "us", "us", "", "MB/s", "ms", "MiB", "MiB", "ticks");
  for (const double speed : options.speeds) {
    if (!options.warm) drop_pages(options.file);
    ASPERITY_TRY(Outcome outcome, touch(options, function, *completed(generator).extent, speed));
    std::sort(outcome.microseconds.begin(), outcome.microseconds.end());
    const auto at = [&](double share) {
      return outcome
          .microseconds[static_cast<std::size_t>(share * static_cast<double>(outcome.microseconds.size() - 1))];
    };
    const auto percent = [&](std::size_t count) {
      return 100.0 * static_cast<double>(count) / static_cast<double>(outcome.ticks);
    };
    fmt::print(
        "{:>6.2f} {:>7} {:>8.3f} {:>9.2f} {:>7.2f} {:>8.1f} {:>9.1f} {:>9.1f} {:>6} {:>7.1f} {:>8.1f} {:>7.1f} "
        "{:>8.1f} {:>6}\n",
        speed, outcome.ticks, percent(outcome.coarse), percent(outcome.touching), at(0.5), at(0.999), at(1.0),
        outcome.longest_busy, outcome.waits, outcome.megabytes_read / options.seconds, outcome.slowest_milliseconds,
        outcome.resident_megabytes, outcome.process_megabytes, outcome.late);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app{"Touches a bricked volume while it is read from disk, at 1 kHz in real time."};
    app.add_option("FILE", options.file, "The bricked volume (.aspvol); written first where there is none")->required();
    app.add_option("--kind", options.kind, "What is in it: gyroid, sphere, waves; its isosurface at 0 is touched");
    app.add_option("--nodes", options.nodes, "Along each axis: 1024 gives 4 GB");
    app.add_option("--resident", options.resident_megabytes, "Memory of the bricks (MiB)");
    app.add_option("--speeds", options.speeds, "Of the probe (m/s)");
    app.add_option("--seconds", options.seconds, "At each speed")->check(CLI::PositiveNumber);
    app.add_flag("--warm", options.warm, "Leave the file in the system's page cache");
    CLI11_PARSE(app, argc, argv);
    const Result<int> code = run(options);
    if (code) return *code;
    fmt::print(stderr, "brick_stream: {}\n", code.error().message());
  } catch (const std::exception& problem) {
    fmt::print(stderr, "brick_stream: {}\n", problem.what());
  }
  return 2;
}
