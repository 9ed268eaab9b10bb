#include <gtest/gtest.h>

#include <limits>

#include "tests/render/implicit_touch.h"

namespace asperity::normal_perturbation_test {
namespace {

using implicit::angle_between;
using implicit::PointTouch;
using test::stiffness;

constexpr double voxel = 0.5e-3;
constexpr double half = 0.02;         // m, of the box
constexpr double amplitude = 0.2e-3;  // m
constexpr double wavelength = 8e-3;   // m

double box_at(const Vec3& p) {
  return test::box_distance(p, Vec3::Constant(half));
}
/// Waves along x + z, so that top and side carry them.
double wave(const Vec3& p) {
  return amplitude * std::sin(2.0 * std::numbers::pi * (p.x() - 1.3 * p.z()) / wavelength);
}
double wave_slope(const Vec3& p) {
  constexpr double k = 2.0 * std::numbers::pi / wavelength;
  return amplitude * k * std::cos(k * (p.x() - 1.3 * p.z()));
}

std::shared_ptr<const ImplicitSurface> textured_box() {
  ImplicitParts parts;
  const double band = 5e-3;
  parts.untextured = test::sparse_grid(box_at, test::cube(half), voxel, band, band);
  parts.grid =
      test::sparse_grid([](const Vec3& p) { return box_at(p) - wave(p); }, test::cube(half), voxel, band, band);
  parts.mesh =
      std::make_shared<const MeshSurface>(TriangleIndex::build(test::mesh_of(box_mesh(Vec3::Constant(2.0 * half)))));
  return std::make_shared<const ImplicitSurface>(test::must(ImplicitSurface::build(std::move(parts))));
}

const std::shared_ptr<const ImplicitSurface>& shared_box() {
  static const auto surface = textured_box();
  return surface;
}

struct Rival {
  std::shared_ptr<const ImplicitSurface> surface = shared_box();
  Material material{};
  Contact state{};
  SurfaceCache cache{};
  LawForce at(const Vec3& p) {
    return test::asked(NormalPerturbationLaw{}, surface, std::monostate(), material, p, Vec3::Zero(), Seconds(1e-3),
                       state, cache);
  }
};

TEST(NormalPerturbation, ForceIsStiffnessTimesDepthAndHeightAlongTheTurnedNormal) {
  Rival touch;
  touch.at(Vec3(0.0, 0.0, half + 4e-3));
  Rng rng(3);
  int pushed = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 foot(rng.uniform(-0.012, 0.012), rng.uniform(-0.012, 0.012), half);
    const double depth = rng.uniform(-0.5e-3, 2e-3);
    const LawForce force = touch.at(foot - Vec3(0.0, 0.0, depth));
    const double felt = depth + wave(foot);
    if (std::abs(felt) < 5e-6) continue;  // between nodes the height is interpolated
    ASSERT_EQ(force.contact, felt > 0.0);
    EXPECT_NEAR(force.height, wave(foot), 6e-6);
    if (!force.contact) continue;
    ++pushed;
    // f' = f - h, so that height rises where f' falls.
    const Vec3 normal = Vec3(-wave_slope(foot), 0.0, 1.0).normalized();
    EXPECT_LT(angle_between(force.force, normal), 2.5);
    EXPECT_NEAR(force.force.norm(), stiffness * felt, stiffness * 6e-6);
    EXPECT_NEAR(force.penetration, felt, 6e-6);
    EXPECT_LT(std::abs(force.force.y()), 1e-6);
    EXPECT_LT((touch.surface->mesh()->mesh().face_normal(force.element) - Vec3::UnitZ()).norm(), 1e-12);
  }
  EXPECT_GT(pushed, 300);
}

TEST(NormalPerturbation, IsFeltFromTheFrontAlone) {
  Rival touch;
  const Vec3 inside(0.001, 0.002, half - 1e-3);
  EXPECT_FALSE(touch.at(inside).contact);
  EXPECT_FALSE(touch.at(Vec3::Zero()).contact);
  touch.at(Vec3(0.001, 0.002, half + 1e-3));
  EXPECT_TRUE(touch.at(inside).contact);
  // However deep: the mesh's nearest point is found everywhere.
  EXPECT_NEAR(touch.at(Vec3(0.0, 0.0, 0.001)).force.norm(), stiffness * 0.019, stiffness * 1.01 * amplitude);
}

TEST(NormalPerturbation, JumpsWhereTheNearestFaceChanges) {
  // Along the bisector's normal, 2 mm deep: of the textured potential nothing jumps.
  const Vec3 from(half - 2e-3 - 2e-3, 0.001, half - 2e-3);
  const Vec3 to(half - 2e-3 + 1.5e-3, 0.001, half - 2e-3);
  Rival rival;
  PointTouch ours{rival.surface, {}, {}};
  double last_rival = 0.0;
  double last_ours = 0.0;
  double last_step = 0.0;
  for (const double step : {1e-5, 1e-6, 2e-7}) {
    implicit::forget(rival.state);
    rival.at(Vec3(0.0, 0.0, half + 4e-3));
    std::vector<Vec3> forces;
    const int count = static_cast<int>((to - from).norm() / step);
    for (const Vec3& p : test::line(from, to, count)) forces.push_back(rival.at(p).force);
    const double jump = test::largest_jump(forces);
    const double smooth = implicit::largest_jump_on(ours, from, to, step);
    EXPECT_GT(jump, 1.0);  // 2 N turned by 90 degrees and more
    if (last_rival > 0.0) {
      EXPECT_NEAR(jump, last_rival, 0.1);
      EXPECT_NEAR(last_ours / smooth, last_step / step, 0.2 * last_step / step);
    }
    last_rival = jump;
    last_ours = smooth;
    last_step = step;
  }
}

TEST(NormalPerturbation, ProbesThatMeanNothingAreNotFelt) {
  Rival touch;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& p : {Vec3(nan, 0.0, 0.0), Vec3(0.0, infinity, 0.0), Vec3(1e6, -1e6, 1e6)}) {
    EXPECT_FALSE(touch.at(p).contact);
    EXPECT_TRUE(touch.at(p).force.isZero());
  }
}

TEST(NormalPerturbation, StepAddsTheMaterialsDamping) {
  Rival touch;
  Instance instance;
  instance.name = "box";
  instance.surface = touch.surface;
  instance.law = NormalPerturbationLaw{};
  instance.material.damping = 2.0;
  const Scene scene = test::must(Scene::build({instance}, 0.0));
  ProxyState state;
  const Vec3 outside(0.001, 0.002, half + 1e-3);
  const Vec3 inside(0.001, 0.002, half - 1e-3);
  test::touch(scene, state, outside);
  touch.at(outside);
  ProbeSample probe = test::probe_at(inside);
  probe.twist.linear = Vec3(0.0, 0.0, -0.1);
  const ForceSample felt = step(scene, state, probe, test::tick);
  const LawForce direct = touch.at(inside);
  const Vec3 expected = direct.force + 2.0 * 0.1 * direct.normal.z() * direct.normal;
  EXPECT_LT((felt.wrench.force - expected).norm(), 1e-9);
}

}  // namespace
}  // namespace asperity::normal_perturbation_test
