#pragma once
// Sheets folded once: what closing and fillets are measured on.

#include "tests/surface/coats.h"

namespace asperity::test {

/// Two planes that meet in the y axis with this angle between them, open towards +z; each `side` wide and long, cut
/// into cells x cells squares of two triangles.
inline MeshSource valley(double opening, double side, int cells = 1) {
  MeshSource source;
  for (int j = 0; j <= cells; ++j) {
    for (int i = -cells; i <= cells; ++i) {
      const double along = side * std::abs(i) / cells;
      source.positions.emplace_back((i < 0 ? -along : along) * std::sin(0.5 * opening),
                                    side * (static_cast<double>(j) / cells - 0.5), along * std::cos(0.5 * opening));
    }
  }
  const auto row = static_cast<std::uint32_t>(2 * cells + 1);
  for (std::uint32_t j = 0; j + 1 < static_cast<std::uint32_t>(cells) + 1; ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = j * row + i;
      source.triangles.push_back({a, a + 1, a + 1 + row});
      source.triangles.push_back({a, a + 1 + row, a + row});
    }
  }
  return source;
}

/// Distance of a point from the fillet of `radius` between the valley's planes raised by `height`, or from the planes
/// where the fillet has ended: 0 on the closed surface.
inline double off_fillet(const Vec3& p, double opening, double height, double radius) {
  const double half = 0.5 * opening;
  const double centre = (radius + height) / std::sin(half);
  if (p.z() < centre - radius * std::sin(half)) return std::abs(std::hypot(p.x(), p.z() - centre) - radius);
  return std::abs(std::sin(half) * p.z() - std::cos(half) * std::abs(p.x()) - height);
}

inline double degrees(double angle) {
  return angle * std::numbers::pi / 180.0;
}

}  // namespace asperity::test
