#pragma once
// Bounds of first order: heights over part of a face as a plane and how far they are from it.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "asperity/core/math.h"

namespace asperity {

/// Part of a face: the hull of up to three places (barycentric u, v), grown by `pad` along u and v.
struct FacePart {
  std::array<Vec2, 3> corner;
  int corners = 3;
  Vec2 middle = Vec2::Zero();
  Vec2 pad = Vec2::Zero();

  /// [servo]
  static FacePart triangle(const Vec2& a, const Vec2& b, const Vec2& c) noexcept {
    return {{a, b, c}, 3, (a + b + c) / 3.0, Vec2::Zero()};
  }
  /// A line and what is beside it. [servo]
  static FacePart line(const Vec2& from, const Vec2& to, const Vec2& pad) noexcept {
    return {{from, to, to}, 2, 0.5 * (from + to), pad};
  }

  /// By how much a linear function may differ over the part from what it is in the middle. [servo]
  [[nodiscard]] double spread(double by_u, double by_v) const noexcept {
    double largest = 0.0;
    for (int k = 0; k < corners; ++k) {
      const Vec2 off = corner[static_cast<std::size_t>(k)] - middle;
      largest = std::max(largest, std::abs(by_u * off.x() + by_v * off.y()));
    }
    return largest + std::abs(by_u) * pad.x() + std::abs(by_v) * pad.y();
  }
  /// The same of a vector. [servo]
  [[nodiscard]] double spread(const Vec3& by_u, const Vec3& by_v) const noexcept {
    double largest = 0.0;
    for (int k = 0; k < corners; ++k) {
      const Vec2 off = corner[static_cast<std::size_t>(k)] - middle;
      largest = std::max(largest, (off.x() * by_u + off.y() * by_v).squaredNorm());
    }
    largest = std::sqrt(largest);
    if (!pad.isZero()) largest += by_u.norm() * pad.x() + by_v.norm() * pad.y();
    return largest;
  }
  /// Calls take(u, v) with places in whose hull the part lies. [servo]
  template <class Take>
  void for_each_extreme(const Take& take) const noexcept {
    for (int k = 0; k < corners; ++k) {
      const Vec2& at = corner[static_cast<std::size_t>(k)];
      if (pad.isZero()) {
        take(at.x(), at.y());
        continue;
      }
      for (const double su : {-1.0, 1.0}) {
        for (const double sv : {-1.0, 1.0}) take(at.x() + su * pad.x(), at.y() + sv * pad.y());
      }
    }
  }
};

/// |H(u, v) - height - u (u - middle u) - v (v - middle v)| <= error over the part it was made for; `u`, `v` are slopes
/// (m).
struct HeightForm {
  double height = 0.0;  ///< m, in the middle
  double u = 0.0;
  double v = 0.0;
  double error = 0.0;  ///< m

  /// As far from the middle of a range as that goes. [servo]
  static HeightForm level(double lowest, double highest) noexcept {
    return {0.5 * (lowest + highest), 0.0, 0.0, 0.5 * (highest - lowest)};
  }
  void add(const HeightForm& more) noexcept {
    height += more.height;
    u += more.u;
    v += more.v;
    error += more.error;
  }
};

/// A weight from 0 to 1 with its slopes, and how far it is from following them over the part.
struct WeightForm {
  double weight = 0.0;
  double u = 0.0;
  double v = 0.0;
  double rest = 0.0;
};

/// Of weights that are not divided by their sum yet: divided. False where the sum may come near to 0. [servo]
inline bool normalise(std::span<WeightForm> weights, const FacePart& part) noexcept {
  WeightForm total;
  for (const WeightForm& one : weights) {
    total.weight += one.weight;
    total.u += one.u;
    total.v += one.v;
    total.rest += one.rest;
  }
  const double change = part.spread(total.u, total.v) + total.rest;
  const double least = total.weight - change;
  if (!(least > 0.25 * total.weight)) return false;
  for (WeightForm& one : weights) {
    const double share = one.weight / total.weight;
    const double u = (one.u - share * total.u) / total.weight;
    const double v = (one.v - share * total.v) / total.weight;
    one = {share, u, v, (one.rest + share * total.rest + change * part.spread(u, v)) / least};
  }
  return true;
}

/// Of a mean of heights by any weights that sum to 1. [servo]
inline HeightForm between(std::span<const HeightForm> heights, const FacePart& part) noexcept {
  const double share = 1.0 / static_cast<double>(heights.size());
  HeightForm mean;
  for (const HeightForm& one : heights) {
    mean.height += share * one.height;
    mean.u += share * one.u;
    mean.v += share * one.v;
  }
  for (const HeightForm& one : heights)
    mean.error = std::max(mean.error,
                          std::abs(one.height - mean.height) + part.spread(one.u - mean.u, one.v - mean.v) + one.error);
  return mean;
}

/// The mean of heights by weights that sum to 1. [servo]
inline HeightForm mixed(std::span<const HeightForm> heights, std::span<const WeightForm> weights,
                        const FacePart& part) noexcept {
  HeightForm mean;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double share = weights[i].weight;
    mean.height += share * heights[i].height;
    mean.u += share * heights[i].u;
    mean.v += share * heights[i].v;
  }
  // Any plane will do for what the weights, which sum to 1, take from one height and give to another: the mean itself.
  HeightForm turned = mean;
  double own = 0.0;
  double first = 0.0;
  double farthest = 0.0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double apart = heights[i].height - mean.height;
    const double slope = part.spread(heights[i].u - mean.u, heights[i].v - mean.v);
    const double change = part.spread(weights[i].u, weights[i].v) + weights[i].rest;
    own += std::min(1.0, weights[i].weight + change) * heights[i].error;
    turned.u += weights[i].u * apart;
    turned.v += weights[i].v * apart;
    first += weights[i].rest * std::abs(apart) + change * slope;
    farthest = std::max(farthest, std::abs(apart) + slope + heights[i].error);
  }
  // Weights that may be anything still keep between the heights.
  if (first + own >= farthest) {
    mean.error = farthest;
    return mean;
  }
  turned.error = first + own;
  return turned;
}

}  // namespace asperity
