#pragma once
// Volumes whose fields are known in closed form.

#include <cmath>
#include <random>

#include "asperity/field/volume/scalar_field.h"

namespace asperity::test {

/// Axis of `count` nodes over [low, high], stretched: cells grow by up to (1 + stretch) towards the middle.
inline GridAxis stretched_axis(double low, double high, std::uint32_t count, double stretch) {
  std::vector<double> nodes(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double u = static_cast<double>(i) / (count - 1);
    const double bent = u - stretch * std::sin(2.0 * 3.14159265358979 * u) / (2.0 * 3.14159265358979);
    nodes[i] = low + (high - low) * bent;
  }
  return GridAxis::build(std::move(nodes)).value();
}

/// Samples of f on the axes.
template <class F>
ScalarGrid sampled(const GridAxes& axes, const F& f) {
  std::vector<float> samples;
  samples.reserve(static_cast<std::size_t>(axes[0].size()) * axes[1].size() * axes[2].size());
  for (std::uint32_t k = 0; k < axes[2].size(); ++k) {
    for (std::uint32_t j = 0; j < axes[1].size(); ++j) {
      for (std::uint32_t i = 0; i < axes[0].size(); ++i) {
        samples.push_back(static_cast<float>(f(Vec3(axes[0].node(i), axes[1].node(j), axes[2].node(k)))));
      }
    }
  }
  return ScalarGrid::build(axes, SampleArray(std::move(samples)), "f").value();
}

inline GridAxes cube_axes(double half, std::uint32_t count, double stretch = 0.0) {
  const GridAxis axis = stretched_axis(-half, half, count, stretch);
  return {axis, axis, axis};
}

/// Distance from the origin over a cube of +-50 mm.
inline std::shared_ptr<const ScalarField> sphere_field(std::uint32_t count,
                                                       CellReconstruction reconstruction = CellReconstruction::smooth,
                                                       double stretch = 0.0) {
  return std::make_shared<const ScalarField>(
      sampled(cube_axes(0.05, count, stretch), [](const Vec3& p) { return p.norm(); }), reconstruction);
}

/// A rough field: independent samples, so that sheets lie closer than cells.
inline std::shared_ptr<const ScalarField> random_field(std::uint32_t count, CellReconstruction reconstruction,
                                                       std::uint64_t seed, double stretch = 0.3) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  return std::make_shared<const ScalarField>(
      sampled(cube_axes(0.05, count, stretch), [&](const Vec3&) { return value(generator); }), reconstruction);
}

/// A wall across z in a cube of +-10 mm with cells of 1 mm whose two faces, at the value 0, lie within one cell:
/// samples dip below 0 in one layer only.
inline std::shared_ptr<const ScalarField> thin_wall(CellReconstruction reconstruction) {
  const GridAxis axis = GridAxis::uniform(-0.01, 0.001, 21).value();
  constexpr std::size_t layer = 21 * 21;
  std::vector<float> samples(layer * 21, 1.0F);
  for (std::size_t i = 10 * layer; i < 11 * layer; ++i) samples[i] = -0.02F;
  return std::make_shared<const ScalarField>(
      ScalarGrid::build({axis, axis, axis}, SampleArray(std::move(samples))).value(), reconstruction);
}

inline Vec3 random_point(std::mt19937_64& generator, double half) {
  std::uniform_real_distribution<double> unit(-half, half);
  const double x = unit(generator);
  const double y = unit(generator);
  return {x, y, unit(generator)};
}

}  // namespace asperity::test
