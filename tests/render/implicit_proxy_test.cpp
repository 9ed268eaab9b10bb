// The proxy law on implicit surfaces: what it shares with isosurfaces is tested there, here what is theirs.

#include <gtest/gtest.h>

#include <random>

#include "asperity/geometry/generators.h"
#include "asperity/render/law_registry.h"
#include "tests/field/volumes.h"
#include "tests/render/implicits.h"

namespace asperity::test::implicit_proxy_test {
namespace {

constexpr double degrees = 57.29577951308232;

class ImplicitProxyEach : public ::testing::TestWithParam<CellReconstruction> {};
INSTANTIATE_TEST_SUITE_P(Both, ImplicitProxyEach,
                         ::testing::Values(CellReconstruction::trilinear, CellReconstruction::smooth));

TEST_P(ImplicitProxyEach, ForceOnASphereIsThatOfTheSphere) {
  const Scene scene =
      Scene::build({implicit_instance(sparse_ball(0.0005, 0.003), ProxyLaw{}, GetParam())}, 0.0).value();
  ProxyState state;
  touch_at(scene, state, Vec3(0, 0, 0.032));
  double sum = 0.0;
  double off = 0.0;
  const int ticks = 20000;
  for (int i = 0; i < ticks; ++i) {
    const double a = 5e-5 * i / 0.03;
    const Vec3 p = 0.029 * Vec3(std::sin(a) * std::cos(0.4 * a), std::sin(a) * std::sin(0.4 * a), std::cos(a));
    const ForceSample out = touch_at(scene, state, p);
    ASSERT_TRUE(out.flags.has(TickFlag::contact));
    sum += std::acos(std::min(1.0, out.wrench.force.normalized().dot(p.normalized()))) * degrees;
    off += std::pow(out.proxy.norm() - 0.03, 2);
  }
  const bool smooth = GetParam() == CellReconstruction::smooth;
  EXPECT_LT(sum / ticks, smooth ? 0.005 : 0.4);
  EXPECT_LT(std::sqrt(off / ticks), smooth ? 0.1e-6 : 1.5e-6);
}

TEST_P(ImplicitProxyEach, ASlabOfHalfAMillimetreIsNeverPassedAtOneMetreASecond) {
  // Voxels coarser than the slab is thick, and finer.
  for (const double voxel : {0.00045, 0.0002}) {
    const Scene scene =
        Scene::build({implicit_instance(sparse_slab(0.0005, 0.01, voxel, 0.003), ProxyLaw{}, GetParam())}, 0.0).value();
    std::mt19937_64 generator(4);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int run = 0; run < 300; ++run) {
      ProxyState state;
      const Vec3 from(0.004 * unit(generator), 0.004 * unit(generator), 0.004);
      const Vec3 direction = Vec3(0.5 * unit(generator), 0.5 * unit(generator), -1.0).normalized();
      touch_at(scene, state, from);
      // 1 mm a tick, on to 4 mm below the slab: longer than what it was ever pressed in.
      for (int i = 1; i <= 8; ++i) {
        const Vec3 p = from + 0.001 * i * direction;
        const ForceSample out = touch_at(scene, state, p);
        ASSERT_GT(out.proxy.z(), 0.0002) << run << " " << i;
        if (p.z() < 0.0002) {
          ASSERT_GT(out.wrench.force.z(), 0.0);
        }
      }
    }
  }
}

TEST_P(ImplicitProxyEach, T5_no_motion_passes_at_any_speed) {
  const auto grid =
      sparse_grid([](const Vec3& p) { return torus_distance(p, 0.02, 0.006); }, cube(0.026), 0.0006, 0.003, 0.003);
  const Scene scene = Scene::build({implicit_instance(grid, ProxyLaw{}, GetParam())}, 0.0).value();
  std::mt19937_64 generator(5);
  int contacts = 0;
  ProxyState state;
  Vec3 p(0.0, 0.0, 0.03);
  touch_at(scene, state, p);
  for (int i = 0; i < 60000; ++i) {
    // 0.01 to 20 m/s at 1 kHz.
    const double length = 1e-5 * std::pow(2000.0, std::uniform_real_distribution<double>(0.0, 1.0)(generator));
    const Vec3 goal = random_point(generator, 0.03);
    const Vec3 way = goal - p;
    p += std::min(length, way.norm()) * way.normalized();
    const ForceSample out = touch_at(scene, state, p);
    contacts += out.flags.has(TickFlag::contact) ? 1 : 0;
    SparseHint hint;
    // Outside, or on the surface to within what interpolation rounds.
    ASSERT_GT(grid->trilinear(out.proxy, hint).value, -3e-5) << i;
  }
  EXPECT_GT(contacts, 4000);
}

TEST(ImplicitProxy, T1_frictionless_loops_give_and_take_nothing) {
  const Scene scene = Scene::build({implicit_instance(sparse_ball(0.0008, 0.003))}, 0.0).value();
  for (int loop = 0; loop < 4; ++loop) {
    ProxyState state;
    const auto at = [&](double t) {
      const double a = 2.0 * 3.14159265358979 * t;
      const double depth = 0.001 + 0.0008 * std::sin(3.0 * a + loop);
      return Vec3((0.03 - depth) *
                  Vec3(0.6 * std::cos(a), 0.6 * std::sin(a), 0.7 + 0.2 * std::sin(2.0 * a)).normalized());
    };
    touch_at(scene, state, 1.2 * at(0.0));
    Vec3 place = at(0.0);
    Vec3 force = touch_at(scene, state, place).wrench.force;
    double work = 0.0;
    const int ticks = 40000;
    for (int i = 1; i <= ticks; ++i) {
      const Vec3 next = at(static_cast<double>(i) / ticks);
      const Vec3 now = touch_at(scene, state, next).wrench.force;
      work += 0.5 * (force + now).dot(next - place);
      place = next;
      force = now;
    }
    // 1e-6 k A, with the area that the loop encloses on the sphere.
    EXPECT_LT(std::abs(work), 1e-6 * 1000.0 * 3.14 * 0.018 * 0.018) << loop;
  }
}

TEST(ImplicitProxy, ABallRestsOnTheLevelOfItsRadius) {
  const auto grid = sparse_box(0.0005, 0.004);
  const Instance instance = implicit_instance(grid);
  const double radius = 0.002;
  const Scene scene = Scene::build({instance}, radius).value();
  ProxyState state;
  touch_at(scene, state, Vec3(0.0, 0.0, 0.03));
  // On a face: the centre stays a radius off, the felt point is on the face.
  ForceSample out = touch_at(scene, state, Vec3(0.004, 0.003, 0.021));
  EXPECT_NEAR(out.proxy.z(), 0.022, 1e-6);
  EXPECT_NEAR(out.wrench.force.z(), 1000.0 * 0.001, 1e-3);
  EXPECT_NEAR(out.contact.point.z(), 0.02, 1e-6);
  // Round an edge: a ball rolls over it, so that its centre is a radius away from the edge.
  for (double t = 0.0; t <= 1.0; t += 0.02) {
    const Vec3 p(0.015 + 0.0065 * t, 0.0, 0.0215 - 0.0065 * t * t);
    out = touch_at(scene, state, p);
    if (!out.flags.has(TickFlag::contact)) continue;
    EXPECT_NEAR(box_distance(out.proxy, Vec3::Constant(0.02)), radius, 5e-5) << t;
  }
  // As the solve for balls on any isosurface does it, on the flat.
  Instance both = instance;
  both.sides = Sides::both;
  const Scene general = Scene::build({both}, radius).value();
  ProxyState other;
  touch_at(general, other, Vec3(0.004, 0.003, 0.03));
  ProxyState again;
  touch_at(scene, again, Vec3(0.004, 0.003, 0.03));
  for (int i = 0; i < 20; ++i) {
    const Vec3 p(0.004 + 2e-5 * i, 0.003, 0.0215);
    EXPECT_NEAR((touch_at(general, other, p).wrench.force - touch_at(scene, again, p).wrench.force).norm(), 0.0, 2e-3);
  }
}

TEST(ImplicitProxy, AnOffsetGivesThinThingsVolume) {
  const auto grid = sparse_slab(0.0005, 0.01, 0.0002, 0.003);
  const Scene scene =
      Scene::build({implicit_instance(grid, ProxyLaw{}, CellReconstruction::smooth, 0.001)}, 0.0).value();
  ProxyState state;
  touch_at(scene, state, Vec3(0, 0, 0.003));
  const ForceSample out = touch_at(scene, state, Vec3(0, 0, 0.0005));
  EXPECT_NEAR(out.proxy.z(), 0.00125, 1e-7);
  EXPECT_NEAR(out.wrench.force.z(), 0.75, 1e-4);
  const ImplicitParts parts{grid, nullptr, nullptr, CellReconstruction::smooth, 0.0028};
  const Result<ImplicitSurface> too_far = ImplicitSurface::build(parts);
  ASSERT_FALSE(too_far);
  EXPECT_EQ(too_far.error().place, "offset");
}

/// A plate whose right half is four times as stiff and rough as its left, over a few voxels.
std::shared_ptr<const SparseGrid> two_materials() {
  SparseSource source = sparse_slab(0.01, 0.02, 0.0005, 0.003)->source();
  for (SparseBlock& block : source.blocks) {
    block.material.resize(SparseBlock::points);
    for (int k = 0; k < 8; ++k) {
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i) {
          const double x = 0.0005 * (8 * block.at[0] + i);
          const double share = std::clamp(0.5 + x / 0.002, 0.0, 1.0);
          PointMaterial& m = block.material[SparseBlock::index(i, j, k)];
          m.stiffness = static_cast<float>(250.0 + 750.0 * share);
          m.static_friction = static_cast<float>(0.4 * share);
          m.dynamic_friction = static_cast<float>(0.3 * share);
        }
      }
    }
  }
  return std::make_shared<const SparseGrid>(SparseGrid::build(std::move(source)).value());
}

TEST(ImplicitProxy, AMagnetLendsAsItsStiffestPlaceDraws) {
  Instance instance = implicit_instance(two_materials());
  instance.law = MagneticLaw{Formulation::consistent, 0.001};
  instance.material.stiffness = 300.0;
  EXPECT_DOUBLE_EQ(Scene::build({instance}, 0.0)->lends(), 1000.0 * 0.001 * 0.001 / 6.0);
}

TEST(ImplicitProxy, MaterialsAreThoseOfTheContact) {
  const Scene scene = Scene::build({implicit_instance(two_materials())}, 0.0).value();
  for (const auto& [x, stiffness] : {std::pair{-0.008, 250.0}, std::pair{0.008, 1000.0}, std::pair{0.0, 625.0}}) {
    ProxyState state;
    touch_at(scene, state, Vec3(x, 0, 0.007));
    const ForceSample out = touch_at(scene, state, Vec3(x, 0, 0.004));
    EXPECT_NEAR(out.wrench.force.norm(), stiffness * 0.001, 1e-3) << x;
  }
  // Dragged along: the left half slips freely, the right half holds 0.3 of the push back.
  for (const auto& [x, held] : {std::pair{-0.012, 0.0}, std::pair{0.008, 0.3}}) {
    ProxyState state;
    touch_at(scene, state, Vec3(x, 0, 0.007));
    ForceSample out;
    for (int i = 0; i < 200; ++i) out = touch_at(scene, state, Vec3(x + 2e-5 * i, 0, 0.004));
    EXPECT_NEAR(-out.wrench.force.x() / out.wrench.force.z(), held, 1e-3) << x;
  }
}

TEST(ImplicitProxy, T1_local_stiffness_gives_no_energy) {
  const Scene scene = Scene::build({implicit_instance(two_materials())}, 0.0).value();
  std::mt19937_64 generator(6);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int loop = 0; loop < 20; ++loop) {
    ProxyState state;
    const double depth = 0.0012;
    const double phase = unit(generator);
    const auto at = [&](double t) {
      const double a = 6.283185307179586 * t;
      return Vec3(0.004 * std::cos(a), 0.003 * std::sin(a + phase), 0.005 - depth - 0.001 * std::sin(a + 3.0 * phase));
    };
    touch_at(scene, state, at(0.0) + Vec3(0, 0, 0.01));
    Vec3 place = at(0.0);
    Vec3 force = touch_at(scene, state, place).wrench.force;
    double work = 0.0;
    for (int i = 1; i <= 3 * 5000; ++i) {
      const Vec3 next = at(i / 5000.0);
      const Vec3 now = touch_at(scene, state, next).wrench.force;
      work += 0.5 * (force + now).dot(next - place);
      place = next;
      force = now;
    }
    EXPECT_LT(work, 1e-7) << loop;
  }
}

/// A place pressed 1 mm into the ball of 30 mm, and one above it.
Vec3 pressed(std::mt19937_64& generator, double radius) {
  return (0.029 + radius) * random_point(generator, 1.0).normalized();
}

TEST_P(ImplicitProxyEach, AnEditedCopyIsTouchedOnFromWhereTheProxyWas) {
  std::mt19937_64 generator(7);
  const auto grid = sparse_ball(0.0008, 0.006);
  SparseSource raised = grid->source();
  for (SparseBlock& block : raised.blocks) {
    for (float& value : block.value) value -= 0.0003F;
  }
  for (const double radius : {0.0, 0.001}) {
    const Scene scene = Scene::build({implicit_instance(grid, ProxyLaw{}, GetParam())}, radius).value();
    const auto same = std::make_shared<const SparseGrid>(SparseGrid::build(grid->source()).value());
    const auto higher = std::make_shared<const SparseGrid>(SparseGrid::build(raised).value());
    const Scene again = Scene::build({implicit_instance(same, ProxyLaw{}, GetParam())}, radius).value();
    const Scene edited = Scene::build({implicit_instance(higher, ProxyLaw{}, GetParam())}, radius).value();
    for (int n = 0; n < 40; ++n) {
      const Vec3 p = pressed(generator, radius);
      ProxyState state;
      touch_at(scene, state, 1.2 * p);
      const Vec3 before = touch_at(scene, state, p).wrench.force;
      ASSERT_NEAR(before.norm(), 1.0, 2e-2);
      EXPECT_NEAR((touch_at(again, state, p).wrench.force - before).norm(), 0.0, 2e-2) << n << " " << radius;
      // Raised: outside still, and no stronger than the spring's energy allows.
      const ForceSample out = touch_at(edited, state, p);
      EXPECT_GT(out.proxy.norm(), 0.0302 + radius) << n;
      EXPECT_GT(out.wrench.force.norm(), 0.5) << n;
      EXPECT_LT(out.wrench.force.norm(), 1.31) << n;
    }
  }
}

TEST_P(ImplicitProxyEach, K_3_DirectionOnATurnedBoxIsTheFacesFromThreeVoxelsOn) {
  const double half = 0.02;
  const double voxel = 0.8e-3;
  std::mt19937_64 generator(23);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  double near = 0.0;
  for (int turn = 0; turn < 4; ++turn) {
    const Mat3 turned =
        Eigen::AngleAxisd(any(generator), Vec3(any(generator), any(generator), any(generator)).normalized())
            .toRotationMatrix();
    const Vec3 size = turned.cwiseAbs() * Vec3::Constant(half);
    Box box;
    box.lower = -size;
    box.upper = size;
    const auto grid =
        sparse_grid([&](const Vec3& p) { return box_distance(turned.transpose() * p, Vec3::Constant(half)); }, box,
                    voxel, 4.0 * voxel, 4.0 * voxel);
    const Scene scene = Scene::build({implicit_instance(grid, ProxyLaw{}, GetParam())}, 0.0).value();
    for (int n = 0; n < 400; ++n) {
      // Straight down on the top, 0 to 6 voxels from its edge.
      const double from_edge = 6.0 * voxel * (n / 400.0);
      const Vec3 place(half - from_edge, 0.6 * half * any(generator), half);
      ProxyState state;
      touch_at(scene, state, turned * (place + Vec3(0.0, 0.0, 2e-3)));
      const ForceSample out = touch_at(scene, state, turned * (place - Vec3(0.0, 0.0, 0.2 * voxel)));
      if (!out.flags.has(TickFlag::contact)) continue;  // the edge itself is rounded off
      const Vec3 normal = turned * Vec3::UnitZ();
      const double off = std::atan2(out.wrench.force.cross(normal).norm(), out.wrench.force.dot(normal)) * degrees;
      // A smooth cell reads nodes up to two voxels beyond its own.
      if (from_edge > 3.0 * std::numbers::sqrt2 * voxel) {
        EXPECT_LT(off, 0.05) << from_edge / voxel;
      }
      near = std::max(near, from_edge < voxel ? off : 0.0);
    }
  }
  EXPECT_GT(near, 3.0);
}

TEST(ImplicitProxy, LawsWithoutAProxyKeepPushingOnAnEditedCopy) {
  const auto grid = sparse_ball(0.0008, 0.006);
  // One copy is edited on the far side alone; from the other 0.3 mm are taken off all over.
  SparseSource source = grid->source();
  std::vector<SparseBlock> far;
  std::vector<SparseBlock> all;
  for (const SparseBlock& block : source.blocks) {
    SparseBlock shaved = block;
    for (float& value : shaved.value) value += 0.0003F;
    if (block.at[2] < 0) far.push_back(shaved);
    all.push_back(std::move(shaved));
  }
  ASSERT_FALSE(far.empty());
  const auto elsewhere = std::make_shared<const SparseGrid>(grid->edited(far).value());
  const auto shaved = std::make_shared<const SparseGrid>(grid->edited(all).value());
  for (const char* name : {"virtual-contact-point", "magnetic", "avila"}) {
    const Law law = law_by_name(name).value();
    const Scene scene = Scene::build({implicit_instance(grid, law)}, 0.0).value();
    const Scene untouched = Scene::build({implicit_instance(elsewhere, law)}, 0.0).value();
    const Scene lower = Scene::build({implicit_instance(shaved, law)}, 0.0).value();
    ProxyState state;
    touch_at(scene, state, Vec3(0, 0, 0.035));
    const Vec3 before = touch_at(scene, state, Vec3(0, 0, 0.0295)).wrench.force;
    ASSERT_NEAR(before.z(), 0.5, 0.01) << name;
    EXPECT_NEAR((touch_at(untouched, state, Vec3(0, 0, 0.0295)).wrench.force - before).norm(), 0.0, 1e-6) << name;
    // What is left of the old force fades; the surface under it is 0.2 mm away.
    Vec3 after;
    for (int i = 0; i < 400; ++i) after = touch_at(lower, state, Vec3(0, 0, 0.0295)).wrench.force;
    EXPECT_NEAR(after.z(), 0.2, 0.01) << name;
  }
}

TEST(ImplicitProxy, AnotherLawOnTheSameSurfaceStartsAfresh) {
  const auto grid = sparse_ball(0.0008, 0.006);
  const Instance first = implicit_instance(grid);
  const char* names[] = {"proxy", "virtual-contact-point", "virtual-contact-point-literal", "magnetic",
                         "avila", "cross-uncross"};
  for (const char* from : names) {
    for (const char* to : names) {
      Instance a = first;
      a.law = law_by_name(from).value();
      Instance b = first;
      b.law = law_by_name(to).value();
      const Scene before = Scene::build({a}, 0.0).value();
      const Scene after = Scene::build({b}, 0.0).value();
      ProxyState state;
      touch_at(before, state, Vec3(0.001, 0, 0.035));
      for (int i = 0; i < 5; ++i) touch_at(before, state, Vec3(0.001, 0, 0.0295));
      // No harder than what presses, and right again after a new approach.
      for (int i = 0; i < 5; ++i) {
        EXPECT_LT(touch_at(after, state, Vec3(0.001, 0, 0.0295)).wrench.force.norm(), 0.6) << from << " " << to;
      }
      touch_at(after, state, Vec3(0.001, 0, 0.035));
      const Vec3 force = touch_at(after, state, Vec3(0.001, 0, 0.0295)).wrench.force;
      EXPECT_NEAR(force.norm(), 0.5, 0.05) << from << " " << to;
    }
  }
}

TEST(ImplicitProxy, ABallFeelsTheMaterialThatItTouches) {
  // The material lies in a thin layer at the surface, where a ball's centre never is.
  SparseSource source = sparse_slab(0.01, 0.02, 0.0005, 0.004)->source();
  for (SparseBlock& block : source.blocks) {
    block.material.resize(SparseBlock::points);
    for (std::size_t n = 0; n < SparseBlock::points; ++n) {
      if (std::abs(block.value[n]) < 0.00075F) block.material[n].stiffness = 200.0F;
    }
  }
  const auto grid = std::make_shared<const SparseGrid>(SparseGrid::build(std::move(source)).value());
  for (const Sides sides : {Sides::front, Sides::both}) {
    Instance instance = implicit_instance(grid);
    instance.sides = sides;
    const Scene scene = Scene::build({instance}, 0.002).value();
    ProxyState state;
    touch_at(scene, state, Vec3(0, 0, 0.01));
    EXPECT_NEAR(touch_at(scene, state, Vec3(0, 0, 0.006)).wrench.force.z(), 0.2, 5e-3);
  }
}

TEST(ImplicitProxy, NormalPerturbationAndAnOffsetDoNotGoTogether) {
  auto mesh = std::make_shared<const MeshSurface>(
      TriangleIndex::build(TriangleMesh::build(box_mesh(Vec3::Constant(0.04))).value()));
  const auto grid = sparse_box(0.0005, 0.004);
  Instance instance = implicit_instance(grid);
  instance.law = NormalPerturbationLaw{};
  instance.surface = std::make_shared<const ImplicitSurface>(
      ImplicitSurface::build({grid, grid, mesh, CellReconstruction::smooth, 0.001}).value());
  const Result<Scene> scene = Scene::build({instance}, 0.0);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::unsupported_pair);
  EXPECT_NE(scene.error().what.find("implicit.offset"), std::string::npos) << scene.error().what;
}

}  // namespace
}  // namespace asperity::test::implicit_proxy_test
