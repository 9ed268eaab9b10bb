#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "asperity/geometry/generators.h"
#include "asperity/surface/relief/surface.h"
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

constexpr double wave_height = 2e-3;  // m
constexpr double wave_length = 40e-3;

/// The sheet with a wave that runs over it, one place of it for each tick.
class Wave {
 public:
  explicit Wave(const TriangleMesh& mesh) : rest_(mesh.positions().begin(), mesh.positions().end()), at_(rest_) {}
  const std::vector<Vec3>& at(std::size_t tick) {
    const double phase = 0.3 * static_cast<double>(tick);
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      const double lift = wave_height * std::sin(2.0 * std::numbers::pi * rest_[i].x() / wave_length + phase);
      at_[i].z() = lift;
    }
    return at_;
  }

 private:
  std::vector<Vec3> rest_;
  std::vector<Vec3> at_;
};

Result<Coat> waves_on(const TriangleMesh& mesh) {
  constexpr int size = 256;
  constexpr double amplitude = 0.15e-3;
  constexpr double tile = 8.0 * 4.9e-3;
  std::vector<float> heights;
  const auto wave = [&](int texel) { return std::cos(2.0 * std::numbers::pi * 8.0 * (texel + 0.5) / size); };
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column)
      heights.push_back(static_cast<float>(amplitude * wave(row) * wave(column)));
  }
  ASPERITY_TRY(HeightMap map,
               HeightMap::build(std::move(heights), size, size, Wrap::repeat, Reconstruction::quadratic_bspline));
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(map), Vec2(tile, tile)));
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  return Coat::build(mesh, std::make_shared<const Mesostructure>(std::move(maps)), settings);
}

MeshSource source_at(const TriangleMesh& mesh, const std::vector<Vec3>& positions) {
  MeshSource source;
  source.positions = positions;
  source.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
  return source;
}

}  // namespace

Result<Group> measure_refit(std::uint32_t triangles, const Effort& effort, double clock_cost) {
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(plane_grid(4.0 * sphere_radius, 4.0 * sphere_radius, triangles)));
  ASPERITY_TRY(Coat coat, waves_on(mesh));
  const MeshSurface rest(TriangleIndex::build(std::move(mesh)));
  const auto relief = std::make_shared<const ReliefSurface>(rest, coat);
  Group group;
  group.kind = "refit";
  group.triangles = rest.mesh().triangles().size();
  group.bytes_per_triangle = static_cast<double>(rest.index().memory_bytes()) / static_cast<double>(group.triangles);

  // The positions are the caller's: all rows take them from the same few, made before.
  constexpr std::size_t phases = 8;
  const auto positions = std::make_shared<std::vector<std::vector<Vec3>>>();
  Wave wave(rest.mesh());
  for (std::size_t phase = 0; phase < phases; ++phase) positions->push_back(wave.at(phase));
  const auto sources = std::make_shared<std::vector<MeshSource>>();
  for (const std::vector<Vec3>& at : *positions) sources->push_back(source_at(rest.mesh(), at));

  const auto deformable = std::make_shared<DeformableMesh>(rest);
  // Ready beforehand, so that a relief's row is about the relief.
  const auto bases = std::make_shared<std::vector<MeshSurface>>();
  for (const std::vector<Vec3>& at : *positions) {
    ASPERITY_TRY(MeshSurface base, deformable->moved(at));
    bases->push_back(std::move(base));
  }
  const auto side_by_side = std::make_shared<DeformableMesh>(rest, 2);
  const auto alone = std::make_shared<DeformableMesh>(rest, 1);
  std::vector<Row> rows;
  rows.emplace_back(mesh_refit,
                    [=](std::size_t tick) { return side_by_side->moved((*positions)[tick % phases]).ok(); });
  rows.emplace_back(mesh_refit_alone, [=](std::size_t tick) { return alone->moved((*positions)[tick % phases]).ok(); });
  rows.emplace_back(mesh_rebuild, [=](std::size_t tick) {
    auto built = TriangleMesh::build((*sources)[tick % phases], {1.0, false});
    return built.ok() && TriangleIndex::build(std::move(built).value()).identity() != 0;
  });
  rows.emplace_back(relief_refit, [=](std::size_t tick) { return relief->moved((*bases)[tick % phases]).ok(); });
  rows.emplace_back(relief_rebuild, [=](std::size_t tick) {
    auto built = TriangleMesh::build((*sources)[tick % phases], {1.0, false});
    if (!built) return false;
    auto laid = waves_on(*built);
    if (!laid) return false;
    return ReliefSurface(MeshSurface(TriangleIndex::build(std::move(built).value())), std::move(laid).value()).reach() >
           0.0;
  });
  // Whole rebuilds take up to a second: as many as fit into some seconds.
  Effort few = effort;
  few.warm = std::clamp<std::size_t>(2000000 / group.triangles, 10, 100);
  few.cold = std::min<std::size_t>(effort.cold, 5);
  group.rows = measure(rows, few, clock_cost);
  return group;
}

}  // namespace asperity::bench
