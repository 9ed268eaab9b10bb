#include "asperity/field/mesostructure/mesostructure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace asperity {
namespace {

// Thresholds read off real pairs (tests/io/image_io_test.cpp prints them): matching ones reach 0.55 and more even when
// the normals were made from a finer source than the heights; maps of different pictures stay below 0.13.
constexpr double agrees = 0.5;
constexpr double related = 0.3;
/// Variance of slopes under which a normal map is one direction: a thousandth of the step of 8 bits, squared.
constexpr double flat_normals = 1e-10;
constexpr int most_points_a_side = 512;
constexpr int fewest_blocks_a_side = 16;
/// Steepest slope that a given normal is read as; 8 bits tell no more.
constexpr double least_outward = 1.0 / 127.0;

Vec2 slope_of_normal(const Vec3& normal) {
  const double outward = std::max(normal.z(), least_outward);
  return {-normal.x() / outward, -normal.y() / outward};
}

/// Sums for the covariance of two series whose means are removed.
struct Covariance {
  double count = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  void add(double x, double y) {
    count += 1.0;
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  [[nodiscard]] double variance_a() const { return std::max(aa / count - (a / count) * (a / count), 0.0); }
  [[nodiscard]] double variance_b() const { return std::max(bb / count - (b / count) * (b / count), 0.0); }
  [[nodiscard]] double covariance() const { return ab / count - (a / count) * (b / count); }
  [[nodiscard]] double correlation() const {
    const double product = variance_a() * variance_b();
    return product > 0.0 ? covariance() / std::sqrt(product) : 0.0;
  }
};

/// Slopes of both maps on a grid of points.
struct SlopeGrid {
  int columns = 0;
  int rows = 0;
  std::vector<Vec2> given;
  std::vector<Vec2> heights;
};

/// At the texel centres of the finer map, or an even selection of them.
SlopeGrid slopes_of(const HeightMap& heights, const NormalMap& normals, const Vec2& tile) {
  const int width = std::max(normals.width(), heights.width());
  const int height = std::max(normals.height(), heights.height());
  SlopeGrid grid{std::min(width, most_points_a_side), std::min(height, most_points_a_side), {}, {}};
  for (int j = 0; j < grid.rows; ++j) {
    const auto y = static_cast<int>(static_cast<std::int64_t>(j) * height / grid.rows);
    for (int i = 0; i < grid.columns; ++i) {
      const auto x = static_cast<int>(static_cast<std::int64_t>(i) * width / grid.columns);
      const Vec2 st((x + 0.5) / width, 1.0 - (y + 0.5) / height);
      grid.given.push_back(slope_of_normal(normals.sample(st)));
      grid.heights.push_back(heights.central_slope(st).cwiseQuotient(tile));
    }
  }
  return grid;
}

/// The grid averaged over blocks of 2 x 2 points; an odd last row or column is left out.
SlopeGrid halved(const SlopeGrid& fine) {
  SlopeGrid grid{fine.columns / 2, fine.rows / 2, {}, {}};
  const auto average = [&](const std::vector<Vec2>& slopes, int i, int j) -> Vec2 {
    const std::size_t first =
        static_cast<std::size_t>(2 * j) * static_cast<std::size_t>(fine.columns) + static_cast<std::size_t>(2 * i);
    const std::size_t second = first + static_cast<std::size_t>(fine.columns);
    return 0.25 * (slopes[first] + slopes[first + 1] + slopes[second] + slopes[second + 1]);
  };
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      grid.given.push_back(average(fine.given, i, j));
      grid.heights.push_back(average(fine.heights, i, j));
    }
  }
  return grid;
}

double rms_angle(const SlopeGrid& grid) {
  double sum = 0.0;
  for (std::size_t i = 0; i < grid.given.size(); ++i) {
    const Vec3 a(-grid.given[i].x(), -grid.given[i].y(), 1.0);
    const Vec3 b(-grid.heights[i].x(), -grid.heights[i].y(), 1.0);
    const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
    sum += angle * angle;
  }
  return std::sqrt(sum / static_cast<double>(grid.given.size()));
}

/// Correlations and scale on one grid; all 0 where a map has no slopes.
NormalAgreement correlate(const SlopeGrid& grid) {
  Covariance s;
  Covariance t;
  for (std::size_t i = 0; i < grid.given.size(); ++i) {
    s.add(grid.given[i].x(), grid.heights[i].x());
    t.add(grid.given[i].y(), grid.heights[i].y());
  }
  NormalAgreement agreement;
  const double given = s.variance_a() + t.variance_a();
  const double heights = s.variance_b() + t.variance_b();
  agreement.heights_flat = heights <= 0.0;
  agreement.normals_flat = given < flat_normals;
  if (agreement.heights_flat || agreement.normals_flat) return agreement;
  const double together = s.covariance() + t.covariance();
  const double flipped = s.covariance() - t.covariance();
  agreement.correlation = together / std::sqrt(given * heights);
  agreement.flipped_correlation = flipped / std::sqrt(given * heights);
  agreement.correlation_s = s.correlation();
  agreement.correlation_t = t.correlation();
  agreement.scale = together / heights;
  return agreement;
}

double likeness(const NormalAgreement& agreement) {
  return std::max(std::abs(agreement.correlation), std::abs(agreement.flipped_correlation));
}

}  // namespace

Mesostructure::Mesostructure(HeightMap heights, std::optional<NormalMap> normals, const Vec2& tile)
    : heights_(std::move(heights)), normals_(std::move(normals)), tile_(tile) {}

Result<Mesostructure> Mesostructure::build(HeightMap heights, const Vec2& tile) {
  ASPERITY_CHECK(check_tile(tile));
  return Mesostructure(std::move(heights), std::nullopt, tile);
}

Result<Mesostructure> Mesostructure::build(HeightMap heights, NormalMap normals, const Vec2& tile) {
  ASPERITY_CHECK(check_tile(tile));
  if (heights.wrap() != normals.wrap()) {
    return refused(ErrorCode::mismatch,
                   fmt::format("the height map wraps by {}, its normal map by {}", to_string(heights.wrap()),
                               to_string(normals.wrap())),
                   {}, "the same wrap for both");
  }
  return Mesostructure(std::move(heights), std::move(normals), tile);
}

MesostructureSample Mesostructure::sample(const Vec2& st) const noexcept {
  const HeightSample relief = heights_.sample(st);
  return {relief.height, relief.gradient,
          normals_ ? normals_->sample(st) : normal_from_gradient(relief.gradient, tile_)};
}

Mesostructure::BetweenMaps Mesostructure::maps_at(double level) const noexcept {
  if (level <= 0.0 || detail_ == nullptr) return {&heights_, nullptr, 0.0};
  const double felt = std::min(level, static_cast<double>(detail_->levels()));
  const int below = static_cast<int>(felt);
  return {below == 0 ? &heights_ : &detail_->map(below), felt > below ? &detail_->map(below + 1) : nullptr,
          felt - below};
}

HeightCurvature Mesostructure::mixed_curvature(const Vec2& st, double level) const noexcept {
  const auto [lower, higher, part] = maps_at(level);
  HeightCurvature mixed = lower->curvature(st);
  if (part <= 0.0) return mixed;
  const HeightCurvature above = higher->curvature(st);
  mixed.height += part * (above.height - mixed.height);
  mixed.gradient += part * (above.gradient - mixed.gradient);
  mixed.ss += part * (above.ss - mixed.ss);
  mixed.st += part * (above.st - mixed.st);
  mixed.tt += part * (above.tt - mixed.tt);
  return mixed;
}

HeightRange Mesostructure::range_over(const Vec2& lower, const Vec2& upper, double level) const noexcept {
  const auto [finer, coarser, part] = maps_at(level);
  const HeightRange mixed = finer->range_over(lower, upper);
  if (part <= 0.0) return mixed;
  const HeightRange above = coarser->range_over(lower, upper);
  // Heights are mixed by another order of rounding than these bounds: a hair of room.
  const double room =
      1e-15 * (std::abs(mixed.lowest) + std::abs(mixed.highest) + std::abs(above.lowest) + std::abs(above.highest));
  return {mixed.lowest + part * (above.lowest - mixed.lowest) - room,
          mixed.highest + part * (above.highest - mixed.highest) + room};
}

HeightPlane Mesostructure::plane_over(const Vec2& lower, const Vec2& upper, double level) const noexcept {
  const auto [finer, coarser, part] = maps_at(level);
  HeightPlane mixed = finer->plane_over(lower, upper);
  if (part <= 0.0) return mixed;
  const HeightPlane above = coarser->plane_over(lower, upper);
  mixed.height += part * (above.height - mixed.height);
  mixed.slope += part * (above.slope - mixed.slope);
  mixed.error += part * (above.error - mixed.error) + 1e-15 * (std::abs(mixed.height) + std::abs(above.height));
  return mixed;
}

Mesostructure Mesostructure::with_detail(std::shared_ptr<const DetailPyramid> detail) const {
  Mesostructure copy = *this;
  copy.detail_ = std::move(detail);
  return copy;
}

HeightRange Mesostructure::range() const noexcept {
  HeightRange all{heights_.lowest(), heights_.highest()};
  for (int level = 1; detail_ != nullptr && level <= detail_->levels(); ++level) {
    all.lowest = std::min(all.lowest, detail_->map(level).lowest());
    all.highest = std::max(all.highest, detail_->map(level).highest());
  }
  return all;
}

std::size_t Mesostructure::memory_bytes() const noexcept {
  const std::size_t normals = normals_ ? normals_->memory_bytes() - sizeof(NormalMap) : 0;
  const std::size_t detail = detail_ != nullptr ? detail_->memory_bytes() : 0;
  return sizeof(*this) + heights_.memory_bytes() - sizeof(HeightMap) + normals + detail;
}

NormalAgreement compare_normals(const HeightMap& heights, const NormalMap& normals, const Vec2& tile) {
  SlopeGrid grid = slopes_of(heights, normals, tile);
  NormalAgreement best = correlate(grid);
  best.heights_flat = best.heights_flat || heights.lowest() >= heights.highest();
  best.rms_angle = rms_angle(grid);
  if (best.heights_flat || best.normals_flat) return best;
  int block = 1;
  while (grid.columns >= 2 * fewest_blocks_a_side && grid.rows >= 2 * fewest_blocks_a_side) {
    grid = halved(grid);
    block *= 2;
    NormalAgreement coarser = correlate(grid);
    if (likeness(coarser) <= likeness(best)) continue;
    coarser.rms_angle = best.rms_angle;
    coarser.block = block;
    coarser.heights_flat = coarser.normals_flat = false;
    best = coarser;
  }
  best.green_flipped_fits_better =
      std::abs(best.flipped_correlation) > std::abs(best.correlation) && likeness(best) > related;
  return best;
}

std::optional<std::string> disagreement_warning(const NormalAgreement& a) {
  if (a.heights_flat && a.normals_flat) return std::nullopt;
  if (a.heights_flat) return "the normal map shows relief but the height map is flat";
  if (a.normals_flat) return "the normal map is flat but the height map is not";
  const double best = a.green_flipped_fits_better ? a.flipped_correlation : a.correlation;
  if (!a.green_flipped_fits_better && best >= agrees) return std::nullopt;
  const std::string numbers = fmt::format("(correlation of slopes {:.2f}: {:.2f} along s, {:.2f} along t)",
                                          a.correlation, a.correlation_s, a.correlation_t);
  if (std::abs(best) < related) {
    return fmt::format("the normal map does not belong to the heights {}; is it of the same picture?", numbers);
  }
  const bool over = best < 0.0;
  const bool flipped = a.green_flipped_fits_better;
  const auto both = [&](const char* of_over, const char* of_flipped) {
    return fmt::format("{}{}{}", over ? of_over : "", over && flipped ? " and " : "", flipped ? of_flipped : "");
  };
  if (over || flipped) {
    return fmt::format("the normal map fits the heights {} {}: try {}",
                       both("turned over", "with its green channel the other way round"), numbers,
                       both("the other setting of white_is", "the other green convention"));
  }
  return fmt::format("the normal map only loosely follows the heights {}", numbers);
}

}  // namespace asperity
