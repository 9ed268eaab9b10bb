// How long one haptic update takes, beside Embree's point query in the same run.

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <unistd.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "bench/rays_rows.h"
#include "bench/real_rows.h"
#include "bench/report.h"
#ifdef ASPERITY_HAS_OPENVDB
#include "asperity/io/vdb/vdb.h"
#endif
#ifdef ASPERITY_HAS_VTK
#include "asperity/io/vtk/vtk_volume.h"
#endif

namespace {

using namespace asperity;
using namespace asperity::bench;

struct Options {
  bool quick = false;
  bool check = false;
  bool json = false;
  std::string only;  ///< one kind of group; empty: all
  std::size_t updates = 100000;
  std::size_t cold_updates = 200;
  std::size_t counted = 0;  ///< ticks a row for a tool that counts; 0: timed
  RealEffort real;
  std::vector<double> radii = {0.0, 0.2, 0.5, 1.0, 3.0, 10.0};  ///< mm: of --only ball
};

void say(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<60}", what);
}

/// What is measured, and how large.
struct Sizes {
  Effort effort;
  std::vector<int> meshes = {3, 5, 6, 7, 8};
  std::vector<int> reliefs = {0, 3, 5, 6, 8};
  std::vector<std::uint32_t> volumes = {32, 64, 128, 256, 512};
  std::vector<int> potentials = {3, 4, 5, 6, 8};
  std::vector<int> fine = {3};
  std::vector<std::uint32_t> moved = {1000, 10000, 100000, 327000};
  int map_size = 1024;
};

bool asked(const Options& options, const char* kind) {
  return options.only.empty() || options.only == kind;
}

Sizes sizes_for(const Options& options) {
  Sizes sizes{.effort = {options.updates, options.cold_updates, 5}};
  if (options.quick) {
    sizes.effort = {std::min<std::size_t>(options.updates, 10000), std::min<std::size_t>(options.cold_updates, 10), 5};
    sizes.meshes = {3, 5, 6};
    sizes.reliefs = {0, 3, 6};
    sizes.volumes = {32, 64, 128};
    sizes.potentials = {3, 4, 5};
    sizes.moved = {1000, 10000};
    sizes.map_size = 256;
  }
  if (options.counted > 0) {
    // Under a tool that counts, everything is tens of times slower.
    sizes.effort = {std::max<std::size_t>(100, options.counted / 4), 0, 1, options.counted};
    sizes.meshes = {3, 5, 6};
    sizes.reliefs = {3};
    sizes.volumes = {64};
    sizes.potentials = {3};
    sizes.moved = {};
  }
  if (!asked(options, "mesh")) sizes.meshes.clear();
  if (!asked(options, "relief")) sizes.reliefs.clear();
  if (!asked(options, "volume")) sizes.volumes.clear();
  if (!asked(options, "potential")) sizes.potentials.clear();
  if (!asked(options, "fine")) sizes.fine.clear();
  if (!asked(options, "refit")) sizes.moved.clear();
  return sizes;
}

Status measure_ray_rows(const Options& options, Report& report) {
  RayEffort rays;
  if (options.quick) {
    rays.width = 60;
    rays.height = 40;
    rays.pictures = 2;
    rays.most_triangles = std::size_t{1} << 19U;
    rays.map_size = 64;
    rays.sphere_alone = true;
  }
  rays.data = options.real.data;
  rays.only = options.real.only;
  const auto told = [](std::string_view what) { fmt::print(stderr, "{}\n", what); };
  ASPERITY_TRY(report.rays, measure_rays(rays, report.clock_cost, told));
  if (options.only == "rays" && report.rays.empty())
    return bad_value("leaves no body to cast rays on", "--rows", "part of a name that a run without it prints");
  return success();
}

Status measure_all(const Options& options, Report& report) {
  const Sizes sizes = sizes_for(options);
  for (const int subdivisions : sizes.meshes) {
    say(fmt::format("icosphere of {} triangles", 20 << (2 * subdivisions)));
    ASPERITY_TRY(Group group, measure_mesh(subdivisions, sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  for (const int subdivisions : sizes.reliefs) {
    say(fmt::format("relief on {} triangles", 20 << (2 * subdivisions)));
    ASPERITY_TRY(Group group, measure_relief(subdivisions, sizes.map_size, sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  for (const std::uint32_t count : sizes.volumes) {
    say(fmt::format("volume of {}^3 samples", count));
    ASPERITY_TRY(Group group, measure_volume(count, sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  for (const int subdivisions : sizes.potentials) {
    say(fmt::format("potential of {} triangles", 20 << (2 * subdivisions)));
    ASPERITY_TRY(Group group, measure_potential(subdivisions, sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  for (const int subdivisions : sizes.fine) {
    say(fmt::format("texture and friction on {} triangles", 20 << (2 * subdivisions)));
    ASPERITY_TRY(Group group, measure_fine(subdivisions, sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  if (asked(options, "formula")) {
    say("spheres by formula");
    ASPERITY_TRY(Group group, measure_formula(sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  for (const std::uint32_t triangles : sizes.moved) {
    say(fmt::format("moving {} triangles", triangles));
    ASPERITY_TRY(Group group, measure_refit(triangles, sizes.effort, report.clock_cost));
    report.groups.push_back(std::move(group));
  }
  say("");
  say("\r");
  return asked(options, "rays") && options.counted == 0 ? measure_ray_rows(options, report) : success();
}

/// The counted rows one a line in the order in which they ran, for scripts/instructions. Answers the exit code.
int say_counted(const std::vector<Group>& groups, std::size_t ticks) {
  if (groups.empty()) {
    fmt::print(stderr, "latency: rows of this kind are no ticks, and are not counted\n");
    return 2;
  }
  int code = 0;
  for (const Group& group : groups) {
    for (const RowResult& row : group.rows) {
      fmt::print("{} of {}\t{}\t{}\n", group.kind, group.size(), row.name, ticks);
      if (row.answered_share >= 0.99) continue;
      fmt::print(stderr, "latency: {} on {} answered only {:.1f} % of its updates\n", row.name, group.size(),
                 100.0 * row.answered_share);
      code = 1;
    }
  }
  return code;
}

int run_real(const Options& options) {
  if (!std::filesystem::is_directory(options.real.data)) {
    fmt::print(stderr, "latency: {} is no folder; accepted: --data with meshes, textures and volumes in it\n",
               options.real.data.string());
    return 2;
  }
#ifdef ASPERITY_HAS_VTK
  register_vtk_volumes();
#endif
#ifdef ASPERITY_HAS_OPENVDB
  register_vdb();
#endif
  const Result<std::vector<RealRow>> rows =
      measure_real(options.real, clock_cost_ns(), [](std::string_view what) { fmt::print(stderr, "{}\n", what); });
  if (!rows) {
    fmt::print(stderr, "latency: {}\n", rows.error().message());
    return 2;
  }
  if (rows->empty() && !options.real.only.empty()) {
    fmt::print(stderr,
               "latency: --rows leaves none; accepted: part of a \"body, stroke, law\" that a run without it prints\n");
    return 2;
  }
  fmt::print("{}", real_text(*rows));
  return 0;
}

int run(const Options& options, const std::string& command) {
  Report report;
  report.command = command;
  report.machine = machine_name();
  report.date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::time(nullptr)));
  report.clock_cost = clock_cost_ns();
  if (const Status status = measure_all(options, report); !status) {
    fmt::print(stderr, "latency: {}\n", status.error().message());
    return 2;
  }
  if (options.counted > 0) return say_counted(report.groups, options.counted);
  fmt::print("{}\n", options.json ? report.json() : report.text());
  if (!options.check) return 0;
  const std::vector<std::string> failures = report.failures();
  for (const std::string& failure : failures) fmt::print(stderr, "latency: {}\n", failure);
  return failures.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    CLI::App app{
        "Measures how long one haptic update takes, warm and with cold caches, beside Embree's point query in the same "
        "run."};
    Options options;
    app.add_flag("--quick", options.quick, "Smaller meshes and fewer updates, some seconds in all");
    app.add_flag("--check", options.check,
                 "Exit with 1 when a row does not answer or a ratio is far beyond what is owed");
    app.add_flag("--json", options.json, "Print JSON in place of the table");
    app.add_option("--only", options.only,
                   "One kind of rows: mesh, relief, volume, potential, fine, formula, refit, rays, real or ball")
        ->check(CLI::IsMember(
            {"mesh", "relief", "volume", "potential", "fine", "formula", "refit", "rays", "real", "ball"}));
    app.add_option("--data", options.real.data, "real, ball, rays: folder of meshes, textures and volumes")
        ->capture_default_str();
    app.add_option("--passes", options.real.passes,
                   "real, ball: times that each tick is timed, of which the least counts")
        ->check(CLI::Range(1, 100));
    app.add_option("--ticks", options.real.ticks, "real, ball: ticks a row")
        ->check(CLI::Range(100, 100000000))
        ->capture_default_str();
    app.add_option("--rows", options.real.only,
                   "real, ball: rows whose \"body, stroke, law\" holds this text; rays: whose body does");
    app.add_flag_callback(
        "--long", [&] { options.real.ticks = 1000000; }, "real, ball: a million ticks a row");
    app.add_option("--budget", options.real.budget, "real, ball: of a tick, in evaluations; 0: no limit");
    app.add_flag("--every", options.real.every, "real, ball: every pair of strokes and laws");
    const CLI::Option* const radii =
        app.add_option("--radii", options.radii, "ball: of the probe (mm)")->check(CLI::Range(0.0, 100.0));
    app.add_option("--updates", options.updates, "Warm updates a row")
        ->check(CLI::Range(100, 100000000))
        ->capture_default_str();
    app.add_option("--cold-updates", options.cold_updates, "Cold updates a row; each sweeps 64 MB first")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    app.add_option("--count", options.counted,
                   "No times: take every row so many ticks through asperity_counted_ticks, for scripts/instructions")
        ->check(CLI::Range(1, 1000000))
        ->excludes("--quick", "--check", "--json", "--updates", "--cold-updates");
    app.footer("Exit codes: 0 success, 1 a check does not hold, 2 bad input or usage.");
    std::string command = "latency";
    for (int i = 1; i < argc; ++i) command += std::string(" ") + argv[i];
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& problem) {
      return app.exit(problem) == 0 ? 0 : 2;
    }
    if (radii->count() > 0 && options.only != "ball") {
      fmt::print(stderr, "latency: --radii is of --only ball alone\n");
      return 2;
    }
    if (options.only == "ball") {
      for (const double radius : options.radii) options.real.radii.push_back(1e-3 * radius);
    }
    return options.only == "real" || options.only == "ball" ? run_real(options) : run(options, command);
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "latency: %s\n", problem.what());
    return 2;
  }
}
