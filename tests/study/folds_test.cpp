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

struct Touch {
  double contact = 0.0;    ///< share of the stroke
  double off = 0.0;        ///< m, from the stroke at its end
  double jump = 0.0;       ///< N, largest change of force a tick
  double generated = 0.0;  ///< J, largest rise of work + stored energy
  double net = 0.0;        ///< J, work of the surface on the hand over the whole stroke; above 0: given
};

struct CupSettings {
  MesostructureKind kind = MesostructureKind::warts;
  int size = 128;
  double amplitude = 0.8e-3;
  const char* hand = "light";
};

/// The cup with reliefs on a ground of 1.5 mm, wiped through by a hand that presses with 1 N at 10 mm/s.
struct Cup {
  std::shared_ptr<const ReliefSurface> open;
  std::shared_ptr<const ReliefSurface> closed;
  HandImpedance hand;

  explicit Cup(const CupSettings& settings) : hand(must(find_hand(settings.hand))) {
    MesostructureSpec spec;
    spec.kind = settings.kind;
    spec.size = settings.size;
    spec.amplitude = settings.amplitude;
    spec.seed = 3;
    std::vector<float> heights = must(generate_heights(spec));
    for (float& height : heights) height += 1.5e-3F;
    open =
        coated(trial_mesh_e(2, std::numbers::pi / 2.0, 0.01),
               must(HeightMap::build(heights, spec.size, spec.size, Wrap::repeat, Reconstruction::quadratic_bspline)),
               Mapping::uv);
    const ClosedRelief maps = must(close_relief(*open, {2e-3, 32}));
    closed = must(wear_closed(*open, maps));
  }

  /// Through the bottom of the cup, `heading` degrees from x.
  [[nodiscard]] StrokePath path(double heading) const {
    const double radius = open->bounds().upper.x();
    StrokeSettings stroke;
    stroke.type = StrokeType::polyline;
    for (int i = 0; i <= 16; ++i) {
      const double a = degrees(-50.0 + 100.0 * i / 16.0);
      const double across = radius * std::sin(a);
      stroke.points.emplace_back(across * std::cos(degrees(heading)), across * std::sin(degrees(heading)),
                                 -radius * std::cos(a));
    }
    stroke.speed = 0.01;
    stroke.press = PressMode::force;
    stroke.normal_force = 1.0;
    stroke.approach_height = 4e-3;
    stroke.sample_spacing = 2e-4;
    return must(build_stroke(stroke, [&](const Vec3& p) {
      SurfaceCache cache;
      const Foot foot = open->view(cache).nearest(p, infinity);
      return SurfacePoint{foot.point, foot.normal.dot(foot.point) > 0.0 ? Vec3(-foot.normal) : foot.normal};
    }));
  }

  [[nodiscard]] Touch touch(const std::shared_ptr<const ReliefSurface>& surface, const Law& law, double heading) const {
    const StrokePath along = path(heading);
    const DeviceProfile profile = must(find_profile("omega.3"));
    SimulatedDevice device = must(SimulatedDevice::build(along, profile, hand));
    SafetyStage safety = must(SafetyStage::build(SafetySettings::from_profile(profile)));
    const Scene scene = scene_of(surface, law);
    ProxyState state;
    ProxyCache cache;
    Touch touch;
    double work = 0.0;
    double least = infinity;
    int ticks = 0;
    Vec3 last_place = device.position();
    Vec3 last_force = Vec3::Zero();
    run_session([&](const ProbeSample& probe, Seconds dt) { return step(scene, state, cache, probe, dt); }, device,
                safety, SessionSettings{},
                [&](const TraceRecord& record) {
                  const Vec3 place = device.position();
                  work += 0.5 * (last_force + record.commanded).dot(place - last_place);
                  const double held = work + 0.5 * record.commanded.squaredNorm() / stiffness;
                  least = std::min(least, held);
                  touch.generated = std::max(touch.generated, held - least);
                  touch.jump = std::max(touch.jump, (record.commanded - last_force).norm());
                  last_place = place;
                  last_force = record.commanded;
                  const StrokePose pose = along.pose(record.probe.time);
                  if (pose.phase != StrokePhase::contact) return;
                  ++ticks;
                  touch.contact += record.rendered.flags.has(TickFlag::contact) ? 1.0 : 0.0;
                  touch.off = (place - pose.point).norm();
                });
    touch.contact /= ticks;
    touch.net = work;
    return touch;
  }
};

void tell(const char* name, double heading, const Touch& touch) {
  std::cout << fmt::format(
      "{:3.0f} degrees, {}: contact {:.1f} %, off at the end {:.2f} mm, jump {:.2f} N, generated "
      "{:.4f} mJ, net {:.4f} mJ\n",
      heading, name, 100.0 * touch.contact, 1e3 * touch.off, touch.jump, 1e3 * touch.generated, 1e3 * touch.net);
}

const MesostructureLaw printed{Formulation::literal, 0.05, Blend::s_shape, {}};

TEST(H_conc, in_the_cup_the_unblended_literal_method_traps_or_feeds_the_hand_and_the_pre_blended_proxy_does_not) {
  const Cup cup{CupSettings{}};
  int trapped = 0;
  int fed = 0;
  for (const double heading : {15.0, 30.0}) {
    const Touch literal = cup.touch(cup.open, printed, heading);
    const Touch ours = cup.touch(cup.closed, ProxyLaw{}, heading);
    tell("literal", heading, literal);
    tell("proxy, pre-blended", heading, ours);
    // Through the sheet and never back: where heights differ by prism the unsigned distance lets the probe out behind.
    trapped += literal.contact < 0.7 && literal.off > 10e-3 ? 1 : 0;
    fed += literal.net > 0.0 ? 1 : 0;
    EXPECT_GT(literal.generated, 2.0 * ours.generated);
    EXPECT_GT(ours.contact, 0.95);
    EXPECT_LT(ours.off, 6e-3);
    EXPECT_LT(ours.net, 0.0);
    // What the hand feels of a sampled spring: k v^2 T^2 / 2 an impact, and no more.
    EXPECT_LT(ours.generated, 0.05e-3);
  }
  EXPECT_GE(trapped, 1);
  EXPECT_GE(trapped + fed, 2);
}

TEST(H_conc, over_gentle_rings_the_literal_force_jumps_and_the_pre_blended_ones_less) {
  const Cup cup{CupSettings{MesostructureKind::rings, 64, 0.4e-3, "paper"}};
  MesostructureLaw on_the_fly = printed;
  on_the_fly.test_neighbours = true;
  const Touch literal = cup.touch(cup.open, printed, 10.0);
  const Touch blended = cup.touch(cup.open, on_the_fly, 10.0);
  const Touch baked = cup.touch(cup.closed, printed, 10.0);
  const Touch ours = cup.touch(cup.closed, ProxyLaw{}, 10.0);
  tell("literal", 10.0, literal);
  tell("literal, blended on the fly", 10.0, blended);
  tell("literal, pre-blended", 10.0, baked);
  tell("proxy, pre-blended", 10.0, ours);
  EXPECT_GT(literal.jump, 5.0 * ours.jump);
  EXPECT_LT(baked.jump, literal.jump);
  EXPECT_GT(literal.generated, 2.0 * ours.generated);
  EXPECT_LT(blended.generated, literal.generated);
  EXPECT_GT(ours.contact, 0.95);
}

}  // namespace
}  // namespace asperity::folds_test
