#include "asperity/field/mesostructure/detail/formulas.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "asperity/core/math.h"
#include "asperity/core/rng.h"
#include "asperity/field/mesostructure/detail/tiled_noise.h"
#include "asperity/geometry/index_table.h"

namespace asperity {
namespace {

using std::numbers::pi;

/// 1 at 0, falling as a raised cosine to 0 at 1 and beyond; slope 0 at both ends.
double raised_cosine(double q) {
  return std::abs(q) < 1.0 ? 0.5 + 0.5 * std::cos(pi * q) : 0.0;
}

/// The shorter way from one coordinate to another on a tile that repeats.
double tiled_difference(double from, double to) {
  const double difference = to - from;
  return difference - std::round(difference);
}

/// Distance of two points on a tile that repeats.
double tiled_distance(double s, double t, double to_s, double to_t) {
  return std::hypot(tiled_difference(to_s, s), tiled_difference(to_t, t));
}

/// Whether a round thing lies clear of all others, or overlaps them by less than a share of their radii.
template <class Round>
bool lies_free(const Round& round, const std::vector<Round>& others, double overlap = 0.0) {
  return std::none_of(others.begin(), others.end(), [&](const Round& other) {
    return tiled_distance(round.s, round.t, other.s, other.t) < (1.0 - overlap) * (round.radius + other.radius);
  });
}

/// A square of texels, on a tile that repeats, that holds the disc around (s, t): `visit(index, s, t)` at their
/// centres.
template <class Visit>
void for_each_texel_near(int size, double s, double t, double radius, Visit&& visit) {
  const auto first = [&](double centre) { return static_cast<int>(std::floor((centre - radius) * size)) - 1; };
  const int span = std::min(static_cast<int>(std::ceil(2.0 * radius * size)) + 3, size);
  for (int j = 0; j < span; ++j) {
    const int row = ((first(t) + j) % size + size) % size;
    for (int i = 0; i < span; ++i) {
      const int column = ((first(s) + i) % size + size) % size;
      const auto index =
          static_cast<std::size_t>(size - 1 - row) * static_cast<std::size_t>(size) + static_cast<std::size_t>(column);
      visit(index, (column + 0.5) / size, (row + 0.5) / size);
    }
  }
}

/// Whether one of `count` beams, `width` of their pitch each and in its middle, covers the texel.
bool under_beam(int texel, int size, int count, double width) {
  const auto twice_size = 2 * static_cast<std::int64_t>(size);
  const auto phase = static_cast<double>((static_cast<std::int64_t>(2 * texel + 1) * count) % twice_size);
  const double half = width * size;
  return half >= size - phase && phase - size < half;
}

/// Whether as many found a place as were asked for.
Status all_placed(std::size_t placed, const MesostructureSpec& spec) {
  if (placed >= static_cast<std::size_t>(spec.number.value_or(0))) return success();
  return bad_value(fmt::format("only {} of {} find a place", placed, *spec.number), "number",
                   "fewer, or smaller radii");
}

// ---- H_3

/// A round feature of H_3, its radii those of the fixed arrangement times `scale`.
struct Roundel {
  double s = 0.0;
  double t = 0.0;
  bool ring = false;
  double centre = 0.0;  // +1: a peak in the middle, -1: a hole
  double scale = 1.0;
  double radius = 0.0;  // tiles; of the fixed arrangement not asked for
};

constexpr std::array<Roundel, 4> fixed_roundels{
    {{0.28, 0.72, true, 1.0}, {0.72, 0.28, true, -1.0}, {0.28, 0.28, false, 1.0}, {0.72, 0.72, false, -1.0}}};

double roundel_rise(const Roundel& roundel, double s, double t) {
  const double q = tiled_distance(s, t, roundel.s, roundel.t) / roundel.scale;
  if (!roundel.ring) return roundel.centre * raised_cosine(q / 0.12);
  return raised_cosine((q - 0.17) / 0.06) + roundel.centre * raised_cosine(q / 0.08);
}

/// Non-overlapping roundels; their scale shrinks until all find a place.
std::vector<Roundel> scatter_roundels(int number, std::uint64_t seed) {
  // A ring around a hole comes first: alone it has both the highest and the lowest point.
  constexpr std::array<Roundel, 4> kinds{
      {{0.0, 0.0, true, -1.0}, {0.0, 0.0, true, 1.0}, {0.0, 0.0, false, 1.0}, {0.0, 0.0, false, -1.0}}};
  constexpr int trials = 500;
  Rng rng(seed);
  double scale = std::min(1.0, 1.6 / std::sqrt(number));
  std::vector<Roundel> placed;
  while (placed.size() < static_cast<std::size_t>(number)) {
    bool found = false;
    for (int trial = 0; trial < trials && !found; ++trial) {
      Roundel next = kinds[placed.size() % kinds.size()];
      next.scale = scale;
      next.s = rng.uniform();
      next.t = rng.uniform();
      next.radius = (next.ring ? 0.23 : 0.12) * scale;
      found = lies_free(next, placed);
      if (found) placed.push_back(next);
    }
    if (found) continue;
    placed.clear();
    scale *= 0.9;
  }
  return placed;
}

// ---- H_4

struct Wart {
  double s = 0.0;
  double t = 0.0;
  double radius = 0.0;  // tiles
  bool steep = false;
};

constexpr int wart_trials = 600;
constexpr int more_trials_a_wart = 100;  // where a number is asked for

std::vector<Wart> scatter_warts(const MesostructureSpec& spec) {
  Rng rng(spec.seed);
  const auto [smallest, largest] = *spec.radius;
  const auto most = static_cast<std::size_t>(spec.number.value_or(wart_trials));
  const int trials = wart_trials + more_trials_a_wart * spec.number.value_or(0);
  std::vector<Wart> warts;
  for (int trial = 0; trial < trials && warts.size() < most; ++trial) {
    Wart wart{rng.uniform(), rng.uniform(), largest, rng.uniform() < 0.5};
    const double size = rng.uniform();
    const double chance = rng.uniform();
    if (!warts.empty()) {
      wart.radius = largest * std::pow(smallest / largest, size);
      if (chance > 0.6 - 0.4 * std::cos(2.0 * pi * wart.s)) continue;
    }
    if (lies_free(wart, warts)) warts.push_back(wart);
  }
  return warts;
}

double wart_profile(const Wart& wart, double largest, double distance) {
  const double q = distance / wart.radius;
  if (q >= 1.0) return 0.0;
  const double rise = wart.radius / largest;
  if (!wart.steep) return rise * raised_cosine(q);
  const double side = 1.0 - q * q * q * q;
  return rise * side * side;
}

// ---- H_5

struct Coin {
  double s = 0.0;
  double t = 0.0;
  double radius = 0.0;  // tiles
  double turn = 0.0;    // rad, of its cross
};

std::vector<Coin> scatter_coins(const MesostructureSpec& spec) {
  constexpr int trials_a_coin = 400;
  Rng rng(spec.seed);
  const auto number = static_cast<std::size_t>(*spec.number);
  std::vector<Coin> coins;
  for (int trial = 0; trial < trials_a_coin * *spec.number && coins.size() < number; ++trial) {
    const Coin coin{rng.uniform(), rng.uniform(), rng.uniform(spec.radius->low, spec.radius->high),
                    rng.uniform(0.0, 0.5 * pi)};
    if (lies_free(coin, coins, spec.overlap)) coins.push_back(coin);
  }
  return coins;
}

/// 1 deeper than `flank` inside an outline, 0 outside; `outside` is the signed distance to the outline.
double inside(double outside, double flank) {
  if (outside >= 0.0) return 0.0;
  return outside <= -flank ? 1.0 : raised_cosine((outside + flank) / flank);
}

/// Signed distance to a rectangle around the origin.
double distance_to_bar(const Vec2& p, double half_length, double half_width) {
  const Vec2 beyond(std::abs(p.x()) - half_length, std::abs(p.y()) - half_width);
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

/// Height of a coin (shares of the amplitude) at `p` from its centre.
double coin_relief(const MesostructureSpec& spec, const Coin& coin, const Vec2& p) {
  const double flank = *spec.flank;
  if (!spec.rim) return 1.0;
  const double within_rim = coin.radius * (1.0 - *spec.rim);
  const double on_rim = inside(within_rim - p.norm(), flank);
  const Vec2 turned = Eigen::Rotation2Dd(-coin.turn) * p;
  const double length = 0.55 * within_rim;
  const double width = 0.16 * within_rim;
  const double to_cross = std::min(distance_to_bar(turned, length, width), distance_to_bar(turned, width, length));
  return spec.field + (1.0 - spec.field) * (on_rim + 0.5 * inside(to_cross, flank));
}

// ---- H_6

/// Distance to an arc around `centre` that runs counterclockwise from angle `from` over `sweep` (rad).
double arc_distance(const Vec2& point, const Vec2& centre, double radius, double from, double sweep) {
  const Vec2 arm = point - centre;
  const double turn = std::atan2(arm.y(), arm.x()) - from;
  const double angle = turn - 2.0 * pi * std::floor(turn / (2.0 * pi));
  if (angle <= sweep) return std::abs(arm.norm() - radius);
  const Vec2 start(std::cos(from), std::sin(from));
  const Vec2 end(std::cos(from + sweep), std::sin(from + sweep));
  return std::min((arm - radius * start).norm(), (arm - radius * end).norm());
}

double letter_distance(double radius, const Vec2& st) {
  const double sweep = 250.0 / 180.0 * pi;
  const double upper = arc_distance(st, {0.5, 0.5 + radius}, radius, 1.5 * pi - sweep, sweep);
  const double lower = arc_distance(st, {0.5, 0.5 - radius}, radius, 0.5 * pi - sweep, sweep);
  return std::min(upper, lower);
}

// ---- H_7

/// Smooth noise on a lattice of `cells` x `cells` that closes on itself: gradients at its points, mixed by a quintic.
class TiledNoise {
 public:
  TiledNoise(int cells, Rng& rng) : cells_(cells), key_(rng.next()), shift_(rng.uniform(), rng.uniform()) {}

  [[nodiscard]] double at(double s, double t) const {
    // Octaves are shifted against each other: lattice points, where noise is 0, must not fall together.
    const double x = (s + shift_.x()) * cells_;
    const double y = (t + shift_.y()) * cells_;
    const double column = std::floor(x);
    const double row = std::floor(y);
    const Vec2 offset(x - column, y - row);
    const int i = static_cast<int>(column) % cells_;
    const int j = static_cast<int>(row) % cells_;
    const int right = (i + 1) % cells_;
    const int above = (j + 1) % cells_;
    const double u = smooth_step(offset.x());
    const double v = smooth_step(offset.y());
    const double low = std::lerp(slope(i, j, offset), slope(right, j, offset - Vec2(1.0, 0.0)), u);
    const double high =
        std::lerp(slope(i, above, offset - Vec2(0.0, 1.0)), slope(right, above, offset - Vec2(1.0, 1.0)), u);
    return std::lerp(low, high, v);
  }

 private:
  static const std::array<Vec2, 256>& directions() {
    static const std::array<Vec2, 256> table = [] {
      std::array<Vec2, 256> all;
      for (std::size_t k = 0; k < all.size(); ++k) {
        const double angle = 2.0 * pi * static_cast<double>(k) / static_cast<double>(all.size());
        all[k] = Vec2(std::cos(angle), std::sin(angle));
      }
      return all;
    }();
    return table;
  }

  [[nodiscard]] double slope(int i, int j, const Vec2& offset) const {
    const auto place = (static_cast<std::uint64_t>(i) << 32U) | static_cast<std::uint64_t>(j);
    return directions()[mixed_bits(mixed_bits(place + 1) + key_) >> 56U].dot(offset);
  }

  int cells_;
  std::uint64_t key_;
  Vec2 shift_;
};

}  // namespace

MadeHeights flat_heights(const MesostructureSpec& spec) {
  return std::vector<float>(static_cast<std::size_t>(spec.size) * static_cast<std::size_t>(spec.size),
                            static_cast<float>(spec.amplitude));
}

MadeHeights serrated_heights(const MesostructureSpec& spec) {
  const int size = spec.size;
  const double slope = (1.0 - spec.wall) * size;  // the right side's part of a ridge, in units of the phase
  std::vector<float> row;
  row.reserve(static_cast<std::size_t>(size));
  for (int x = 0; x < size; ++x) {
    const auto phase = static_cast<double>(static_cast<std::int64_t>(x) * spec.count % size);
    const double height =
        phase <= slope ? spec.amplitude * (slope - phase) / slope : spec.amplitude * (phase - slope) / (size - slope);
    row.push_back(static_cast<float>(height));
  }
  std::vector<float> heights;
  heights.reserve(row.size() * row.size());
  for (int y = 0; y < size; ++y) heights.insert(heights.end(), row.begin(), row.end());
  return heights;
}

MadeHeights beam_heights(const MesostructureSpec& spec) {
  const auto side = static_cast<std::size_t>(spec.size);
  std::vector<bool> covered;
  for (int i = 0; i < spec.size; ++i) covered.push_back(under_beam(i, spec.size, spec.count, *spec.width));
  std::vector<float> heights(side * side);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      if (covered[x] || covered[side - 1 - y]) heights[y * side + x] = static_cast<float>(spec.amplitude);
    }
  }
  return heights;
}

MadeHeights ring_heights(const MesostructureSpec& spec) {
  const std::vector<Roundel> roundels = spec.number
                                            ? scatter_roundels(*spec.number, spec.seed)
                                            : std::vector<Roundel>(fixed_roundels.begin(), fixed_roundels.end());
  return tabulated(spec.size, spec.size, [&](const Vec2& st) {
    double rise = 0.0;
    for (const Roundel& roundel : roundels) rise += roundel_rise(roundel, st.x(), st.y());
    return 0.5 * spec.amplitude * (1.0 + rise);
  });
}

MadeHeights wart_heights(const MesostructureSpec& spec) {
  const std::vector<Wart> warts = scatter_warts(spec);
  const auto texels = static_cast<std::size_t>(spec.size) * static_cast<std::size_t>(spec.size);
  ASPERITY_CHECK(all_placed(warts.size(), spec));
  std::vector<float> heights(texels);
  for (const Wart& wart : warts) {
    for_each_texel_near(spec.size, wart.s, wart.t, wart.radius, [&](std::size_t index, double s, double t) {
      const double rise = wart_profile(wart, spec.radius->high, tiled_distance(s, t, wart.s, wart.t));
      heights[index] = std::max(heights[index], static_cast<float>(spec.amplitude * rise));
    });
  }
  return heights;
}

MadeHeights coin_heights(const MesostructureSpec& spec) {
  const std::vector<Coin> coins = scatter_coins(spec);
  const auto texels = static_cast<std::size_t>(spec.size) * static_cast<std::size_t>(spec.size);
  ASPERITY_CHECK(all_placed(coins.size(), spec));
  std::vector<float> heights(texels);
  for (const Coin& coin : coins) {
    for_each_texel_near(spec.size, coin.s, coin.t, coin.radius, [&](std::size_t index, double s, double t) {
      const Vec2 p(tiled_difference(coin.s, s), tiled_difference(coin.t, t));
      const double covers = inside(p.norm() - coin.radius, *spec.flank);
      if (covers <= 0.0) return;
      const double relief = spec.amplitude * coin_relief(spec, coin, p);
      heights[index] = static_cast<float>(std::lerp(static_cast<double>(heights[index]), relief, covers));
    });
  }
  return heights;
}

MadeHeights groove_heights(const MesostructureSpec& spec) {
  const double half = 0.5 * *spec.width;
  const double wall = *spec.flank / half;
  return tabulated(spec.size, spec.size, [&](const Vec2& st) {
    const double q = letter_distance(spec.radius->high, st) / half;
    const double up_the_wall = q - (1.0 - wall);
    const double depth = up_the_wall < wall ? raised_cosine(up_the_wall / wall) : 0.0;
    return -spec.amplitude * (up_the_wall <= 0.0 ? 1.0 : depth);
  });
}

MadeHeights fractal_heights(const MesostructureSpec& spec) {
  Rng rng(spec.seed);
  std::vector<TiledNoise> octaves;
  for (int k = 0; k < *spec.octaves; ++k) octaves.emplace_back(2 << k, rng);
  const double share = std::exp2(-spec.hurst);
  std::vector<float> heights = tabulated(spec.size, spec.size, [&](const Vec2& st) {
    double height = 0.0;
    double weight = 1.0;
    for (const TiledNoise& octave : octaves) {
      height += weight * octave.at(st.x(), st.y());
      weight *= share;
    }
    return height;
  });
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  const double lowest = *low;
  const double range = static_cast<double>(*high) - lowest;
  for (float& height : heights) {
    height = range > 0.0 ? static_cast<float>(spec.amplitude * ((height - lowest) / range)) : 0.0F;
  }
  return heights;
}

}  // namespace asperity
