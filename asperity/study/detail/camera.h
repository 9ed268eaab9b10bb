#pragma once
// The view of a picture. Private to study.

#include <span>

#include "asperity/core/math.h"

namespace asperity {

/// A pinhole camera. World frame (m); pixels count from the upper left, centres at halves.
struct Camera {
  Vec3 eye = Vec3::Zero();
  Vec3 right = Vec3::UnitX();     ///< unit
  Vec3 up = Vec3::UnitY();        ///< unit
  Vec3 forward = -Vec3::UnitZ();  ///< unit
  double pixel = 1.0;             ///< size of a pixel at distance 1
  double width = 1.0;             ///< pixels
  double height = 1.0;            ///< pixels

  /// Direction through a place of the image; its component along `forward` is 1.
  [[nodiscard]] Vec3 ray(double x, double y) const {
    return forward + pixel * ((x - 0.5 * width) * right + (0.5 * height - y) * up);
  }
  /// Pixel (x, y) and depth along `forward` of a point.
  [[nodiscard]] Vec3 project(const Vec3& point) const {
    const Vec3 offset = point - eye;
    const double depth = offset.dot(forward);
    return {0.5 * width + offset.dot(right) / (depth * pixel), 0.5 * height - offset.dot(up) / (depth * pixel), depth};
  }
};

/// A three-quarter view onto the side that `normal` points to, just wide enough for all of `points` and a margin.
/// `normal` is up in the image. [main]
Camera three_quarter_view(std::span<const Vec3> points, const Vec3& normal, int width, int height);

}  // namespace asperity
