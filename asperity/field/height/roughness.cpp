#include "asperity/field/height/roughness.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity {
namespace {

using std::numbers::pi;

constexpr int most_profiles = 2048;      // of a map along each axis
constexpr int lines_across = 64;         // over a map's repeat
constexpr int repeats_along = 8;         // that each of them runs over
constexpr int most_points = 1 << 14;     // on each of them
constexpr int most_noise_points = 512;   // along each axis of a repeat of noise
constexpr std::size_t most_felt = 4096;  // points of a period that a tip rides over

/// What a direction a hair off the lay makes of it is the rounding of pi / 2.
constexpr double along_the_lay = 1e-12;

/// Sums of what a roughness is made of.
struct Deviations {
  double average = 0.0;
  double square = 0.0;
  double slope = 0.0;
  double count = 0.0;
  void add(double height, double rise) {
    average += std::abs(height);
    square += height * height;
    slope += std::abs(rise);
    count += 1.0;
  }
  [[nodiscard]] Roughness roughness() const { return {average / count, std::sqrt(square / count), slope / count}; }
};

/// Adds the share of one of `count` profiles to their mean.
void add_share(Roughness& mean, const Roughness& own, int count) {
  mean.average += own.average / count;
  mean.rms += own.rms / count;
  mean.mean_slope += own.mean_slope / count;
}

/// Mean of |a sin p + b sin q| over all p and q.
double mean_of_two_waves(double a, double b) {
  const double large = std::max(std::abs(a), std::abs(b));
  const double small = std::min(std::abs(a), std::abs(b));
  if (!(large > 0.0)) return 0.0;
  // Over p the mean is known; over q it is smooth and periodic, for which the midpoint rule converges at once.
  constexpr int points = 256;
  double sum = 0.0;
  for (int i = 0; i < points; ++i) {
    const double shift = small * std::sin(2.0 * pi * (i + 0.5) / points) / large;
    sum += 2.0 / pi * (shift * std::asin(shift) + std::sqrt(1.0 - shift * shift));
  }
  return large * sum / points;
}

/// c cos(w_u u') cos(w_v v') over all lines of a direction.
Roughness grid_roughness(const FeatureSpec& spec, double direction) {
  const double u = 2.0 * pi / spec.wavelength.x() * std::cos(direction - spec.direction);
  const double v = 2.0 * pi / spec.wavelength.y() * std::sin(direction - spec.direction);
  // Its slope is -c/2 ((u + v) sin(a + b) + (u - v) sin(a - b)), and all sums and differences come up alike.
  return {4.0 / (pi * pi) * spec.amplitude, 0.5 * spec.amplitude,
          0.5 * spec.amplitude * mean_of_two_waves(u + v, u - v)};
}

/// Over a whole repeat of noise, whose mean is 0 and whose R_q is what it was made to be.
Roughness noise_roughness(const SurfaceFeature& noise, const Vec2& along) {
  const FeatureSpec& spec = noise.spec();
  Deviations deviations;
  const auto points = [&](double period) {
    return std::clamp(static_cast<int>(8.0 * period / spec.correlation_length), 64, most_noise_points);
  };
  const int columns = points(spec.period.x());
  const int rows = points(spec.period.y());
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const FeatureSample sample =
          noise.sample(spec.period.cwiseProduct(Vec2((column + 0.5) / columns, (row + 0.5) / rows)));
      deviations.add(sample.height, sample.gradient.dot(along));
    }
  }
  Roughness roughness = deviations.roughness();
  roughness.rms = spec.roughness;
  return roughness;
}

/// Mean over lines side by side, each about its own mean.
Roughness map_roughness(const SurfaceFeature& map, double direction) {
  const FeatureSpec& spec = map.spec();
  const Vec2 along(std::cos(direction), std::sin(direction));
  const Vec2 across(-along.y(), along.x());
  const double cosine = std::abs(std::cos(direction - spec.direction));
  const double sine = std::abs(std::sin(direction - spec.direction));
  // Whole repeats along the axis that the line runs along more, and lines over one repeat of the other.
  const bool first = cosine * spec.wavelength.y() >= sine * spec.wavelength.x();
  const double length = repeats_along * (first ? spec.wavelength.x() / cosine : spec.wavelength.y() / sine);
  const double width = first ? spec.wavelength.y() * cosine : spec.wavelength.x() * sine;
  const int points =
      std::clamp(2 * repeats_along * std::max(spec.heights->width(), spec.heights->height()), 256, most_points);
  Roughness mean;
  std::vector<FeatureSample> samples(static_cast<std::size_t>(points));
  for (int line = 0; line < lines_across; ++line) {
    double sum = 0.0;
    for (int i = 0; i < points; ++i) {
      FeatureSample& sample = samples[static_cast<std::size_t>(i)];
      sample = map.sample(width * (line + 0.5) / lines_across * across + length * (i + 0.5) / points * along);
      sum += sample.height;
    }
    Deviations deviations;
    for (const FeatureSample& sample : samples)
      deviations.add(sample.height - sum / points, sample.gradient.dot(along));
    add_share(mean, deviations.roughness(), lines_across);
  }
  return mean;
}

/// Mean over the rows or the columns of a map.
Roughness mean_profile(const HeightMap& map, bool along_s, double spacing) {
  const int length = along_s ? map.width() : map.height();
  const int available = along_s ? map.height() : map.width();
  const int count = std::min(available, most_profiles);
  std::vector<double> heights(static_cast<std::size_t>(length));
  Roughness mean;
  for (int k = 0; k < count; ++k) {
    const auto across = static_cast<int>(std::int64_t{k} * available / count);
    for (int i = 0; i < length; ++i)
      heights[static_cast<std::size_t>(i)] = along_s ? map.texel(i, across) : map.texel(across, i);
    add_share(mean, profile_roughness(heights, spacing), count);
  }
  return mean;
}

}  // namespace

Roughness SurfaceFeature::roughness_along(double direction) const {
  const double c = spec_.amplitude;
  const double share = std::abs(std::cos(direction - spec_.direction));
  switch (spec_.kind) {
    case FeatureKind::grating:
      if (share < along_the_lay) return {};
      return {2.0 / pi * c, c / std::numbers::sqrt2, 4.0 * c / spec_.wavelength.x() * share};
    case FeatureKind::triangular:
    case FeatureKind::serrated:
      // Every height comes up alike, whatever the flanks; up and down once per wavelength is 4 c.
      if (share < along_the_lay) return {};
      return {0.5 * c, c / std::numbers::sqrt3, 4.0 * c / spec_.wavelength.x() * share};
    case FeatureKind::circular_grating:
      // Far from the centre, where a long line is most of the time, it runs across the circles.
      return {2.0 / pi * c, c / std::numbers::sqrt2, 4.0 * c / spec_.wavelength.x()};
    case FeatureKind::grid: return grid_roughness(spec_, direction);
    case FeatureKind::noise: return noise_roughness(*this, Vec2(std::cos(direction), std::sin(direction)));
    case FeatureKind::map: return map_roughness(*this, direction);
  }
  return {};
}

Roughness profile_roughness(std::span<const double> heights, double spacing) {
  if (heights.size() < 3 || !(spacing > 0.0)) return {};
  const auto count = static_cast<double>(heights.size());
  double mean = 0.0;
  for (const double height : heights) mean += height / count;
  // Places are counted from the middle, where the line passes through the mean.
  const double middle = 0.5 * (count - 1.0);
  double moment = 0.0;
  double spread = 0.0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double place = static_cast<double>(i) - middle;
    moment += place * (heights[i] - mean);
    spread += place * place;
  }
  const double tilt = moment / spread;
  Deviations deviations;
  for (std::size_t i = 0; i < heights.size(); ++i)
    deviations.add(heights[i] - mean - tilt * (static_cast<double>(i) - middle), 0.0);
  Roughness roughness = deviations.roughness();
  for (std::size_t i = 1; i < heights.size(); ++i)
    roughness.mean_slope += std::abs(heights[i] - heights[i - 1] - tilt) / (spacing * (count - 1.0));
  return roughness;
}

SurfaceRoughness surface_roughness(const HeightMap& map, const Vec2& tile) {
  return {mean_profile(map, true, tile.x() / map.width()), mean_profile(map, false, tile.y() / map.height())};
}

FrictionProposal propose_friction(const SurfaceRoughness& roughness, double smooth) noexcept {
  constexpr double most = 2.0;
  const double s = roughness.along_s.mean_slope;
  const double t = roughness.along_t.mean_slope;
  return {std::min(most, smooth + std::max(s, t)), std::min(most, smooth + std::min(s, t)), s >= t};
}

double felt_roughness(double amplitude, double wavelength, double tip_radius) {
  // The tip's centre over the contact at x is at x - r h' / sqrt(1 + h'^2), and its path there is as steep as the
  // profile. From a crest on it follows the flank until it is over the middle of the valley, which it touches at its
  // bottom or, when that is too narrow, on both flanks.
  const double w = 2.0 * pi / wavelength;
  const auto slope = [&](double x) { return -amplitude * w * std::sin(w * x); };
  const auto centre = [&](double x) {
    const double rise = slope(x);
    return x - tip_radius * rise / std::sqrt(1.0 + rise * rise);
  };
  // How fast the centre goes as the contact does.
  const auto pace = [&](double x) {
    const double rise = slope(x);
    return 1.0 + tip_radius * amplitude * w * w * std::cos(w * x) / std::pow(1.0 + rise * rise, 1.5);
  };
  const auto bisect = [](double low, double high, auto&& below) {
    for (int i = 0; i < 60; ++i) (below(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    return 0.5 * (low + high);
  };
  double last = 0.5 * wavelength;
  if (pace(last) < 0.0) {
    const double farthest = bisect(0.25 * wavelength, last, [&](double x) { return pace(x) > 0.0; });
    last = bisect(0.0, farthest, [&](double x) { return centre(x) < 0.5 * wavelength; });
  }
  // Simpson's rule.
  constexpr int intervals = 2048;
  double sum = 0.0;
  for (int i = 0; i <= intervals; ++i) {
    const double x = last * i / intervals;
    const double weight = i == 0 || i == intervals ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * slope(x) * slope(x) * pace(x);
  }
  return std::sqrt(sum * last / (3.0 * intervals) / (0.5 * wavelength));
}

double felt_roughness(std::span<const double> heights, double spacing, double tip_radius) {
  if (heights.size() < 3 || !(spacing > 0.0) || !(tip_radius > 0.0)) return 0.0;
  std::vector<double> profile;
  const std::size_t step = (heights.size() + most_felt - 1) / most_felt;
  for (std::size_t i = 0; i < heights.size(); i += step) profile.push_back(heights[i]);
  const auto count = static_cast<std::ptrdiff_t>(profile.size());
  const double apart = spacing * static_cast<double>(heights.size()) / static_cast<double>(count);
  // Farther than its radius it cannot touch; nor, of places that repeat, one that is not the nearest of them.
  const auto reach = static_cast<std::ptrdiff_t>(std::min(tip_radius / apart, 0.5 * static_cast<double>(count)));
  std::vector<double> cap;
  for (std::ptrdiff_t k = 0; k <= reach; ++k) {
    const double away = static_cast<double>(k) * apart;
    cap.push_back(std::sqrt(std::max(0.0, tip_radius * tip_radius - away * away)));
  }
  std::vector<double> path;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    double highest = -infinity;
    for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
      const double height = profile[static_cast<std::size_t>((i + k + count) % count)];
      highest = std::max(highest, height + cap[static_cast<std::size_t>(std::abs(k))]);
    }
    path.push_back(highest);
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double rise = (path[(i + 1) % path.size()] - path[i]) / apart;
    sum += rise * rise;
  }
  return std::sqrt(sum / static_cast<double>(path.size()));
}

}  // namespace asperity
