#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

#include "asperity/geometry/generators.h"
#if defined(ASPERITY_HAS_OPENVDB)
#include "bench/openvdb_peer.h"
#endif
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

/// The sphere's mesh as a potential: exact distances to its faces, in all blocks that the bands reach into.
Result<SparseGrid> potential_of(const TriangleIndex& index, double voxel, double outside, double inside) {
  SparseSource source;
  source.voxel = voxel;
  source.outside = outside;
  source.inside = -inside;
  const double block = voxel * SparseBlock::side;
  const auto last = static_cast<std::int32_t>(std::ceil((sphere_radius + outside) / block));
  for (std::int32_t z = -last; z < last; ++z) {
    for (std::int32_t y = -last; y < last; ++y) {
      for (std::int32_t x = -last; x < last; ++x) {
        const Vec3 corner = block * Vec3(x, y, z);
        const double middle = (corner + Vec3::Constant(0.5 * block)).norm();
        if (std::abs(middle - sphere_radius) > std::max(outside, inside) + block) continue;
        SparseBlock stored;
        stored.at = {x, y, z};
        TrianglePatch patch;
        for (int k = 0; k < SparseBlock::side; ++k) {
          for (int j = 0; j < SparseBlock::side; ++j) {
            for (int i = 0; i < SparseBlock::side; ++i) {
              const Vec3 p = corner + voxel * Vec3(i, j, k);
              const Foot foot = index.closest(p, infinity, patch);
              const bool within = (p - foot.point).dot(foot.point) < 0.0;
              const double value = within ? -foot.distance : foot.distance;
              stored.value[SparseBlock::index(i, j, k)] = static_cast<float>(std::clamp(value, -inside, outside));
            }
          }
        }
        source.blocks.push_back(std::move(stored));
      }
    }
  }
  return SparseGrid::build(std::move(source));
}

Result<Row> step_row(const std::string& name, const std::shared_ptr<const SparseGrid>& grid,
                     CellReconstruction reconstruction, const std::shared_ptr<const Slide>& slide, const Law& law,
                     bool friction) {
  ASPERITY_TRY(ImplicitSurface surface, ImplicitSurface::build({grid, nullptr, nullptr, reconstruction, 0.0}));
  Instance instance;
  instance.name = "potential";
  instance.surface = std::make_shared<const ImplicitSurface>(std::move(surface));
  instance.law = law;
  instance.sides = Sides::front;
  if (friction) {
    instance.material.static_friction = 0.3;
    instance.material.dynamic_friction = 0.2;
  }
  return sliding_row(name, {instance}, slide, {.start = 1.1 * sphere_radius});
}

constexpr std::size_t samples = 16;  // one is shorter than a reading of the clock

/// Ten micrometres apart. All are ready before the first is asked for: a place that was written just before in parts is
/// waited for, three times as long as sampling takes.
std::array<Vec3, samples> places_from(const Vec3& first) {
  std::array<Vec3, samples> places;
  for (std::size_t i = 0; i < samples; ++i) places[i] = first + Vec3(1e-5 * static_cast<double>(i), 0.0, 0.0);
  return places;
}

/// The sampling alone, where the slide is.
Row sample_row(const std::string& name, const std::shared_ptr<const SparseGrid>& grid,
               const std::shared_ptr<const Slide>& slide,
               Potential (SparseGrid::*sample)(const Vec3&, SparseHint&) const noexcept) {
  return Row(name, [grid, slide, sample, hint = SparseHint{}](std::size_t tick) mutable {
    double sum = 0.0;
    for (const Vec3& p : places_from(slide->probe(tick, 0.0))) {
      const Potential here = ((*grid).*sample)(p, hint);
      sum += here.value + here.gradient.x();
    }
    return sum != 0.0;
  });
}

#if defined(ASPERITY_HAS_OPENVDB)
/// The same places.
Row peer_row(const std::string& name, const std::shared_ptr<const OpenvdbPeer>& peer,
             const std::shared_ptr<const Slide>& slide) {
  return Row(name, [peer, slide](std::size_t tick) {
    double sum = 0.0;
    for (const Vec3& p : places_from(slide->probe(tick, 0.0))) sum += peer->value(p);
    return sum != 0.0;
  });
}
#endif

}  // namespace

Result<Group> measure_potential(int subdivisions, const Effort& effort, double clock_cost) {
  constexpr double voxel = 2.0 * sphere_radius / 128.0;
  const Clock::time_point start = Clock::now();
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(icosphere(subdivisions, sphere_radius)));
  const std::size_t triangles = mesh.triangles().size();
  const TriangleIndex index = TriangleIndex::build(std::move(mesh));
  const Clock::time_point built = Clock::now();
  ASPERITY_TRY(SparseGrid made, potential_of(index, voxel, 3.0 * voxel, 5.0 * voxel));
  const auto grid = std::make_shared<const SparseGrid>(std::move(made));
  Group group;
  group.kind = "potential";
  group.triangles = triangles;
  group.mesh_build_seconds = std::chrono::duration<double>(built - start).count();
  group.search_build_seconds = std::chrono::duration<double>(Clock::now() - built).count();
  group.coat_bytes = grid->memory_bytes();
  auto slide = std::make_shared<Slide>();
  slide->direction = wandering_directions(effort.ticks());
  slide->surface.assign(effort.ticks(), sphere_radius);
  std::vector<Row> rows;
  const auto add = [&](const char* name, CellReconstruction reconstruction, const Law& law, bool friction) -> Status {
    ASPERITY_TRY(Row row, step_row(name, grid, reconstruction, slide, law, friction));
    rows.push_back(std::move(row));
    return success();
  };
  constexpr auto smooth = CellReconstruction::smooth;
  constexpr auto trilinear = CellReconstruction::trilinear;
  ASPERITY_CHECK(add(contact_point_friction, smooth, VirtualContactPointLaw{}, true));
  ASPERITY_CHECK(add("virtual contact point, smooth", smooth, VirtualContactPointLaw{}, false));
  ASPERITY_CHECK(add("virtual contact point, friction, trilinear", trilinear, VirtualContactPointLaw{}, true));
  ASPERITY_CHECK(add("virtual contact point, literal", trilinear, VirtualContactPointLaw{Formulation::literal}, true));
  ASPERITY_CHECK(add("proxy, smooth", smooth, ProxyLaw{}, true));
  ASPERITY_CHECK(add("proxy, trilinear", trilinear, ProxyLaw{}, true));
  rows.push_back(sample_row("16 x value and gradient, trilinear", grid, slide, &SparseGrid::trilinear));
  rows.push_back(sample_row("16 x value, node gradients", grid, slide, &SparseGrid::node_gradients));
#if defined(ASPERITY_HAS_OPENVDB)
  const auto peer = std::make_shared<const OpenvdbPeer>(grid->source());
  for (std::size_t tick = 0; tick < std::min<std::size_t>(1000, effort.ticks()); ++tick) {
    const Vec3 p = slide->probe(tick, 0.0);
    SparseHint hint;
    group.largest_disagreement =
        std::max(group.largest_disagreement, std::abs(peer->value(p) - grid->trilinear(p, hint).value));
  }
  rows.push_back(peer_row("OpenVDB, 16 x value alone", peer, slide));
#endif
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
