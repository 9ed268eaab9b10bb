#include <cmath>
#include <memory>
#include <numbers>

#include "asperity/field/mesostructure_generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/render/step.h"
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

/// Texture coordinates by longitude and latitude, unwrapped within each triangle.
void lay_globe_uvs(MeshSource& source) {
  const auto longitude = [](const Vec3& p) { return std::atan2(p.y(), p.x()) / (2.0 * std::numbers::pi); };
  for (std::size_t face = 0; face < source.triangles.size(); ++face) {
    const double first = longitude(source.positions[source.triangles[face][0]]);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& p = source.positions[source.triangles[face][corner]];
      const double s = longitude(p);
      const double t = std::asin(std::clamp(p.normalized().z(), -1.0, 1.0)) / std::numbers::pi + 0.5;
      source.corner_uvs[face][corner] = Vec2(s - std::round(s - first), t).cast<float>();
    }
  }
}

Result<std::shared_ptr<const ReliefSurface>> coated(int subdivisions, int map_size, Mapping mapping) {
  MeshSource source = icosphere(subdivisions, sphere_radius);
  lay_globe_uvs(source);
  MesostructureSpec rings;
  rings.kind = MesostructureKind::rings;
  rings.size = map_size;
  rings.amplitude = 1e-3;
  ASPERITY_TRY(HeightMap heights, generate_height_map(rings, Wrap::repeat, Reconstruction::quadratic_bspline));
  // A tile of an eighth of the equator, and as much from pole to pole: about 39 mm.
  constexpr double tile = 2.0 * std::numbers::pi * sphere_radius / 8.0;
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), Vec2(tile, tile)));
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(std::move(source)));
  CoatSettings settings;
  settings.mapping = mapping;
  if (mapping == Mapping::uv) settings.repeat = Vec2(8.0, 4.0);
  ASPERITY_TRY(Coat coat, Coat::build(mesh, std::make_shared<const Mesostructure>(std::move(maps)), settings));
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

Result<Row> step_row(const std::string& name, const std::shared_ptr<const ReliefSurface>& surface,
                     const std::shared_ptr<const Slide>& slide, const Law& law) {
  Instance sphere;
  sphere.name = "sphere";
  sphere.surface = surface;
  sphere.law = law;
  sphere.sides = Sides::front;
  ASPERITY_TRY(Scene scene, Scene::build({sphere}, 0.0));
  ProxyState state;
  ProbeSample probe;
  probe.pose.position = 1.5 * sphere_radius * slide->direction.front();
  step(scene, state, probe, Seconds(tick_seconds));
  return Row(name, [scene = std::move(scene), slide, state, probe](std::size_t tick) mutable {
    probe.pose.position = slide->probe(tick, 0.0);
    return step(scene, state, probe, Seconds(tick_seconds)).flags.has(TickFlag::contact);
  });
}

}  // namespace

Result<Group> measure_relief(int subdivisions, int map_size, const Effort& effort, double clock_cost) {
  ASPERITY_TRY(const auto globe, coated(subdivisions, map_size, Mapping::uv));
  ASPERITY_TRY(const auto triplanar, coated(subdivisions, map_size, Mapping::triplanar));
  const TriangleIndex& index = globe->base().index();
  Group group;
  group.kind = "relief";
  group.triangles = index.mesh().triangles().size();
  group.bytes_per_triangle = static_cast<double>(index.memory_bytes()) / static_cast<double>(group.triangles);
  group.coat_bytes = globe->coat().memory_bytes();

  const auto slide = std::make_shared<const Slide>(make_slide(index, effort.ticks()));
  std::vector<Row> rows;
  ASPERITY_TRY(Row height, step_row("height-field, UVs", globe, slide, HeightFieldLaw{}));
  ASPERITY_TRY(Row blend, step_row("mesostructure, UVs", globe, slide, MesostructureLaw{}));
  ASPERITY_TRY(Row height3, step_row("height-field, triplanar", triplanar, slide, HeightFieldLaw{}));
  ASPERITY_TRY(Row blend3, step_row("mesostructure, triplanar", triplanar, slide, MesostructureLaw{}));
  rows.push_back(std::move(height));
  rows.push_back(std::move(blend));
  rows.push_back(std::move(height3));
  rows.push_back(std::move(blend3));
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
