#pragma once
// A sphere displaced radially by a wave, as a formula and as a relief baked on a coarse base: what both say is
// compared.

#include <cmath>
#include <memory>
#include <numbers>

#include "asperity/surface/relief/atlas.h"
#include "tests/render/fixtures.h"

namespace asperity::test {

/// r(d) = radius + amplitude cos(k x) cos(k y), (x, y, z) = radius d.
struct WavySphere {
  double radius = 0.05;
  double amplitude = 0.15e-3;  ///< 0.30 mm from trough to crest
  double wavelength = 4.9e-3;

  [[nodiscard]] double height(const Vec3& direction) const {
    const double k = 2.0 * std::numbers::pi / wavelength * radius;
    return amplitude * std::cos(k * direction.x()) * std::cos(k * direction.y());
  }
  [[nodiscard]] Vec3 point(const Vec3& direction) const {
    const Vec3 d = direction.normalized();
    return (radius + height(d)) * d;
  }
  /// Outside above 0.
  [[nodiscard]] double level(const Vec3& p) const { return p.norm() - radius - height(p.normalized()); }
  [[nodiscard]] Vec3 normal(const Vec3& p) const {
    const double r = p.norm();
    const Vec3 d = p / r;
    const double k = 2.0 * std::numbers::pi / wavelength * radius;
    const Vec3 slope(-amplitude * k * std::sin(k * d.x()) * std::cos(k * d.y()),
                     -amplitude * k * std::cos(k * d.x()) * std::sin(k * d.y()), 0.0);
    return (d - (slope - slope.dot(d) * d) / r).normalized();
  }
  /// Where origin + h direction meets the surface.
  [[nodiscard]] double ray(const Vec3& origin, const Vec3& direction) const {
    double h = 0.0;
    for (int i = 0; i < 50; ++i) {
      const Vec3 p = origin + h * direction;
      const double step = level(p) / normal(p).dot(direction) * normal(p).dot(p.normalized());
      h -= step;
      if (std::abs(step) < 1e-15) break;
    }
    return h;
  }
};

/// The exact god-object of a point on that sphere, or of the middle of a ball that is nowhere as bent as its valleys:
/// the local minimum of the distance on the surface or on its parallel surface, followed from tick to tick.
class ExactGodObject {
 public:
  ExactGodObject(const WavySphere& sphere, const Vec3& probe, double ball = 0.0)
      : sphere_(sphere), direction_(probe.normalized()), ball_(ball) {}

  /// The place nearest to the probe, in the basin that the last one was in.
  Vec3 follow(const Vec3& probe) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 x = sphere_.point(direction_);
      const Vec3 n = sphere_.normal(x);
      const Vec3 rest = probe - place(direction_);
      const Vec3 along = rest - rest.dot(n) * n;
      if (along.norm() < 1e-13) break;
      // Along the tangent by what a step of a hundredth finds the best, so that no basin is left.
      double best = rest.squaredNorm();
      double share = 1.0;
      Vec3 next = direction_;
      bool moved = false;
      for (int k = 0; k < 40; ++k, share *= 0.5) {
        const Vec3 trial = (x + share * along).normalized();
        const double distance = (probe - place(trial)).squaredNorm();
        if (distance >= best) {
          if (moved) break;
          continue;
        }
        best = distance;
        next = trial;
        moved = true;
      }
      if (!moved) break;
      direction_ = next;
    }
    return place(direction_);
  }

 private:
  [[nodiscard]] Vec3 place(const Vec3& direction) const {
    const Vec3 x = sphere_.point(direction);
    return ball_ > 0.0 ? Vec3(x + ball_ * sphere_.normal(x)) : x;
  }

  WavySphere sphere_;
  Vec3 direction_;
  double ball_;
};

/// The sphere baked onto an icosphere of 20 * 4^subdivisions triangles.
inline std::shared_ptr<const ReliefSurface> baked(const WavySphere& sphere, int subdivisions, int texels,
                                                  Reconstruction how = Reconstruction::quadratic_bspline) {
  MeshSource source = icosphere(subdivisions, sphere.radius);
  const TriangleMesh plain = mesh_of(source);
  const ReliefAtlas atlas =
      must(bake_relief(plain, Shell::build(plain), texels,
                       [&](const Vec3& origin, const Vec3& direction) { return sphere.ray(origin, direction); }));
  source.corner_uvs = atlas.corner_uvs;
  TriangleMesh mesh = mesh_of(source);
  HeightMap map = must(HeightMap::build(atlas.heights, atlas.width, atlas.height, Wrap::clamp, how));
  CoatSettings settings;
  // The surface is round where the base has folds: penetrations agree over an edge, heights over flat triangles do not.
  settings.stitching.folds = FoldMode::round;
  Coat coat = must(Coat::build(mesh, tiled(std::move(map)), settings));
  return std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
}

/// Directions of a path that winds over a sphere, `advance` radians a tick.
inline std::vector<Vec3> winding(double advance, std::size_t count) {
  std::vector<Vec3> path;
  Vec3 place = Vec3(0.3, 1.0, 0.2).normalized();
  Vec3 heading = place.cross(Vec3(1.0, 0.0, 0.0)).normalized();
  for (std::size_t i = 0; i < count; ++i) {
    path.push_back(place);
    const double travelled = advance * static_cast<double>(i);
    const double turn = advance * (0.9 * std::sin(0.37 * travelled) + 0.6 * std::sin(1.13 * travelled));
    const Vec3 ahead = (std::cos(advance) * place + std::sin(advance) * heading).normalized();
    const Vec3 onward = (std::cos(advance) * heading - std::sin(advance) * place).normalized();
    place = ahead;
    heading = (std::cos(turn) * onward + std::sin(turn) * ahead.cross(onward)).normalized();
    heading = (heading - heading.dot(place) * place).normalized();
  }
  return path;
}

}  // namespace asperity::test
