#include <algorithm>
#include <cmath>
#include <memory>

#include "asperity/core/rng.h"
#include "asperity/geometry/generators.h"
#include "bench/embree_peer.h"
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

constexpr double tracker_bound = 3e-3;  // m: what a tracker that knows the last distance would search within

/// How a row touches the mesh.
struct MeshTouch {
  double radius = 0.0;     ///< m
  bool friction = false;   ///< 0.3 / 0.2
  bool resting = false;    ///< where the slide begins, and stays there
  std::size_t others = 0;  ///< instances around it, out of reach
};

/// Small spheres in a cloud around the large one, nearest 5 mm from it.
Status add_others(std::size_t count, std::vector<Instance>& instances) {
  if (count == 0) return success();
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(icosphere(1, 2e-3)));
  Instance small;
  small.surface = std::make_shared<const MeshSurface>(TriangleIndex::build(std::move(mesh)));
  Rng rng(7);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 direction(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    small.name = "small " + std::to_string(i);
    small.world_from_object.position = (sphere_radius + rng.uniform(7e-3, 30e-3)) * direction.normalized();
    instances.push_back(small);
  }
  return success();
}

/// A row that takes a probe through `step`.
Result<Row> step_row(const std::string& name, const std::shared_ptr<const MeshSurface>& surface,
                     const std::shared_ptr<const Slide>& slide, const MeshTouch& touch) {
  Instance sphere;
  sphere.name = "sphere";
  sphere.surface = surface;
  sphere.sides = Sides::front;
  if (touch.friction) {
    sphere.material.static_friction = 0.3;
    sphere.material.dynamic_friction = 0.2;
  }
  std::vector<Instance> instances{sphere};
  ASPERITY_CHECK(add_others(touch.others, instances));
  return sliding_row(name, std::move(instances), slide, {touch.radius, touch.resting});
}

Row closest_row(const std::shared_ptr<const MeshSurface>& surface, const std::shared_ptr<const Slide>& slide) {
  return {closest_coherent, [surface, slide, patch = TrianglePatch{}](std::size_t tick) mutable {
            return surface->index().closest(slide->probe(tick, 0.0), tracker_bound, patch).found();
          }};
}

Row closest_anew_row(const std::shared_ptr<const MeshSurface>& surface, const std::shared_ptr<const Slide>& slide) {
  return {closest_anew, [surface, slide](std::size_t tick) {
            return surface->index().closest(slide->probe(tick, 0.0), infinity).found();
          }};
}

Row embree_row(const char* name, const std::shared_ptr<const EmbreePeer>& peer,
               const std::shared_ptr<const Slide>& slide, double bound) {
  return {name, [peer, slide, bound](std::size_t tick) {
            return std::isfinite(peer->closest(slide->probe(tick, 0.0), bound));
          }};
}

/// Largest difference between our distance and Embree's over the slide (m).
double largest_disagreement(const MeshSurface& surface, const EmbreePeer& peer, const Slide& slide) {
  double largest = 0.0;
  TrianglePatch patch;
  for (std::size_t tick = 0; tick < slide.direction.size(); tick += 7) {
    const Vec3 p = slide.probe(tick, 0.0);
    const double ours = surface.index().closest(p, tracker_bound, patch).distance;
    largest = std::max(
        {largest, std::abs(ours - peer.closest(p, infinity)), std::abs(ours - peer.closest(p, tracker_bound))});
  }
  return largest;
}

}  // namespace

const RowResult* Group::row(const std::string& name) const {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const RowResult& row) { return row.name == name; });
  return found == rows.end() ? nullptr : &*found;
}

Result<Group> measure_mesh(int subdivisions, const Effort& effort, double clock_cost) {
  Group group;
  group.kind = "mesh";
  MeshSource source = icosphere(subdivisions, sphere_radius);
  Clock::time_point start = Clock::now();
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(std::move(source)));
  group.mesh_build_seconds = seconds_since(start);
  start = Clock::now();
  const auto surface = std::make_shared<const MeshSurface>(TriangleIndex::build(std::move(mesh)));
  group.search_build_seconds = seconds_since(start);
  const auto peer = std::make_shared<const EmbreePeer>(surface->mesh());
  group.embree_build_seconds = peer->build_seconds();
  group.triangles = surface->mesh().triangles().size();
  group.bytes_per_triangle =
      static_cast<double>(surface->index().memory_bytes()) / static_cast<double>(group.triangles);

  const auto slide = std::make_shared<const Slide>(make_slide(surface->index(), effort.ticks()));
  group.largest_disagreement = largest_disagreement(*surface, *peer, *slide);
  std::vector<Row> rows;
  const auto add = [&](const char* name, const MeshTouch& touch) -> Status {
    ASPERITY_TRY(Row row, step_row(name, surface, slide, touch));
    rows.push_back(std::move(row));
    return success();
  };
  ASPERITY_CHECK(add(god_object_point, {}));
  ASPERITY_CHECK(add(god_object_radius, {.radius = 1e-3}));
  ASPERITY_CHECK(add("god-object, 5 mm radius", {.radius = 5e-3}));
  ASPERITY_CHECK(add("god-object, point, resting", {.resting = true}));
  ASPERITY_CHECK(add("proxy, point, friction", {.friction = true}));
  ASPERITY_CHECK(add("god-object, point, among 1,000", {.others = 1000}));
  rows.push_back(closest_row(surface, slide));
  rows.push_back(closest_anew_row(surface, slide));
  rows.push_back(embree_row(embree_bounded, peer, slide, tracker_bound));
  rows.push_back(embree_row(embree_infinite, peer, slide, infinity));
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
