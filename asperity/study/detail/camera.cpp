#include "asperity/study/detail/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity {
namespace {

constexpr double elevation = 48.0 * std::numbers::pi / 180.0;
constexpr double azimuth = -24.0 * std::numbers::pi / 180.0;
constexpr double field_of_view = 24.0 * std::numbers::pi / 180.0;  // vertical
constexpr double margin = 1.05;

/// Distance from `target`, against `forward`, at which every point is in view, and the offset that would centre them.
struct Fit {
  double distance = 0.0;
  Vec3 offset = Vec3::Zero();
};

Fit fit(const Camera& camera, std::span<const Vec3> points, const Vec3& target) {
  const double half_height = 0.5 * camera.height * camera.pixel;
  const double half_width = 0.5 * camera.width * camera.pixel;
  Fit out;
  for (const Vec3& point : points) {
    const Vec3 p = point - target;
    const double near = -p.dot(camera.forward);
    const double across =
        std::max(std::abs(p.dot(camera.right)) / half_width, std::abs(p.dot(camera.up)) / half_height);
    out.distance = std::max(out.distance, near + margin * across);
  }
  double low[2] = {infinity, infinity};
  double high[2] = {-infinity, -infinity};
  for (const Vec3& point : points) {
    const Vec3 p = point - target;
    const double depth = out.distance + p.dot(camera.forward);
    const double image[2] = {p.dot(camera.right) / depth, p.dot(camera.up) / depth};
    for (int k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], image[k]);
      high[k] = std::max(high[k], image[k]);
    }
  }
  out.offset = 0.5 * out.distance * ((low[0] + high[0]) * camera.right + (low[1] + high[1]) * camera.up);
  return out;
}

}  // namespace

Camera three_quarter_view(std::span<const Vec3> points, const Vec3& normal, int width, int height) {
  // Seen from the front (+z); a sheet that itself faces the front is seen from below, with y up.
  const Vec3 hint = std::abs(normal.z()) > 0.8 ? Vec3(-Vec3::UnitY()) : Vec3::UnitZ();
  const Vec3 front = (hint - hint.dot(normal) * normal).normalized();
  const Vec3 side = normal.cross(front);
  const Vec3 towards_eye =
      std::sin(elevation) * normal + std::cos(elevation) * (std::cos(azimuth) * front + std::sin(azimuth) * side);
  Camera camera;
  camera.forward = -towards_eye;
  camera.right = camera.forward.cross(normal).normalized();
  camera.up = camera.right.cross(camera.forward);
  camera.width = width;
  camera.height = height;
  camera.pixel = 2.0 * std::tan(0.5 * field_of_view) / height;

  Box box;
  for (const Vec3& point : points) box.include(point);
  Vec3 target = box.centre();
  Fit best = fit(camera, points, target);
  for (int i = 0; i < 4; ++i) {
    target += best.offset;
    best = fit(camera, points, target);
  }
  camera.eye = target + std::max(best.distance, 1e-6) * towards_eye;
  return camera;
}

}  // namespace asperity
