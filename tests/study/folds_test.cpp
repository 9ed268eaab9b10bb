// Concave folds: fillets in place, the blend on the fly of hrm-2010 4.2, and the cup under a moving hand (H-conc).

#include <gtest/gtest.h>

#include <iostream>

#include <fmt/format.h>

#include "asperity/device/simulated_device.h"
#include "asperity/servo/session.h"
#include "asperity/surface/relief/closing.h"
#include "tests/render/fixtures.h"
#include "tests/surface/folded.h"

namespace asperity::folds_test {
namespace {

using namespace test;

Stitching fillet(double radius, double rho) {
  Stitching stitching;
  stitching.folds = FoldMode::fillet;
  stitching.rho = rho;
  stitching.fillet_radius = radius;
  return stitching;
}

void expect_fillet_in_place(double opening_degrees, double height, double radius) {
  SCOPED_TRACE(opening_degrees);
  const double opening = degrees(opening_degrees);
  constexpr double side = 0.02;
  const auto surface =
      coated(valley(opening, side), flat_map(height), Mapping::triplanar, 0.01, 1.0, fillet(radius, 1.0 / 3.0));
  ASSERT_NEAR(surface->least_fillet(), radius, 1e-6 * radius) << "the band has room for it";
  Rng rng(3);
  double worst = 0.0;
  int round = 0;
  for (int i = 0; i < 4000; ++i) {
    const std::uint32_t face = random_face(rng, surface->base().mesh());
    Vec3 b = random_barycentric(rng);
    if (i % 2 == 0) b[static_cast<int>(rng.below(3))] *= 0.1;
    b /= b.sum();
    const ReliefFrame frame = surface->frame(face);
    const ReliefPoint point = surface->point(frame, b[1], b[2]);
    worst = std::max(worst, off_fillet(point.point, opening, height, radius));
    round += point.jet.height > height + 1e-9 ? 1 : 0;
    const Vec2 whole[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};
    const HeightRange range = surface->range(frame, whole);
    ASSERT_GE(point.jet.height, range.lowest);
    ASSERT_LE(point.jet.height, range.highest);
  }
  EXPECT_LE(worst, 1e-6 * radius);
  EXPECT_GT(round, 100);
}

TEST(Fillet, in_place_has_exactly_the_radius_between_planes_at_any_angle) {
  for (const double height : {0.0, 0.2e-3}) {
    expect_fillet_in_place(150.0, height, 2e-3);
    expect_fillet_in_place(120.0, height, 1e-3);
    expect_fillet_in_place(90.0, height, 0.5e-3);
    expect_fillet_in_place(60.0, height, 0.3e-3);
  }
}

TEST(Fillet, convex_folds_stay_as_they_are) {
  const auto kept = coated(roof(std::numbers::pi / 3.0, 0.01), wavy_map(0.2e-3), Mapping::uv);
  const auto filled =
      coated(roof(std::numbers::pi / 3.0, 0.01), wavy_map(0.2e-3), Mapping::uv, 0.01, 1.0, fillet(1e-3, 0.2));
  Rng rng(5);
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t face = random_face(rng, kept->base().mesh());
    const Vec3 b = random_barycentric(rng);
    const Vec3 one = kept->point(kept->frame(face), b[1], b[2]).point;
    ASSERT_LT((one - filled->point(filled->frame(face), b[1], b[2]).point).norm(), 1e-9);
  }
}

std::shared_ptr<const ReliefSurface> filleted_cup() {
  return coated(trial_mesh_e(2, std::numbers::pi / 2.0, 0.01), wavy_map(0.2e-3), Mapping::triplanar, 0.02, 1.0,
                fillet(1e-3, 0.3));
}

TEST(Fillet, gradient_is_that_of_the_value) {
  const auto surface = filleted_cup();
  Rng rng(8);
  int checked = 0;
  int filled = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::uint32_t face = random_face(rng, surface->base().mesh());
    Vec3 b = random_barycentric(rng, 0.01);
    b[static_cast<int>(rng.below(3))] *= 0.3;
    b /= b.sum();
    const ReliefFrame frame = surface->frame(face);
    const double height = surface->height(frame, b[1], b[2]).height;
    const Vec3 p = frame.prism.point({b[1], b[2], height + rng.uniform(-0.2e-3, 0.2e-3)});
    const Vec3 way = random_direction(rng);
    constexpr double h = 1e-8;
    SurfaceCache cache;
    const FieldSample here = surface->eval(p, cache);
    const double ahead = surface->eval(p + h * way, cache).value - here.value;
    const double behind = here.value - surface->eval(p - h * way, cache).value;
    // Where a wall begins to hold the ball the slopes of both sides differ.
    if (std::abs(ahead - behind) > 1e-4 * h) continue;
    ++checked;
    filled += height > surface->coat().jet(frame.coat, b[1], b[2]).height + 1e-7 ? 1 : 0;
    ASSERT_NEAR(0.5 * (ahead + behind) / h, here.gradient.dot(way), 1e-4) << i;
  }
  EXPECT_GT(checked, 1800);
  EXPECT_GT(filled, 50);
}

TEST(Fillet, heights_agree_over_every_edge_of_the_cup) {
  const auto surface = filleted_cup();
  const TriangleMesh& mesh = surface->base().mesh();
  double worst = 0.0;
  double highest = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t other = mesh.neighbour(face, edge);
      if (other == no_index) continue;
      for (const double t : {0.02, 0.1, 0.3, 0.5, 0.8, 0.95}) {
        Vec3 b = Vec3::Zero();
        b[edge] = 1.0 - t;
        b[(edge + 1) % 3] = t;
        const Vec3 there = barycentric_frame(mesh, other).coordinates(point_on(mesh, face, b));
        const double one = surface->height(surface->frame(face), b[1], b[2]).height;
        worst = std::max(worst, std::abs(one - surface->height(surface->frame(other), there[1], there[2]).height));
        highest = std::max(highest, one - surface->coat().jet(surface->frame(face).coat, b[1], b[2]).height);
      }
    }
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_GT(highest, 1e-5) << "the folds are filled";
}

TEST(Fillet, refuses_a_radius_that_is_none) {
  for (const double radius : {0.0, -1e-3, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const Status status = validate(fillet(radius, 0.1));
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().place, "fillet_radius");
  }
}

TEST(MesostructureLiteral, on_the_fly_the_prisms_that_hold_the_probe_are_averaged_in_a_band_along_edges) {
  // Over the middle of a fold of 90 degrees both prisms hold the probe, and each counts one half.
  const auto surface = coated(valley(degrees(90.0), 0.02), flat_map(2e-3), Mapping::triplanar);
  MesostructureLaw law{Formulation::literal, 0.05, Blend::s_shape, {}};
  const Vec3 probe(0.0, 2e-3, 1e-3);
  const auto force = [&](const Vec3& p) { return poke(scene_of(surface, law), p, p).wrench.force; };
  const Vec3 alone = force(probe);
  law.test_neighbours = true;
  const Vec3 both = force(probe);
  EXPECT_GT(std::abs(alone.x()), 0.5 * alone.z()) << "one of the walls pushes aside";
  EXPECT_NEAR(both.x(), 0.0, 1e-9);
  EXPECT_GT(both.z(), 0.0);
  // Beside the band nothing is averaged.
  const Vec3 aside(4e-3, 2e-3, 5e-3);
  law.test_neighbours = false;
  const Vec3 plain = force(aside);
  law.test_neighbours = true;
  EXPECT_EQ((force(aside) - plain).norm(), 0.0);
  EXPECT_GT(plain.norm(), 0.0);
}

TEST(MesostructureLiteral, testing_neighbours_is_the_literal_forms_alone) {
  MesostructureLaw law;
  law.test_neighbours = true;
  const Status status = validate(Law(law));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().place, "test_neighbours");
}

// H-conc. "This may create a back-and-forth effect at the probe, sometimes getting stuck and unable to leave the
// surface" (4.2, Fig. 5). Each law meets the same strokes on the same cup twice: as it is, and closed. Both times it
// wears the atlas that closing bakes, of the same texels; what closing raised them by is all that differs.

/// What befell a hand on one stroke.
struct Stroke {
  bool trapped = false;  ///< the probe stayed within 1 mm of a place while the hand's aim went 5 mm on
  bool through = false;  ///< it was behind all of the cup's faces, and nothing pushed
  double given = 0.0;    ///< J, work on the hand from before it touched until it had let go; below 0: taken
  int kicks = 0;         ///< ticks of contact in which the force changed by a quarter of what the hand presses with
};

constexpr double hand_press = 1.0;   // N
constexpr double hand_speed = 0.01;  // m/s
constexpr double fed = 5e-6;         // J, more than a stroke over a flat cup gives by sampling

/// M_e of 24 faces of 10 mm, folds of 36 degrees, with H_4 of 0.8 mm on a ground of 1.5 mm.
class Cup {
 public:
  explicit Cup(std::uint64_t seed) {
    MesostructureSpec spec;
    spec.kind = MesostructureKind::warts;
    spec.size = 128;
    spec.amplitude = amplitude;
    spec.seed = seed;
    std::vector<float> heights = must(generate_heights(spec));
    for (float& height : heights) height += static_cast<float>(ground);
    const auto original =
        coated(trial_mesh_e(2, std::numbers::pi / 2.0, 0.01),
               must(HeightMap::build(heights, spec.size, spec.size, Wrap::repeat, Reconstruction::quadratic_bspline)),
               Mapping::uv);
    ClosedRelief maps = must(close_relief(*original, {2e-3, 32}));
    closed_ = must(wear_closed(*original, maps));
    filled_ = maps.report.changed_share;
    for (std::size_t i = 0; i < maps.rise.size(); ++i) maps.atlas.heights[i] -= maps.rise[i];
    open_ = must(wear_closed(*original, maps));
    for (const Vec3& vertex : original->base().mesh().positions()) radius_ = std::max(radius_, vertex.norm());
  }

  [[nodiscard]] const std::shared_ptr<const ReliefSurface>& relief(bool closed) const {
    return closed ? closed_ : open_;
  }
  [[nodiscard]] double filled() const { return filled_; }

  /// Through the bottom, `heading` degrees from x, at half the warts' height.
  [[nodiscard]] StrokePath path(double heading) const {
    StrokeSettings stroke;
    stroke.type = StrokeType::polyline;
    for (int i = 0; i <= 16; ++i) {
      const double a = degrees(-50.0 + 100.0 * i / 16.0);
      const double across = radius_ * std::sin(a);
      stroke.points.emplace_back(across * std::cos(degrees(heading)), across * std::sin(degrees(heading)),
                                 -radius_ * std::cos(a));
    }
    stroke.speed = hand_speed;
    stroke.press = PressMode::force;
    stroke.normal_force = hand_press;
    stroke.approach_height = 4e-3;
    stroke.sample_spacing = 2e-4;
    return must(build_stroke(stroke, [&](const Vec3& p) {
      SurfaceCache cache;
      const Vec3 inwards = -p.normalized();
      const Vec3 foot = open_->base().view(cache).nearest(p, infinity).point;
      return SurfacePoint{foot + (ground + 0.5 * amplitude) * inwards, inwards};
    }));
  }

  [[nodiscard]] Stroke stroke(bool closed, const Law& law, const StrokePath& along, const HandImpedance& hand) const {
    constexpr double place_size = 1e-3;
    constexpr double aim_ahead = 5e-3;
    constexpr double behind = 0.5e-3;
    const DeviceProfile profile = must(find_profile("omega.3"));
    SimulatedDevice device = must(SimulatedDevice::build(along, profile, hand));
    SafetyStage safety = must(SafetyStage::build(SafetySettings::from_profile(profile)));
    const Scene scene = scene_of(relief(closed), law);
    ProxyState state;
    ProxyCache cache;
    Stroke stroke;
    Vec3 place = device.position();
    Vec3 force = Vec3::Zero();
    Vec3 stayed_at = place;
    double stayed_since = 0.0;
    bool touched = false;
    run_session([&](const ProbeSample& probe, Seconds dt) { return step(scene, state, cache, probe, dt); }, device,
                safety, SessionSettings{},
                [&](const TraceRecord& record) {
                  const Vec3 now = device.position();
                  stroke.given += 0.5 * (force + record.commanded).dot(now - place);
                  const bool touches = record.rendered.flags.has(TickFlag::contact);
                  const double change = (record.commanded - force).norm();
                  stroke.kicks += touched && touches && change > 0.25 * hand_press ? 1 : 0;
                  touched = touches;
                  place = now;
                  force = record.commanded;
                  const double time = record.probe.time.count();
                  const bool wiping = along.pose(record.probe.time).phase == StrokePhase::contact;
                  if (!wiping || (place - stayed_at).norm() > place_size) {
                    stayed_at = place;
                    stayed_since = time;
                  }
                  stroke.trapped = stroke.trapped || (time - stayed_since) * hand_speed > aim_ahead;
                  // The vertices lie on this sphere, the faces within.
                  stroke.through = stroke.through || (wiping && place.norm() > radius_ + behind && force.isZero());
                });
    return stroke;
  }

 private:
  static constexpr double amplitude = 0.8e-3;
  static constexpr double ground = 1.5e-3;

  std::shared_ptr<const ReliefSurface> open_;
  std::shared_ptr<const ReliefSurface> closed_;
  double filled_ = 0.0;  // share of the area
  double radius_ = 0.0;  // m, of the sphere
};

/// A share of a population with its 95 % interval (Wilson).
struct Rate {
  int count = 0;
  int of = 0;

  [[nodiscard]] double lowest() const { return std::max(0.0, middle() - spread()); }
  [[nodiscard]] double highest() const { return middle() + spread(); }
  [[nodiscard]] std::string text() const {
    return fmt::format("{:4.1f} % ({:.1f} to {:.1f})", 100.0 * count / of, 100.0 * lowest(), 100.0 * highest());
  }

 private:
  static constexpr double z = 1.96;
  [[nodiscard]] double middle() const { return (count + 0.5 * z * z) / (of + z * z); }
  [[nodiscard]] double spread() const {
    const double share = static_cast<double>(count) / of;
    return z / (of + z * z) * std::sqrt(of * share * (1.0 - share) + 0.25 * z * z);
  }
};

/// Whether two shares differ by more than chance: their intervals lie apart.
::testing::AssertionResult apart(const Rate& more, const Rate& less) {
  if (more.lowest() > less.highest()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << more.text() << " is not clearly more than " << less.text();
}

struct Population {
  Rate trapped;
  Rate through;
  Rate lost;  ///< either
  Rate given_energy;
  double kicks = 0.0;  ///< a stroke

  void include(const Stroke& stroke) {
    for (Rate* rate : {&trapped, &through, &lost, &given_energy}) ++rate->of;
    trapped.count += stroke.trapped ? 1 : 0;
    through.count += stroke.through ? 1 : 0;
    lost.count += stroke.trapped || stroke.through ? 1 : 0;
    given_energy.count += stroke.given > fed ? 1 : 0;
    kicks += (stroke.kicks - kicks) / lost.of;
  }
  [[nodiscard]] std::string text() const {
    return fmt::format("trapped {}, through {}, either {}, fed {}, {:5.1f} kicks", trapped.text(), through.text(),
                       lost.text(), given_energy.text(), kicks);
  }
};

/// The light hand, whose spring of 100 N/m pulls with half a newton by then, and those of 400 N/m and more.
struct Hands {
  Population light;
  Population others;
};

/// The light hand along twelve headings through every cup, the others through the first two. Each stroke of one hand is
/// another way over another place: their chances are their own.
Hands wiped(const std::vector<Cup>& cups, const char* name, const Law& law, bool closed) {
  Hands hands;
  for (const Cup& cup : cups) {
    for (int heading = 0; heading < 12; ++heading) {
      const StrokePath along = cup.path(30.0 * heading + 7.0);
      for (const HandImpedance& hand : hand_presets()) {
        if (hand.name == "light") {
          hands.light.include(cup.stroke(closed, law, along, hand));
        } else if (&cup < cups.data() + 2) {
          hands.others.include(cup.stroke(closed, law, along, hand));
        }
      }
    }
  }
  std::cout << fmt::format("{}, {}\n  light hand:  {}\n  other hands: {}\n", name, closed ? "closed" : "open",
                           hands.light.text(), hands.others.text());
  return hands;
}

TEST(H_conc, of_the_same_law_the_open_folds_of_the_cup_trap_a_light_hand_and_the_closed_ones_do_not) {
  std::vector<Cup> cups;
  for (std::uint64_t seed = 3; seed < 9; ++seed) cups.emplace_back(seed);
  for (const Cup& cup : cups) EXPECT_GT(cup.filled(), 0.5) << "of its area";
  const MesostructureLaw printed{Formulation::literal, 0.05, Blend::s_shape, {}};
  MesostructureLaw on_the_fly = printed;
  on_the_fly.test_neighbours = true;

  const Hands literal = wiped(cups, "Algorithm 2 as printed", printed, false);
  const Hands literal_closed = wiped(cups, "Algorithm 2 as printed", printed, true);
  const Hands blended = wiped(cups, "as printed, blended on the fly", on_the_fly, false);
  const Hands intended = wiped(cups, "Algorithm 2 as intended", named("mesostructure-intended"), false);
  const Hands intended_closed = wiped(cups, "Algorithm 2 as intended", named("mesostructure-intended"), true);
  const Hands potential = wiped(cups, "mesostructure, consistent", named("mesostructure"), false);
  const Hands potential_closed = wiped(cups, "mesostructure, consistent", named("mesostructure"), true);
  const Hands proxy = wiped(cups, "proxy", ProxyLaw{}, false);
  const Hands proxy_closed = wiped(cups, "proxy", ProxyLaw{}, true);

  // As printed: back and forth, stuck, or fallen through. Closing cures that.
  EXPECT_TRUE(apart(literal.light.lost, literal_closed.light.lost));
  for (const auto& [open, closed] :
       {std::pair(&literal.light, &literal_closed.light), std::pair(&literal.others, &literal_closed.others)})
    EXPECT_GT(open->kicks, 5.0 * closed->kicks);
  // Blended in place nothing is cured ("as will the possibility of getting trapped"): more are trapped.
  EXPECT_TRUE(apart(blended.light.trapped, literal.light.trapped));
  EXPECT_GT(blended.light.kicks, literal.light.kicks);
  // As it was meant it seldom traps, even in open folds, and drops nobody.
  for (const Hands* one : {&intended, &intended_closed}) {
    EXPECT_LT(one->light.trapped.highest(), 0.2);
    EXPECT_EQ(one->light.through.count, 0);
  }
  // Laws whose forces give nothing trap in open folds too, for crevices are there; in closed ones there are none.
  EXPECT_TRUE(apart(potential.light.trapped, potential_closed.light.trapped));
  EXPECT_TRUE(apart(proxy.light.trapped, proxy_closed.light.trapped));
  for (const Hands* one : {&potential, &potential_closed, &proxy, &proxy_closed})
    EXPECT_EQ(one->light.through.count, 0);
  for (const Hands* one : {&literal_closed, &intended_closed, &potential_closed, &proxy_closed})
    EXPECT_LT(one->light.trapped.highest(), 0.15);
  // Energy is the law's own affair: the algorithm feeds the hand whether folds are closed or not.
  for (const Hands* one : {&literal, &literal_closed, &blended, &intended, &intended_closed}) {
    EXPECT_GT(one->light.given_energy.lowest(), 0.15);
    EXPECT_GT(one->others.given_energy.lowest(), 0.15);
  }
  for (const Hands* one : {&potential_closed, &proxy, &proxy_closed}) {
    EXPECT_EQ(one->light.given_energy.count, 0);
    EXPECT_EQ(one->others.given_energy.count, 0);
  }
  // A hand that pulls with 2 N by the time it would count as trapped gets out of all of them.
  for (const Hands* one : {&literal, &literal_closed, &blended, &intended, &intended_closed, &potential,
                           &potential_closed, &proxy, &proxy_closed})
    EXPECT_LE(one->others.lost.count, 1);
}

}  // namespace
}  // namespace asperity::folds_test
