#include "asperity/render/fine_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

Error bad(std::string place, std::string what, std::string accepted) {
  return Error{ErrorCode::bad_value, std::move(what), {}, std::move(place), std::move(accepted)};
}

Status check_lay(const FrictionLay& lay) {
  const auto share = [](double value) { return value >= 0.0 && value <= 1.0; };
  if (!share(lay.still_ratio)) return bad("still_ratio", fmt::format("is {}", lay.still_ratio), "0 to 1");
  if (!share(lay.sliding_ratio)) return bad("sliding_ratio", fmt::format("is {}", lay.sliding_ratio), "0 to 1");
  if (!std::isfinite(lay.direction)) return bad("direction", fmt::format("is {}", lay.direction), "an angle");
  return success();
}

/// From nothing at two steps a wavelength to all of it at four.
double share_of(double steps) noexcept {
  constexpr double none_below = 2.0;
  constexpr double whole_from = 4.0;
  const double t = std::clamp((steps - none_below) / (whole_from - none_below), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

Result<FineFeatures> FineFeatures::build(FineSettings settings) {
  if (settings.texture.size() + settings.micro.size() > most_features) {
    return bad("features", fmt::format("has {} entries", settings.texture.size() + settings.micro.size()),
               fmt::format("at most {}", most_features));
  }
  if (settings.source == TextureSource::coat && !settings.texture.empty())
    return bad("source", "is the coat, and there are features", "the coat, or features");
  if (auto valid = check_lay(settings.lay); !valid) return std::move(valid).error().at("lay");
  if (!(settings.resolution >= 0.0 && std::isfinite(settings.resolution)))
    return bad("resolution", fmt::format("is {}", settings.resolution), "a length of 0 or more (m)");
  const FrictionMap& map = settings.friction_map;
  if (map.factors != nullptr) {
    if (!(map.tile.minCoeff() > 0.0 && map.tile.allFinite()))
      return bad("friction_map.tile", fmt::format("is {} x {} m", map.tile.x(), map.tile.y()), "lengths above 0");
    if (map.factors->highest() <= 0.0) return bad("friction_map", "is 0 throughout", "factors of 0 or more");
  }
  FineFeatures fine;
  for (const SurfaceFeature& feature : settings.texture) {
    ASPERITY_CHECK(settings.mapping.check(feature));
    fine.highest_ += feature.highest();
  }
  double roughest = -1.0;
  for (std::size_t i = 0; i < settings.micro.size(); ++i) {
    const SurfaceFeature& feature = settings.micro[i];
    constexpr double quarter = 1.5707963267948966;
    const double across = feature.roughness_along(feature.spec().direction).mean_slope;
    fine.interlock_across_ += across;
    fine.interlock_along_ += feature.roughness_along(feature.spec().direction + quarter).mean_slope;
    if (across > roughest) {
      roughest = across;
      fine.lay_feature_ = i;
    }
  }
  fine.shapes_friction_ = !settings.micro.empty() || map.factors != nullptr || settings.lay.still_ratio < 1.0 ||
                          settings.lay.sliding_ratio < 1.0;
  fine.settings_ = std::move(settings);
  return fine;
}

Vec2 FineFeatures::across(const Vec2& uv) const noexcept {
  if (!settings_.micro.empty()) return settings_.micro[lay_feature_].across(uv);
  for (const SurfaceFeature& feature : settings_.texture) {
    const Vec2 way = feature.across(uv);
    if (!way.isZero()) return way;
  }
  return {std::cos(settings_.lay.direction), std::sin(settings_.lay.direction)};
}

double texture_share(double wavelength, double speed, Seconds dt, double resolution) noexcept {
  const double travel = speed * dt.count();
  double share = travel > 0.0 ? share_of(wavelength / travel) : 1.0;
  if (resolution > 0.0) share = std::min(share, share_of(wavelength / resolution));
  return share;
}

}  // namespace asperity
