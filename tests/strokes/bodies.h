#pragma once
// Bodies of every provider, each with its distance told by a formula or by looking at every triangle: an oracle that
// shares no code with what is judged by it.

#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/render/fixtures.h"
#include "tests/render/implicits.h"
#include "tests/render/volumes.h"
#include "tests/surface/custom_fields.h"

namespace asperity::strokes {

using Distance = std::function<double(const Vec3&)>;

/// One touchable thing of a scene, and how far a place is outside of it (m, world; below 0 inside).
struct Body {
  Instance instance;
  Distance distance;
  double size = 0.0;   ///< m: of a ball within it, by which others are laid around it
  double error = 0.0;  ///< m, between what is felt and what `distance` tells
  std::string name;
  double rim = infinity;  ///< m, of a sheet: beyond that from its middle, sideways, `distance` is of what is not there
  std::vector<Distance> sheets{};  ///< what it consists of, if of several
};

/// Distance to one triangle, by its planes, edges and corners in turn.
inline double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto to_edge = [&](const Vec3& s, const Vec3& t) {
    const double share = std::clamp((p - s).dot(t - s) / (t - s).squaredNorm(), 0.0, 1.0);
    return (p - (s + share * (t - s))).norm();
  };
  const Vec3 n = (b - a).cross(c - a).normalized();
  const bool above =
      (b - a).cross(p - a).dot(n) >= 0.0 && (c - b).cross(p - b).dot(n) >= 0.0 && (a - c).cross(p - c).dot(n) >= 0.0;
  if (above) return std::abs((p - a).dot(n));
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

/// Of a convex polyhedron.
inline Distance convex_distance(const MeshSource& source) {
  return [source](const Vec3& p) {
    double deepest = -infinity;
    double nearest = infinity;
    for (const auto& t : source.triangles) {
      const Vec3& a = source.positions[t[0]];
      const Vec3& b = source.positions[t[1]];
      const Vec3& c = source.positions[t[2]];
      deepest = std::max(deepest, (p - a).dot((b - a).cross(c - a).normalized()));
      nearest = std::min(nearest, triangle_distance(p, a, b, c));
    }
    return deepest > 0.0 ? nearest : -nearest;
  };
}

/// Under the sheet z = h(x, y): the best of a grid of places around, walked to its foot.
template <class Height>
Distance sheet_distance(const Height& h, double around) {
  return [h, around](const Vec3& p) {
    const double above = p.z() - h(p.x(), p.y());
    // A foot farther sideways than that is farther than the one straight below.
    const double reach = std::min(around, std::abs(above));
    const auto square = [&](double x, double y) {
      const double dx = p.x() - x;
      const double dy = p.y() - y;
      const double dz = p.z() - h(x, y);
      return dx * dx + dy * dy + dz * dz;
    };
    constexpr int steps = 3;
    struct Start {
      double square, x, y;
    };
    std::vector<Start> starts;
    for (int i = -steps; i <= steps; ++i) {
      for (int j = -steps; j <= steps; ++j) {
        const double x = p.x() + reach * i / steps;
        const double y = p.y() + reach * j / steps;
        starts.push_back({square(x, y), x, y});
      }
    }
    std::partial_sort(starts.begin(), starts.begin() + 3, starts.end(),
                      [](const Start& a, const Start& b) { return a.square < b.square; });
    double best = infinity;
    for (int k = 0; k < 3; ++k) {
      auto [here, x, y] = starts[static_cast<std::size_t>(k)];
      for (double stride = 0.5 * reach / steps; stride > 1e-7;) {
        const double left = square(x - stride, y);
        const double right = square(x + stride, y);
        const double down = square(x, y - stride);
        const double up = square(x, y + stride);
        // Where the four have their least, as a parabola along either axis.
        const auto off = [&](double before, double after) {
          const double bend = before + after - 2.0 * here;
          return bend > 0.0 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : (before < after ? -1.0 : 1.0);
        };
        const double next_x = x + stride * off(left, right);
        const double next_y = y + stride * off(down, up);
        const double there = square(next_x, next_y);
        if (there < here) {
          here = there;
          x = next_x;
          y = next_y;
        } else {
          stride *= 0.2;
        }
      }
      best = std::min(best, here);
    }
    return above < 0.0 ? -std::sqrt(best) : std::sqrt(best);
  };
}

inline Distance ball_distance(double radius) {
  return [radius](const Vec3& p) { return p.norm() - radius; };
}

inline Instance instance_of(Surface surface) {
  Instance instance;
  instance.name = "body";
  instance.surface = std::move(surface);
  instance.sides = Sides::front;
  instance.material.stiffness = test::stiffness;
  return instance;
}

inline Body box(Rng& rng) {
  const Vec3 size(rng.uniform(0.008, 0.03), rng.uniform(0.008, 0.03), rng.uniform(0.008, 0.03));
  const MeshSource source = box_mesh(size);
  return {instance_of(test::bare(source)), convex_distance(source), 0.5 * size.minCoeff(), 1e-6, "box"};
}

inline Body polyhedron(Rng& rng) {
  const double radius = rng.uniform(0.005, 0.015);
  const MeshSource source = icosphere(rng.uniform(0.0, 1.0) < 0.5 ? 0 : 1, radius);
  return {instance_of(test::bare(source)), convex_distance(source), 0.75 * radius, 1e-6, "polyhedron"};
}

/// A relief on a square of 60 mm. Its waves are of `wave` (m).
inline Body relief(Rng& rng) {
  const double waves = std::floor(rng.uniform(6.0, 30.0));
  const double side = 0.06;
  const double amplitude = rng.uniform(0.02, 0.06) * side / waves;
  const double turn = 2.0 * std::numbers::pi * waves / side;
  const auto height = [=](double x, double y) {
    return amplitude * 0.5 * (std::sin(turn * x) + std::cos(turn * y) * std::cos(turn * x));
  };
  auto map = test::map_of(512, [&](double s, double t) { return height((s - 0.5) * side, (t - 0.5) * side); });
  return {instance_of(test::coated(plane_grid(side, side, 2, 2), std::move(map), Mapping::uv, side)),
          sheet_distance(height, 3e-3),
          0.01,
          3e-6,
          "relief",
          0.5 * side};
}

/// Two such squares that cross, as one relief: what is under either is inside, and they hold a point along the crease
/// that they make.
inline Body folds(Rng& rng) {
  const double waves = std::floor(rng.uniform(6.0, 30.0));
  const double side = 0.06;
  const double amplitude = rng.uniform(0.02, 0.06) * side / waves;
  const double turn = 2.0 * std::numbers::pi * waves / side;
  const auto height = [=](double x, double y) {
    return amplitude * 0.5 * (std::sin(turn * x) + std::cos(turn * y) * std::cos(turn * x));
  };
  Pose other;
  other.orientation = Quat(Eigen::AngleAxisd(rng.uniform(0.7, 2.4), Vec3::UnitX()) *
                           Eigen::AngleAxisd(rng.uniform(0.0, 6.0), Vec3::UnitZ()));
  other.position = Vec3(0.7e-3, 0.4e-3, 0.0);  // no vertex of one on one of the other
  MeshSource source = plane_grid(side, side, 12, 12);
  const MeshSource flat = source;
  for (const Vec3& p : flat.positions) source.positions.push_back(other.apply(p));
  const auto first = static_cast<std::uint32_t>(flat.positions.size());
  for (const auto& t : flat.triangles) source.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  source.corner_uvs.insert(source.corner_uvs.end(), flat.corner_uvs.begin(), flat.corner_uvs.end());
  auto map = test::map_of(512, [&](double s, double t) { return height((s - 0.5) * side, (t - 0.5) * side); });
  return {instance_of(test::coated(std::move(source), std::move(map), Mapping::uv, side)),
          [one = sheet_distance(height, 3e-3), other](const Vec3& p) {
            return std::min(one(p), one(other.apply_inverse(p)));
          },
          0.01,
          3e-6,
          "folds",
          0.5 * side,
          {sheet_distance(height, 3e-3),
           [one = sheet_distance(height, 3e-3), other](const Vec3& p) { return one(other.apply_inverse(p)); }}};
}

inline Body iso(Rng& rng) {
  const double radius = rng.uniform(0.005, 0.015);
  const double half = 1.3 * radius;
  const auto grid = volumes::cube(half, 41);
  return {
      instance_of(volumes::surface_of(
          volumes::sampled(grid, [&](const Vec3& p) { return (p.squaredNorm() - radius * radius) / radius; }), 0.0)),
      ball_distance(radius), radius, 3e-3 * radius, "iso"};
}

inline Body implicit(Rng& rng) {
  const double radius = rng.uniform(0.005, 0.015);
  constexpr double band = 5e-3;
  const auto grid = test::sparse_grid(ball_distance(radius), test::cube(radius + band), radius / 20.0, band, band);
  Instance instance = test::implicit_instance(grid);
  instance.material.stiffness = test::stiffness;
  return {instance, ball_distance(radius), radius, 3e-3 * radius, "implicit"};
}

inline Body parametric(Rng& rng) {
  ParametricSettings settings;
  settings.shape = ParametricShape::sphere;
  settings.radius = rng.uniform(0.005, 0.015);
  return {instance_of(std::make_shared<const ParametricSurface>(test::must(ParametricSurface::build(settings)))),
          ball_distance(settings.radius), settings.radius, 1e-6, "parametric"};
}

inline Body custom(Rng& rng) {
  const double radius = rng.uniform(0.005, 0.015);
  return {instance_of(std::make_shared<const CustomSurface>(
              test::must(CustomSurface::build(test::SmoothBall{test::Ball{radius}})))),
          ball_distance(radius), radius, 1e-6, "custom"};
}

using Maker = Body (*)(Rng&);
inline const std::vector<Maker>& makers() {
  static const std::vector<Maker> all = {box, polyhedron, relief, iso, implicit, parametric, custom};
  return all;
}

/// The body somewhere else.
inline Body placed(Body body, const Pose& pose) {
  body.instance.world_from_object = pose;
  const auto moved = [&pose](Distance own) -> Distance {
    return [own = std::move(own), pose](const Vec3& p) { return own(pose.apply_inverse(p)); };
  };
  body.distance = moved(std::move(body.distance));
  for (Distance& sheet : body.sheets) sheet = moved(std::move(sheet));
  return body;
}

}  // namespace asperity::strokes
