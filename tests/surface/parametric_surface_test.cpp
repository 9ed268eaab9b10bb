// Parametric surfaces: derivatives, and queries against formulas and against dense sampling.

#include "asperity/surface/parametric/view.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "asperity/core/rng.h"
#include "asperity/surface/tangents.h"
#include "tests/surface/balls.h"

namespace asperity::test::parametric_surface_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr ParametricShape shapes[] = {ParametricShape::plane, ParametricShape::cylinder, ParametricShape::sphere,
                                      ParametricShape::torus, ParametricShape::vase,     ParametricShape::ramp};

SurfaceFeature grating(double amplitude, double wavelength, double direction, double phase = 0.0) {
  FeatureSpec spec;
  spec.kind = FeatureKind::grating;
  spec.amplitude = amplitude;
  spec.wavelength = Vec2(wavelength, 0.0);
  spec.direction = direction;
  spec.phase = phase;
  return SurfaceFeature::build(spec).value();
}

SurfaceFeature ridges(double amplitude, double wavelength, double direction) {
  FeatureSpec spec;
  spec.kind = FeatureKind::triangular;
  spec.amplitude = amplitude;
  spec.wavelength = Vec2(wavelength, 0.0);
  spec.direction = direction;
  return SurfaceFeature::build(spec).value();
}

/// Every shape, with a grating along v (40 waves around where u closes, too) when asked for.
ParametricSettings settings_of(ParametricShape shape, bool featured) {
  ParametricSettings s;
  s.shape = shape;
  if (!featured) return s;
  const bool angle = shape != ParametricShape::plane && shape != ParametricShape::ramp;
  s.tile = Vec2(angle ? s.radius : (shape == ParametricShape::ramp ? 2.0 * s.scale : 1.0), 1.0);
  if (shape == ParametricShape::sphere) {
    s.tile.y() = s.radius;
    s.features = {grating(0.0002, pi * s.radius / 20.0, 0.5 * pi)};
    return s;
  }
  if (shape == ParametricShape::torus) s.tile.y() = s.tube;
  if (shape == ParametricShape::ramp) s.tile.y() = s.scale;
  s.features = {grating(0.0003, 2.0 * pi * s.tile.x() / (angle ? 40.0 : 30.0), 0.0)};
  if (shape == ParametricShape::torus)
    s.features.push_back(grating(0.0001, 2.0 * pi * s.tube / 12.0, 0.5 * pi, 0.4));
  else
    s.features.push_back(grating(0.0002, 0.006, 0.5 * pi, 0.4));
  return s;
}

ParametricSurface surface_of(ParametricShape shape, bool featured = false) {
  return ParametricSurface::build(settings_of(shape, featured)).value();
}

Vec2 place_in(const ParametricSurface& s, double a, double b) {
  return s.lower() + Vec2(a, b).cwiseProduct(s.upper() - s.lower());
}

Vec3 random_in(Rng& rng, const Box& box) {
  Vec3 p;
  for (int k = 0; k < 3; ++k) p[k] = rng.uniform(box.lower[k], box.upper[k]);
  return p;
}

/// Corners of a dense net of the surface.
struct Net {
  int columns = 0;
  int rows = 0;
  std::vector<Vec3> points;
  [[nodiscard]] const Vec3& at(int i, int j) const { return points[static_cast<std::size_t>(j * (columns + 1) + i)]; }
};

Net net_of(const ParametricSurface& s, int columns, int rows) {
  Net net{columns, rows, {}};
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i)
      net.points.push_back(s.jet(place_in(s, static_cast<double>(i) / columns, static_cast<double>(j) / rows)).point);
  }
  return net;
}

/// First crossing of a segment with the net's triangles, by its share; 2 where there is none.
double first_crossing(const Net& net, const Segment& motion) {
  const Vec3 d = motion.to - motion.from;
  double best = 2.0;
  const auto triangle = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = (b - a).cross(c - a);
    const double rate = n.dot(d);
    if (rate == 0.0) return;
    const double t = n.dot(a - motion.from) / rate;
    if (t < 0.0 || t > 1.0 || t >= best) return;
    const Vec3 p = motion.from + t * d - a;
    const double u = p.cross(c - a).dot(n) / n.squaredNorm();
    const double v = (b - a).cross(p).dot(n) / n.squaredNorm();
    if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) best = t;
  };
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      triangle(net.at(i, j), net.at(i + 1, j), net.at(i + 1, j + 1));
      triangle(net.at(i, j), net.at(i + 1, j + 1), net.at(i, j + 1));
    }
  }
  return best;
}

/// Every shape plain, then every shape with features.
const std::vector<ParametricSurface>& plain_and_featured() {
  static const std::vector<ParametricSurface> all = [] {
    std::vector<ParametricSurface> made;
    for (const bool featured : {false, true}) {
      for (const ParametricShape shape : shapes) made.push_back(surface_of(shape, featured));
    }
    return made;
  }();
  return all;
}

TEST(ParametricSurface, APlainShapeTellsNoHeight) {
  for (const ParametricShape shape : shapes) {
    const ParametricSurface s = surface_of(shape);
    for (const double share : {0.1, 0.5, 0.9}) EXPECT_EQ(s.jet(place_in(s, share, 1.0 - share)).height, 0.0);
  }
}

RC_GTEST_PROP(ParametricSurface, T8_derivatives_are_those_of_the_points, ()) {
  const double a = 0.05 + 0.9e-4 * *rc::gen::inRange(0, 10000);
  const double b = 0.05 + 0.9e-4 * *rc::gen::inRange(0, 10000);
  for (const ParametricSurface& s : plain_and_featured()) {
    const Vec2 uv = place_in(s, a, b);
    const ParametricJet here = s.jet(uv);
    const bool featured = !s.settings().features.empty();
    const Vec3 firsts[2] = {here.u, here.v};
    const Vec3 seconds[2][2] = {{here.uu, here.uv}, {here.uv, here.vv}};
    for (int k = 0; k < 2; ++k) {
      const double step = 1e-5 * (s.upper()[k] - s.lower()[k]) * (featured ? 0.1 : 1.0);
      const Vec2 off = step * (k == 0 ? Vec2::UnitX() : Vec2::UnitY());
      // Of fourth order: near a pole third derivatives are large.
      const ParametricJet near[2] = {s.jet(uv - off), s.jet(uv + off)};
      const ParametricJet far[2] = {s.jet(uv - 2.0 * off), s.jet(uv + 2.0 * off)};
      const auto difference = [&](Vec3 ParametricJet::*of) {
        return Vec3((8.0 * (near[1].*of - near[0].*of) - (far[1].*of - far[0].*of)) / (12.0 * step));
      };
      const Vec3 first = difference(&ParametricJet::point);
      RC_ASSERT((first - firsts[k]).norm() < 1e-6 * (firsts[k].norm() + 1e-3));
      const Vec3 by_u = difference(&ParametricJet::u);
      const Vec3 by_v = difference(&ParametricJet::v);
      const double scale = here.uu.norm() + here.uv.norm() + here.vv.norm() + 1e-3;
      RC_ASSERT((by_u - seconds[k][0]).norm() < (featured ? 2e-4 : 1e-6) * scale);
      RC_ASSERT((by_v - seconds[k][1]).norm() < (featured ? 2e-4 : 1e-6) * scale);
    }
  }
}

RC_GTEST_PROP(ParametricSurface, T8_parameter_gradients_and_bend_are_differences_along_the_surface, ()) {
  const auto index = *rc::gen::inRange<std::size_t>(0, 6);
  const ParametricSurface s = surface_of(shapes[index]);
  const Vec2 uv = place_in(s, 0.05 + 0.9e-4 * *rc::gen::inRange(0, 10000), 0.05 + 0.9e-4 * *rc::gen::inRange(0, 10000));
  const ParametricJet here = s.jet(uv);
  Vec3 du;
  Vec3 dv;
  parameter_gradients(here.u, here.v, du, dv);
  const Vec3 n = s.normal(here);
  RC_ASSERT(std::abs(du.dot(here.u) - 1.0) < 1e-12);
  RC_ASSERT(std::abs(dv.dot(here.v) - 1.0) < 1e-12);
  RC_ASSERT(std::abs(du.dot(here.v)) < 1e-9 * du.norm());
  RC_ASSERT(std::abs(n.dot(du)) < 1e-12 * du.norm());
  RC_ASSERT(std::abs(n.dot(dv)) < 1e-12 * dv.norm());
  const Mat3 bend = s.shape_operator(here);
  RC_ASSERT((bend - bend.transpose()).norm() < 1e-9 * (bend.norm() + 1.0));
  for (int k = 0; k < 2; ++k) {
    const double step = 1e-6 * (s.upper()[k] - s.lower()[k]);
    const Vec2 off = step * (k == 0 ? Vec2::UnitX() : Vec2::UnitY());
    const ParametricJet after = s.jet(uv + off);
    const ParametricJet before = s.jet(uv - off);
    const Vec3 turned = s.normal(after) - s.normal(before);
    const Vec3 moved = after.point - before.point;
    RC_ASSERT((turned - bend * moved).norm() < 1e-6 * (bend.norm() + 1.0) * moved.norm());
  }
}

TEST(ParametricSurface, FrontsTurnOutwards) {
  for (const ParametricShape shape : {ParametricShape::cylinder, ParametricShape::sphere, ParametricShape::vase}) {
    const ParametricSurface s = surface_of(shape);
    const ParametricJet jet = s.jet(place_in(s, 0.3, 0.5));
    EXPECT_GT(s.normal(jet).dot(Vec3(jet.point.x(), jet.point.y(), 0.0)), 0.0) << parametric_name(shape);
  }
  const ParametricSurface pole = surface_of(ParametricShape::sphere);
  EXPECT_NEAR(pole.normal(pole.jet(Vec2(0.7, pole.upper().y()))).z(), 1.0, 1e-12);
  EXPECT_NEAR(pole.shape_operator(pole.jet(Vec2(0.3, 0.4)))(2, 2), std::pow(std::cos(0.4), 2) / 0.03, 1e-6);
}

TEST(ParametricSurface, Y6_the_vase_is_three_times_as_wide_below_as_at_its_neck) {
  const ParametricSurface s = surface_of(ParametricShape::vase);
  double widest = 0.0;
  double at = 0.0;
  double narrowest = infinity;
  for (int i = 0; i <= 1000; ++i) {
    const Vec3 p = s.jet(Vec2(0.0, 0.1 * i / 1000.0)).point;
    if (p.x() > widest) {
      widest = p.x();
      at = p.z();
    }
    narrowest = std::min(narrowest, p.x());
  }
  EXPECT_NEAR(widest, 0.03, 1e-9);
  EXPECT_NEAR(widest / narrowest, 3.0, 1e-6);
  EXPECT_LT(at, 0.04);
}

TEST(ParametricSurface, NearestPlacesOfSphereTorusCylinderAndPlane) {
  Rng rng(3);
  const ParametricSurface sphere = surface_of(ParametricShape::sphere);
  const ParametricSurface torus = surface_of(ParametricShape::torus);
  const ParametricSurface cylinder = surface_of(ParametricShape::cylinder);
  const ParametricSurface plane = surface_of(ParametricShape::plane);
  const ParametricSurface* surfaces[4] = {&sphere, &torus, &cylinder, &plane};
  Place last[4];
  // Each search starts where the one before ended.
  const auto nearest = [&](std::size_t which, const Vec3& p, double bound) {
    const Foot foot = surfaces[which]->view().nearest(p, bound, last[which]);
    if (foot.found()) last[which] = {foot.element, false, foot.at};
    return foot;
  };
  for (int i = 0; i < 1500; ++i) {
    const Vec3 p = random_in(rng, torus.bounds().grown(0.02));
    const double around = std::hypot(p.x(), p.y());
    EXPECT_NEAR(nearest(0, p, infinity).distance, std::abs(p.norm() - 0.03), 2e-10);
    EXPECT_NEAR(nearest(1, p, infinity).distance, std::abs(std::hypot(around - 0.03, p.z()) - 0.01), 2e-10);
    const double beyond = std::max({0.0, -p.z(), p.z() - 0.1});
    EXPECT_NEAR(nearest(2, p, infinity).distance, std::hypot(around - 0.03, beyond), 2e-10);
    const Vec3 flat(std::clamp(p.x(), -0.05, 0.05), std::clamp(p.y(), -0.05, 0.05), 0.0);
    EXPECT_NEAR(nearest(3, p, infinity).distance, (p - flat).norm(), 2e-10);
  }
  EXPECT_FALSE(nearest(0, Vec3(0.0, 0.0, 0.05), 0.019).found());
  EXPECT_TRUE(nearest(0, Vec3(0.0, 0.0, 0.05), 0.021).found());
  // Where every place is the nearest one.
  EXPECT_NEAR(nearest(0, Vec3::Zero(), infinity).distance, 0.03, 1e-9);
}

TEST(ParametricSurface, NearestPlacesAgainstDenseSamplingOfEveryFeaturedShape) {
  Rng rng(5);
  for (const ParametricShape shape : shapes) {
    const ParametricSurface s = surface_of(shape, true);
    const Net net = net_of(s, 600, 300);
    Place last;
    for (int i = 0; i < 25; ++i) {
      const Vec3 p = random_in(rng, s.bounds().grown(0.005));
      if (i % 3 == 0) last = {};
      const Foot foot = s.view().nearest(p, infinity, last);
      ASSERT_TRUE(foot.found());
      last = {foot.element, false, foot.at};
      double sampled = infinity;
      for (const Vec3& q : net.points) sampled = std::min(sampled, (p - q).norm());
      EXPECT_LE(foot.distance, sampled + 2e-10) << parametric_name(shape) << " " << i;
      // What was found is on the surface.
      EXPECT_LT((s.jet(foot.at.head<2>()).point - foot.point).norm(), 1e-12);
      EXPECT_NEAR((p - foot.point).norm(), foot.distance, 1e-12);
    }
  }
}

TEST(ParametricSurface, SegmentsMeetSpheresToriAndCylindersWhereFormulasSay) {
  Rng rng(7);
  const ParametricSurface sphere = surface_of(ParametricShape::sphere);
  const ParametricSurface cylinder = surface_of(ParametricShape::cylinder);
  int hits = 0;
  for (int i = 0; i < 4000; ++i) {
    const Segment g{random_in(rng, sphere.bounds().grown(0.03)), random_in(rng, sphere.bounds().grown(0.03))};
    const Vec3 d = g.to - g.from;
    const auto first = [&](double a, double b, double c, bool from_outside, const auto& valid) {
      const double root = b * b - a * c;
      if (root < 0.0) return 2.0;
      for (const double sign : {-1.0, 1.0}) {
        const double t = (-b + sign * std::sqrt(root)) / a;
        if (t >= 0.0 && t <= 1.0 && valid(t) && (!from_outside || sign < 0.0)) return t;
      }
      return 2.0;
    };
    for (const bool front : {false, true}) {
      const double t =
          first(d.squaredNorm(), d.dot(g.from), g.from.squaredNorm() - 9e-4, front, [](double) { return true; });
      const SweptHit hit = sphere.view().first_touch(g, front ? Sides::front : Sides::both);
      ASSERT_EQ(hit.hit, t <= 1.0) << i;
      if (hit.hit) {
        EXPECT_NEAR(hit.t, t, 1e-9);
      }
      hits += hit.hit ? 1 : 0;
    }
    const double t = first(d.head<2>().squaredNorm(), d.head<2>().dot(g.from.head<2>()),
                           g.from.head<2>().squaredNorm() - 9e-4, false, [&](double at) {
                             const double z = g.from.z() + at * d.z();
                             return z >= 0.0 && z <= 0.1;
                           });
    const SweptHit hit = cylinder.view().first_touch(g, Sides::both);
    ASSERT_EQ(hit.hit, t <= 1.0) << i;
    if (hit.hit) {
      EXPECT_NEAR(hit.t, t, 1e-9);
      EXPECT_LT(hit.contact.normal.dot(d), 0.0);
    }
  }
  EXPECT_GT(hits, 1000);
}

TEST(ParametricSurface, SegmentsThroughPolesSeamsAndRimsMeetTheSurface) {
  const ParametricSurface sphere = surface_of(ParametricShape::sphere);
  const ParametricSurface torus = surface_of(ParametricShape::torus);
  const ParametricSurface plane = surface_of(ParametricShape::plane);
  EXPECT_NEAR(sphere.view().first_touch({Vec3(0, 0, 0.05), Vec3(0, 0, -0.05)}, Sides::both).t, 0.2, 1e-8);
  EXPECT_NEAR(sphere.view().first_touch({Vec3(0.05, 0, 0), Vec3(-0.05, 0, 0)}, Sides::both).t, 0.2, 1e-8);
  EXPECT_NEAR(torus.view().first_touch({Vec3(0.06, 0, 0), Vec3(0, 0, 0)}, Sides::front).t, 1.0 / 3.0, 1e-10);
  EXPECT_NEAR(torus.view().first_touch({Vec3(0, 0, 0), Vec3(0.06, 0, 0)}, Sides::front).t, 1.0 / 3.0, 1e-10);
  EXPECT_TRUE(plane.view().first_touch({Vec3(0.05, 0.05, 1), Vec3(0.05, 0.05, -1)}, Sides::both).hit);
  EXPECT_FALSE(plane.view().first_touch({Vec3(0.0501, 0.05, 1), Vec3(0.0501, 0.05, -1)}, Sides::both).hit);
  // Along the surface, just above it, and where a ray only touches.
  EXPECT_FALSE(plane.view().first_touch({Vec3(-1, 0, 1e-8), Vec3(1, 0, 1e-8)}, Sides::both).hit);
  EXPECT_TRUE(plane.view().first_touch({Vec3(-1, 0, 1e-8), Vec3(1, 0, -1e-8)}, Sides::both).hit);
  EXPECT_FALSE(sphere.view().first_touch({Vec3(-1, 0, 0.03 + 1e-8), Vec3(1, 0, 0.03 + 1e-8)}, Sides::both).hit);
  EXPECT_TRUE(sphere.view().first_touch({Vec3(-1, 0, 0.03 - 1e-8), Vec3(1, 0, 0.03 - 1e-8)}, Sides::both).hit);
}

TEST(ParametricSurface, SegmentsAgainstADenseNetOfEveryFeaturedShape) {
  Rng rng(11);
  for (const ParametricShape shape : shapes) {
    const ParametricSurface s = surface_of(shape, true);
    const int columns = 240;
    const int rows = 160;
    const Net net = net_of(s, columns, rows);
    const double size = s.bounds().diagonal();
    int hits = 0;
    for (int i = 0; i < 40; ++i) {
      const Segment g{random_in(rng, s.bounds().grown(0.01)), random_in(rng, s.bounds().grown(0.01))};
      const SweptHit hit = s.view().first_touch(g, Sides::both);
      const double t = first_crossing(net, g);
      if (hit.hit) {
        ++hits;
        // On the surface and on the segment.
        EXPECT_LT((s.jet(hit.contact.at.head<2>()).point - g.from - hit.t * (g.to - g.from)).norm(), 2e-9 * size);
      }
      // Nothing that the net meets well before is passed; triangles cut off what is thinner than they are.
      const double slack = 0.03;
      if (t <= 1.0) {
        EXPECT_LT(hit.t, t + slack) << parametric_name(shape) << " " << i;
      }
    }
    EXPECT_GT(hits, 5) << parametric_name(shape);
  }
}

TEST(ParametricSurface, RidgesWithEdgesAreMetAndNearest) {
  ParametricSettings settings;
  settings.features = {ridges(0.001, 0.008, 0.3)};
  const ParametricSurface s = ParametricSurface::build(settings).value();
  Rng rng(13);
  for (int i = 0; i < 30; ++i) {
    const Vec3 p(rng.uniform(-0.04, 0.04), rng.uniform(-0.04, 0.04), rng.uniform(0.002, 0.006));
    const Vec2 uv(p.x() + 0.05, p.y() + 0.05);
    const double height = settings.features[0].sample(uv).height;
    const SweptHit down = s.view().first_touch({p, p - Vec3(0, 0, 0.01)}, Sides::both);
    ASSERT_TRUE(down.hit);
    EXPECT_NEAR(p.z() - 0.01 * down.t, height, 1e-9);
    const Foot foot = s.view().nearest(p, infinity, {down.contact.element, false, down.contact.at});
    double sampled = infinity;
    for (int k = 0; k < 400; ++k) {
      // The nearest place lies across the ridges.
      const double along = -0.01 + 0.02 * k / 399.0;
      const Vec2 at = uv + along * Vec2(std::cos(0.3), std::sin(0.3));
      const Vec3 q(at.x() - 0.05, at.y() - 0.05, settings.features[0].sample(at).height);
      sampled = std::min(sampled, (p - q).norm());
    }
    EXPECT_LE(foot.distance, sampled + 1e-9);
    EXPECT_GE(foot.distance, sampled - 2e-5);
  }
}

TEST(ParametricSurface, RidgesFinerThanItsPatchesAreMetAndNearest) {
  // 480 ridges where 256 patches is the most: one of them may hold two flanks that rise alike with a fall in between.
  ParametricSettings settings;
  const double wavelength = 0.1 / 480.0;
  settings.features = {ridges(0.4 * wavelength, wavelength, 0.0)};
  const ParametricSurface s = ParametricSurface::build(settings).value();
  Rng rng(29);
  for (int i = 0; i < 200; ++i) {
    // Low over the ridges and mostly along them or across: where it is first below them, by small steps.
    const Vec3 from(rng.uniform(-0.04, 0.04), rng.uniform(-0.04, 0.04), rng.uniform(0.41, 0.6) * wavelength);
    const Vec3 to = from + Vec3(rng.uniform(-3.0, 3.0), rng.uniform(-0.3, 0.3), -1.0) * wavelength;
    constexpr int steps = 4000;
    double below = 2.0;
    for (int k = 0; k <= steps && below > 1.0; ++k) {
      const double t = static_cast<double>(k) / steps;
      const Vec3 p = from + t * (to - from);
      if (p.z() < settings.features[0].sample(Vec2(p.x() + 0.05, p.y() + 0.05)).height) below = t;
    }
    const SweptHit hit = s.view().first_touch({from, to}, Sides::both);
    ASSERT_TRUE(hit.hit) << i;
    EXPECT_NEAR(hit.t, below, 1.1 / steps) << i;
  }
}

TEST(ParametricSurface, ElementsAreAQuarterOfTheShortestRidgeOrLess) {
  // So that what messages and traces name tells a crest from its flanks. Of 2 mm: 0.5 mm; fine enough for 7 mm, too.
  for (const double wavelength : {2e-3, 7e-3}) {
    ParametricSettings settings;
    settings.features = {grating(1e-5, wavelength, 0.0), grating(1e-5, 3.0 * wavelength, 0.5 * pi)};
    const ParametricSurface s = ParametricSurface::build(settings).value();
    for (int k = 0; k < 2; ++k) {
      constexpr int places = 8192;
      std::map<std::uint32_t, int> met;
      for (int i = 0; i < places; ++i) {
        Vec2 uv = Vec2::Constant(0.0437);
        uv[k] = 0.1 * (i + 0.5) / places;
        ++met[s.element_of(uv)];
      }
      for (const auto& [element, count] : met) {
        EXPECT_LE(0.1 * count / places, 0.25 * wavelength) << element;
        EXPECT_EQ(count, met.begin()->second) << element << ": all are of one size";
      }
    }
  }
}

TEST(ParametricSurface, BoundsOfWhatHasNoFormulaAreAtMostTwiceWhatIsThere) {
  // Gentle noise: its slopes are far below 1.
  FeatureSpec spec;
  spec.kind = FeatureKind::noise;
  spec.roughness = 5e-6;
  spec.correlation_length = 1e-3;
  ParametricSettings settings;
  settings.features = {SurfaceFeature::build(spec).value()};
  const ParametricSurface s = ParametricSurface::build(settings).value();
  Rng rng(31);
  double steepest = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const Vec2 uv(rng.uniform(0.0, 0.1), rng.uniform(0.0, 0.1));
    steepest = std::max(steepest, settings.features[0].sample(uv).gradient.norm());
  }
  EXPECT_LT(steepest, 0.1);
  EXPECT_GE(s.limits().slope_u, steepest);
  EXPECT_LE(s.limits().slope_u, 2.0 * steepest);
}

TEST(ParametricSurface, GrainFollowsTheShortestWaveAsItLiesOnTheSurface) {
  // Around the axis waves are shortest where the surface is nearest to it: within the torus. Those of a sphere run
  // along its meridians and are as long at the poles as anywhere.
  for (const ParametricShape shape : {ParametricShape::sphere, ParametricShape::torus}) {
    for (const double count : {40.0, 160.0}) {
      ParametricSettings s = settings_of(shape, true);
      const bool sphere = shape == ParametricShape::sphere;
      s.features = {grating(1e-6, 2.0 * pi * s.radius / count, sphere ? 0.5 * pi : 0.0)};
      const double shortest = 2.0 * pi * (sphere ? s.radius : s.radius - s.tube) / count;
      const ParametricSurface surface = ParametricSurface::build(s).value();
      EXPECT_LE(surface.grain(), 0.1 * shortest) << to_string(shape);
      if (count > 100.0) {
        EXPECT_GE(surface.grain(), 0.05 * shortest) << to_string(shape);
      }
    }
  }
}

TEST(ParametricSurface, BallsStopAtTheirRadius) {
  Rng rng(17);
  const ParametricSurface sphere = surface_of(ParametricShape::sphere);
  const ParametricSurface vase = surface_of(ParametricShape::vase, true);
  const Net net = net_of(vase, 600, 300);
  int hits = 0;
  for (int i = 0; i < 60; ++i) {
    const double r = rng.uniform(0.0005, 0.004);
    const Segment g{0.06 * random_in(rng, {Vec3::Constant(-1), Vec3::Constant(1)}).normalized(),
                    random_in(rng, sphere.bounds())};
    const double touch = ball_touch(g, r, [&](const Vec3& p) { return sphere.view().nearest(p, infinity); });
    const Vec3 d = g.to - g.from;
    const double root = std::pow(d.dot(g.from), 2) - d.squaredNorm() * (g.from.squaredNorm() - std::pow(0.03 + r, 2));
    const double t = root < 0.0 ? 2.0 : (-d.dot(g.from) - std::sqrt(root)) / d.squaredNorm();
    ASSERT_EQ(touch <= 1.0, t >= 0.0 && t <= 1.0) << i;
    if (touch <= 1.0) {
      EXPECT_NEAR(touch, t, 1e-5);
    }
    const double other = ball_touch(g, r, [&](const Vec3& p) { return vase.view().nearest(p, infinity); });
    if (other > 1.0 || other == 0.0) continue;
    ++hits;
    const Vec3 centre = g.from + other * d;
    EXPECT_NEAR(vase.view().nearest(centre, infinity).distance, r, 1e-7);
    // It is the first touch: of a dense net of the surface nothing is nearer on the way, and something is there.
    double sampled = infinity;
    for (int k = 0; k <= 10; ++k) {
      const Vec3 at = g.from + (0.1 * k * other) * d;
      sampled = infinity;
      for (const Vec3& q : net.points) sampled = std::min(sampled, (at - q).norm());
      EXPECT_GT(sampled, r - 1e-7) << i;
    }
    EXPECT_LT(sampled, r + 1e-4) << i;
  }
  EXPECT_GT(hits, 10);
}

TEST(ParametricSurface, BothFlanksOfAGrooveAreNearestToABallInIt) {
  ParametricSettings settings;
  settings.features = {grating(0.001, 0.008, 0.0)};
  const ParametricSurface s = ParametricSurface::build(settings).value();
  // A valley lies at u = 4 mm + n 8 mm; a ball of more than its radius of curvature touches both flanks.
  const double x = 0.052 - 0.05;
  const double r = 0.004;
  double low = -0.001;
  double high = 0.01;
  for (int i = 0; i < 60; ++i) {
    const double z = 0.5 * (low + high);
    (s.view().nearest(Vec3(x, 0, z), infinity).distance < r ? low : high) = z;
  }
  // On either side of the middle the flank there is the nearer one.
  const Foot left = s.view().nearest(Vec3(x - 1e-7, 0, low), r + 1e-7);
  const Foot right = s.view().nearest(Vec3(x + 1e-7, 0, low), r + 1e-7);
  ASSERT_TRUE(left.found());
  ASSERT_TRUE(right.found());
  EXPECT_GT(left.normal.x(), 0.1);
  EXPECT_LT(right.normal.x(), -0.1);
  EXPECT_NEAR(left.normal.x(), -right.normal.x(), 1e-3);
  EXPECT_NEAR(left.distance, r, 2e-7);
  EXPECT_NEAR(right.distance, r, 2e-7);
  EXPECT_FALSE(s.view().nearest(Vec3(x, 0, 0.1), r).found());
}

TEST(ParametricSurface, SignedDistanceOfASphere) {
  const ParametricSurface s = surface_of(ParametricShape::sphere);
  Rng rng(19);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p = random_in(rng, s.bounds().grown(0.01));
    const FieldSample sample = s.view().eval(p);
    EXPECT_NEAR(sample.value, p.norm() - 0.03, 2e-10);
    if (std::abs(sample.value) < 1e-4) continue;
    EXPECT_LT((sample.gradient - p.normalized()).norm(), 1e-5);
  }
}

TEST(ParametricSurface, BoundsHoldEveryPointAndMemoryIsSmall) {
  for (const ParametricShape shape : shapes) {
    const ParametricSurface s = surface_of(shape, true);
    Rng rng(23);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p = s.jet(place_in(s, rng.uniform(), rng.uniform())).point;
      ASSERT_TRUE((p.array() >= s.bounds().lower.array()).all() && (p.array() <= s.bounds().upper.array()).all());
    }
    EXPECT_LT(s.memory_bytes(), 4U << 20U);
    EXPECT_LT(surface_of(shape).memory_bytes(), 64U << 10U);
  }
}

/// What build answers to a change of the settings.
Error refused(const ParametricSettings& settings) {
  const auto built = ParametricSurface::build(settings);
  return built ? Error{ErrorCode::bad_value, "", "", "accepted", ""} : built.error();
}

TEST(ParametricSurface, BadSettingsAreNamed) {
  const auto place = [](auto change, ParametricShape shape) {
    ParametricSettings s;
    s.shape = shape;
    change(s);
    const Error error = refused(s);
    EXPECT_FALSE(error.accepted.empty() && error.place != "accepted");
    return error.place;
  };
  const double nan = std::nan("");
  EXPECT_EQ(place([](auto& s) { s.width = 0.0; }, ParametricShape::plane), "width");
  EXPECT_EQ(place([&](auto& s) { s.depth = nan; }, ParametricShape::plane), "depth");
  EXPECT_EQ(place([](auto& s) { s.radius = -1.0; }, ParametricShape::sphere), "radius");
  EXPECT_EQ(place([](auto& s) { s.height = infinity; }, ParametricShape::cylinder), "height");
  EXPECT_EQ(place([](auto& s) { s.tube = 0.03; }, ParametricShape::torus), "tube");
  EXPECT_EQ(place([](auto& s) { s.tube = 0.0; }, ParametricShape::torus), "tube");
  EXPECT_EQ(place([](auto& s) { s.neck = 0.0; }, ParametricShape::vase), "neck");
  EXPECT_EQ(place([](auto& s) { s.neck = 1.0; }, ParametricShape::vase), "neck");
  EXPECT_EQ(place([](auto& s) { s.scale = 0.0; }, ParametricShape::ramp), "scale");
  EXPECT_EQ(place([](auto& s) { s.tile.y() = 0.0; }, ParametricShape::plane), "tile[1]");
  EXPECT_EQ(place([](auto& s) { s.shape = static_cast<ParametricShape>(17); }, ParametricShape::plane), "shape");
  // What a shape does not take is not looked at.
  EXPECT_EQ(place([](auto& s) { s.neck = 7.0; }, ParametricShape::plane), "accepted");
}

TEST(ParametricSurface, FeaturesThatDoNotFitAreRefused) {
  ParametricSettings s = settings_of(ParametricShape::torus, false);
  s.tile = Vec2(0.03, 0.01);
  s.features = {grating(0.0005, 2.0 * pi * 0.03 / 40.5, 0.0)};
  EXPECT_EQ(refused(s).code, ErrorCode::mismatch);
  EXPECT_NE(refused(s).message().find("u comes back"), std::string::npos);
  s.features = {grating(0.0005, 2.0 * pi * 0.01 / 7.3, 0.5 * pi)};
  EXPECT_NE(refused(s).message().find("v comes back"), std::string::npos);
  s.features = {grating(0.011, 2.0 * pi * 0.03 / 4, 0.0)};
  EXPECT_EQ(refused(s).code, ErrorCode::bad_value);
  EXPECT_NE(refused(s).message().find("10 mm"), std::string::npos) << refused(s).message();
  ParametricSettings ball = settings_of(ParametricShape::sphere, true);
  ball.features = {grating(0.0002, 2.0 * pi * ball.radius / 40.0, 0.0)};
  EXPECT_EQ(refused(ball).code, ErrorCode::mismatch);
  ball.features = {grating(0.0002, pi * ball.radius / 20.5, 0.5 * pi)};
  EXPECT_EQ(refused(ball).code, ErrorCode::mismatch);
  ParametricSettings many;
  many.features.assign(17, grating(0.0001, 0.01, 0.0));
  EXPECT_EQ(refused(many).code, ErrorCode::too_large);
}

TEST(ParametricSurface, NamesComeBack) {
  for (const ParametricShape shape : shapes) {
    EXPECT_EQ(value_named<ParametricShape>(parametric_name(shape)), shape);
    EXPECT_FALSE(parametric_parameters(shape).empty());
  }
  EXPECT_EQ(parametric_names().size(), 6U);
  EXPECT_FALSE(value_named<ParametricShape>("cone").has_value());
  EXPECT_NE(name_list<ParametricShape>().find("torus"), std::string::npos);
}

}  // namespace
}  // namespace asperity::test::parametric_surface_test
