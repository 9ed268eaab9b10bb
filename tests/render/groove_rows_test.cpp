// Row H-neg (hrm-2010, Fig. 12): the engraved S, and a hand that follows it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/render/relief_scans.h"

namespace asperity::groove_rows_test {
namespace {

using namespace test;
using std::numbers::pi;

TEST(H_neg, a_groove_is_followed_down_by_the_consistent_laws) {
  const Sheet sheet(MesostructureKind::groove);
  for (const Law& law : {Law(HeightFieldLaw{}), Law(MesostructureLaw{})}) {
    const Score score = follow_rows(sheet, law);
    EXPECT_LT(score.lowest(), -0.95 * amplitude) << law.facts().name;
    EXPECT_LT(score.rms(), 0.05 * amplitude) << law.facts().name;
  }
}

TEST(H_neg, a_groove_is_never_felt_by_the_literal_laws_that_feel_the_same_letter_raised) {
  const Sheet sheet(MesostructureKind::groove);
  std::vector<float> heights = must(generate_heights({MesostructureKind::groove, 256, amplitude}));
  for (float& height : heights) height = -height;
  const auto raised = coated(
      trial_mesh_a(), must(HeightMap::build(heights, 256, 256, Wrap::repeat, Reconstruction::bilinear)), Mapping::uv);
  for (const char* law : {"height-field-literal", "mesostructure-literal"}) {
    const Scene cut = scene_of(sheet.surface, named(law));
    const Scene proud = scene_of(raised, named(law));
    Rng rng(8);
    int pushed = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3 base(rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), 0.0);
      const auto down = line(base + Vec3(0.0, 0.0, 2e-3), base - Vec3(0.0, 0.0, 2e-3), 40);
      for (const Vec3& force : slide(cut, down)) ASSERT_EQ(force, Vec3::Zero().eval()) << law;
      pushed += largest_jump(slide(proud, down)) > 0.0 ? 1 : 0;
    }
    EXPECT_GT(pushed, 20) << law;
  }
}

/// The letter's middle line on M_a (m), from its upper end to its lower one: two bows of 250 degrees that meet in the
/// middle of the tile, of radius 0.16.
class MiddleLine {
 public:
  explicit MiddleLine(const Sheet& sheet) {
    constexpr int count = 1000;
    constexpr double radius = 0.16;
    constexpr double sweep = 250.0 / 180.0 * pi;
    for (int i = 0; i <= 2 * count; ++i) {
      const bool upper = i <= count;
      const double turned = sweep * (i - count) / count;
      const double angle = upper ? 1.5 * pi + turned : 0.5 * pi - turned;
      const double centre = upper ? 0.5 + radius : 0.5 - radius;
      points_.emplace_back(sheet.at(0.5 + radius * std::cos(angle), centre + radius * std::sin(angle)).head<2>());
    }
  }

  /// A share of the way along it (of its angle).
  [[nodiscard]] Vec2 at(double share) const {
    return points_[static_cast<std::size_t>(share * static_cast<double>(points_.size() - 1))];
  }
  struct Nearest {
    double distance = infinity;  ///< m
    double share = 0.0;
  };
  [[nodiscard]] Nearest nearest(const Vec2& p) const {
    Nearest found;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double distance = (points_[i] - p).norm();
      if (distance < found.distance)
        found = {distance, static_cast<double>(i) / static_cast<double>(points_.size() - 1)};
    }
    return found;
  }

 private:
  std::vector<Vec2> points_;
};

/// A hand that does not know the letter. It presses with a constant force, goes on at a constant speed, and turns the
/// way that it is pushed sideways; of how it had to turn it learns how to go on.
struct Hand {
  double mass = 0.25;       // kg
  double damping = 6.5;     // N s/m
  double press = 0.5;       // N
  double speed = 0.015;     // m/s
  double turning = 40.0;    // rad/(s N)
  double learning = 100.0;  // rad/(s^2 N)
};

struct Followed {
  double reached = 0.0;  ///< share of the letter that was gone along, step by step
  double rms = 0.0;      ///< distance from its middle line until then or until it was left (m)
  double height = 0.0;   ///< mean of the hand's with F / k removed (m)
  bool touched = false;
};
Followed follow(const Scene& scene, const MiddleLine& letter, const Hand& hand) {
  constexpr int substeps = 5;
  constexpr double step = 1e-3 / substeps;
  constexpr double lost = 0.01;  // m, from the middle line
  constexpr double start = 0.02;
  Followed followed{start};
  const Vec2 first = letter.at(start);
  const Vec2 way = letter.at(start + 0.01) - first;
  double heading = std::atan2(way.y(), way.x());
  double turn = 0.0;
  double sideways = 0.0;
  Vec3 position(first.x(), first.y(), amplitude);
  Vec3 velocity = Vec3::Zero();
  ProxyState state;
  Score score;
  double heights = 0.0;
  for (int tick = 0; tick < 15000 && followed.reached < 0.97; ++tick) {
    const ForceSample felt = touch(scene, state, position);
    const Vec3& force = felt.wrench.force;
    followed.touched = followed.touched || felt.flags.has(TickFlag::contact);
    // What the hand feels sideways, over some 20 ms.
    sideways += 0.05 * (std::cos(heading) * force.y() - std::sin(heading) * force.x() - sideways);
    turn += 1e-3 * hand.learning * sideways;
    heading += 1e-3 * (hand.turning * sideways + turn);
    const Vec3 drive = hand.damping * hand.speed * Vec3(std::cos(heading), std::sin(heading), 0.0);
    for (int i = 0; i < substeps; ++i) {
      velocity += step / hand.mass * (force + drive - hand.press * Vec3::UnitZ());
      velocity /= 1.0 + step * hand.damping / hand.mass;
      position += step * velocity;
    }
    const MiddleLine::Nearest nearest = letter.nearest(position.head<2>());
    if (nearest.distance > lost || position.z() < -lost) break;
    score.add(nearest.distance, 0.0);
    heights += position.z() + hand.press / stiffness;
    // No further than the hand can have come within a tick: it may not jump from bow to bow.
    if (nearest.share < followed.reached + 0.01) followed.reached = std::max(followed.reached, nearest.share);
  }
  followed.rms = score.rms();
  followed.height = heights / score.samples();
  return followed;
}

// "Our HRM-rendering algorithm allows a correct perception of this sort of characteristics as well, even cruising along
// the grooves of the scratches." Force shading has the same force sideways and leads the hand as well, but on the base;
// the printed forms never touch, and without a groove the hand goes straight on.
TEST(H_neg, a_hand_that_turns_as_it_is_pushed_follows_the_engraved_S) {
  const Scene plain = scene_of(coated(trial_mesh_a(), flat_map(0.0), Mapping::uv), MesostructureLaw{});
  for (const double flank : {0.02, 0.04}) {
    MesostructureSpec spec{.kind = MesostructureKind::groove, .size = 512, .amplitude = amplitude};
    spec.width = 0.08;
    // Of each wall: as H_6 has it, with a flat bottom, and round.
    spec.flank = flank;
    const Sheet sheet(spec);
    const MiddleLine letter(sheet);
    // The tile is wider than long.
    const double width = *spec.width * std::min(sheet.box.extent().x(), sheet.box.extent().y());
    for (const double press : {0.5, 1.0}) {
      const Hand hand{.press = press};
      for (const auto& [name, law, has_height] : methods()) {
        const Followed followed = follow(scene_of(sheet.surface, law), letter, hand);
        EXPECT_GE(followed.reached, 0.97) << name << " at " << press << " N";
        EXPECT_LT(followed.rms, (flank < 0.04 ? 0.25 : 0.02) * width) << name << " at " << press << " N";
        EXPECT_NEAR(followed.height, has_height ? -amplitude : 0.0, 0.05 * amplitude) << name;
      }
      for (const char* name : {"height-field-literal", "mesostructure-literal"}) {
        const Followed fallen = follow(scene_of(sheet.surface, named(name)), letter, hand);
        EXPECT_FALSE(fallen.touched) << name;
        EXPECT_LT(fallen.reached, 0.1) << name;
      }
      const Followed straight_on = follow(plain, letter, hand);
      EXPECT_TRUE(straight_on.touched);
      EXPECT_LT(straight_on.reached, 0.3);
    }
  }
}

}  // namespace
}  // namespace asperity::groove_rows_test
