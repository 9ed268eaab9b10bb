#include "asperity/field/volume/material_brush.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "asperity/field/volume/places.h"

namespace asperity {

namespace {

constexpr std::size_t roughness_channel = 4;

Status check_channels(const PointMaterial& material, const std::string& place) {
  static constexpr const char* units[] = {" N/m", " N·s/m", "", "", ""};
  for (std::size_t channel = 0; channel < material_channels; ++channel) {
    const float value = material.get(channel);
    if (std::isnan(value) || fits_channel(channel, value)) continue;
    return bad_value(fmt::format("is {}{}", value, units[channel]),
                     fmt::format("{}.{}", place, material_channel_names()[channel]),
                     fmt::format("a finite value, {}{}", channel == 0 ? "above 0" : "0 or more", units[channel]));
  }
  return success();
}

Status check_brush(const MaterialBrush& brush, const std::string& place) {
  if (!brush.centre.allFinite()) return bad_value("is not finite", place + ".centre", "three finite lengths (m)");
  if (!(brush.radius > 0.0) || !std::isfinite(brush.radius))
    return bad_value(fmt::format("is {} m", brush.radius), place + ".radius", "a length above 0");
  if (!(brush.falloff >= 0.0 && brush.falloff <= brush.radius)) {
    return bad_value(fmt::format("is {} m", brush.falloff), place + ".falloff",
                     fmt::format("0 up to the radius, {} m", brush.radius));
  }
  ASPERITY_CHECK(check_channels(brush.material, place));
  bool empty = true;
  for (std::size_t channel = 0; channel < material_channels; ++channel)
    empty = empty && std::isnan(brush.material.get(channel));
  if (empty) {
    return bad_value("gives no channel a value", place,
                     "at least one of stiffness, damping, static_friction, dynamic_friction, roughness");
  }
  return success();
}

/// 1 within, 0 beyond; smoothstep over the falloff.
double weight_at(const MaterialBrush& brush, double distance) {
  const double within = brush.radius - distance;
  if (within < 0.0) return 0.0;
  if (within >= brush.falloff) return 1.0;
  const double t = within / brush.falloff;
  return t * t * (3.0 - 2.0 * t);
}

/// What brushes do to a grid's blocks.
class Painting {
 public:
  Painting(const SparseGrid& grid, const PointMaterial& own) : source_(grid.source()), own_(own) {
    touched_.resize(source_.blocks.size());
  }

  Status lay(const MaterialBrush& brush, std::size_t number) {
    bool reached = false;
    for (std::size_t b = 0; b < source_.blocks.size(); ++b) {
      if (!overlaps(source_.blocks[b], brush)) continue;
      reached = lay_on(b, brush, number) || reached;
    }
    if (reached) return success();
    return bad_value("touches no stored point", fmt::format("[{}]", number),
                     fmt::format("a ball that reaches the surface; points are stored near it, {:.4g} mm apart",
                                 1e3 * source_.voxel));
  }

  /// The blocks that have changed.
  Result<std::vector<SparseBlock>> finished() && {
    std::vector<SparseBlock> changed;
    for (std::size_t b = 0; b < source_.blocks.size(); ++b) {
      if (touched_[b].empty()) continue;
      ASPERITY_CHECK(settle_friction(b));
      changed.push_back(std::move(source_.blocks[b]));
    }
    return changed;
  }

 private:
  static constexpr std::uint32_t none = no_index;

  [[nodiscard]] Vec3 position(const SparseBlock& block, int i, int j, int k) const {
    return source_.origin + source_.voxel * Vec3(node(block, 0, i), node(block, 1, j), node(block, 2, k));
  }
  static double node(const SparseBlock& block, std::size_t axis, int i) {
    return static_cast<double>(SparseBlock::side * std::int64_t{block.at[axis]} + i);
  }

  [[nodiscard]] bool overlaps(const SparseBlock& block, const MaterialBrush& brush) const {
    constexpr int last = SparseBlock::side - 1;
    const Vec3 nearest = brush.centre.cwiseMax(position(block, 0, 0, 0)).cwiseMin(position(block, last, last, last));
    return (nearest - brush.centre).norm() <= brush.radius;
  }

  /// Whether it reached a point that belongs to the surface, not to the constant beyond its band.
  bool lay_on(std::size_t b, const MaterialBrush& brush, std::size_t number) {
    SparseBlock& block = source_.blocks[b];
    bool reached = false;
    for_each_in_cube(0, SparseBlock::side, [&](int i, int j, int k) {
      const double weight = weight_at(brush, (position(block, i, j, k) - brush.centre).norm());
      if (!(weight > 0.0)) return;
      if (touched_[b].empty()) {
        touched_[b].assign(SparseBlock::points, none);
        block.material.resize(SparseBlock::points);
      }
      const std::size_t point = SparseBlock::index(i, j, k);
      touched_[b][point] = static_cast<std::uint32_t>(number);
      blend(brush.material, weight, block.material[point]);
      const float value = block.value[point];
      reached = reached || (value < static_cast<float>(source_.outside) && value > static_cast<float>(source_.inside));
    });
    return reached;
  }

  void blend(const PointMaterial& laid, double weight, PointMaterial& there) const {
    for (std::size_t channel = 0; channel < material_channels; ++channel) {
      if (std::isnan(laid.get(channel))) continue;
      const auto to = static_cast<double>(laid.get(channel));
      const auto from = static_cast<double>(std::isnan(there.get(channel)) ? own_.get(channel) : there.get(channel));
      there.set(channel, static_cast<float>(weight < 1.0 ? from + weight * (to - from) : to));
    }
  }

  Status settle_friction(std::size_t b) {
    // By so much rounding may part two coefficients that were blended alike.
    constexpr float rounding = 1e-6F;
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      if (touched_[b][point] == none) continue;
      PointMaterial& material = source_.blocks[b].material[point];
      const float at_rest = std::isnan(material.static_friction) ? own_.static_friction : material.static_friction;
      const float sliding = std::isnan(material.dynamic_friction) ? own_.dynamic_friction : material.dynamic_friction;
      if (!(at_rest < sliding)) continue;
      if (at_rest < sliding * (1.0F - rounding)) {
        return bad_value(
            fmt::format("is {} where dynamic_friction is {}, other brushes and the surface's own considered", at_rest,
                        sliding),
            fmt::format("[{}].static_friction", touched_[b][point]),
            "a static friction not below the dynamic one everywhere");
      }
      if (std::isnan(material.static_friction)) {
        material.dynamic_friction = at_rest;
      } else {
        material.static_friction = sliding;
      }
    }
    return success();
  }

  SparseSource source_;
  PointMaterial own_;
  std::vector<std::vector<std::uint32_t>> touched_;  ///< by block: the last brush at each point; empty: untouched
};

}  // namespace

Result<SparseGrid> painted(const SparseGrid& grid, std::span<const MaterialBrush> brushes, const PointMaterial& own) {
  PointMaterial fallback = own;
  // A roughness level multiplies the texture: what has none has it as it is.
  if (std::isnan(fallback.roughness)) fallback.set(roughness_channel, 1.0F);
  ASPERITY_CHECK(check_channels(fallback, "own"));
  for (std::size_t n = 0; n < brushes.size(); ++n) {
    ASPERITY_CHECK(check_brush(brushes[n], fmt::format("[{}]", n)));
    for (std::size_t channel = 0; channel < material_channels; ++channel) {
      if (std::isnan(brushes[n].material.get(channel)) || !std::isnan(fallback.get(channel))) continue;
      return bad_value("is not given, and a brush fades to it",
                       fmt::format("own.{}", material_channel_names()[channel]), "the surface's own value");
    }
  }
  Painting painting(grid, fallback);
  for (std::size_t n = 0; n < brushes.size(); ++n) ASPERITY_CHECK(painting.lay(brushes[n], n));
  ASPERITY_TRY(std::vector<SparseBlock> changed, std::move(painting).finished());
  return grid.edited(std::move(changed));
}

}  // namespace asperity
