#pragma once
// Volumes sampled from formulas, for the tests of laws that are felt on them.

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "asperity/surface/iso/surface.h"

namespace asperity::volumes {

/// `nodes` along each axis of the cube |x|, |y|, |z| <= half, evenly spaced.
inline GridAxes cube(double half, std::uint32_t nodes) {
  GridAxes axes;
  for (GridAxis& axis : axes) axis = GridAxis::uniform(-half, 2.0 * half / (nodes - 1), nodes).value();
  return axes;
}

/// The field that f(p) gives at the nodes.
template <class F>
std::shared_ptr<const ScalarField> sampled(const GridAxes& axes, const F& f) {
  std::vector<float> samples;
  for (const double z : axes[2].nodes()) {
    for (const double y : axes[1].nodes()) {
      for (const double x : axes[0].nodes()) samples.push_back(static_cast<float>(f(Vec3(x, y, z))));
    }
  }
  return std::make_shared<const ScalarField>(ScalarGrid::build(axes, std::move(samples), "test").value());
}

inline std::shared_ptr<const IsoSurface> surface_of(std::shared_ptr<const ScalarField> field, double threshold,
                                                    Inside inside = Inside::low) {
  return std::make_shared<const IsoSurface>(IsoSurface::build(std::move(field), threshold, inside).value());
}

}  // namespace asperity::volumes
