#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "asperity/core/frames.h"
#include "asperity/core/rng.h"

namespace asperity::box_test {
namespace {

Pose random_pose(Rng& rng) {
  const auto number = [&] { return rng.uniform(-1.0, 1.0); };
  Pose pose;
  pose.position = Vec3(number(), number(), number());
  pose.orientation = Quat(number(), number(), number(), number()).normalized();
  return pose;
}

Vec3 random_point(Rng& rng) {
  return {rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0)};
}

TEST(Box, HasEightCorners) {
  const Box box{Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0)};
  std::set<std::tuple<double, double, double>> seen;
  for (unsigned k = 0; k < 8; ++k) {
    const Vec3 corner = box.corner(k);
    seen.emplace(corner.x(), corner.y(), corner.z());
    for (int a = 0; a < 3; ++a) EXPECT_EQ(corner[a], (k >> a & 1U) != 0 ? box.upper[a] : box.lower[a]);
  }
  EXPECT_EQ(seen.size(), 8U);
}

TEST(Box, MovedIsTheBoxAroundItsMovedCorners) {
  Rng rng(7);
  for (int i = 0; i < 200; ++i) {
    Box box;
    box.include(random_point(rng));
    if (i % 10 != 0) box.include(random_point(rng));
    const Pose pose = random_pose(rng);
    Box expected;
    for (const double x : {box.lower.x(), box.upper.x()}) {
      for (const double y : {box.lower.y(), box.upper.y()}) {
        for (const double z : {box.lower.z(), box.upper.z()}) expected.include(pose.apply(Vec3(x, y, z)));
      }
    }
    const Box moved = transformed(box, pose);
    EXPECT_EQ(moved.lower, expected.lower);
    EXPECT_EQ(moved.upper, expected.upper);
  }
}

TEST(Box, MovedHoldsWhatTheBoxHeld) {
  Rng rng(8);
  for (int i = 0; i < 200; ++i) {
    Box box;
    box.include(random_point(rng));
    box.include(random_point(rng));
    const Pose pose = random_pose(rng);
    const Vec3 inside =
        box.lower +
        Vec3(rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0)).cwiseProduct(box.extent());
    const Box moved = transformed(box, pose).grown(1e-12);
    const Vec3 at = pose.apply(inside);
    EXPECT_TRUE((at.array() >= moved.lower.array()).all() && (at.array() <= moved.upper.array()).all());
  }
}

TEST(Box, EmptyStaysEmpty) {
  Rng rng(9);
  const Box moved = transformed(Box{}, random_pose(rng));
  EXPECT_TRUE(moved.empty());
  EXPECT_EQ(moved.lower, Box{}.lower);
  EXPECT_EQ(moved.upper, Box{}.upper);
  Box flat{Vec3(0.0, 0.0, 1.0), Vec3(1.0, 1.0, 0.0)};
  EXPECT_TRUE(transformed(flat, random_pose(rng)).empty());
}

}  // namespace
}  // namespace asperity::box_test
