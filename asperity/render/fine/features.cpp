#include "asperity/render/fine/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/core/units.h"

namespace asperity {

namespace {

Status check_lay(const FrictionLay& lay) {
  const auto share = [](double value) { return value >= 0.0 && value <= 1.0; };
  if (!share(lay.still_ratio)) return bad_value(fmt::format("is {}", lay.still_ratio), "still_ratio", "0 to 1");
  if (!share(lay.sliding_ratio)) return bad_value(fmt::format("is {}", lay.sliding_ratio), "sliding_ratio", "0 to 1");
  if (!(lay.stiffness_ratio >= 0.01 && lay.stiffness_ratio <= 1.0))
    return bad_value(fmt::format("is {}", lay.stiffness_ratio), "stiffness_ratio", "0.01 to 1");
  if (lay.direction && !std::isfinite(*lay.direction))
    return bad_value(fmt::format("is {}", *lay.direction), "direction", "an angle");
  return success();
}

/// From nothing at two steps a wavelength to all of it at four.
double share_of(double steps) noexcept {
  constexpr double none_below = 2.0;
  constexpr double whole_from = 4.0;
  const double t = std::clamp((steps - none_below) / (whole_from - none_below), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Largest slope (m/m), a bound.
double steepest_slope(const SurfaceFeature& feature) {
  const FeatureSpec& spec = feature.spec();
  const double wavelength = feature.wavelength();
  if (spec.kind == FeatureKind::triangular) return 4.0 * spec.amplitude / wavelength;
  if (spec.kind == FeatureKind::serrated)
    return 2.0 * spec.amplitude / (std::min(spec.wall, 1.0 - spec.wall) * wavelength);
  return std::numbers::pi * (feature.highest() - feature.lowest()) / wavelength;
}

/// Squares of the mean slopes along every direction. Rings that are `alone` stand as if they were straight along u;
/// among others they count alike in every direction.
LayMatrix squared_slopes(const SurfaceFeature& feature, bool alone) {
  const FeatureSpec& spec = feature.spec();
  if (spec.kind == FeatureKind::circular_grating) {
    const double slope = 4.0 * spec.amplitude / feature.wavelength();
    const double square = slope * slope;
    return alone ? LayMatrix{square, 0.0, 0.0} : LayMatrix{0.5 * square, 0.0, 0.5 * square};
  }
  const auto square_along = [&](double direction) {
    const double slope = feature.roughness_along(direction).mean_slope;
    return slope * slope;
  };
  constexpr double quarter = 0.5 * std::numbers::pi;
  const double uu = square_along(0.0);
  const double vv = square_along(quarter);
  return {uu, square_along(0.5 * quarter) - 0.5 * (uu + vv), vv};
}

/// The positive matrix whose square this is.
LayMatrix root(const LayMatrix& square) {
  const double determinant = std::sqrt(std::max(0.0, square.uu * square.vv - square.uv * square.uv));
  const double trace = std::sqrt(square.uu + square.vv + 2.0 * determinant);
  if (!(trace > 0.0)) return {};
  return {(square.uu + determinant) / trace, square.uv / trace, (square.vv + determinant) / trace};
}

}  // namespace

Result<FineFeatures> FineFeatures::build(FineSettings settings) {
  if (settings.texture.size() + settings.micro.size() > most_features) {
    return bad_value(fmt::format("has {} entries", settings.texture.size() + settings.micro.size()), "features",
                     fmt::format("at most {}", most_features));
  }
  if (settings.source == TextureSource::coat && !settings.texture.empty())
    return bad_value("is the coat, and there are features", "source", "the coat, or features");
  if (auto valid = check_lay(settings.lay); !valid) return std::move(valid).error().at("lay");
  if (!(settings.resolution >= 0.0 && std::isfinite(settings.resolution)))
    return bad_value(fmt::format("is {}", settings.resolution), "resolution", "a length of 0 or more (m)");
  const FrictionMap& map = settings.friction_map;
  if (map.factors != nullptr) {
    if (!(map.tile.minCoeff() > 0.0 && map.tile.allFinite()))
      return bad_value(fmt::format("is {} x {} m", map.tile.x(), map.tile.y()), "friction_map.tile", "lengths above 0");
    if (map.factors->highest() <= 0.0) return bad_value("is 0 throughout", "friction_map", "factors of 0 or more");
  }
  FineFeatures fine;
  for (const SurfaceFeature& feature : settings.texture) {
    ASPERITY_CHECK(settings.mapping.check(feature));
    fine.highest_ += feature.highest();
    fine.steepness_.push_back(steepest_slope(feature));
    const FeatureKind kind = feature.spec().kind;
    // Bounds of what is not a formula of slopes are far from what it reaches.
    if (kind == FeatureKind::noise || kind == FeatureKind::map || fine.steepness_.back() <= most_slope) continue;
    return bad_value(fmt::format("has a {} whose slopes reach {:.2g}", feature_name(kind), fine.steepness_.back()),
                     "features",
                     fmt::format("slopes up to {:g}: an amplitude of at most {}", most_slope,
                                 format_length(feature.spec().amplitude * most_slope / fine.steepness_.back())));
  }
  LayMatrix squares;
  for (const SurfaceFeature& feature : settings.micro)
    squares = squares + squared_slopes(feature, settings.micro.size() == 1);
  fine.interlock_ = root(squares);
  fine.micro_across_ = fine.interlock_.principal();
  fine.rings_ = settings.micro.size() == 1 && settings.micro.front().spec().kind == FeatureKind::circular_grating;
  fine.shapes_friction_ = !settings.micro.empty() || map.factors != nullptr || settings.lay.still_ratio < 1.0 ||
                          settings.lay.sliding_ratio < 1.0 || settings.lay.stiffness_ratio < 1.0;
  fine.settings_ = std::move(settings);
  return fine;
}

Vec2 LayMatrix::principal() const noexcept {
  const double half = 0.5 * (uu - vv);
  const double length = std::hypot(half, uv);
  if (!(length > 1e-9 * (uu + vv))) return Vec2::Zero();
  const Vec2 axis = half > 0.0 ? Vec2(half + length, uv) : Vec2(uv, length - half);
  return axis.normalized();
}

LayMatrix FineFeatures::interlock(const Vec2& uv) const noexcept {
  if (!rings_) return interlock_;
  // Rings are crossed along their radius; their matrix was made as if they were straight along u.
  return LayMatrix::of(interlock_.uu, interlock_.vv, settings_.micro.front().across(uv));
}

Vec2 FineFeatures::across(const Vec2& uv) const noexcept {
  if (settings_.lay.direction) return {std::cos(*settings_.lay.direction), std::sin(*settings_.lay.direction)};
  if (rings_) return settings_.micro.front().across(uv);
  if (!micro_across_.isZero()) return micro_across_;
  for (const SurfaceFeature& feature : settings_.texture) {
    const Vec2 way = feature.across(uv);
    if (!way.isZero() || feature.spec().kind == FeatureKind::circular_grating) return way;
  }
  return Vec2::UnitX();
}

double texture_share(double wavelength, double speed, Seconds dt, double resolution) noexcept {
  const double travel = speed * dt.count();
  double share = travel > 0.0 ? share_of(wavelength / travel) : 1.0;
  if (resolution > 0.0) share = std::min(share, share_of(wavelength / resolution));
  return share;
}

}  // namespace asperity
