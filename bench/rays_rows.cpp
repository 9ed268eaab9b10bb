#include "bench/rays_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <variant>

#include "asperity/field/mesostructure/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/io/experiment.h"
#include "asperity/surface/relief/mesh.h"
#include "asperity/surface/relief/view.h"
#include "bench/embree_peer.h"
#include "bench/measure.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

using RayRelief = std::shared_ptr<const ReliefSurface>;

// ---- bodies

struct RayBody {
  std::string name;
  std::string file;  ///< that has to be there, under the data's folder; empty: the sphere
  std::string map;
};

std::vector<RayBody> ray_bodies() {
  std::vector<RayBody> all = {{"sphere, warts, 1 mm", "", ""}};
  for (const auto& [mesh, file] : {std::pair("bunny-28k", "meshes/bunny-28k.obj"), std::pair("spot", "meshes/spot.obj"),
                                   std::pair("FlightHelmet", "meshes/FlightHelmet/FlightHelmet.gltf")}) {
    for (const auto& [map, image] : {std::pair("rock023", "textures/ambientcg/rock023_alb_ht.png"),
                                     std::pair("wool", "textures/godot/wool_depth.png")})
      all.push_back({fmt::format("{}, {}, 1 mm", mesh, map), file, image});
  }
  return all;
}

Result<RayRelief> warty_sphere(int map_size) {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::warts;
  spec.size = map_size;
  constexpr double tile = 0.04;  // m
  ASPERITY_TRY(HeightMap heights, generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline));
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), Vec2(tile, tile)));
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(icosphere(4, sphere_radius)));
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  return make_relief(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(maps), settings);
}

Result<RayRelief> relief_of_body(const RayBody& body, const RayEffort& effort) {
  if (body.file.empty()) return warty_sphere(effort.map_size);
  const std::string scene = fmt::format(
      R"({{"surfaces":[{{"mesh":"{}","coat":{{"height_map":"{}","height":"1 mm"}}}}]}})", body.file, body.map);
  ASPERITY_TRY(const Experiment experiment, parse_experiment(scene, effort.data, body.name));
  return std::get<RayRelief>(experiment.scene.instances().front().surface);
}

// ---- triangles

/// A relief cut into flat triangles, face by face; places on common edges are there once a face.
struct DenseMesh {
  std::vector<EmbreeRays::Vertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<double> flatness;  ///< m, of one triangle a face
  [[nodiscard]] std::size_t bytes() const {
    return vertices.size() * sizeof(vertices[0]) + triangles.size() * sizeof(triangles[0]);
  }
};

/// How far the relief is from the middle of the triangle that has its first corner at (i, j) of a face's grid.
double flatness_at(const ReliefSurface& surface, const ReliefFrame& frame, int i, int j, int parts) {
  Vec3 middle = Vec3::Zero();
  Vec2 place = Vec2::Zero();
  for (const Vec2& at : {grid_place(i, j, parts), grid_place(i + 1, j, parts), grid_place(i, j + 1, parts)}) {
    middle += surface.point(frame, at.x(), at.y()).point / 3.0;
    place += at / 3.0;
  }
  return (surface.point(frame, place.x(), place.y()).point - middle).norm();
}

/// The cells of tessellate(), which makes half as many at most.
DenseMesh cut(const ReliefSurface& surface, int parts) {
  DenseMesh dense;
  const auto faces = static_cast<std::uint32_t>(surface.base().mesh().triangles().size());
  const auto cuts = static_cast<std::size_t>(parts);
  dense.vertices.reserve(faces * (cuts + 1) * (cuts + 2) / 2);
  dense.triangles.reserve(faces * cuts * cuts);
  for (std::uint32_t face = 0; face < faces; ++face) {
    const ReliefFrame frame = surface.frame(face);
    for (int j = 0; j <= parts; ++j) {
      const auto row = static_cast<std::uint32_t>(dense.vertices.size());
      const auto length = static_cast<std::uint32_t>(parts - j + 1);
      for (int i = 0; i + j <= parts; ++i) {
        const Vec2 at = grid_place(i, j, parts);
        const Eigen::Vector3f point = surface.point(frame, at.x(), at.y()).point.cast<float>();
        dense.vertices.push_back({point.x(), point.y(), point.z()});
      }
      const std::uint32_t below = row - length - 1;
      for (std::uint32_t i = 0; j > 0 && i < length; ++i) {
        dense.triangles.push_back({below + i, below + i + 1, row + i});
        if (i + 1 < length) dense.triangles.push_back({below + i + 1, row + i + 1, row + i});
      }
    }
    // Wandering over the grids, so that no part of a face is preferred.
    const int i = static_cast<int>(face % cuts);
    const int j = static_cast<int>(face / cuts % (cuts - static_cast<std::size_t>(i)));
    dense.flatness.push_back(flatness_at(surface, frame, i, j, parts));
  }
  return dense;
}

// ---- rays

/// The rays of a picture that just holds a mesh and a margin, row by row: from the eye to well behind it.
std::vector<Segment> picture_of(const TriangleMesh& mesh, int width, int height) {
  Box box;
  for (const Vec3& position : mesh.positions()) box.include(position);
  const Vec3 towards = -Vec3(0.5, 0.4, 0.77).normalized();
  const Vec3 right = towards.cross(Vec3::UnitY()).normalized();
  const Vec3 up = right.cross(towards);
  const double distance = 2.0 * box.diagonal();
  const Vec3 eye = box.centre() - distance * towards;
  constexpr double margin = 1.05;
  double pixel = 0.0;  // at distance 1
  for (const Vec3& position : mesh.positions()) {
    const Vec3 offset = position - eye;
    const double depth = offset.dot(towards);
    pixel = std::max({pixel, 2.0 * margin * std::abs(offset.dot(right)) / (width * depth),
                      2.0 * margin * std::abs(offset.dot(up)) / (height * depth)});
  }
  std::vector<Segment> rays;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec3 along = towards + pixel * ((x + 0.5 - 0.5 * width) * right + (0.5 * height - y - 0.5) * up);
      rays.push_back({eye, eye + 1.5 * distance * along});
    }
  }
  return rays;
}

/// What this thread has computed so far (ns), whatever else the machine does.
double thread_nanoseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e9 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec);
}

/// The same picture, several times.
struct TimedRays {
  std::vector<double> distance;  ///< m, of the hit; infinity: none
  std::vector<double> least;     ///< ns, of a ray
  std::vector<double> totals;    ///< ns, of a picture

  explicit TimedRays(std::size_t rays) : distance(rays, infinity), least(rays, infinity) {}

  /// Once as a whole, once ray by ray.
  template <class Cast>
  void take(const std::vector<Segment>& rays, double clock_cost, const Cast& cast) {
    const double begin = thread_nanoseconds();
    for (std::size_t i = 0; i < rays.size(); ++i) distance[i] = cast(rays[i]);
    totals.push_back(thread_nanoseconds() - begin);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Clock::time_point start = Clock::now();
      const double fraction = cast(rays[i]);
      const double took = std::chrono::duration<double, std::nano>(Clock::now() - start).count();
      least[i] = std::min(least[i], took - clock_cost);
      distance[i] = fraction * (rays[i].to - rays[i].from).norm();
    }
  }
};

/// The value below which a share of them are; 0 of none.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

RaySpeed speed_of(const TimedRays& timed) {
  const auto rays = static_cast<double>(timed.distance.size());
  const auto hits = std::count_if(timed.distance.begin(), timed.distance.end(), [](double d) { return d < infinity; });
  return {1e9 * rays / quantile(timed.totals, 0.5), static_cast<double>(hits) / rays,
          *std::max_element(timed.least.begin(), timed.least.end())};
}

Result<RayRow> measure_body(const RayBody& body, const RayEffort& effort, double clock_cost) {
  RayRow row;
  row.body = body.name;
  Clock::time_point start = Clock::now();
  ASPERITY_TRY(const RayRelief relief, relief_of_body(body, effort));
  row.relief_build_seconds = seconds_since(start);
  row.relief_bytes = relief->memory_bytes();
  const TriangleMesh& base = relief->base().mesh();
  row.faces = base.triangles().size();
  row.texel = relief->coat().texel_size();

  const double wanted = std::ceil(base.mean_edge() / row.texel);
  const double most = std::sqrt(static_cast<double>(effort.most_triangles) / static_cast<double>(row.faces));
  row.capped = wanted > std::floor(most);
  const int parts = std::max(1, static_cast<int>(std::min(wanted, most)));
  row.texels_an_edge = base.mean_edge() / row.texel / parts;
  start = Clock::now();
  DenseMesh dense = cut(*relief, parts);
  row.cut_seconds = seconds_since(start);
  row.triangles = dense.triangles.size();
  row.triangle_bytes = dense.bytes();
  row.flatness_p50 = quantile(dense.flatness, 0.5);
  row.flatness_p99 = quantile(dense.flatness, 0.99);
  const EmbreeRays embree(dense.vertices, dense.triangles);
  dense = {};
  row.embree_build_seconds = embree.build_seconds();
  row.embree_bytes = embree.memory_bytes();

  const std::vector<Segment> rays = picture_of(base, effort.width, effort.height);
  row.rays = rays.size();
  TimedRays ours(rays.size());
  TimedRays theirs(rays.size());
  SurfaceCache cache;
  const ReliefView view = relief->view(cache);
  for (int picture = 0; picture < effort.pictures; ++picture) {
    ours.take(rays, clock_cost, [&](const Segment& ray) {
      const SweptHit hit = view.first_touch(ray, Sides::both);
      return hit.hit ? hit.t : infinity;
    });
    theirs.take(rays, clock_cost, [&](const Segment& ray) { return embree.first_hit(ray); });
  }
  row.relief = speed_of(ours);
  row.embree = speed_of(theirs);
  std::vector<double> differences;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (ours.distance[i] < infinity && theirs.distance[i] < infinity)
      differences.push_back(std::abs(ours.distance[i] - theirs.distance[i]));
  }
  row.both_share = static_cast<double>(differences.size()) / static_cast<double>(rays.size());
  row.difference_p50 = quantile(differences, 0.5);
  row.difference_p99 = quantile(differences, 0.99);
  return row;
}

std::string line_of(const std::string& name, const RaySpeed& speed) {
  return fmt::format("{:<58}{:>10.0f}{:>8.1f}{:>10.1f}", name, speed.rays_a_second, 100.0 * speed.hit_share,
                     1e-3 * speed.worst);
}

}  // namespace

Result<std::vector<RayRow>> measure_rays(const RayEffort& effort, double clock_cost,
                                         const std::function<void(std::string_view)>& told) {
  std::vector<RayRow> rows;
  for (const RayBody& body : ray_bodies()) {
    if (body.name.find(effort.only) == std::string::npos || (effort.sphere_alone && !body.file.empty())) continue;
    std::string missing;
    for (const std::string& file : {body.file, body.map}) {
      if (!file.empty() && !std::filesystem::exists(effort.data / file)) missing = (effort.data / file).string();
    }
    if (!missing.empty()) {
      told(fmt::format("rays on {}: skipped, {} is not there", body.name, missing));
      continue;
    }
    ASPERITY_TRY(RayRow row, measure_body(body, effort, clock_cost));
    told(fmt::format("rays on {}: {:.0f} a second, Embree {:.0f}", row.body, row.relief.rays_a_second,
                     row.embree.rays_a_second));
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string rays_text(const std::vector<RayRow>& rows) {
  std::string text;
  constexpr double um = 1e6;
  constexpr double megabytes = 1e-6;
  for (const RayRow& row : rows) {
    text += fmt::format(
        "\nrays on {}: {} faces, texels of {:.3f} mm; {} rays, {:.1f} % hit in both\n"
        "distances differ by {:.3f} um (p50), {:.2f} um (p99); triangles are {:.3f} um (p50), {:.2f} um (p99) off the "
        "relief\n",
        row.body, row.faces, 1e3 * row.texel, row.rays, 100.0 * row.both_share, um * row.difference_p50,
        um * row.difference_p99, um * row.flatness_p50, um * row.flatness_p99);
    text += fmt::format("{:<58}{:>10}{:>8}{:>10}{:>10}{:>12}\n", "", "rays/s", "hit %", "worst us", "MB", "made in s");
    text += line_of("the relief itself", row.relief) + fmt::format("{:>10.1f}{:>12.2f}\n",
                                                                   megabytes * static_cast<double>(row.relief_bytes),
                                                                   row.relief_build_seconds);
    text += line_of(fmt::format("Embree, {} triangles, {:.2f} texels an edge{}", row.triangles, row.texels_an_edge,
                                row.capped ? ", capped" : ""),
                    row.embree) +
            fmt::format("{:>10.1f}{:>12.2f}   {:.1f} MB with the tree; cut in {:.2f} s\n",
                        megabytes * static_cast<double>(row.triangle_bytes), row.embree_build_seconds,
                        megabytes * static_cast<double>(row.embree_bytes), row.cut_seconds);
  }
  return text;
}

std::vector<std::string> ray_failures(const std::vector<RayRow>& rows) {
  std::vector<std::string> failures;
  constexpr double rounding = 1e-7;  // m, of single precision at the picture's distance
  for (const RayRow& row : rows) {
    if (!(row.both_share > 0.0)) failures.push_back(fmt::format("rays on {}: none hits in both", row.body));
    if (!(row.difference_p50 <= row.flatness_p99 + rounding)) {
      failures.push_back(fmt::format("rays on {}: distances differ by {:.2e} m, triangles are within {:.2e} m",
                                     row.body, row.difference_p50, row.flatness_p99));
    }
  }
  return failures;
}

}  // namespace asperity::bench
