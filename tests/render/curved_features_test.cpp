// Friction by direction on curved surfaces, and the profile that a probe feels: heterogeneous-features-2008, rows Y-8
// and Y-9. Surfaces and gradients are written out here once more.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/render/textures.h"

namespace asperity::test::curved_features_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double push = 0.6;  // N, as in Tab. 3
constexpr double depth = push / stiffness;

// ---- Y-8: friction by direction ----

/// A surface of revolution about z: distance from the axis and height by a parameter, each with its derivative.
struct Meridian {
  double a, a1, b, b1;
};

constexpr double ball_radius = 0.03;
Meridian ball(double latitude) {
  return {ball_radius * std::cos(latitude), -ball_radius * std::sin(latitude), ball_radius * std::sin(latitude),
          ball_radius * std::cos(latitude)};
}

/// The vase between its belly, of 30 mm at 36 mm, and its neck, of 10 mm at 96 mm: a fifth-degree step.
Meridian vase(double height) {
  const double t = (height - 0.036) / 0.06;
  return {0.03 - 0.02 * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t),
          -0.02 * 30.0 * t * t * (1.0 - t) * (1.0 - t) / 0.06, height, 1.0};
}

struct Curved {
  Meridian (*meridian)(double);
  bool by_sphere = false;  ///< the features' v is the latitude at the radius, not the height
  double radius = 0.0;     ///< of the surface between (m)
  double begin = 0.0;      ///< parameter of the meridian where a stroke starts
  ParametricShape shape = ParametricShape::sphere;
};
const Curved curved[] = {{ball, true, ball_radius, -0.3, ParametricShape::sphere},
                         {ball, false, ball_radius, -0.3, ParametricShape::sphere},
                         {vase, false, ball_radius, 0.06, ParametricShape::vase}};

/// A place of the surface with unit directions around it and up it.
struct Spot {
  Vec3 point, around, up, normal;
  Meridian m;
  Spot(const Curved& on, double angle, double along) : m(on.meridian(along)) {
    const Vec3 out(std::cos(angle), std::sin(angle), 0.0);
    point = m.a * out + Vec3(0.0, 0.0, m.b);
    around = Vec3(-out.y(), out.x(), 0.0);
    up = (m.a1 * out + Vec3(0.0, 0.0, m.b1)).normalized();
    normal = around.cross(up);
  }
  /// Unit, along the gradient on the surface of cos(slant) u + sin(slant) v.
  [[nodiscard]] Vec3 gradient(const Curved& on, double slant) const {
    const double climb = on.by_sphere ? on.radius / std::hypot(m.a1, m.b1) : m.b1 / std::hypot(m.a1, m.b1);
    return (std::cos(slant) * on.radius / m.a * around + std::sin(slant) * climb * up).normalized();
  }
};

std::shared_ptr<const ParametricSurface> surface_of(const Curved& on) {
  ParametricSettings settings;
  settings.shape = on.shape;
  settings.radius = ball_radius;
  if (on.shape == ParametricShape::vase) settings.height = 0.12;
  return std::make_shared<const ParametricSurface>(must(ParametricSurface::build(settings)));
}

/// Tab. 3's block bent to that surface: gratings in a slanted direction, too low to be felt but for their lay.
Instance bent_block(const Curved& on, double slant, Formulation formulation) {
  FeatureMappingSettings mapping;
  mapping.surface = on.by_sphere ? IntermediateSurface::sphere : IntermediateSurface::cylinder;
  mapping.radius = on.radius;
  mapping.range = Vec2(-pi, pi);
  FineSettings settings = fine_settings({grating(1e-10, 1e-3, slant)}, Formulation::literal, mapping);
  settings.lay.sliding_ratio = 0.0;
  settings.lay.formulation = formulation;
  Instance instance = instance_of(surface_of(on));
  instance.material.static_friction = instance.material.dynamic_friction = 0.4;
  instance.material.friction.kind = FrictionKind::karnopp;
  instance.material.friction.formulation = formulation;
  instance.material.friction.stiffness = 250.0;
  instance.material.friction.break_away = 0.4;
  instance.material.friction_named = true;
  instance.fine = fine(settings);
  return instance;
}

constexpr double step_length = 20e-6;  // m a tick: 20 mm/s

/// A stroke at that angle to the gradient all the way, and the place of the surface under each point of it.
std::pair<std::vector<Vec3>, std::vector<Spot>> slanted_stroke(const Curved& on, double slant, double heading) {
  double angle = 0.4;
  double along = on.begin;
  std::vector<Vec3> path;
  std::vector<Spot> under;
  const auto probe = [&](double a, double s) {
    const Spot spot(on, a, s);
    return Vec3(spot.point - depth * spot.normal);
  };
  {
    const Spot first(on, angle, along);
    path.emplace_back(first.point + 1e-3 * first.normal);
    under.push_back(first);
  }
  for (int tick = 0; tick < 1000; ++tick) {
    const Spot here(on, angle, along);
    path.push_back(probe(angle, along));
    under.push_back(here);
    const Vec3 across = here.gradient(on, slant);
    const Vec3 way = std::cos(heading) * across + std::sin(heading) * here.normal.cross(across);
    // The probe runs below the surface: its own velocity has the angle.
    constexpr double h = 1e-6;
    const Vec3 by_angle = (probe(angle + h, along) - probe(angle - h, along)) / (2.0 * h);
    const Vec3 by_along = (probe(angle, along + h) - probe(angle, along - h)) / (2.0 * h);
    angle += step_length * way.dot(by_angle) / by_angle.squaredNorm();
    along += step_length * way.dot(by_along) / by_along.squaredNorm();
  }
  return {path, under};
}

TEST(Rows, Y8_on_curved_surfaces_friction_goes_by_the_angle_to_the_gradient_there) {
  const double degree = pi / 180.0;
  const std::pair<double, double> expected[] = {{0.0, 0.24}, {30.0, 0.16}, {60.0, 0.08}, {90.0, 0.0}};
  for (const Curved& on : curved) {
    for (const double slant : {0.0, 0.6}) {
      const Scene printed = scene_with(bent_block(on, slant, Formulation::literal));
      const Scene elliptic = scene_with(bent_block(on, slant, Formulation::consistent));
      for (const auto& [angle, force] : expected) {
        SCOPED_TRACE(std::string(parametric_name(on.shape)) + (on.by_sphere ? " by sphere " : " by cylinder ") +
                     std::to_string(slant) + " " + std::to_string(angle));
        const auto [path, under] = slanted_stroke(on, slant, angle * degree);
        const std::vector<ForceSample> felt = stroke(printed, path);
        const std::vector<ForceSample> passive = stroke(elliptic, path);
        for (std::size_t i = 100; i < path.size(); ++i) {
          ASSERT_NEAR((felt[i].contact.point - under[i].point).norm(), 0.0, 1e-8);
          const Vec3& normal = under[i].normal;
          Vec3 velocity = (path[i] - path[i - 1]) / tick.count();
          velocity -= velocity.dot(normal) * normal;
          // A tick turns the way by as much as the step is of the sharpest bend, of 1 / (10 mm): 2 mrad of the acute
          // angle, which is 0.24 N x 2 mrad / 90 degrees = 0.3 mN.
          ASSERT_NEAR(felt[i].parts.friction.norm(), force, 3.1e-4);
          const Vec3 across = under[i].gradient(on, slant);
          const double acute = std::atan2(velocity.cross(across).norm(), std::abs(velocity.dot(across)));
          const Vec3 literal = -push * 0.4 * (1.0 - acute / (0.5 * pi)) * velocity.normalized();
          ASSERT_NEAR((felt[i].parts.friction - literal).norm(), 0.0, 1e-6);
          // -N D v / sqrt(v' D v) with D = diag(0.4 squared, 0): along the gradient, whatever the angle.
          if (angle > 89.0) continue;
          const Vec3 along = across * (velocity.dot(across) > 0.0 ? 1.0 : -1.0);
          ASSERT_NEAR((passive[i].parts.friction + push * 0.4 * along).norm(), 0.0, 1e-5);
        }
      }
    }
  }
}

TEST(Rows, Y8_on_a_sphere_a_map_of_friction_changes_it_from_place_to_place) {
  const auto factor = [](double s, double t) { return 1.0 + 0.5 * std::cos(2.0 * pi * s) * std::cos(2.0 * pi * t); };
  const Curved& on = curved[0];
  Instance instance = bent_block(on, 0.0, Formulation::literal);
  FineSettings settings = instance.fine->settings();
  settings.lay = {};
  settings.friction_map = {
      std::make_shared<const HeightMap>(map_of(256, factor, Wrap::repeat, Reconstruction::bilinear)),
      Vec2(0.01, 0.007)};
  instance.fine = fine(settings);
  const Scene scene = scene_with(instance);
  const auto [path, under] = slanted_stroke(on, 0.0, 0.5);
  const std::vector<ForceSample> felt = stroke(scene, path);
  double least = infinity;
  double most = 0.0;
  for (std::size_t i = 100; i < path.size(); ++i) {
    const Vec3& p = under[i].point;
    // u counts from the first angle of the range, -pi.
    const double u = on.radius * (std::atan2(p.y(), p.x()) + pi);
    const double v = on.radius * std::asin(p.z() / on.radius);
    // Between texels a bilinear map is off by (1 / 256)^2 / 8 of the second derivatives, 0.5 (2 pi)^2 along each axis.
    const double expected = push * 0.4 * factor(u / 0.01, v / 0.007);
    ASSERT_NEAR(felt[i].parts.friction.norm(), expected, push * 0.4 * 8e-5);
    least = std::min(least, expected);
    most = std::max(most, expected);
  }
  // The stroke passes more than half of what the map spans.
  EXPECT_GT(most - least, 0.5 * push * 0.4);
}

// ---- Y-9: the roughness that is felt ----

/// Mean distance of the height, at which a force is felt, from its mean (m), along a line.
double felt_average(const Scene& scene, double force, const Vec3& way, double length, int count) {
  ProxyState state;
  std::vector<double> heights;
  double mean = 0.0;
  touch(scene, state, {0.0, 0.0, 2e-3});
  for (int i = 0; i < count; ++i) {
    const Vec3 base = ((i + 0.5) * length / count) * way;
    heights.push_back(height_at_force(scene, state, base, Vec3::UnitZ(), force, 1e-3, -2e-3));
    mean += heights.back() / count;
  }
  double average = 0.0;
  for (const double height : heights) average += std::abs(height - mean) / count;
  return average;
}

TEST(Rows, Y9_the_felt_profile_of_the_milled_block_has_the_measured_roughness) {
  // Fig. 13: R_a of 3.81 um and 0.33 um, felt of gratings of c = 5.985 um and 0.518 um.
  const double wavelength = 0.1e-3;
  constexpr int waves = 2;
  constexpr int samples = 400;  // a wave
  const struct { double amplitude, average; } measured[] = {{5.985e-6, 3.81e-6}, {0.518e-6, 0.33e-6}};
  for (const auto& [amplitude, average] : measured) {
    // c is given to 0.5 nm, 2 / pi of which is R_a's; the midpoint rule misses (2 pi / 400)^2 / 24 of it.
    const double rounding = 0.5e-9 * 2.0 / pi + 1.1e-5 * average;
    Instance texture = instance_of(flat_square());
    texture.fine = fine(fine_settings({grating(amplitude, wavelength)}));
    const Scene pressed = scene_with(texture);
    EXPECT_NEAR(felt_average(pressed, push, Vec3::UnitX(), waves * wavelength, waves * samples), average, rounding);
    EXPECT_LT(felt_average(pressed, push, Vec3::UnitY(), waves * wavelength, 100), 1e-12);
    // As geometry a probe is pushed back at right angles to the flanks: that moves what is felt aside by the depth
    // times the slope, and R_a by no more of itself than depth times curvature.
    ParametricSettings formula;
    formula.width = formula.depth = 0.04;
    formula.features = {grating(amplitude, wavelength)};
    const Scene shaped =
        scene_with(instance_of(std::make_shared<const ParametricSurface>(must(ParametricSurface::build(formula)))));
    constexpr double light = 1e-4;  // N
    const double curvature = amplitude * std::pow(2.0 * pi / wavelength, 2);
    EXPECT_NEAR(felt_average(shaped, light, Vec3::UnitX(), waves * wavelength, waves * samples), average,
                rounding + light / stiffness * curvature * average);
    EXPECT_LT(felt_average(shaped, light, Vec3::UnitY(), waves * wavelength, 100), 1e-12);
  }
}

}  // namespace
}  // namespace asperity::test::curved_features_test
