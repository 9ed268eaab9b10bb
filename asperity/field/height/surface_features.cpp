#include "asperity/field/height/surface_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "asperity/core/rng.h"
#include "asperity/field/height/detail/texel_coordinate.h"

namespace asperity {
namespace {

using std::numbers::pi;

constexpr double longest = 10.0;              // m: no feature is larger
constexpr double shortest_wave = 1e-9;        // m: below it there are no surfaces, only atoms
constexpr int fewest_cells = 8;               // of noise along an axis: fewer would correlate with their own repeats
constexpr int usual_cells = 64;               // of noise whose period is not given
constexpr int most_cells = 1 << 22;           // of noise: 16 MB
constexpr int most_feature_texels = 1 << 26;  // of a baked map
constexpr int most_side = 1 << 14;            // of a baked map

bool takes(FeatureKind kind, std::string_view member) {
  const auto& all = feature_parameters(kind);
  return std::find(all.begin(), all.end(), member) != all.end();
}

Status length_within(double value, double least, const char* place) {
  if (value >= least && value <= longest) return success();
  return bad_value(fmt::format("is {:.6g} m", value), place, fmt::format("a length of {:g} to {:g} m", least, longest));
}

Status finite(double value, const char* place, const char* accepted) {
  if (std::isfinite(value) && std::abs(value) <= 1e6) return success();
  return bad_value(fmt::format("is {:.6g}", value), place, accepted);
}

Status check_shape(const FeatureSpec& spec) {
  if (takes(spec.kind, "amplitude")) ASPERITY_CHECK(length_within(spec.amplitude, 1e-12, "amplitude"));
  if (takes(spec.kind, "wavelength")) ASPERITY_CHECK(length_within(spec.wavelength.x(), shortest_wave, "wavelength"));
  if (spec.kind == FeatureKind::grid || spec.kind == FeatureKind::map)
    ASPERITY_CHECK(length_within(spec.wavelength.y(), shortest_wave, "wavelength"));
  if (takes(spec.kind, "direction")) ASPERITY_CHECK(finite(spec.direction, "direction", "an angle up to 1e6 rad"));
  if (takes(spec.kind, "phase")) ASPERITY_CHECK(finite(spec.phase, "phase", "an angle up to 1e6 rad"));
  if (takes(spec.kind, "centre") && !(spec.centre.norm() <= longest)) {
    return bad_value(fmt::format("is {:.6g}, {:.6g} m", spec.centre.x(), spec.centre.y()), "centre",
                     fmt::format("a place within {:g} m of the origin", longest));
  }
  if (takes(spec.kind, "wall") && !(spec.wall >= 0.01 && spec.wall <= 0.5))
    return bad_value(fmt::format("is {:.6g}", spec.wall), "wall", "a share of 0.01 to 0.5 of the wavelength");
  if (spec.kind == FeatureKind::map && spec.heights == nullptr)
    return bad_value("is not given", "heights", "a height map");
  return success();
}

// ---- noise ---------------------------------------------------------------------------------------------------------
// Independent Gaussian numbers as coefficients of a cubic B-spline: a smooth (C2) Gaussian surface whose
// autocorrelation is, over all places, the B-spline of degree 7 along each axis.

/// Values of that spline at 0, 1, 2, 3.
constexpr std::array<double, 4> covariance{151.0 / 315.0, 397.0 / 1680.0, 1.0 / 42.0, 1.0 / 5040.0};
/// Where it has fallen to 1/e of its middle (cells).
constexpr double correlation_cells = 1.184695871196793;

/// A sum of twelve uniform numbers: Gaussian to within a kurtosis of 2.9, which the spline brings closer to 3, and the
/// same bits on every platform, which logarithms and cosines are not.
double gaussian(Rng& rng) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += rng.uniform();
  return sum;
}

/// Coefficients of one repeat, row by row.
struct Lattice {
  int columns = 0;
  int rows = 0;
  std::vector<double> values;
  [[nodiscard]] double at(int column, int row) const {
    const auto wrapped = [](int i, int count) { return i < 0 ? i + count : (i >= count ? i - count : i); };
    return values[static_cast<std::size_t>(wrapped(row, rows)) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(wrapped(column, columns))];
  }
};

/// Mean square of the spline over its repeat, exact.
double mean_square(const Lattice& lattice) {
  const auto correlated = [](const auto& at) {
    double sum = covariance[0] * at(0);
    for (int k = 1; k < 4; ++k) sum += covariance[static_cast<std::size_t>(k)] * (at(-k) + at(k));
    return sum;
  };
  Lattice along{lattice.columns, lattice.rows, {}};
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column)
      along.values.push_back(correlated([&](int k) { return lattice.at(column + k, row); }));
  }
  double total = 0.0;
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column)
      total += correlated([&](int k) { return along.at(column, row + k); }) * lattice.at(column, row);
  }
  return total / static_cast<double>(lattice.values.size());
}

/// Mean 0 and root mean square `rms`.
void normalise(Lattice& lattice, double rms) {
  double mean = 0.0;
  for (const double value : lattice.values) mean += value;
  mean /= static_cast<double>(lattice.values.size());
  for (double& value : lattice.values) value -= mean;
  const double scale = rms / std::sqrt(mean_square(lattice));
  for (double& value : lattice.values) value *= scale;
}

/// Bounds of the spline: of its Bezier points, which are nearer to it than its coefficients.
std::pair<double, double> bounds_of(const Lattice& lattice) {
  // Three of a cell's four points along an axis, from coefficients -1 to 1; the fourth is the next cell's first.
  constexpr double points[3][3] = {
      {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0}, {0.0, 2.0 / 3.0, 1.0 / 3.0}, {0.0, 1.0 / 3.0, 2.0 / 3.0}};
  std::pair<double, double> bounds{infinity, -infinity};
  Lattice line{lattice.columns, 1, std::vector<double>(static_cast<std::size_t>(lattice.columns))};
  for (int row = 0; row < lattice.rows; ++row) {
    for (const auto& upright : points) {
      for (int column = 0; column < lattice.columns; ++column) {
        line.values[static_cast<std::size_t>(column)] = upright[0] * lattice.at(column, row - 1) +
                                                        upright[1] * lattice.at(column, row) +
                                                        upright[2] * lattice.at(column, row + 1);
      }
      for (int column = 0; column < lattice.columns; ++column) {
        for (const auto& level : points) {
          const double value =
              level[0] * line.at(column - 1, 0) + level[1] * line.at(column, 0) + level[2] * line.at(column + 1, 0);
          bounds.first = std::min(bounds.first, value);
          bounds.second = std::max(bounds.second, value);
        }
      }
    }
  }
  return bounds;
}

/// Cells along one axis: as many as make the correlation length nearly what was asked for.
Result<int> cells_along(double period, double spacing) {
  if (period == 0.0) return usual_cells;
  const double cells = std::round(period / spacing);
  if (period > 0.0 && cells >= fewest_cells && cells <= most_cells) return static_cast<int>(cells);
  return bad_value(fmt::format("is {:.6g} m", period), "period",
                   fmt::format("0, or a length of {:.4g} to {:.4g} m with this correlation length",
                               fewest_cells * spacing, spacing * most_cells));
}

/// Cubic B-spline over the four coefficients around a place `t` (0 to 1) between the middle two.
struct FeatureWeights {
  double value[4];
  double slope[4];
};

FeatureWeights spline_weights(double t) noexcept {
  const double s = 1.0 - t;
  const double tt = t * t;
  const double ss = s * s;
  constexpr double sixth = 1.0 / 6.0;
  return {{sixth * ss * s, sixth * (4.0 + 3.0 * tt * (t - 2.0)), sixth * (4.0 + 3.0 * ss * (s - 2.0)), sixth * tt * t},
          {-0.5 * ss, t * (1.5 * t - 2.0), -s * (1.5 * s - 2.0), 0.5 * tt}};
}

}  // namespace

Status SurfaceFeature::prepare_noise() {
  ASPERITY_CHECK(length_within(spec_.roughness, 1e-12, "roughness"));
  ASPERITY_CHECK(length_within(spec_.correlation_length, shortest_wave, "correlation_length"));
  const double spacing = spec_.correlation_length / correlation_cells;
  ASPERITY_TRY(columns_, cells_along(spec_.period.x(), spacing));
  ASPERITY_TRY(rows_, cells_along(spec_.period.y(), spacing));
  const std::int64_t cells = std::int64_t{columns_} * rows_;
  if (cells > most_cells) {
    return refused(
        ErrorCode::too_large, fmt::format("makes {} x {} cells of noise", columns_, rows_), "period",
        fmt::format("a period of at most {} cells in all: shorter, or a longer correlation length", most_cells));
  }
  if (spec_.period.x() == 0.0) spec_.period.x() = columns_ * spacing;
  if (spec_.period.y() == 0.0) spec_.period.y() = rows_ * spacing;
  per_repeat_ = spec_.period.cwiseInverse();
  Lattice lattice{columns_, rows_, std::vector<double>(static_cast<std::size_t>(cells))};
  Rng rng(spec_.seed);
  for (double& value : lattice.values) value = gaussian(rng);
  normalise(lattice, spec_.roughness);
  const auto [low, high] = bounds_of(lattice);
  // What is stored as floats.
  const double rounding = 1e-6 * std::max(-low, high);
  lowest_ = low - rounding;
  highest_ = high + rounding;
  wavelength_ = 4.0 * correlation_cells * std::min(spec_.period.x() / columns_, spec_.period.y() / rows_);
  std::vector<float> stored;
  stored.reserve(static_cast<std::size_t>(columns_ + 3) * static_cast<std::size_t>(rows_ + 3));
  for (int row = -1; row < rows_ + 2; ++row) {
    for (int column = -1; column < columns_ + 2; ++column)
      stored.push_back(static_cast<float>(lattice.at(column, row)));
  }
  lattice_ = std::make_shared<const std::vector<float>>(std::move(stored));
  return success();
}

Result<SurfaceFeature> SurfaceFeature::build(const FeatureSpec& spec) {
  if (static_cast<std::size_t>(spec.kind) >= feature_names().size())
    return bad_value("is unknown", "kind", name_list<FeatureKind>());
  ASPERITY_CHECK(check_shape(spec));
  SurfaceFeature feature;
  feature.spec_ = spec;
  if (takes(spec.kind, "direction")) feature.axis_ = Vec2(std::cos(spec.direction), std::sin(spec.direction));
  if (takes(spec.kind, "wavelength")) {
    const double second =
        spec.kind == FeatureKind::grid || spec.kind == FeatureKind::map ? spec.wavelength.y() : spec.wavelength.x();
    feature.per_repeat_ = Vec2(1.0 / spec.wavelength.x(), 1.0 / second);
    feature.frequency_ = 2.0 * pi * feature.per_repeat_;
    feature.wavelength_ = std::min(spec.wavelength.x(), second);
  }
  feature.lowest_ = -spec.amplitude;
  feature.highest_ = spec.amplitude;
  if (spec.kind == FeatureKind::triangular || spec.kind == FeatureKind::serrated) {
    const double wall = spec.kind == FeatureKind::triangular ? 0.5 : spec.wall;
    feature.falling_share_ = 1.0 - wall;
    feature.rise_ = 2.0 * spec.amplitude / (wall * spec.wavelength.x());
    feature.fall_ = -2.0 * spec.amplitude / ((1.0 - wall) * spec.wavelength.x());
  }
  if (spec.kind == FeatureKind::noise) ASPERITY_CHECK(feature.prepare_noise());
  if (spec.kind == FeatureKind::map) {
    feature.lowest_ = spec.heights->lowest();
    feature.highest_ = spec.heights->highest();
    feature.wavelength_ =
        4.0 * std::min(spec.wavelength.x() / spec.heights->width(), spec.wavelength.y() / spec.heights->height());
  }
  return feature;
}

FeatureSample SurfaceFeature::sample_ridges(double along) const noexcept {
  const double repeats = along * per_repeat_.x() + spec_.phase * (0.5 / pi);
  const double share = repeats - std::floor(repeats);
  const bool falls = share < falling_share_;
  const double height = falls ? spec_.amplitude + fall_ * share * spec_.wavelength.x()
                              : spec_.amplitude - rise_ * (1.0 - share) * spec_.wavelength.x();
  return {std::clamp(height, lowest_, highest_), (falls ? fall_ : rise_) * axis_};
}

FeatureSample SurfaceFeature::sample_noise(const Vec2& uv) const noexcept {
  const TexelPlace u = texel_under(unit_coordinate(uv.x() * per_repeat_.x(), Wrap::repeat), columns_);
  const TexelPlace v = texel_under(unit_coordinate(uv.y() * per_repeat_.y(), Wrap::repeat), rows_);
  const FeatureWeights along_u = spline_weights(u.offset + 0.5);
  const FeatureWeights along_v = spline_weights(v.offset + 0.5);
  const auto stride = static_cast<std::size_t>(columns_ + 3);
  const float* row = lattice_->data() + static_cast<std::size_t>(v.index) * stride + static_cast<std::size_t>(u.index);
  // Along v first: four columns at a time fit the processor's registers.
  Eigen::Array4d value = Eigen::Array4d::Zero();
  Eigen::Array4d slope = Eigen::Array4d::Zero();
  for (int j = 0; j < 4; ++j, row += stride) {
    const Eigen::Array4d coefficients = Eigen::Map<const Eigen::Array4f>(row).cast<double>();
    value += along_v.value[j] * coefficients;
    slope += along_v.slope[j] * coefficients;
  }
  const Eigen::Array4d value_u = Eigen::Map<const Eigen::Array4d>(along_u.value);
  const Eigen::Array4d slope_of_u = Eigen::Map<const Eigen::Array4d>(along_u.slope);
  const double height = (value_u * value).sum();
  const double slope_u = (slope_of_u * value).sum();
  const double slope_v = (value_u * slope).sum();
  return {height, Vec2(slope_u * columns_ * per_repeat_.x(), slope_v * rows_ * per_repeat_.y())};
}

FeatureSample SurfaceFeature::sample(const Vec2& uv) const noexcept {
  switch (spec_.kind) {
    case FeatureKind::grating: {
      const double angle = frequency_.x() * axis_.dot(uv) + spec_.phase;
      const double steepest = -spec_.amplitude * frequency_.x();
      return {spec_.amplitude * std::cos(angle), steepest * std::sin(angle) * axis_};
    }
    case FeatureKind::circular_grating: {
      const Vec2 from_centre = uv - spec_.centre;
      const double distance = from_centre.norm();
      const double angle = frequency_.x() * distance + spec_.phase;
      const double height = spec_.amplitude * std::cos(angle);
      if (!(distance > 0.0)) return {height, Vec2::Zero()};
      return {height, (-spec_.amplitude * frequency_.x() * std::sin(angle) / distance) * from_centre};
    }
    case FeatureKind::grid: {
      const Vec2 second(-axis_.y(), axis_.x());
      const double angle_u = frequency_.x() * axis_.dot(uv);
      const double angle_v = frequency_.y() * second.dot(uv);
      const double cos_u = std::cos(angle_u);
      const double cos_v = std::cos(angle_v);
      return {spec_.amplitude * cos_u * cos_v,
              -spec_.amplitude * (frequency_.x() * std::sin(angle_u) * cos_v * axis_ +
                                  frequency_.y() * cos_u * std::sin(angle_v) * second)};
    }
    case FeatureKind::triangular:
    case FeatureKind::serrated: return sample_ridges(axis_.dot(uv));
    case FeatureKind::noise: return sample_noise(uv);
    case FeatureKind::map: {
      const Vec2 second(-axis_.y(), axis_.x());
      const HeightSample heights =
          spec_.heights->sample(Vec2(axis_.dot(uv) * per_repeat_.x(), second.dot(uv) * per_repeat_.y()));
      return {heights.height,
              heights.gradient.x() * per_repeat_.x() * axis_ + heights.gradient.y() * per_repeat_.y() * second};
    }
  }
  return {};
}

Vec2 SurfaceFeature::across(const Vec2& uv) const noexcept {
  if (spec_.kind == FeatureKind::circular_grating) {
    const Vec2 from_centre = uv - spec_.centre;
    const double distance = from_centre.norm();
    return distance > 0.0 ? Vec2(from_centre / distance) : Vec2(Vec2::Zero());
  }
  const bool straight = spec_.kind == FeatureKind::grating || spec_.kind == FeatureKind::triangular ||
                        spec_.kind == FeatureKind::serrated;
  return straight ? axis_ : Vec2(Vec2::Zero());
}

std::size_t SurfaceFeature::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this);
  if (lattice_) bytes += lattice_->capacity() * sizeof(float);
  if (spec_.heights) bytes += spec_.heights->memory_bytes();
  return bytes;
}

const char* feature_name(FeatureKind kind) {
  return to_string(kind);
}

const std::vector<std::string>& feature_names() {
  return all_names<FeatureKind>();
}

const std::vector<std::string>& feature_parameters(FeatureKind kind) {
  static const std::vector<std::string> of_kind[] = {
      {"amplitude", "wavelength", "direction", "phase"},          // grating
      {"amplitude", "wavelength", "phase", "centre"},             // circular_grating
      {"amplitude", "wavelength", "direction"},                   // grid
      {"amplitude", "wavelength", "direction", "phase"},          // triangular
      {"amplitude", "wavelength", "direction", "phase", "wall"},  // serrated
      {"roughness", "correlation_length", "seed", "period"},      // noise
      {"wavelength", "direction", "heights"},                     // map
  };
  return of_kind[std::min(static_cast<std::size_t>(kind), std::size(of_kind) - 1)];
}

FeatureScales feature_scales(double resolution) noexcept {
  FeatureScales scales;
  // The comparison also turns away what is not a number.
  if (5.0 * resolution > scales.friction_below) scales.friction_below = std::min(5.0 * resolution, scales.shape_from);
  return scales;
}

FeatureScale scale_of(double wavelength, const FeatureScales& scales) noexcept {
  if (wavelength >= scales.shape_from) return FeatureScale::shape;
  return wavelength < scales.friction_below ? FeatureScale::friction : FeatureScale::texture;
}

const char* scale_name(FeatureScale scale) {
  return to_string(scale);
}

Result<HeightMap> bake(const std::vector<SurfaceFeature>& features, const Vec2& lower, const Vec2& upper, int columns,
                       int rows, Wrap wrap) {
  const Vec2 extent = upper - lower;
  if (!lower.allFinite() || !extent.allFinite() || !(extent.minCoeff() > 0.0)) {
    return bad_value(
        fmt::format("runs from {:.6g}, {:.6g} to {:.6g}, {:.6g} m", lower.x(), lower.y(), upper.x(), upper.y()),
        "rectangle", "an upper corner above and to the right of the lower one");
  }
  if (columns < 1 || rows < 1)
    return bad_value(fmt::format("is {} x {}", columns, rows), "texels", "1 or more along each axis");
  if (columns > most_side || rows > most_side || std::int64_t{columns} * rows > most_feature_texels) {
    return refused(ErrorCode::too_large, fmt::format("is {} x {}", columns, rows), "texels",
                   fmt::format("at most {} along each axis and {} in all", most_side, most_feature_texels));
  }
  std::vector<float> heights = tabulated(columns, rows, [&](const Vec2& st) {
    const Vec2 place = lower + extent.cwiseProduct(st);
    double height = 0.0;
    for (const SurfaceFeature& feature : features) height += feature.sample(place).height;
    return height;
  });
  return HeightMap::build(std::move(heights), columns, rows, wrap, Reconstruction::quadratic_bspline);
}

}  // namespace asperity
