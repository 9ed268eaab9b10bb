// Millions of ticks under displaced spheres: never stuck, never fallen through.

#include <algorithm>

#include "tests/render/analytic_relief.h"

namespace asperity::test::endurance_test {
namespace {

struct Endurance {
  std::size_t lost = 0;      // ticks without contact
  std::size_t inside = 0;    // with the proxy off the formula's surface
  std::size_t stuck = 0;     // with the proxy farther away than any true one is
  std::size_t softened = 0;  // with energy that had to be held back
  double farthest = 0.0;     // m, between probe and proxy
};

template <class Off>
Endurance press(const std::shared_ptr<const ReliefSurface>& surface, std::size_t ticks, double depth, double friction,
                double farthest_allowed, const Off& off) {
  Instance instance;
  instance.surface = surface;
  instance.sides = Sides::front;
  instance.material.static_friction = friction;
  instance.material.dynamic_friction = 0.8 * friction;
  const Scene scene = must(Scene::build({instance}, 0.0));
  const double radius = 0.05;
  const double advance = 50e-6 / radius;
  ProxyState state;
  Endurance sum;
  Vec3 place = Vec3(0.3, 1.0, 0.2).normalized();
  touch(scene, state, 1.2 * radius * place);
  Vec3 heading = place.cross(Vec3::UnitX()).normalized();
  for (std::size_t i = 0; i < ticks; ++i) {
    const double travelled = advance * static_cast<double>(i);
    const double turn = advance * (0.9 * std::sin(0.37 * travelled) + 0.6 * std::sin(1.13 * travelled));
    const Vec3 ahead = (place + advance * heading).normalized();
    heading = (heading + turn * ahead.cross(heading));
    heading = (heading - heading.dot(ahead) * ahead).normalized();
    place = ahead;
    const Vec3 probe = (radius - depth) * place;
    const ForceSample felt = touch(scene, state, probe);
    if (!felt.flags.has(TickFlag::contact)) ++sum.lost;
    if (felt.flags.has(TickFlag::energy_limited)) ++sum.softened;
    const double distance = (felt.proxy - probe).norm();
    sum.farthest = std::max(sum.farthest, distance);
    if (distance > farthest_allowed) ++sum.stuck;
    if (off(felt.proxy)) ++sum.inside;
  }
  return sum;
}

void expect_sound(const Endurance& sum) {
  EXPECT_EQ(sum.lost, 0U);
  EXPECT_EQ(sum.inside, 0U);
  EXPECT_EQ(sum.stuck, 0U) << "farthest " << sum.farthest << " m";
  EXPECT_EQ(sum.softened, 0U);
}

TEST(Endurance, a_sphere_baked_onto_a_coarse_base) {
  const WavySphere sphere;
  const auto surface = baked(sphere, 3, 40);
  const auto off = [&](const Vec3& proxy) { return std::abs(sphere.level(proxy)) > 1e-7; };
  expect_sound(press(surface, 2000000, 1.2e-3, 0.0, 1.5e-3, off));
  expect_sound(press(surface, 1000000, 1.2e-3, 0.3, 1.8e-3, off));
}

TEST(Endurance, triplanar_waves_on_icospheres_of_many_sizes) {
  const double tile = 8.0 * 4.9e-3;
  const HeightMap map = map_of(512, [](double s, double t) {
    return 0.15e-3 * std::cos(16.0 * std::numbers::pi * s) * std::cos(16.0 * std::numbers::pi * t);
  });
  for (const int subdivisions : {2, 4, 6}) {
    const auto surface = coated(icosphere(subdivisions, 0.05), map, Mapping::triplanar, tile);
    // The base's own facets lie below the sphere by up to this.
    const TriangleMesh& mesh = surface->base().mesh();
    double sagitta = 0.0;
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face)
      sagitta = std::max(sagitta, 0.05 - mesh.face_normal(face).dot(mesh.corners(face)[0]));
    expect_sound(press(surface, 1000000, sagitta + 1e-3, subdivisions == 4 ? 0.2 : 0.0, 2.0 * sagitta + 1.8e-3,
                       [&](const Vec3& proxy) { return proxy.norm() < 0.05 - sagitta - 0.2e-3; }));
  }
}

}  // namespace
}  // namespace asperity::test::endurance_test
