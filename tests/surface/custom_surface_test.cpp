// Surfaces of one's own against formulas, parametric surfaces, and plain sampling of the field.

#include "asperity/surface/custom/view.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "asperity/core/rng.h"
#include "asperity/surface/parametric/view.h"
#include "tests/surface/balls.h"
#include "tests/surface/custom_fields.h"

namespace asperity::custom_surface_test {
namespace {

using namespace test;

/// The first change of sign along a motion, by steps of `step` (m); infinity: none.
template <class Field>
double sampled_touch(const Field& field, const Segment& motion, double step) {
  const Vec3 way = motion.to - motion.from;
  const int count = static_cast<int>(way.norm() / step) + 1;
  const bool outside = field.eval(motion.from).value >= 0.0;
  for (int i = 1; i <= count; ++i) {
    const double t = static_cast<double>(i) / count;
    if ((field.eval(motion.from + t * way).value >= 0.0) != outside) return t;
  }
  return infinity;
}

Vec3 random_place(double half) {
  const auto coordinate = [&] { return half * (*rc::gen::inRange(-10000, 10001)) * 1e-4; };
  const double x = coordinate();
  const double y = coordinate();
  return {x, y, coordinate()};
}

template <class T>
CustomSurface made(T field) {
  Result<CustomSurface> surface = CustomSurface::build(std::move(field));
  EXPECT_TRUE(surface.ok()) << (surface.ok() ? std::string() : surface.error().message());
  return std::move(*surface);
}

TEST(CustomSurface, DeepInsideABallTheFootIsStraightOut) {
  // Here all places of the ball are nearly as far: what another start finds may be no nearer than landing is exact.
  const CustomSurface ball = made(Ball{0.03});
  for (const Vec3& p : {Vec3(-691, 54, -113), Vec3(300, 0, 1), Vec3(5, -40, 20)}) {
    const Vec3 place = 5e-6 * p;
    const Foot foot = ball.view().nearest(place, infinity);
    ASSERT_TRUE(foot.found());
    EXPECT_LT((foot.point - 0.03 * place.normalized()).norm(), ball.skin());
  }
}

RC_GTEST_PROP(CustomSurface, BallAnswersAsTheParametricSphereDoes, ()) {
  static const CustomSurface ball = made(Ball{0.03});
  ParametricSettings settings;
  settings.shape = ParametricShape::sphere;
  settings.radius = 0.03;
  static const ParametricSurface sphere = *ParametricSurface::build(settings);
  const Vec3 p = random_place(0.05);
  RC_PRE(p.norm() > 1e-4);
  const Foot foot = ball.view().nearest(p, infinity);
  RC_ASSERT(foot.found());
  RC_ASSERT((foot.point - 0.03 * p.normalized()).norm() < ball.skin());
  RC_ASSERT(std::abs(foot.distance - sphere.view().nearest(p, infinity).distance) < ball.skin());
  const Segment motion{p, random_place(0.05)};
  for (const Sides sides : {Sides::front, Sides::both}) {
    const SweptHit own = ball.view().first_touch(motion, sides);
    const SweptHit other = sphere.view().first_touch(motion, sides);
    const double apart = (motion.to - motion.from).norm();
    // A motion that just grazes may go either way.
    const Vec3 way = (motion.to - motion.from).normalized();
    const double nearest = (motion.from - motion.from.dot(way) * way).norm();
    if (std::abs(nearest - 0.03) < 1e-6 || std::abs(motion.from.norm() - 0.03) < 1e-6 ||
        std::abs(motion.to.norm() - 0.03) < 1e-6)
      continue;
    RC_ASSERT(own.hit == other.hit);
    if (!own.hit) continue;
    const double slant = std::abs(way.dot(other.contact.normal));
    RC_ASSERT(std::abs(own.t - other.t) * apart * slant < 4.0 * ball.skin());
    RC_ASSERT((own.contact.normal - other.contact.normal).norm() < 1e-3);
  }
}

template <class Field>
void expect_no_passing(const Field& field, const CustomSurface& surface, double half) {
  const Segment motion{random_place(half), random_place(half)};
  const double length = (motion.to - motion.from).norm();
  RC_PRE(length > 1e-4);
  const double step = 0.02 * surface.grain();
  const double sampled = sampled_touch(field, motion, step);
  const SweptHit hit = surface.view().first_touch(motion, Sides::both);
  RC_ASSERT(hit.hit || !(sampled < infinity));
  if (!hit.hit) return;
  RC_ASSERT(hit.t <= sampled + 1e-9);
  // Whatever it stops at is the surface, or so near along it that the search ran out of steps.
  constexpr double most_steps = 512.0;
  const FieldSample there = field.eval(motion.from + hit.t * (motion.to - motion.from));
  RC_ASSERT(std::abs(there.value) <= surface.facts().lipschitz * std::max(2.0 * surface.skin(), length / most_steps));
}

RC_GTEST_PROP(CustomSurface, NothingPassesThroughASuperquadric, ()) {
  static const Superquadric field{};
  static const CustomSurface surface = made(field);
  expect_no_passing(field, surface, 0.06);
}

RC_GTEST_PROP(CustomSurface, NothingPassesThroughAGyroid, ()) {
  static const GyroidSheet field{};
  static const CustomSurface surface = made(field);
  expect_no_passing(field, surface, 0.028);
}

RC_GTEST_PROP(CustomSurface, NothingPassesThroughATorus, ()) {
  static const Torus field{};
  static const CustomSurface surface = made(field);
  expect_no_passing(field, surface, 0.045);
}

RC_GTEST_PROP(CustomSurface, LongerStepsOfAKnownBendPassNothingEither, ()) {
  static const SmoothBall field{};
  static const CustomSurface surface = made(field);
  RC_ASSERT(!surface.has_folds());
  expect_no_passing(field, surface, 0.05);
}

RC_GTEST_PROP(CustomSurface, FeetAreOnTheSurfaceAndSquareToIt, ()) {
  static const Torus field{};
  static const CustomSurface surface = made(field);
  const Vec3 p = random_place(0.045);
  const double around = std::hypot(p.x(), p.y());
  // The nearest point of a torus by its formula; on the axis and in the tube's middle there is no one.
  const double from_ring = std::hypot(around - field.radius, p.z());
  RC_PRE(around > 1e-3 && from_ring > 1e-4);
  const Foot foot = surface.view().nearest(p, infinity);
  RC_ASSERT(foot.found());
  RC_ASSERT(std::abs(field.eval(foot.point).value) < surface.skin());
  RC_ASSERT(std::abs(foot.distance - std::abs(from_ring - field.tube)) < 2.0 * surface.skin());
}

TEST(CustomSurface, WithinAnEllipsoidTheNearestPlaceIsFoundBesideTheSlopesOwn) {
  // From a place of the longest axis the slope leads to its end, which is the farthest place around. The nearest ones
  // lie above and below, where the normal leads through it: (x - d) / (x / a^2) = z / (z / c^2).
  const Ellipsoid field;
  const CustomSurface surface = made(field);
  const double a = field.size.x();
  const double c = field.size.z();
  for (const double d : {0.002, 0.005, 0.01, 0.015, 0.02}) {
    for (const double end : {-1.0, 1.0}) {
      const Vec3 p(end * d, 0.0, 0.0);
      const double distance = c * std::sqrt(1.0 - d * d / (a * a - c * c));
      ASSERT_LT(distance, a - d);
      const Foot foot = surface.view().nearest(p, infinity);
      ASSERT_TRUE(foot.found());
      EXPECT_NEAR(foot.distance, distance, surface.skin()) << d;
      EXPECT_NEAR(foot.point.x(), end * a * a * d / (a * a - c * c), 1e-2 * a) << d;
    }
  }
}

TEST(CustomSurface, BallInACornerTouchesBothWalls) {
  const CustomSurface corner = made(Corner{});
  // On either side of the middle the wall there is the nearer one.
  const Foot feet[2] = {corner.view().nearest(Vec3(0.01, 0.0, 0.01 - 1e-7), 0.01 + corner.skin()),
                        corner.view().nearest(Vec3(0.01 - 1e-7, 0.0, 0.01), 0.01 + corner.skin())};
  double sum = 0.0;
  for (const Foot& foot : feet) {
    ASSERT_TRUE(foot.found());
    EXPECT_NEAR(foot.distance, 0.01, 1e-6);
    sum += std::abs(foot.normal.x()) + std::abs(foot.normal.z());
  }
  EXPECT_NEAR(sum, 2.0, 1e-3);
  EXPECT_LT(std::abs(feet[0].normal.dot(feet[1].normal)), 1e-3);
}

TEST(CustomSurface, MovingBallStopsARadiusBefore) {
  const CustomSurface ball = made(Ball{0.03});
  const double t = ball_touch({Vec3(0.0, 0.004, 0.1), Vec3(0.0, 0.004, 0.0)}, 0.01,
                              [&](const Vec3& p) { return ball.view().nearest(p, infinity); });
  ASSERT_LE(t, 1.0);
  const double z = std::sqrt(0.04 * 0.04 - 0.004 * 0.004);
  EXPECT_NEAR(0.1 * (1.0 - t), z, 1e-6);
  EXPECT_FALSE(ball.view().first_touch({Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.1)}, Sides::front).hit);
  EXPECT_TRUE(ball.view().first_touch({Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.1)}, Sides::both).hit);
}

TEST(CustomSurface, WhatIsTouchedLiesOnTheSurfaceWhereTheWayEndsBeforeIt) {
  const Superquadric field;
  const CustomSurface surface = made(field);
  Rng rng(3);
  for (int i = 0; i < 300; ++i) {
    const Vec3 from = 0.06 * Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
    const Vec3 to = 0.01 * Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    const SweptHit hit = surface.view().first_touch({from, to}, Sides::front);
    ASSERT_TRUE(hit.hit);
    // Far nearer than what counts as touched.
    EXPECT_LT(std::abs(field.eval(hit.contact.point).value), 1e-2 * surface.skin()) << i;
    EXPECT_NEAR(hit.contact.distance, (from + hit.t * (to - from) - hit.contact.point).norm(), 1e-2 * surface.skin());
  }
}

/// A ball that answers its nearest point and its first touch itself, and says so by its element.
struct OwnQueries : Ball {
  [[nodiscard]] Foot nearest(const Vec3& p, double bound) const noexcept {
    Foot foot;
    const double length = p.norm();
    if (std::abs(length - radius) > bound || !(length > 0.0)) return foot;
    foot.normal = (length < radius ? -1.0 : 1.0) * p / length;
    foot.point = radius / length * p;
    foot.distance = std::abs(length - radius);
    foot.element = 7;
    return foot;
  }
  /// Of ways to the centre alone.
  [[nodiscard]] SweptHit first_touch(const Segment& motion, Sides) const noexcept {
    SweptHit hit;
    const double length = motion.from.norm();
    if (!(length > radius)) return hit;
    hit.hit = true;
    hit.t = 1.0 - radius / length;
    hit.contact = nearest(motion.from, infinity);
    hit.contact.element = 8;
    return hit;
  }
};

TEST(CustomSurface, WhatATypeDoesItselfIsTaken) {
  const CustomSurface surface = made(OwnQueries{{0.03}});
  const Vec3 p(0.04, 0.0, 0.0);
  EXPECT_EQ(surface.view().nearest(p, infinity).element, 7U);
  EXPECT_FALSE(surface.view().nearest(p, 0.009).found());
  const Foot touched = surface.view().nearest(p, 0.01 + surface.skin());
  ASSERT_TRUE(touched.found());
  EXPECT_EQ(touched.element, 7U);
  EXPECT_EQ(touched.at, touched.point);
  const SweptHit hit = surface.view().first_touch({p, Vec3::Zero()}, Sides::front);
  ASSERT_TRUE(hit.hit);
  EXPECT_EQ(hit.t, 0.25);
  EXPECT_EQ(hit.side, 1.0);
  EXPECT_EQ(hit.contact.element, 8U);
  EXPECT_EQ(hit.contact.at, hit.contact.point);
}

/// A ball with something wrong with it.
struct Broken : Ball {
  double steepness = 1.0;  ///< of the value
  double turned = 1.0;     ///< of the gradient
  double hole = 0.0;       ///< within it the value is no number (m)
  double box = 1.0;        ///< of the bounds
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample = Ball::eval(p);
    sample.value *= steepness;
    sample.gradient *= steepness * turned;
    if (p.norm() < hole) sample.value = std::nan("");
    return sample;
  }
  [[nodiscard]] Box bounds() const {
    Box all = Ball::bounds();
    all.lower *= box;
    all.upper *= box;
    return all;
  }
};

TEST(CustomSurface, WhatIsSaidWronglyIsRefusedByName) {
  const auto place = [](Broken field) {
    const Result<CustomSurface> surface = CustomSurface::build(field);
    EXPECT_FALSE(surface.ok());
    return surface.ok() ? std::string() : surface.error().place;
  };
  Broken steep{{0.03}};
  steep.steepness = 1.5;
  EXPECT_EQ(place(steep), "lipschitz");
  Broken backwards{{0.03}};
  backwards.turned = -1.0;
  EXPECT_EQ(place(backwards), "eval");
  Broken holed{{0.03}};
  holed.hole = 0.02;
  EXPECT_EQ(place(holed), "eval");
  Broken small{{0.03}};
  small.box = 0.3;
  EXPECT_EQ(place(small), "bounds");
  Broken empty{{0.03}};
  empty.box = -1.0;
  EXPECT_EQ(place(empty), "bounds");
  EXPECT_TRUE(CustomSurface::build(Broken{{0.03}}).ok());
}

/// A ball made of numbers.
struct NumberedBall : Ball {
  explicit NumberedBall(NamedNumbers& numbers) : Ball{numbers.get("radius", 0.02)} {}
};

TEST(CustomSurface, RegisteredTypesAreMadeOfTheirNumbers) {
  ASSERT_TRUE(register_custom_surface<NumberedBall>("test-ball").ok());
  NamedNumbers given({{"radius", 0.05}});
  const Result<CustomSurface> surface = make_custom_surface("test-ball", given);
  ASSERT_TRUE(surface.ok()) << surface.error().message();
  EXPECT_EQ(surface->type(), "test-ball");
  EXPECT_DOUBLE_EQ(surface->bounds().upper.x(), 0.05);
  NamedNumbers none;
  ASSERT_TRUE(make_custom_surface("test-ball", none).ok());
  EXPECT_DOUBLE_EQ(none.taken().at("radius"), 0.02);

  const Status again = register_custom_surface<NumberedBall>("test-ball");
  ASSERT_FALSE(again.ok());
  EXPECT_NE(again.error().what.find("registered already"), std::string::npos);
  EXPECT_FALSE(register_custom_surface<NumberedBall>("Test Ball").ok());
  const Result<CustomSurface> unknown = make_custom_surface("test-bal", none);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().what.find("did you mean \"test-ball\"?"), std::string::npos);
  NamedNumbers wrong({{"radios", 0.05}});
  const Result<CustomSurface> unread = make_custom_surface("test-ball", wrong);
  ASSERT_FALSE(unread.ok());
  EXPECT_EQ(unread.error().code, ErrorCode::bad_key);
  EXPECT_EQ(unread.error().place, "radios");
  EXPECT_NE(unread.error().what.find("did you mean \"radius\"?"), std::string::npos);
}

}  // namespace
}  // namespace asperity::custom_surface_test
