#include "bench/real_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "asperity/core/rng.h"
#include "asperity/io/experiment.h"
#include "asperity/render/step.h"
#include "bench/embree_peer.h"

namespace asperity::bench {

namespace {

constexpr double dt = 1e-3;  // s
// Of bare meshes: what a tracker that knows the last distance would search within (m), and how often each tick is
// timed.
constexpr double peer_bound = 3e-3;
constexpr int peer_passes = 5;
constexpr const char* bare_body = ", bare";
constexpr const char* bare_law = "god-object";
constexpr const char* peer_law = "Embree, 3 mm start radius";

// ---- bodies

struct Body {
  std::string name;
  std::string surface;  ///< of a scene, as JSON
  std::string coat;     ///< of that, as JSON; empty: none
  std::string file;     ///< that has to be there, under the data's folder; empty: none
  bool volume = false;
  double highest = 0.0;  ///< m, of its relief
  bool bare = false;     ///< a mesh without a coat, beside Embree
};

std::vector<Body> bodies() {
  struct Mesh {
    const char* name;
    const char* file;
  };
  struct Map {
    const char* name;
    const char* file;
  };
  const Mesh meshes[] = {{"bunny-28k", "meshes/bunny-28k.obj"},
                         {"spot", "meshes/spot.obj"},
                         {"FlightHelmet", "meshes/FlightHelmet/FlightHelmet.gltf"}};
  const Map maps[] = {{"rock023", "textures/ambientcg/rock023_alb_ht.png"},
                      {"wool", "textures/godot/wool_depth.png"},
                      {"texture_rock", "textures/godot/texture_rock_depth.png"},
                      {"stones", "textures/exr-height/stones.exr"}};
  std::vector<Body> all;
  for (const Mesh& mesh : meshes) {
    for (const Map& map : maps) {
      for (const double height : {0.3, 1.0, 2.0}) {
        const std::string coat = fmt::format(R"({{"height_map":"{}","height":"{:g} mm"}})", map.file, height);
        all.push_back({fmt::format("{}, {}, {:g} mm", mesh.name, map.name, height),
                       fmt::format(R"({{"mesh":"{}","coat":{}}})", mesh.file, coat), coat, mesh.file, false,
                       1e-3 * height});
      }
    }
  }
  for (const Mesh& mesh : meshes) {
    all.push_back({mesh.name + std::string(bare_body), fmt::format(R"({{"mesh":"{}"}})", mesh.file), "", mesh.file,
                   false, 0.0, true});
  }
  all.push_back({"vase", R"({"volume":"volumes/vase.vti"})", "", "volumes/vase.vti", true, 0.0});
  all.push_back({"carotid", R"({"volume":"volumes/carotid.vtk"})", "", "volumes/carotid.vtk", true, 0.0});
  all.push_back({"cavity", R"({"volume":{"generator":"cavity","derive":"vorticity_magnitude"}})", "", "", true, 0.0});
  all.push_back({"bunny, potential", R"({"mesh":"meshes/bunny-28k.obj","implicit":{"resolution":128}})", "",
                 "meshes/bunny-28k.obj", true, 0.0});
  return all;
}

// ---- strokes

/// Led over what carries a surface: places on it, with its outward normal there.
class Carrier {
 public:
  explicit Carrier(const Instance& instance) : surface_(instance.surface) {
    if (const MeshSurface* base = base_of(surface_); base != nullptr && iso_of(surface_) == nullptr) {
      bounds_ = base->bounds();
      grain_ = base->mesh().mean_edge();
    } else {
      bounds_ = iso_of(surface_)->surface_bounds();
      grain_ = 0.01 * bounds_.diagonal();
    }
  }
  [[nodiscard]] const Box& bounds() const { return bounds_; }
  [[nodiscard]] double grain() const { return grain_; }

  struct Spot {
    Vec3 point;
    Vec3 normal;
  };
  Spot nearest(const Vec3& p) {
    const auto ask = [&](const auto& view) {
      const Foot foot = view.nearest(p, infinity);
      return foot.found() ? Spot{foot.point, view.front(foot)} : Spot{p, Vec3::UnitZ()};
    };
    if (const MeshSurface* base = base_of(surface_); base != nullptr && iso_of(surface_) == nullptr)
      return ask(base->view(cache_));
    const IsoSurface& iso = *iso_of(surface_);
    iso.field().enter();
    const Spot spot = ask(iso.view(cache_.cells, iso.field().levels() - 1, iso.threshold()));
    iso.field().leave();
    return spot;
  }

 private:
  Surface surface_;
  SurfaceCache cache_;
  Box bounds_;
  double grain_ = 0.0;
};

const char* const real_strokes[] = {"line",        "raster",    "spiral",      "walk with slips",
                                    "pokes 2 m/s", "sweep 0.5", "sweep 5 m/s", "free flight"};

// Rows of two surfaces, one of them a wall.
constexpr const char* beside_wall = "beside a wall";
constexpr const char* beside_relief = "beside a relief";

/// Where the wall of the rows with one stands.
double wall_at(const Box& bounds) {
  return bounds.centre().x() + 0.05 * bounds.extent().x();
}

/// What a stroke does in one tick.
struct Motion {
  double speed = 0.01;  ///< m/s
  double depth = 1e-3;  ///< m
  double turn = 0.0;    ///< rad/s
};

Motion motion_of(const std::string& stroke, std::size_t tick, double highest, Rng& rng) {
  const double time = dt * static_cast<double>(tick);
  Motion motion{.turn = 0.3 * std::sin(0.7 * time)};
  if (stroke == "raster") {
    motion.speed = 0.05;
    motion.depth = 0.5e-3;
    // To and fro over 10 mm, with a turn of half a circle in 20 ticks.
    if (tick % 200 < 20) motion.turn = std::numbers::pi / (20.0 * dt) * (tick / 200 % 2 == 0 ? 1.0 : -1.0);
  } else if (stroke == "spiral") {
    motion.speed = 0.1;
    motion.depth = 0.7e-3;
    motion.turn = motion.speed / (1e-3 + 2e-3 * std::fmod(time, 5.0));
  } else if (stroke == "walk with slips") {
    motion.speed = 0.1 * (1.0 + std::sin(3.1 * time));
    motion.depth = 0.5e-3 + 1e-3 * std::sin(11.0 * time);
    motion.turn = 40.0 * rng.uniform(-1.0, 1.0);
  } else if (stroke == "pokes 2 m/s") {
    motion.speed = 0.02;
    // Down from 4 mm above by 2 mm a tick to 4 mm below, held for a while, and up again.
    const std::size_t step = tick % 40;
    const auto in = static_cast<double>(step);
    const double down = step < 5 ? 2e-3 * in : (step < 35 ? 8e-3 : 2e-3 * (39.0 - in));
    motion.depth = down - 4e-3;
  } else if (stroke == "sweep 0.5") {
    motion.speed = 0.5;
    motion.depth = 0.7e-3;
  } else if (stroke == "sweep 5 m/s") {
    motion.speed = 5.0;
  } else if (stroke == "free flight") {
    motion.speed = 0.05;
    motion.depth = -highest - 1e-3;
  }
  return motion;
}

/// Where the probe is at each tick. Places move along the carrier; the normal that depths are measured by follows
/// slowly, so that facets are not felt in the probe's own path. Depths are those of a ball's lowest point.
std::vector<Vec3> led(const std::string& stroke, Carrier& carrier, double highest, double radius, std::size_t ticks,
                      std::uint64_t seed, bool across_wall) {
  Rng rng(seed);
  std::vector<Vec3> path;
  path.reserve(ticks);
  const Box& bounds = carrier.bounds();
  const auto random_spot = [&] {
    Vec3 p = bounds.centre();
    for (int axis = 0; axis < 3; ++axis) p[axis] += rng.uniform(-0.5, 0.5) * bounds.extent()[axis];
    return carrier.nearest(p);
  };
  // Across a wall it goes to and fro through it.
  const auto begin = [&] {
    if (!across_wall) return random_spot();
    Vec3 p = random_spot().point;
    p.x() = wall_at(bounds);
    return carrier.nearest(p);
  };
  Carrier::Spot spot = begin();
  Vec3 normal = spot.normal;
  Vec3 heading = normal.unitOrthogonal();
  if (across_wall) heading = (Vec3::UnitX() - normal.x() * normal).normalized();
  constexpr int most_stuck = 50;
  constexpr double approach = 100.0;  // ticks
  int stuck = 0;
  std::size_t begun = 0;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const auto [speed, depth, turn] = motion_of(stroke, tick, highest, rng);
    heading = std::cos(turn * dt) * heading + std::sin(turn * dt) * normal.cross(heading);
    const Carrier::Spot next = carrier.nearest(spot.point + speed * dt * heading);
    // At a rim, or in a fold that it does not leave: another way; in the end somewhere else, from above.
    if ((next.point - spot.point).norm() < 0.2 * speed * dt) {
      const double angle = rng.uniform(0.5, 1.5) * std::numbers::pi;
      heading = std::cos(angle) * heading + std::sin(angle) * normal.cross(heading);
      if (++stuck > most_stuck) {
        stuck = 0;
        spot = begin();
        normal = spot.normal;
        begun = tick;
      }
    } else {
      stuck = 0;
      spot = next;
    }
    const double share = std::min(1.0, speed * dt / (2.0 * carrier.grain()));
    normal = (normal + share * (spot.normal - normal)).normalized();
    heading = (heading - heading.dot(normal) * normal).normalized();
    if (!heading.allFinite()) heading = normal.unitOrthogonal();
    // It comes down from above.
    const double down = std::min(1.0, static_cast<double>(tick - begun) / approach);
    path.push_back(spot.point + (radius - down * depth + (1.0 - down) * (highest + 1e-3)) * normal);
  }
  return path;
}

/// A plane across the middle of the bounds, as a wall.
Result<Instance> wall_through(const Box& bounds) {
  const double size = 2.0 * bounds.diagonal();
  MeshSource source;
  Vec3 middle = bounds.centre();
  middle.x() = wall_at(bounds);
  for (const double y : {-0.5, 0.5}) {
    for (const double z : {-0.5, 0.5}) source.positions.push_back(middle + size * Vec3(0.0, y, z));
  }
  source.triangles = {{0, 2, 1}, {1, 2, 3}};
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(std::move(source)));
  Instance wall;
  wall.name = "wall";
  wall.surface = std::make_shared<const MeshSurface>(TriangleIndex::build(std::move(mesh)));
  wall.sides = Sides::both;
  return wall;
}

/// The same wall in a body's coat.
Result<Instance> relief_through(const Box& bounds, const Body& body, const std::filesystem::path& data) {
  const double size = 2.0 * bounds.diagonal();
  const Vec3 middle = bounds.centre();
  std::string coat = body.coat;
  coat.pop_back();
  coat += fmt::format(R"(,"mapping":"triplanar","tile":{}}})", 0.25 * bounds.diagonal());
  const std::string scene =
      fmt::format(R"({{"surfaces":[{{"mesh":{{"generator":"plane","columns":32,"rows":32,"width":{0},"depth":{0}}},)"
                  R"("pose":{{"position":[{1},{2},{3}],"axis":[0,1,0],"angle":"90 deg"}},"coat":{4}}}]}})",
                  size, wall_at(bounds), middle.y(), middle.z(), coat);
  ASPERITY_TRY(const Experiment experiment, parse_experiment(scene, data, "wall"));
  return experiment.scene.instances().front();
}

// ---- rows

/// A probe that is led along a path over a scene, tick by tick.
struct LedProbe {
  const Scene& scene;
  const std::vector<Vec3>& path;
  ProxyState state = {};
  ProxyCache cache = ProxyCache(scene);

  [[nodiscard]] ProbeSample probe(std::size_t tick) const {
    ProbeSample probe;
    probe.twist.linear = tick > 0 ? Vec3((path[tick] - path[tick - 1]) / dt) : Vec3(Vec3::Zero());
    probe.pose.position = path[tick];
    probe.time = Seconds(dt * static_cast<double>(tick));
    return probe;
  }
  ForceSample go(std::size_t tick) { return step(scene, state, cache, probe(tick), Seconds(dt)); }
};

/// What the ticks were like, whatever they took.
void count(const Scene& scene, const std::vector<Vec3>& path, RealRow& row) {
  LedProbe led{scene, path};
  std::vector<std::uint32_t> work;
  work.reserve(path.size());
  Vec3 last_force = Vec3::Zero();
  std::size_t touched = 0;
  for (std::size_t tick = 0; tick < path.size(); ++tick) {
    const ForceSample felt = led.go(tick);
    touched += felt.flags.has(TickFlag::contact) ? 1U : 0U;
    work.push_back(led.cache.work().done().sum());
    row.open += felt.flags.has(TickFlag::work_left) ? 1U : 0U;
    row.longest_open = std::max(row.longest_open, led.state.open_ticks);
    row.not_converged += felt.flags.has(TickFlag::not_converged) ? 1U : 0U;
    row.limited += felt.flags.has(TickFlag::energy_limited) ? 1U : 0U;
    if (tick > 0) row.largest_jump = std::max(row.largest_jump, (felt.wrench.force - last_force).norm());
    last_force = felt.wrench.force;
  }
  std::sort(work.begin(), work.end());
  row.work_p999 = work[std::min(work.size() - 1, work.size() * 999 / 1000)];
  row.work_max = work.back();
  row.contact_share = static_cast<double>(touched) / static_cast<double>(path.size());
}

/// A tick from its state, caches empty and cold, the least of 20 times: what the machine does meanwhile meets each of
/// these alike, and the least of them hardly at all.
double time_again(const Scene& scene, const std::vector<Vec3>& path, std::size_t tick, double clock_cost) {
  LedProbe led{scene, path};
  for (std::size_t before = 0; before < tick; ++before) led.go(before);
  const ProxyState from = led.state;
  double least = infinity;
  CacheSweep sweep;
  for (int i = 0; i < 20; ++i) {
    LedProbe again{scene, path, from};
    sweep.run();
    const Clock::time_point start = Clock::now();
    again.go(tick);
    least = std::min(least, std::chrono::duration<double, std::nano>(Clock::now() - start).count() - clock_cost);
  }
  return least;
}

/// Of each tick the least of several passes, which what else the machine does meets hardly ever: `start` begins a pass,
/// update(tick) answers whether it touched or found something.
template <class Start, class Update>
std::size_t run_passes(std::size_t ticks, int passes, double clock_cost, const Start& start, const Update& update,
                       RealRow& row) {
  std::vector<Clock::duration> least(ticks, Clock::duration::max());
  std::vector<std::uint8_t> answered(ticks, 0);
  for (int pass = 0; pass < passes; ++pass) {
    start();
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      const Clock::time_point began = Clock::now();
      answered[tick] = update(tick) ? 1 : 0;
      least[tick] = std::min(least[tick], Clock::now() - began);
    }
  }
  Samples samples;
  samples.reserve(ticks);
  for (std::size_t tick = 0; tick < ticks; ++tick) samples.add(least[tick], answered[tick] != 0);
  row.times = samples.summary(clock_cost);
  row.worst_again = row.times.max;
  row.contact_share = samples.answered_share();
  return static_cast<std::size_t>(std::max_element(least.begin(), least.end()) - least.begin());
}

/// By a law, over any body.
void run(const Scene& scene, const std::vector<Vec3>& path, int passes, double clock_cost, RealRow& row) {
  LedProbe led{scene, path};
  const auto start = [&] {
    led.state = {};
    led.cache = ProxyCache(scene);
  };
  const auto update = [&](std::size_t tick) { return led.go(tick).flags.has(TickFlag::contact); };
  const std::size_t slowest = run_passes(path.size(), passes, clock_cost, start, update, row);
  count(scene, path, row);
  row.worst_again = time_again(scene, path, slowest, clock_cost);
}

/// A bare mesh by the god-object, and Embree's point query at the same places.
void run_bare(const Scene& scene, const std::vector<Vec3>& path, double clock_cost, RealRow& row) {
  if (row.law == peer_law) {
    const EmbreePeer peer(base_of(scene.instances().front().surface)->mesh());
    run_passes(
        path.size(), peer_passes, clock_cost, [] {},
        [&](std::size_t tick) { return std::isfinite(peer.closest(path[tick], peer_bound)); }, row);
    return;
  }
  LedProbe led{scene, path};
  const auto start = [&] {
    led.state = {};
    led.cache = ProxyCache(scene);
    row.not_converged = 0;
  };
  const auto update = [&](std::size_t tick) {
    const ForceSample felt = led.go(tick);
    row.not_converged += felt.flags.has(TickFlag::not_converged) ? 1U : 0U;
    return felt.flags.has(TickFlag::contact);
  };
  run_passes(path.size(), peer_passes, clock_cost, start, update, row);
}

/// What goes with a body.
std::vector<std::string> laws_for(const Body& body, bool balls) {
  if (body.bare && balls) return {bare_law};
  if (balls) return {"proxy", "proxy, friction"};
  if (body.name == "bunny, potential") return {"proxy", "virtual-contact-point", "magnetic"};
  if (body.bare) return {bare_law, peer_law};
  if (body.volume) return {"proxy", "cross-uncross", "avila"};
  return {"proxy",         "proxy, friction",       "god-object", "force-shading", "height-field",
          "mesostructure", "mesostructure-intended"};
}

Result<Experiment> read(const Body& body, const std::string& law, const std::filesystem::path& data) {
  std::string surface = body.surface;
  surface.pop_back();
  const bool friction = law == "proxy, friction";
  const char* const other = law == peer_law ? bare_law : law.c_str();
  surface += fmt::format(R"(,"law":"{}")", friction ? "proxy" : other);
  if (friction) surface += R"(,"material":{"static_friction":0.4,"dynamic_friction":0.3})";
  const std::string scene = fmt::format(R"({{"surfaces":[{}}}]}})", surface);
  return parse_experiment(scene, data, body.name);
}

/// A stroke and a law.
using Pair = std::pair<std::string, std::string>;

/// Of the body with this number. Every stroke by one law at least, the proxy by every second; so that all pairs of
/// strokes and laws come up.
std::vector<Pair> pairs_of(const Body& body, std::size_t number, bool balls, bool every) {
  const std::vector<std::string> laws = laws_for(body, balls);
  std::vector<Pair> pairs;
  for (std::size_t s = 0; s < std::size(real_strokes); ++s) {
    if (every || body.bare) {
      for (const std::string& law : laws) pairs.emplace_back(real_strokes[s], law);
    } else if (balls) {
      pairs.emplace_back(real_strokes[s], laws[(number + s) % laws.size()]);
    } else {
      if ((number + s) % 2 == 0) pairs.emplace_back(real_strokes[s], "proxy");
      if ((number + s) % 3 == 0) pairs.emplace_back(real_strokes[s], laws[1 + (number + s / 3) % (laws.size() - 1)]);
    }
  }
  if (!body.bare) pairs.emplace_back(beside_wall, "proxy");
  if (balls && !body.coat.empty()) pairs.emplace_back(beside_relief, "proxy");
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return pairs;
}

/// Of a body as an experiment's scene holds it.
Status measure_row(const Body& body, const Experiment& experiment, const RealEffort& effort, double clock_cost,
                   RealRow& row) {
  const std::span<const Instance> read_instances = experiment.scene.instances();
  std::vector<Instance> instances(read_instances.begin(), read_instances.end());
  Carrier carrier(instances.front());
  std::string led_as = row.stroke;
  if (row.stroke == beside_wall || row.stroke == beside_relief) {
    const bool plain = row.stroke == beside_wall;
    ASPERITY_TRY(Instance wall,
                 plain ? wall_through(carrier.bounds()) : relief_through(carrier.bounds(), body, effort.data));
    instances.push_back(std::move(wall));
    led_as = "raster";
  }
  SceneSettings settings;
  settings.budget = effort.budget;
  settings.probe_radius = row.radius;
  ASPERITY_TRY(const Scene scene, Scene::build(std::move(instances), settings));
  const std::vector<Vec3> path = led(led_as, carrier, body.highest, row.radius, effort.ticks, 17, led_as != row.stroke);
  if (body.bare) {
    run_bare(scene, path, clock_cost, row);
  } else {
    run(scene, path, effort.passes, clock_cost, row);
  }
  return success();
}

}  // namespace

Result<std::vector<RealRow>> measure_real(const RealEffort& effort, double clock_cost,
                                          const std::function<void(std::string_view)>& told) {
  const bool balls = !effort.radii.empty();
  const std::vector<double> radii = balls ? effort.radii : std::vector<double>{0.0};
  std::vector<RealRow> rows;
  std::size_t number = 0;
  for (const Body& body : bodies()) {
    if (!body.file.empty() && !std::filesystem::exists(effort.data / body.file)) {
      told(fmt::format("{}: skipped, {} is not there", body.name, (effort.data / body.file).string()));
      continue;
    }
    const std::vector<Pair> pairs = pairs_of(body, number, balls, effort.every);
    // Rows of the others stay the same.
    if (!body.bare) ++number;
    std::optional<Experiment> read_by;
    std::string last_law;
    for (const auto& [stroke, law] : pairs) {
      if (!effort.only.empty() &&
          fmt::format("{}, {}, {}", body.name, stroke, law).find(effort.only) == std::string::npos)
        continue;
      if (!read_by || last_law != law) {
        ASPERITY_TRY(read_by, read(body, law, effort.data));
        last_law = law;
      }
      for (const double radius : radii) {
        RealRow row;
        row.body = body.name;
        row.stroke = stroke;
        row.law = law;
        row.radius = radius;
        if (const Status done = measure_row(body, *read_by, effort, clock_cost, row); !done) return done.error();
        told(fmt::format("{}, {}, {}{}: p50 {:.2f} us, p99.9 {:.1f}, worst {:.1f} us again {:.1f}", body.name, stroke,
                         law, balls ? fmt::format(", {:g} mm", 1e3 * radius) : "", 1e-3 * row.times.p50,
                         1e-3 * row.times.p999, 1e-3 * row.times.max, 1e-3 * row.worst_again));
        rows.push_back(std::move(row));
      }
    }
  }
  return rows;
}

namespace {

/// Rows that keep what is owed.
struct Kept {
  std::size_t rows = 0;
  std::size_t p999 = 0;   ///< of them, by this
  std::size_t worst = 0;  ///< and by their slowest tick
  double dearest_p999 = 0.0;
  double dearest = 0.0;
  std::size_t not_converged = 0;  ///< ticks

  void add(const RealRow& row, double most_p999, double most) {
    ++rows;
    p999 += row.times.p999 <= most_p999 ? 1U : 0U;
    worst += row.worst_again <= most ? 1U : 0U;
    dearest_p999 = std::max(dearest_p999, row.times.p999);
    dearest = std::max(dearest, row.worst_again);
    not_converged += row.not_converged;
  }
};

/// How many rows keep what is owed: p99.9 and the slowest tick (us), of strokes at 5 m/s more.
std::string sum_up(const std::string& of, const std::vector<RealRow>& rows) {
  Kept kept;
  std::size_t open = 0;
  std::uint32_t longest = 0;
  for (const RealRow& row : rows) {
    if (!row.body.starts_with(of) || row.body.find(bare_body) != std::string::npos) continue;
    const bool fast = row.stroke == "sweep 5 m/s";
    kept.add(row, fast ? 50e3 : 20e3, fast ? 200e3 : 100e3);
    open += row.open;
    longest = std::max(longest, row.longest_open);
  }
  if (kept.rows == 0) return {};
  return fmt::format("{:<16} {:>5} {:>12} {:>14.1f} {:>13} {:>14.1f} {:>8} {:>8} {:>8}\n", of.empty() ? "all" : of,
                     kept.rows, kept.p999, 1e-3 * kept.dearest_p999, kept.worst, 1e-3 * kept.dearest,
                     kept.not_converged, open, longest);
}

constexpr const char* bodies_of_sums[] = {"bunny-28k", "spot",   "FlightHelmet",     "vase",
                                          "carotid",   "cavity", "bunny, potential", ""};

/// Of balls of each radius on each kind of body: how often a tick is late, and the median beside that of the same row
/// by a point.
std::string beside_points(const std::vector<RealRow>& rows) {
  constexpr double most_p999 = 50e3;  // ns
  constexpr double most = 200e3;
  std::string text = fmt::format("Rows in time: p99.9 at most {:g} us, the slowest tick {:g} us.\n{:<16} {:>9} {:>5} ",
                                 1e-3 * most_p999, 1e-3 * most, "body", "radius mm", "rows");
  text += fmt::format("{:>12} {:>12} {:>12} {:>14} {:>13} {:>14} {:>8} {:>8}\n", "median p50", "dearest p50",
                      "median/point", "dearest p99.9", "p99.9 kept", "dearest tick", "kept", "not c.");
  std::vector<double> radii;
  for (const RealRow& row : rows) {
    if (std::find(radii.begin(), radii.end(), row.radius) == radii.end()) radii.push_back(row.radius);
  }
  for (const std::string of : bodies_of_sums) {
    for (const double radius : radii) {
      Kept kept;
      std::vector<double> p50;
      std::vector<double> ratio;
      for (const RealRow& row : rows) {
        if (row.radius != radius || !row.body.starts_with(of)) continue;
        const auto point = std::find_if(rows.begin(), rows.end(), [&](const RealRow& one) {
          return one.radius == 0.0 && one.body == row.body && one.stroke == row.stroke && one.law == row.law;
        });
        kept.add(row, most_p999, most);
        p50.push_back(row.times.p50);
        if (point != rows.end()) ratio.push_back(row.times.p50 / std::max(1.0, point->times.p50));
      }
      if (kept.rows == 0) continue;
      std::sort(p50.begin(), p50.end());
      std::sort(ratio.begin(), ratio.end());
      text += fmt::format("{:<16} {:>9g} {:>5} {:>12.2f} {:>12.2f} {:>12} {:>14.1f} {:>13} {:>14.1f} {:>8} {:>8}\n",
                          of.empty() ? "all" : of, 1e3 * radius, kept.rows, 1e-3 * p50[p50.size() / 2],
                          1e-3 * p50.back(), ratio.empty() ? "-" : fmt::format("{:.2f}", ratio[ratio.size() / 2]),
                          1e-3 * kept.dearest_p999, kept.p999, 1e-3 * kept.dearest, kept.worst, kept.not_converged);
    }
  }
  return text;
}

/// Two surfaces at once beside the same body alone, each median over the dearer of its own: that of the body.
std::string beside_singles(const std::vector<RealRow>& rows) {
  constexpr double owed = 3.0;
  std::string text;
  for (const char* const stroke : {beside_wall, beside_relief}) {
    for (const bool point : {true, false}) {
      std::vector<double> ratio;
      std::size_t kept = 0;
      for (const RealRow& both : rows) {
        if (both.stroke != stroke || (both.radius == 0.0) != point) continue;
        const auto alone = std::find_if(rows.begin(), rows.end(), [&](const RealRow& row) {
          return row.body == both.body && row.radius == both.radius && row.stroke == "raster";
        });
        if (alone == rows.end()) continue;
        ratio.push_back(both.times.p50 / std::max(1.0, alone->times.p50));
        kept += ratio.back() <= owed ? 1U : 0U;
      }
      if (ratio.empty()) continue;
      std::sort(ratio.begin(), ratio.end());
      text += fmt::format("{:<16} {:<6} {:>5} {:>12.2f} {:>12.2f} {:>8}\n", stroke, point ? "point" : "ball",
                          ratio.size(), ratio[ratio.size() / 2], ratio.back(), kept);
    }
  }
  if (text.empty()) return text;
  return fmt::format(
             "\nTwo surfaces, p50 over that of the body alone (raster), owed {:g}:\n{:<16} {:<6} {:>5} {:>12} "
             "{:>12} {:>8}\n",
             owed, "stroke", "probe", "rows", "median", "dearest", "kept") +
         text;
}

/// Bare meshes: the god-object's p99.9 against Embree's.
std::string beside_embree(const std::vector<RealRow>& rows) {
  std::string text;
  for (const RealRow& ours : rows) {
    if (ours.law != bare_law) continue;
    const auto theirs = std::find_if(rows.begin(), rows.end(), [&](const RealRow& row) {
      return row.law == peer_law && row.body == ours.body && row.stroke == ours.stroke;
    });
    if (theirs == rows.end()) continue;
    text += fmt::format("{:<32} {:<16} {:>9.2f} {:>9.2f} {:>6.2f}\n", ours.body, ours.stroke, 1e-3 * ours.times.p999,
                        1e-3 * theirs->times.p999, ours.times.p999 / theirs->times.p999);
  }
  if (text.empty()) return text;
  return fmt::format("\nBare meshes, p99.9 of each tick's least of {} passes, us:\n{:<32} {:<16} {:>9} {:>9} {:>6}\n",
                     peer_passes, "body", "stroke", "god-obj.", "Embree", "ratio") +
         text;
}

}  // namespace

std::string real_text(const std::vector<RealRow>& rows) {
  const bool balls = std::any_of(rows.begin(), rows.end(), [](const RealRow& row) { return row.radius > 0.0; });
  std::string text = fmt::format(
      "{:<32} {:<16} {:<24} {:>7} {:>8} {:>9} {:>9} {:>9} {:>6} {:>6} {:>5} {:>6} {:>6} {:>5} {:>6} {:>6}\n", "body",
      "stroke", balls ? "law, radius" : "law", "p50 us", "p99", "p99.9", "max", "worst*", "w99.9", "w max", "in %",
      "not c.", "open", "run", "e.lim.", "jump N");
  for (const RealRow& row : rows) {
    text += fmt::format(
        "{:<32} {:<16} {:<24} {:>7.2f} {:>8.2f} {:>9.2f} {:>9.1f} {:>9.1f} {:>6} {:>6} {:>5.0f} {:>6} {:>6} {:>5} "
        "{:>6} {:>6.2f}\n",
        row.body, row.stroke, balls ? fmt::format("{}, {:g} mm", row.law, 1e3 * row.radius) : row.law,
        1e-3 * row.times.p50, 1e-3 * row.times.p99, 1e-3 * row.times.p999, 1e-3 * row.times.max, 1e-3 * row.worst_again,
        row.work_p999, row.work_max, 100.0 * row.contact_share, row.not_converged, row.open, row.longest_open,
        row.limited, row.largest_jump);
  }
  text +=
      "p50 to max: of each tick the least of some passes. * the slowest tick again from its state, caches empty and 64 "
      "MB swept before: the least of 20 times. w: work, "
      "in evaluations. open: "
      "ticks whose budget was spent, run: one after the other.\n\n";
  if (balls) return text + beside_points(rows) + beside_singles(rows);
  text += "Rows in time: p99.9 at most 20 us, the slowest tick 100 us; at 5 m/s 50 and 200 us.\n";
  text += fmt::format("{:<16} {:>5} {:>12} {:>14} {:>13} {:>14} {:>8} {:>8} {:>8}\n", "body", "rows", "p99.9 kept",
                      "dearest p99.9", "slowest kept", "dearest tick", "not c.", "open", "run");
  for (const char* body : bodies_of_sums) text += sum_up(body, rows);
  return text + beside_embree(rows);
}

}  // namespace asperity::bench
