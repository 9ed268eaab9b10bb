#include <cmath>
#include <memory>
#include <random>

#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

constexpr double half_side = 0.06;  // m, of the cube that holds the sphere

/// The distance from the middle, with 0.2 mm of slow waves so that cells are not alike.
Result<ScalarGrid> sphere_volume(std::uint32_t count) {
  ASPERITY_TRY(const GridAxis axis, GridAxis::uniform(-half_side, 2.0 * half_side / (count - 1), count));
  std::vector<float> samples;
  samples.reserve(static_cast<std::size_t>(count) * count * count);
  for (std::uint32_t k = 0; k < count; ++k) {
    for (std::uint32_t j = 0; j < count; ++j) {
      const double z = axis.node(k);
      const double y = axis.node(j);
      const double wave = 0.2e-3 * std::cos(y / 0.008) * std::cos(z / 0.009);
      for (std::uint32_t i = 0; i < count; ++i) {
        const double x = axis.node(i);
        samples.push_back(static_cast<float>(std::sqrt(x * x + y * y + z * z) + wave));
      }
    }
  }
  return ScalarGrid::build({axis, axis, axis}, SampleArray(std::move(samples)), "distance");
}

Result<Row> step_row(const std::string& name, const std::shared_ptr<const ScalarField>& field,
                     const std::shared_ptr<const Slide>& slide, const Law& law) {
  ASPERITY_TRY(IsoSurface surface, IsoSurface::build(field, sphere_radius, Inside::low));
  Instance instance;
  instance.name = "isosurface";
  instance.surface = std::make_shared<const IsoSurface>(std::move(surface));
  instance.law = law;
  instance.sides = Sides::front;
  if (law.is<ProxyLaw>()) {
    instance.material.static_friction = 0.3;
    instance.material.dynamic_friction = 0.2;
  }
  return sliding_row(name, {instance}, slide, {.start = 1.1 * sphere_radius});
}

/// The wandering slide of the meshes, on the sphere itself.
std::shared_ptr<const Slide> wander(std::size_t ticks) {
  auto slide = std::make_shared<Slide>();
  slide->direction = wandering_directions(ticks);
  slide->surface.assign(ticks, sphere_radius);
  return slide;
}

/// One motion of 1.2 cells a tick near the isosurface: the search alone.
Row segment_row(const std::shared_ptr<const ScalarField>& field) {
  const double length = 1.2 * field->narrowest_cell();
  return Row("first crossing of 1.2 cells, trilinear",
             [field, length, generator = std::mt19937_64(1), place = Vec3(0.0, 0.0, sphere_radius),
              cells = std::make_shared<CellCache>()](std::size_t) mutable {
               std::normal_distribution<double> normal;
               const Vec3 way = Vec3(normal(generator), normal(generator), normal(generator)).normalized() * length;
               IsoView view;
               view.field = field.get();
               view.threshold = sphere_radius;
               view.cells = cells.get();
               const IsoCrossing crossing = view.first_crossing({place, place + way});
               place = (place + way).normalized() * sphere_radius;
               return crossing.t <= 1.0;
             });
}

}  // namespace

Result<Group> measure_volume(std::uint32_t count, const Effort& effort, double clock_cost) {
  const Clock::time_point start = Clock::now();
  ASPERITY_TRY(ScalarGrid grid, sphere_volume(count));
  const Clock::time_point sampled = Clock::now();
  const auto smooth = std::make_shared<const ScalarField>(grid, CellReconstruction::smooth);
  const Clock::time_point built = Clock::now();
  const auto trilinear = std::make_shared<const ScalarField>(std::move(grid), CellReconstruction::trilinear);
  Group group;
  group.kind = "volume";
  group.resolution = count;
  group.mesh_build_seconds = std::chrono::duration<double>(sampled - start).count();
  group.search_build_seconds = std::chrono::duration<double>(built - sampled).count();
  group.coat_bytes = smooth->memory_bytes();
  const auto slide = wander(effort.ticks());
  std::vector<Row> rows;
  const auto add = [&](const char* name, const std::shared_ptr<const ScalarField>& field, const Law& law) -> Status {
    ASPERITY_TRY(Row row, step_row(name, field, slide, law));
    rows.push_back(std::move(row));
    return success();
  };
  ASPERITY_CHECK(add("proxy, smooth", smooth, ProxyLaw{}));
  ASPERITY_CHECK(add("proxy, trilinear", trilinear, ProxyLaw{}));
  ASPERITY_CHECK(add("cross-uncross, smooth", smooth, CrossUncrossLaw{}));
  ASPERITY_CHECK(add("cross-uncross, trilinear", trilinear, CrossUncrossLaw{}));
  ASPERITY_CHECK(add("avila, trilinear", trilinear, AvilaLaw{}));
  rows.push_back(segment_row(trilinear));
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
