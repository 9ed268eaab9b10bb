// Scanned meshes, photographed rock and a measured surface: what the generators cannot stand for.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

#include "asperity/io/image_io.h"
#include "asperity/io/mesh_io.h"
#include "tests/render/fixtures.h"

namespace asperity::real_input_test {
namespace {

using namespace test;

const std::filesystem::path shared = ASPERITY_SHARED_DATA;

#define SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "shared data absent: " << (path)

/// The mesh of a file, brought to a size of 0.1 m.
MeshSource fitted(const std::filesystem::path& path) {
  MeshSource source = must(read_mesh(path));
  Box box;
  for (const Vec3& p : source.positions) box.include(p);
  const double scale = 0.1 / box.extent().maxCoeff();
  for (Vec3& p : source.positions) p = scale * (p - box.centre());
  return source;
}

const std::filesystem::path rock = shared / "textures/ambientcg/rock023_alb_ht.png";

HeightMap rock_heights(double amplitude) {
  HeightMapSettings settings;
  settings.amplitude = amplitude;
  settings.offset = -0.5 * amplitude;
  return must(HeightMap::build(must(read_image(rock)), Channel::alpha, settings));
}

/// A path over the surface, pressed in by `depth` below the lowest relief, in steps of about `step`; from above at
/// first.
std::vector<Vec3> pressed_walk(const ReliefSurface& surface, double depth, double step, int count, Rng& rng) {
  const TriangleMesh& mesh = surface.base().mesh();
  std::uint32_t face = random_face(rng, mesh);
  Vec3 p = point_on(mesh, face, Vec3::Constant(1.0 / 3.0));
  Vec3 heading = random_direction(rng);
  std::vector<Vec3> path{p + 5e-3 * mesh.face_normal(face)};
  SurfaceCache cache;
  for (int i = 0; i < count; ++i) {
    const Foot foot = surface.base().view(cache).nearest(p, infinity);
    const Vec3 normal = interpolated_normal(mesh, foot.element, foot.at);
    path.emplace_back(foot.point - depth * normal);
    heading = (heading - heading.dot(normal) * normal).normalized();
    p = foot.point + step * heading;
  }
  return path;
}

struct Felt {
  double strongest = 0.0;
  double jump = 0.0;
  double contact_share = 0.0;
};

/// Walks over a coated mesh, twice: finite, in contact and the same both times.
Felt walk(const std::shared_ptr<const ReliefSurface>& surface, const Law& law, double depth, double step) {
  const Scene scene = scene_of(surface, law);
  Felt felt;
  int contacts = 0;
  int ticks = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    const auto path = pressed_walk(*surface, depth, step, 1500, rng);
    const auto forces = slide(scene, path);
    EXPECT_EQ(forces, slide(scene, path)) << "deterministic";
    for (std::size_t i = 1; i < forces.size(); ++i) {
      EXPECT_TRUE(forces[i].allFinite());
      felt.strongest = std::max(felt.strongest, forces[i].norm());
      contacts += forces[i].norm() > 0.0 ? 1 : 0;
      ++ticks;
      if (i > 1) felt.jump = std::max(felt.jump, (forces[i] - forces[i - 1]).norm());
    }
  }
  felt.contact_share = static_cast<double>(contacts) / ticks;
  return felt;
}

TEST(RealInput, rock_on_the_bunny_is_felt_without_jumps) {
  const auto file = shared / "meshes/bunny-28k.obj";
  SKIP_WITHOUT(file);
  SKIP_WITHOUT(rock);
  const auto surface = coated(fitted(file), rock_heights(2e-4), Mapping::triplanar, 0.05);
  EXPECT_FALSE(surface->base().mesh().has_uvs());
  for (const char* law : {"proxy", "mesostructure", "height-field", "force-shading", "god-object"}) {
    const Felt felt = walk(surface, named(law), 3e-4, 2e-6);
    EXPECT_GT(felt.contact_share, 0.95) << law;
    EXPECT_LT(felt.strongest, 2.0) << law << ": k times a depth of 0.3 mm and a relief of 0.1 mm, slopes included";
  }
  // The base's own folds are felt unless they are asked to be rounded.
  const auto rounded = coated(fitted(file), rock_heights(2e-4), Mapping::triplanar, 0.05, 1.0,
                              Stitching{FoldMode::round, Blend::quintic, 0.2, {}});
  EXPECT_LT(walk(rounded, named("mesostructure"), 3e-4, 2e-6).jump, 0.05) << "N in a step of 2 um";
}

TEST(RealInput, millions_of_ticks_under_the_rocky_bunny_are_never_stuck_nor_through) {
  const auto file = shared / "meshes/bunny-28k.obj";
  SKIP_WITHOUT(file);
  SKIP_WITHOUT(rock);
  const double amplitude = 2e-4;
  const double depth = 5e-4;
  const auto surface = coated(fitted(file), rock_heights(amplitude), Mapping::triplanar, 0.05);
  const TriangleMesh& mesh = surface->base().mesh();
  Instance instance;
  instance.surface = surface;
  instance.sides = Sides::front;
  const Scene scene = must(Scene::build({instance}, 0.0));
  std::size_t lost = 0;
  std::size_t stuck = 0;
  std::size_t open = 0;
  SurfaceCache cache;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Rng rng(seed);
    std::uint32_t face = random_face(rng, mesh);
    Vec3 p = point_on(mesh, face, Vec3::Constant(1.0 / 3.0));
    Vec3 heading = random_direction(rng);
    ProxyState state;
    ProxyCache remembered;
    const auto touched = [&](const Vec3& at) { return step(scene, state, remembered, probe_at(at), tick); };
    touched(p + 5e-3 * mesh.face_normal(face));
    for (int i = 0; i < 100000; ++i) {
      const Foot foot = surface->base().view(cache).nearest(p, infinity);
      const Vec3 normal = interpolated_normal(mesh, foot.element, foot.at);
      const Vec3 probe = foot.point - depth * normal;
      const ForceSample felt = touched(probe);
      heading = (heading - heading.dot(normal) * normal).normalized();
      p = foot.point + 2e-5 * heading;
      lost += felt.flags.has(TickFlag::contact) ? 0U : 1U;
      open += unfinished(felt.flags) ? 1U : 0U;
      if (!felt.flags.has(TickFlag::contact) || unfinished(felt.flags)) continue;
      // At rest within a face the spring stands straight on the relief: nothing holds the proxy back.
      const Contact& contact = state.contacts[0];
      ASSERT_TRUE(contact.surface.rests && contact.first().known());
      const Place place = contact.first();
      const bool inside = place.at.minCoeff() > 1e-9;
      const Vec3 front = surface->view(cache).at(place).front;
      const Vec3 spring = felt.proxy - probe;
      stuck += inside && spring.cross(front).norm() > 1e-3 * spring.norm() + 1e-7 ? 1U : 0U;
    }
  }
  EXPECT_EQ(lost, 0U);
  EXPECT_EQ(stuck, 0U);
  // Slipping off a ridge, the proxy may have farther to go than one tick's budget leads it; it goes on in the next.
  EXPECT_LE(open, 800U) << "of four million";
}

TEST(RealInput, rock_on_spot_is_felt_over_its_uv_seams) {
  const auto file = shared / "meshes/spot.obj";
  SKIP_WITHOUT(file);
  SKIP_WITHOUT(rock);
  const auto surface = coated(fitted(file), rock_heights(2e-4), Mapping::uv, 0.1, 1.0,
                              Stitching{FoldMode::round, Blend::quintic, 0.2, {}});
  EXPECT_TRUE(surface->coat().has_seams());
  const Felt felt = walk(surface, named("mesostructure"), 3e-4, 2e-6);
  EXPECT_GT(felt.contact_share, 0.95);
  EXPECT_LT(felt.strongest, 2.0);
  // Below 1e-3 N nearly everywhere; around spot's sharpest folds the rounding itself is that tight.
  EXPECT_LT(felt.jump, 0.1) << "N in a step of 2 um";
  const auto kept = coated(fitted(file), rock_heights(2e-4), Mapping::uv, 0.1);
  EXPECT_GT(walk(kept, named("proxy"), 3e-4, 2e-6).contact_share, 0.95);
}

TEST(RealInput, spots_uv_seams_do_not_break_adjacency) {
  const auto file = shared / "meshes/spot.obj";
  SKIP_WITHOUT(file);
  const TriangleMesh mesh = mesh_of(must(read_mesh(file)));
  ASSERT_TRUE(mesh.has_uvs());
  EXPECT_TRUE(mesh.report().closed());
  int seams = 0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t other = mesh.neighbour(face, edge);
      ASSERT_NE(other, no_index);
      const std::uint32_t vertex = mesh.triangles()[face][static_cast<std::size_t>(edge)];
      for (std::size_t i = 0; i < 3; ++i) {
        if (mesh.triangles()[other][i] == vertex &&
            mesh.uvs(other)[i] != mesh.uvs(face)[static_cast<std::size_t>(edge)])
          ++seams;
      }
    }
  }
  EXPECT_GT(seams, 0);
}

TEST(RealInput, a_measured_surface_on_a_plane_is_followed_at_its_own_scale) {
  const auto file = shared / "topography/matrix-2_height16.png";
  const auto scale = shared / "topography/matrix-2_height16.json";
  SKIP_WITHOUT(file);
  SKIP_WITHOUT(scale);
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(scale), nullptr, false);
  ASSERT_FALSE(json.is_discarded());
  HeightMapSettings settings;
  settings.offset = json["height_min_m"].get<double>();
  settings.amplitude = json["height_max_m"].get<double>() - settings.offset;
  const HeightMap map = must(HeightMap::build(must(read_image(file)), Channel::automatic, settings));
  const double side = map.width() * json["pixel_size_m"][0].get<double>();
  // A hand of 1 N/m pressing 5 uN: the surface is micrometres high.
  const Scene scene =
      scene_of(coated(plane_grid(side, side, 8, 8), map, Mapping::uv, side), named("mesostructure"), 1.0);
  ProxyState state;
  double squares = 0.0;
  int samples = 0;
  for (const Vec3& base : line(Vec3(-0.4 * side, -0.3 * side, 0.0), Vec3(0.4 * side, 0.35 * side, 0.0), 400)) {
    const double z = height_at_force(scene, state, base, Vec3::UnitZ(), 5e-6, 3.0 * settings.amplitude, -1e-4) + 5e-6;
    squares += std::pow(z - map.height_at(Vec2(base.x() / side + 0.5, base.y() / side + 0.5)), 2);
    ++samples;
  }
  EXPECT_LT(std::sqrt(squares / samples), 0.05 * settings.amplitude);
}

}  // namespace
}  // namespace asperity::real_input_test
