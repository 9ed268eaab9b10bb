// Surfaces and laws of one's own under `step`: the same invariants as of those that are built in.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstring>

#include "asperity/geometry/generators.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/touched_surface.h"
#include "tests/render/fixtures.h"
#include "tests/surface/custom_fields.h"

namespace asperity::custom_test {
namespace {

using namespace test;

template <class Field>
Surface surface_of(Field field) {
  return std::make_shared<const CustomSurface>(must(CustomSurface::build(std::move(field))));
}

Surface parametric_ball(double radius) {
  ParametricSettings settings;
  settings.shape = ParametricShape::sphere;
  settings.radius = radius;
  return std::make_shared<const ParametricSurface>(must(ParametricSurface::build(settings)));
}

Surface floor_mesh() {
  return std::make_shared<const MeshSurface>(
      TriangleIndex::build(must(TriangleMesh::build(plane_grid(0.2, 0.2, 8, 8)))));
}

Instance instance_of(Surface surface, Sides sides = Sides::front, double friction = 0.0) {
  Instance instance;
  instance.name = "test";
  instance.surface = std::move(surface);
  instance.sides = sides;
  instance.material.stiffness = stiffness;
  instance.material.static_friction = friction;
  instance.material.dynamic_friction = 0.8 * friction;
  return instance;
}

// --- Surfaces -------------------------------------------------------------------------------------------------------

TEST(CustomSurfaceProxy, PushesAsTheFormulaSays) {
  for (const double radius : {0.0, 0.004}) {
    const Scene scene = must(Scene::build({instance_of(surface_of(SmoothBall{}))}, radius));
    const Vec3 out = Vec3(1.0, 2.0, -1.5).normalized();
    const double depth = 1.5e-3;
    const Vec3 place = (0.03 + radius - depth) * out;
    const ForceSample felt = poke(scene, 0.05 * out, place);
    EXPECT_LT((felt.wrench.force - stiffness * depth * out).norm(), 1e-4) << radius;
    EXPECT_LT((felt.contact.point - 0.03 * out).norm(), 2e-5);
    EXPECT_TRUE(felt.flags.has(TickFlag::contact));
  }
}

TEST(CustomSurfaceProxy, ABallLiesInACornerAgainstBothWalls) {
  for (const double radius : {1e-3, 8e-3}) {
    const Scene scene = must(Scene::build({instance_of(surface_of(Corner{}))}, radius));
    ProxyState state;
    touch(scene, state, Vec3(0.02, 0.0, 0.02));
    for (int i = 0; i <= 40; ++i) {
      const double into = 5e-4 * i;
      const Vec3 place(std::max(0.02 - into, radius - 1e-3), 1e-4 * i, std::max(0.02 - 0.9 * into, radius - 2e-3));
      const ForceSample felt = touch(scene, state, place);
      const Vec3 rest(std::max(place.x(), radius), place.y(), std::max(place.z(), radius));
      ASSERT_FALSE(unfinished(felt.flags)) << radius << " " << i;
      ASSERT_LT((state.proxy - rest).norm(), 1e-5) << radius << " " << i;
      ASSERT_LT((felt.wrench.force - stiffness * (rest - place)).norm(), 1e-5 * stiffness) << radius << " " << i;
    }
  }
}

TEST(CustomSurfaceProxy, ABallComesToRestInTheRoomsOfAGyroid) {
  const Instance sheet = instance_of(surface_of(GyroidSheet{}), Sides::both);
  const CustomView view = custom_of(sheet.surface)->view();
  Rng rng(92);
  int unfinished_ticks = 0;
  int touching = 0;
  for (const double radius : {5e-4, 3e-3}) {
    const Scene scene = must(Scene::build({sheet}, radius));
    ProxyState state;
    // In the middle of one of its rooms; from there it is led against the walls.
    Vec3 place(0.0, 0.0, 0.0);
    for (int i = 0; i < 40 && view.nearest(place, infinity).distance < 1.2 * radius; ++i)
      place = 5e-3 * random_direction(rng);
    const Vec3 middle = place;
    touch(scene, state, place);
    Vec3 heading = Vec3::Zero();
    for (int i = 0; i < 400; ++i) {
      if (i % 40 == 0) heading = 1e-4 * random_direction(rng);
      if ((place - middle).norm() > 4e-3) heading = -1e-4 * (place - middle).normalized();
      place += heading;
      const ForceSample felt = touch(scene, state, place);
      unfinished_ticks += unfinished(felt.flags) ? 1 : 0;
      const double kept = view.nearest(state.proxy, infinity).distance;
      ASSERT_GT(kept, radius * (1.0 - 1e-4)) << radius << " " << i;
      if (!felt.flags.has(TickFlag::contact)) continue;
      ++touching;
      ASSERT_LT(kept, radius + 1e-3 * view.grain()) << radius << " " << i;
    }
  }
  EXPECT_GT(touching, 200);
  EXPECT_EQ(unfinished_ticks, 0);
}

TEST(CustomSurfaceProxy, SlidesLikeTheParametricSphere) {
  for (const double friction : {0.0, 0.3}) {
    const Scene own = must(Scene::build({instance_of(surface_of(Ball{}), Sides::front, friction)}, 0.0));
    const Scene other = must(Scene::build({instance_of(parametric_ball(0.03), Sides::front, friction)}, 0.0));
    std::vector<Vec3> path;
    for (int i = 0; i <= 800; ++i) path.emplace_back(0.029 * Vec3(std::sin(2e-3 * i), 0.1, std::cos(2e-3 * i)));
    const std::vector<Vec3> mine = slide(own, path, Vec3(1.3 * path.front()));
    const std::vector<Vec3> theirs = slide(other, path, Vec3(1.3 * path.front()));
    for (std::size_t i = 0; i < path.size(); ++i)
      ASSERT_LT((mine[i] - theirs[i]).norm(), 0.01 * theirs[i].norm() + 1e-3) << friction << " at " << i;
  }
}

// A ball touches its box where it is widest: there its tangents lead out of the box, and the surface does not end.
TEST(CustomSurfaceProxy, GoesOnWhereTheSurfaceTouchesItsBox) {
  const double radius = 0.011;
  const Scene smooth = must(Scene::build({instance_of(surface_of(SmoothBall{Ball{radius}}))}, 0.0));
  const Scene plain = must(Scene::build({instance_of(surface_of(Ball{radius}))}, 0.0));
  for (const Scene* scene : {&smooth, &plain}) {
    Rng rng(7);
    for (int stroke = 0; stroke < 600; ++stroke) {
      // From one side of a pole over it, by chance right over it, to the other side.
      Vec3 pole = Vec3::Zero();
      pole[static_cast<int>(rng.below(3))] = rng.below(2) == 0 ? 1.0 : -1.0;
      const Vec3 way = pole.unitOrthogonal();
      const Vec3 across = std::cos(rng.uniform(0.0, 6.28)) * way + std::sin(rng.uniform(0.0, 6.28)) * pole.cross(way);
      const Vec3 aside =
          rng.uniform(0.0, 1.0) < 0.5 ? Vec3(Vec3::Zero()) : Vec3(rng.uniform(-0.1, 0.1) * pole.cross(across));
      const auto out = [&](double angle) { return Vec3((pole + angle * across + aside).normalized()); };
      const Vec3 from = out(-rng.uniform(0.01, 0.4));
      const Vec3 to = out(rng.uniform(0.01, 0.4));
      const double depth = rng.uniform(1e-4, 2e-3);
      ProxyState state;
      touch(*scene, state, 1.2 * radius * from);
      touch(*scene, state, (radius - depth) * from);
      const ForceSample felt = touch(*scene, state, (radius - depth) * to);
      ASSERT_LT((felt.proxy - radius * to).norm(), 1e-6)
          << "stroke " << stroke << " from " << from.transpose() << " to " << to.transpose();
    }
  }
}

TEST(CustomSurfaceProxy, ForceStaysInTheConeOfFriction) {
  const double friction = 0.4;
  const Scene scene = must(Scene::build({instance_of(surface_of(Torus{}), Sides::front, friction)}, 0.0));
  ProxyState state;
  touch(scene, state, Vec3(0.03, 0.0, 0.02));
  for (int i = 0; i < 600; ++i) {
    const ForceSample felt = touch(scene, state, Vec3(0.03 * std::cos(5e-3 * i), 0.03 * std::sin(5e-3 * i), 0.009));
    ASSERT_TRUE(felt.flags.has(TickFlag::contact)) << i;
    const Vec3 normal = Vec3::UnitZ();
    const double push = felt.wrench.force.dot(normal);
    EXPECT_GT(push, 0.0);
    EXPECT_LE((felt.wrench.force - push * normal).norm(), friction * push * 1.02 + 1e-3) << i;
  }
}

TEST(CustomSurfaceProxy, BothSidesHoldFromWithin) {
  const Vec3 inside(0.0, 0.0, 0.028);
  const Vec3 outside(0.0, 0.0, 0.032);
  const Scene both = must(Scene::build({instance_of(surface_of(Ball{}), Sides::both)}, 0.0));
  EXPECT_NEAR(poke(both, inside, outside).wrench.force.z(), -stiffness * 2e-3, 1e-3);
  EXPECT_NEAR(poke(both, outside, inside).wrench.force.z(), stiffness * 2e-3, 1e-3);
  const Scene front = must(Scene::build({instance_of(surface_of(Ball{}), Sides::front)}, 0.0));
  EXPECT_EQ(poke(front, inside, outside).wrench.force.norm(), 0.0);
  EXPECT_NEAR(poke(front, outside, inside).wrench.force.z(), stiffness * 2e-3, 1e-3);
}

/// A probe that wanders about, in steps of up to `stride` (m) a coordinate, kept within a ball.
class Wanderer {
 public:
  Wanderer(std::uint64_t seed, double stride, double within) : state_(seed), stride_(stride), within_(within) {}
  Vec3 next(const Vec3& from) {
    Vec3 to = from + stride_ * Vec3(share(), share(), share());
    if (to.norm() > within_) to *= within_ / to.norm();
    return to;
  }

 private:
  double share() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state_ >> 11U) * (2.0 / 9007199254740992.0) - 1.0;
  }
  std::uint64_t state_;
  double stride_;
  double within_;
};

template <class Field>
void expect_never_through(const Field& field, Sides sides, double radius, double stride, const Vec3& start) {
  const Scene scene = must(Scene::build({instance_of(surface_of(field), sides, 0.2)}, radius));
  const double side = field.eval(start).value < 0.0 ? -1.0 : 1.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Wanderer wanderer(seed, stride, 0.027);
    ProxyState state;
    Vec3 probe = start;
    int touching = 0;
    for (int i = 0; i < 400; ++i) {
      touching += touch(scene, state, probe).flags.has(TickFlag::contact) ? 1 : 0;
      ASSERT_GT(side * field.eval(state.proxy).value, 0.0) << "seed " << seed << ", tick " << i;
      probe = wanderer.next(probe);
    }
    EXPECT_GT(touching, 20);
  }
}

TEST(CustomSurfaceProxy, NeverGetsThroughAGyroid) {
  const GyroidSheet field;
  for (const double radius : {0.0, 1e-3}) {
    expect_never_through(field, Sides::both, radius, 1.5e-3, Vec3(0.005, 0.0, 0.0));
    expect_never_through(field, Sides::both, radius, 8e-3, Vec3(0.005, 0.0, 0.0));
  }
}

TEST(CustomSurfaceProxy, NeverGetsIntoATorus) {
  for (const double radius : {0.0, 2e-3})
    expect_never_through(Torus{}, Sides::front, radius, 5e-3, Vec3(0.0, 0.0, 0.0));
}

TEST(CustomSurfaceProxy, ForceIsContinuousAlongASuperquadric) {
  const Scene scene = must(Scene::build({instance_of(surface_of(Superquadric{}))}, 0.0));
  // Over a rounded edge, 1 mm deep at its sides, in steps of 10 um.
  std::vector<Vec3> path;
  for (int i = 0; i <= 2000; ++i) {
    const double angle = 0.4 + 4e-4 * i;
    const Vec3 way(std::cos(angle), 0.0, std::sin(angle));
    const double far = 0.02 / (Superquadric{}.eval(way).value + 0.02);
    path.emplace_back((far - 1e-3) * way);
  }
  const std::vector<Vec3> forces = slide(scene, path, 2.0 * path.front());
  // Sides bend over no less than 5 mm and the probe is 1 mm deep.
  EXPECT_LT(largest_jump(forces), stiffness * 6.0 * 1.7e-5);
  for (const Vec3& force : forces) EXPECT_GT(force.norm(), 0.1);
}

TEST(CustomSurfaceProxy, ClosedPathsGiveNoEnergy) {
  for (const double friction : {0.0, 0.3}) {
    const Scene scene = must(Scene::build({instance_of(surface_of(Torus{}), Sides::front, friction)}, 0.0));
    std::vector<Vec3> loop;
    for (int i = 0; i < 1000; ++i) {
      const double angle = 6.283185307179586 * i / 1000.0;
      loop.emplace_back(0.03 + 0.006 * std::cos(angle), 0.004 * std::sin(angle), 0.006);
    }
    // The first time around friction takes hold; afterwards it only takes.
    std::vector<Vec3> twice = loop;
    twice.insert(twice.end(), loop.begin(), loop.end());
    const std::vector<Vec3> forces = slide(scene, twice, Vec3(0.036, 0.0, 0.02));
    double work = 0.0;
    double moved = 0.0;
    for (std::size_t i = loop.size(); i < twice.size(); ++i) {
      work += 0.5 * (forces[i] + forces[i - 1]).dot(twice[i] - twice[i - 1]);
      moved += std::abs(forces[i].dot(twice[i] - twice[i - 1]));
    }
    EXPECT_LT(work, 1e-3 * moved);
    if (friction > 0.0) {
      EXPECT_LT(work, -1e-4);
    }
  }
}

TEST(CustomSurfaceProxy, RestsBetweenItAndAMesh) {
  // A ball of 30 mm stands on the floor; the probe is pressed into the wedge where they meet.
  Instance ball = instance_of(surface_of(Ball{}));
  ball.world_from_object.position = Vec3(0.0, 0.0, 0.03);
  const Instance floor = instance_of(floor_mesh(), Sides::both);
  const double radius = 2e-3;
  const Scene scene = must(Scene::build({ball, floor}, radius));
  ProxyState state;
  touch(scene, state, Vec3(0.04, 0.0, 0.01));
  const double wedge = 2.0 * std::sqrt(0.03 * radius);  // from where the ball stands: touching both
  ForceSample felt;
  for (int i = 0; i <= 200; ++i) {
    const double t = i / 200.0;
    felt = touch(scene, state, Vec3(0.04 + t * (wedge - 2e-3 - 0.04), 0.0, 0.01 + t * (radius - 1e-3 - 0.01)));
    ASSERT_GT(state.proxy.z(), radius * 0.999) << i;
    ASSERT_GT((state.proxy - Vec3(0.0, 0.0, 0.03)).norm(), (0.03 + radius) * 0.999) << i;
  }
  EXPECT_EQ(felt.contact.count, 2U);
  EXPECT_NEAR(state.proxy.x(), wedge, 5e-5);
  EXPECT_NEAR(state.proxy.z(), radius, 2e-5);
}

TEST(CustomSurfaceProxy, OtherLawsAreRefused) {
  for (const char* law : {"god-object", "mesostructure", "avila", "virtual-contact-point"}) {
    Instance instance = instance_of(surface_of(Ball{}));
    instance.law = named(law);
    const Result<Scene> scene = Scene::build({instance}, 0.0);
    ASSERT_FALSE(scene.ok()) << law;
    EXPECT_EQ(scene.error().code, ErrorCode::unsupported_pair) << law;
    EXPECT_EQ(scene.error().place, "surfaces[0].law");
  }
}

// --- Laws -----------------------------------------------------------------------------------------------------------

/// F = stiffness depth^exponent of its own along the gradient, on what has a signed value.
struct Power {
  static constexpr LawFacts facts{.name = "mine", .title = "rises with a power of the depth", .source = "none"};
  double exponent = 2.0;
  double scale = 1e5;
  bool damped = false;
  [[nodiscard]] LawForce force(const TouchedSurface& surface, const Material&, const Vec3& probe, const Vec3&,
                               Seconds) const noexcept {
    LawForce answer;
    const FieldSample field = surface.eval(probe);
    if (!(field.value < 0.0)) return answer;
    answer.contact = true;
    answer.normal = field.gradient.normalized();
    answer.penetration = -field.value;
    answer.force = scale * std::pow(-field.value, exponent) * answer.normal;
    answer.point = probe - field.value * answer.normal;
    answer.element = field.element;
    answer.damped = damped;
    answer.spring = answer.force;
    return answer;
  }
};

/// Counts its own ticks and pushes up with as many newtons.
struct Counting {
  static constexpr LawFacts facts{.name = "counting", .title = "counts", .source = "none"};
  struct State {
    double ticks = 0.0;
    std::uint64_t more[7] = {1, 2, 3, 4, 5, 6, 7};
  };
  [[nodiscard]] LawForce force(const TouchedSurface&, const Material&, const Vec3& probe, const Vec3&, Seconds,
                               State& state) const noexcept {
    LawForce answer;
    state.ticks += 1.0;
    bool intact = true;
    for (std::uint64_t i = 0; i < 7; ++i) intact = intact && state.more[i] == i + 1;
    answer.contact = true;
    answer.normal = Vec3::UnitZ();
    answer.force = Vec3(0.0, 0.0, intact ? state.ticks : -1.0);
    answer.point = probe;
    return answer;
  }
};

/// The same by another name.
struct CountingAgain : Counting {
  static constexpr LawFacts facts{.name = "counting-again", .title = "counts", .source = "none"};
};

TEST(LawOfOnesOwn, ItsForceIsRenderedOnEveryKindOfSurface) {
  const std::vector<Surface> surfaces = {
      surface_of(Ball{}), parametric_ball(0.03),
      std::make_shared<const MeshSurface>(TriangleIndex::build(must(TriangleMesh::build(icosphere(5, 0.03)))))};
  const Vec3 out = Vec3(0.2, -0.5, 1.0).normalized();
  for (const Surface& surface : surfaces) {
    SCOPED_TRACE(surface_kind(surface));
    Instance instance = instance_of(surface);
    instance.law = Power{};
    instance.world_from_object.position = Vec3(0.1, 0.0, 0.0);
    const Scene scene = must(Scene::build({instance}, 0.0));
    const Vec3 origin = instance.world_from_object.position;
    const double depth = 2e-3;
    const ForceSample felt = poke(scene, origin + 0.05 * out, origin + (0.03 - depth) * out);
    // The mesh is a polyhedron within the ball.
    EXPECT_NEAR(felt.wrench.force.dot(out), 1e5 * depth * depth, 0.02);
    EXPECT_EQ(felt.contact.count, 1U);
    EXPECT_EQ(law_name(instance.law), "mine");
    EXPECT_EQ(poke(scene, origin + 0.05 * out, origin + 0.031 * out).wrench.force.norm(), 0.0);
  }
}

TEST(LawOfOnesOwn, KeepsAStateOfItsOwnForEachProbeAndLaw) {
  Instance instance = instance_of(surface_of(Ball{}));
  instance.law = Counting{};
  // It gives as it likes: the scene pays.
  SceneSettings settings;
  settings.change_power = settings.energy_capacity = 1e3;
  settings.handover = Seconds(0.0);
  const Scene scene = must(Scene::build({instance}, settings));
  ProxyState first;
  ProxyState second;
  for (int i = 1; i <= 5; ++i)
    EXPECT_EQ(touch(scene, first, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), static_cast<double>(i));
  EXPECT_EQ(touch(scene, second, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 1.0);
  // A copy goes on from where it was taken: what replays rest on.
  ProxyState copy = first;
  EXPECT_EQ(touch(scene, copy, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 6.0);
  EXPECT_EQ(touch(scene, first, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 6.0);
  // The same law goes on in another scene, and another one starts anew, though it has the same State.
  instance.law = Counting{};
  const Scene next = must(Scene::build({instance}, settings));
  EXPECT_EQ(touch(next, first, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 7.0);
  instance.law = CountingAgain{};
  const Scene other = must(Scene::build({instance}, settings));
  EXPECT_LE(touch(other, first, Vec3(0.0, 0.0, 0.029)).wrench.force.z(), 2.0);
}

TEST(LawOfOnesOwn, MaterialsDampingAndFrictionComeOnTop) {
  const auto felt = [](bool damped, double damping, bool friction) {
    Instance instance = instance_of(surface_of(Ball{}), Sides::front, friction ? 0.5 : 0.0);
    Power law;
    law.damped = damped;
    instance.law = law;
    instance.material.damping = damping;
    instance.material.friction_named = friction;
    const Scene scene = must(Scene::build({instance}, 0.0));
    ProxyState state;
    ForceSample out;
    // From outside: the hand gets back what it has put in.
    for (int i = -200; i <= 100; ++i) {
      ProbeSample probe = probe_at(Vec3(1e-5 * std::max(i, 0), 0.0, 0.028 - 1.1e-5 * std::min(i, 0)));
      probe.twist.linear = Vec3(0.01, 0.0, -0.02);
      out = step(scene, state, probe, tick);
    }
    return out;
  };
  const double plain = felt(false, 0.0, false).wrench.force.z();
  EXPECT_NEAR(plain, 0.4, 0.01);
  EXPECT_NEAR(felt(false, 5.0, false).wrench.force.z() - plain, 0.1, 0.01);
  EXPECT_NEAR(felt(true, 5.0, false).wrench.force.z(), plain, 1e-12);
  const ForceSample rough = felt(false, 0.0, true);
  EXPECT_LT(rough.wrench.force.x(), -0.05);
  EXPECT_LE(rough.parts.friction.norm(), 0.5 * plain * 1.01);
}

TEST(LawOfOnesOwn, ForcesThatAreNoNumbersAreNone) {
  Power law;
  law.scale = std::nan("");
  Instance instance = instance_of(surface_of(Ball{}));
  instance.law = law;
  const Scene scene = must(Scene::build({instance}, 0.0));
  const ForceSample felt = poke(scene, Vec3(0.0, 0.0, 0.04), Vec3(0.0, 0.0, 0.029));
  EXPECT_TRUE(felt.wrench.force.isZero(0.0));
  EXPECT_FALSE(felt.flags.has(TickFlag::contact));
}

/// A spring of a stiffness of its own, which says how stiff it is and what it holds.
struct Stiff {
  static constexpr LawFacts facts{.name = "stiff", .title = "a spring of its own", .source = "none"};
  double stiffness = 1000.0;
  [[nodiscard]] LawForce force(const TouchedSurface& surface, const Material&, const Vec3& probe, const Vec3&,
                               Seconds) const noexcept {
    LawForce answer;
    const FieldSample field = surface.eval(probe);
    if (!(field.value < 0.0)) return answer;
    answer.contact = answer.damped = true;
    answer.normal = field.gradient.normalized();
    answer.penetration = -field.value;
    answer.point = probe - field.value * answer.normal;
    answer.force = answer.spring = -stiffness * field.value * answer.normal;
    answer.stiffness = stiffness;
    answer.stored = 0.5 * stiffness * field.value * field.value;
    return answer;
  }
};

TEST(LawOfOnesOwn, AStifferSpringThanItsMaterialsIsRenderedWhereItIsSeen) {
  // It gives back what the hand has put in: as it is seen to be so stiff, all of it is rendered on the way in and out.
  Instance instance = instance_of(surface_of(Ball{}));
  instance.law = Stiff{2.0 * stiffness};
  const Scene scene = must(Scene::build({instance}, 0.0));
  ProxyState state;
  for (int i = -50; i <= 150; ++i) {
    const double depth = 1e-5 * (i <= 50 ? i : 100 - i);
    const ForceSample felt = touch(scene, state, Vec3(0.0, 0.0, 0.03 - depth));
    ASSERT_NEAR(felt.wrench.force.z(), 2.0 * stiffness * std::max(0.0, depth), 1e-9) << i;
    EXPECT_FALSE(felt.flags.has(TickFlag::energy_limited)) << i;
  }
}

TEST(LawOfOnesOwn, TwoRunsAreEqualToTheBit) {
  Instance instance = instance_of(surface_of(GyroidSheet{}), Sides::both);
  instance.law = Power{};
  const Scene scene = must(Scene::build({instance}, 0.0));
  std::vector<Vec3> path;
  Wanderer wanderer(5, 1e-3, 0.027);
  path.emplace_back(0.005, 0.0, 0.0);
  for (int i = 0; i < 500; ++i) path.push_back(wanderer.next(path.back()));
  const std::vector<Vec3> first = slide(scene, path);
  const std::vector<Vec3> second = slide(scene, path);
  double largest = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    ASSERT_EQ(std::memcmp(first[i].data(), second[i].data(), 3 * sizeof(double)), 0);
    largest = std::max(largest, first[i].norm());
  }
  EXPECT_GT(largest, 0.0);
}

/// A law for meshes alone, whose number has to be above 0.
struct Picky : Power {
  static constexpr LawFacts facts{.name = "picky", .title = "rises with a power of the depth", .source = "none"};
  static void options(std::vector<Option>& rows) {
    rows.push_back(option("scale", &Picky::scale, OptionType::number(Range::positive()), "force at a metre."));
    rows.push_back(option("most", &Picky::most, OptionType::quantity(Dimension::force, Range::positive()), "limit."));
  }
  double scale = 100.0;
  double most = 2.0;
  [[nodiscard]] std::string lacks(const Instance& instance) const {
    return base_of(instance.surface) != nullptr ? "" : "a mesh";
  }
};

/// Once in a process, whichever test comes first.
bool picky_is_registered() {
  static const bool registered = register_law<Picky>().ok();
  return registered;
}

TEST(LawOfOnesOwn, RegisteredLawsHaveTheirNameAndTheirOptions) {
  ASSERT_TRUE(picky_is_registered());
  const Law law = must(law_by_name("picky"));
  EXPECT_EQ(law_name(law), "picky");
  EXPECT_FALSE(law.constrains());
  EXPECT_FALSE(is_built_in(law));
  EXPECT_TRUE(is_built_in(ProxyLaw{}));
  EXPECT_DOUBLE_EQ(law.as<Picky>()->scale, 100.0);
  EXPECT_EQ(law.as<Counting>(), nullptr);
  // A force is greater by the zoom in the scene that is shown; a number without a unit is not.
  EXPECT_DOUBLE_EQ(magnified(law, 3.0).as<Picky>()->most, 6.0);
  EXPECT_DOUBLE_EQ(magnified(law, 3.0).as<Picky>()->scale, 100.0);
  Picky wrong;
  wrong.scale = -1.0;
  const Status bad = validate(Law(wrong));
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error().place, "scale");
  const Result<Law> near = law_by_name("pickY-");
  ASSERT_FALSE(near.ok());
  EXPECT_NE(near.error().what.find("did you mean \"picky\"?"), std::string::npos) << near.error().what;
  EXPECT_NE(near.error().accepted.find("picky"), std::string::npos);
}

/// The same under a name of every kind that is no name, or taken, or with options that cannot be.
template <int Which>
struct Misnamed : Power {
  static constexpr std::string_view names[] = {"picky", "proxy", "mesostructure-literal", "Proxy",    "a+b",
                                               "",      "twice", "type-is-ours",          "helpless", "bad-default"};
  static constexpr LawFacts facts{.name = names[Which], .title = "none", .source = "none"};
  static void options(std::vector<Option>& rows) {
    const OptionType number = OptionType::number(Range::positive());
    const bool twice = facts.name == "twice";
    rows.push_back(option(facts.name == "type-is-ours" ? "type" : "scale", &Misnamed::scale, number,
                          facts.name == "helpless" ? "" : "some."));
    if (twice) rows.push_back(rows.front());
  }
  double scale = 100.0;
  [[nodiscard]] Status validate() const {
    return facts.name == "bad-default" ? bad_value("is bad", "scale", "better ones") : success();
  }
};

TEST(LawOfOnesOwn, WhatCannotBeALawIsRefused) {
  ASSERT_TRUE(picky_is_registered());
  const std::size_t before = law_names().size();
  const auto refused = [](const Status& status) { return !status.ok() && !status.error().accepted.empty(); };
  EXPECT_TRUE(refused(register_law<Misnamed<0>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<1>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<2>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<3>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<4>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<5>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<6>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<7>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<8>>()));
  EXPECT_TRUE(refused(register_law<Misnamed<9>>()));
  EXPECT_EQ(law_names().size(), before);
}

TEST(LawOfOnesOwn, ScenesRefuseWhatItDoesNotFit) {
  Instance instance = instance_of(surface_of(Ball{}));
  instance.law = Picky{};
  const Result<Scene> refused = Scene::build({instance}, 0.0);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported_pair);
  EXPECT_NE(refused.error().what.find("the law \"picky\" needs a mesh"), std::string::npos) << refused.error().what;
  instance.surface = floor_mesh();
  EXPECT_TRUE(Scene::build({instance}, 0.0).ok());
  const Result<Scene> ball = Scene::build({instance}, 1e-3);
  ASSERT_FALSE(ball.ok());
  EXPECT_EQ(ball.error().code, ErrorCode::unsupported_pair);
}

}  // namespace
}  // namespace asperity::custom_test
