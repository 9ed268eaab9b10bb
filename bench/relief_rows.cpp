#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "asperity/field/mesostructure/generators.h"
#include "asperity/geometry/generators.h"
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

using SharedRelief = std::shared_ptr<const ReliefSurface>;

// Eight waves of 4.9 mm, as the relief test has them.
constexpr double tile = 8.0 * 4.9e-3;
constexpr double cosine_amplitude = 0.15e-3;
// A tenth of the mean edge of the icosphere of 1,280 triangles.
constexpr double ridge_amplitude = 0.7e-3;

/// Texture coordinates by projection along the axis that a triangle faces: six charts, with seams between them.
void lay_cube_uvs(MeshSource& source) {
  for (std::size_t face = 0; face < source.triangles.size(); ++face) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t vertex : source.triangles[face]) middle += source.positions[vertex];
    int axis = 0;
    middle.cwiseAbs().maxCoeff(&axis);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& p = source.positions[source.triangles[face][corner]];
      source.corner_uvs[face][corner] = Vec2(p[(axis + 1) % 3] / tile, p[(axis + 2) % 3] / tile).cast<float>();
    }
  }
}

Result<HeightMap> cosine_map(int size) {
  std::vector<float> heights;
  const auto wave = [&](int texel) { return std::cos(2.0 * std::numbers::pi * 8.0 * (texel + 0.5) / size); };
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column)
      heights.push_back(static_cast<float>(cosine_amplitude * wave(row) * wave(column)));
  }
  return HeightMap::build(std::move(heights), size, size, Wrap::repeat, Reconstruction::quadratic_bspline);
}

Result<HeightMap> ridge_map(int size) {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::serrated;
  spec.size = size;
  spec.count = 8;
  spec.amplitude = ridge_amplitude;
  return generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline);
}

Result<SharedRelief> coated(int subdivisions, HeightMap heights, Mapping mapping) {
  MeshSource source = icosphere(subdivisions, sphere_radius);
  lay_cube_uvs(source);
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), Vec2(tile, tile)));
  ASPERITY_TRY(TriangleMesh mesh, TriangleMesh::build(std::move(source)));
  CoatSettings settings;
  settings.mapping = mapping;
  ASPERITY_TRY(Coat coat, Coat::build(mesh, std::make_shared<const Mesostructure>(std::move(maps)), settings));
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

Result<Row> step_row(const std::string& name, const SharedRelief& surface, const std::shared_ptr<const Slide>& slide,
                     const Law& law) {
  Instance sphere;
  sphere.name = "sphere";
  sphere.surface = surface;
  sphere.law = law;
  sphere.sides = Sides::front;
  sphere.material.static_friction = 0.3;
  sphere.material.dynamic_friction = 0.2;
  return sliding_row(name, {sphere}, slide);
}

/// A slide through these directions, the probe under the facets.
std::shared_ptr<const Slide> through(const TriangleIndex& index, std::vector<Vec3> directions) {
  auto slide = std::make_shared<Slide>();
  slide->direction = std::move(directions);
  for (const Vec3& direction : slide->direction) {
    const FirstHit hit = index.first_hit({2.0 * sphere_radius * direction, Vec3::Zero()});
    slide->surface.push_back(hit.face != no_index ? 2.0 * sphere_radius * (1.0 - hit.t) : sphere_radius);
  }
  return slide;
}

/// The first place of a slide, at every tick.
std::shared_ptr<const Slide> resting_at(const Slide& slide) {
  auto still = std::make_shared<Slide>();
  still->direction.assign(slide.direction.size(), slide.direction.front());
  still->surface.assign(slide.surface.size(), slide.surface.front());
  return still;
}

/// Strokes over the cap around +z, up the slopes of the ridges and off their walls; between strokes the probe is lifted
/// for one tick.
std::shared_ptr<const Slide> strokes(const TriangleIndex& index, std::size_t ticks) {
  constexpr double widest = 0.4;
  const double advance = slide_speed * tick_seconds / sphere_radius;
  std::vector<Vec3> directions;
  std::vector<std::size_t> lifted;
  double angle = widest;
  double across = 0.0;
  while (directions.size() < ticks) {
    directions.push_back(Vec3(std::sin(angle), 0.3 * std::sin(across), std::cos(angle)).normalized());
    angle -= advance;
    if (angle > -widest) continue;
    angle = widest;
    across += 0.37;
    if (directions.size() < ticks) {
      lifted.push_back(directions.size());
      directions.push_back(Vec3(std::sin(angle), 0.3 * std::sin(across), std::cos(angle)).normalized());
    }
  }
  auto slide = std::make_shared<Slide>(*through(index, std::move(directions)));
  for (const std::size_t tick : lifted) slide->surface[tick] = 1.2 * sphere_radius;
  return slide;
}

/// To and fro along an edge of the mesh, weaving over it within the band where its two faces are joined.
std::shared_ptr<const Slide> along_edge(const TriangleIndex& index, std::size_t ticks) {
  const auto corners = index.mesh().corners(0);
  const double length = (corners[1] - corners[0]).norm();
  const Vec3 over = index.mesh().face_normal(0).cross(corners[1] - corners[0]).normalized();
  std::vector<Vec3> directions;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double travelled = slide_speed * tick_seconds * static_cast<double>(tick) / length;
    const double phase = travelled - std::floor(travelled);
    const double along = 0.2 + 0.6 * (static_cast<long>(travelled) % 2 == 0 ? phase : 1.0 - phase);
    const double weave = 0.02 * length * std::sin(40.0 * travelled);
    directions.push_back((corners[0] + along * (corners[1] - corners[0]) + weave * over).normalized());
  }
  return through(index, std::move(directions));
}

/// Around the middle of a face, farther from its edges than the bands reach.
std::shared_ptr<const Slide> inside_face(const TriangleIndex& index, std::size_t ticks) {
  const auto corners = index.mesh().corners(0);
  const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
  const Vec3 one = (corners[1] - corners[0]).normalized();
  const Vec3 other = index.mesh().face_normal(0).cross(one);
  const double radius = 0.16 * (corners[1] - corners[0]).norm();
  std::vector<Vec3> directions;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double angle = slide_speed * tick_seconds * static_cast<double>(tick) / radius;
    directions.push_back((middle + radius * (std::cos(angle) * one + std::sin(angle) * other)).normalized());
  }
  return through(index, std::move(directions));
}

}  // namespace

Result<Group> measure_relief(int subdivisions, int map_size, const Effort& effort, double clock_cost) {
  ASPERITY_TRY(HeightMap cosine, cosine_map(map_size));
  ASPERITY_TRY(HeightMap ridges, ridge_map(map_size));
  ASPERITY_TRY(const SharedRelief charted, coated(subdivisions, cosine, Mapping::uv));
  ASPERITY_TRY(const SharedRelief triplanar, coated(subdivisions, cosine, Mapping::triplanar));
  ASPERITY_TRY(const SharedRelief walls, coated(subdivisions, std::move(ridges), Mapping::uv));
  const TriangleIndex& index = charted->base().index();
  Group group;
  group.kind = "relief";
  group.triangles = index.mesh().triangles().size();
  group.bytes_per_triangle = static_cast<double>(index.memory_bytes()) / static_cast<double>(group.triangles);
  group.coat_bytes = charted->memory_bytes() - index.memory_bytes();

  const auto slide = std::make_shared<const Slide>(make_slide(index, effort.ticks()));
  const auto over_ridges = strokes(index, effort.ticks());
  std::vector<Row> rows;
  const auto add = [&](const char* name, const SharedRelief& surface, const std::shared_ptr<const Slide>& on,
                       const Law& law) -> Status {
    ASPERITY_TRY(Row row, step_row(name, surface, on, law));
    rows.push_back(std::move(row));
    return success();
  };
  ASPERITY_CHECK(add(proxy_cosine, charted, slide, ProxyLaw{}));
  ASPERITY_CHECK(add("proxy, cosine, triplanar", triplanar, slide, ProxyLaw{}));
  ASPERITY_CHECK(add("proxy, cosine, UVs, resting", charted, resting_at(*slide), ProxyLaw{}));
  ASPERITY_CHECK(add("proxy, H_1, UVs", walls, over_ridges, ProxyLaw{}));
  ASPERITY_CHECK(add("height-field, cosine, UVs", charted, slide, HeightFieldLaw{}));
  ASPERITY_CHECK(add("mesostructure, cosine, UVs", charted, slide, MesostructureLaw{}));
  if (group.triangles <= 1280) {
    ASPERITY_TRY(HeightMap smaller, cosine_map(map_size / 4));
    ASPERITY_TRY(const SharedRelief per_face, coated(subdivisions, std::move(smaller), Mapping::per_face));
    ASPERITY_CHECK(add(proxy_inside, per_face, inside_face(index, effort.ticks()), ProxyLaw{}));
    ASPERITY_CHECK(add(proxy_edge, per_face, along_edge(index, effort.ticks()), ProxyLaw{}));
  }
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
