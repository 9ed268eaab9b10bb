// Cloth, basketry, skin, wood, stone and sand.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "asperity/field/mesostructure/detail/patterns.h"
#include "asperity/field/mesostructure/detail/tiled_noise.h"

namespace asperity {
namespace {

using std::numbers::pi;

/// Height of a round thing of radius 1 over its middle plane.
double round_top(double q) {
  return std::sqrt(std::max(0.0, 1.0 - q * q));
}

/// Which thread lies on top at a crossing of warp `i` (along t) and weft `j` (along s).
using Weave = bool (*)(int warp, int weft);

/// A cloth of `count` threads each way.
struct Cloth {
  int count = 16;
  Weave warp_on_top = nullptr;
  double width = 0.96;  ///< of a thread, share of its pitch
  double swing = 0.5;   ///< of a thread's middle, radii
  double uneven = 0.0;  ///< of widths, share
  double twist = 0.0;   ///< depth of the fibres' furrows, radii
};

/// Height of one thread: `across` from its middle (pitches), `along` in pitches, `sign` the side it lies on.
double thread_height(const Cloth& cloth, double across, double along, double radius, double sign) {
  const double q = 2.0 * across / radius;
  if (std::abs(q) >= 1.0) return -2.0;
  const double furrow = cloth.twist * std::sin(2.0 * pi * (3.0 * along + 1.2 * std::asin(q)));
  return round_top(q) * (1.0 + furrow) + cloth.swing * sign;
}

double cloth_height(const Cloth& cloth, const TileNoise& slubs, double s, double t) {
  const double x = s * cloth.count;
  const double y = t * cloth.count;
  const auto sign = [&](int warp, int weft) {
    return cloth.warp_on_top(wrapped(warp, cloth.count), wrapped(weft, cloth.count)) ? 1.0 : -1.0;
  };
  const int warp = static_cast<int>(std::floor(x));
  const int weft = static_cast<int>(std::floor(y));
  // Between the crossings a thread goes from one side to the other.
  const double before_t = std::floor(y - 0.5);
  const double before_s = std::floor(x - 0.5);
  const double up = std::lerp(sign(warp, static_cast<int>(before_t)), sign(warp, static_cast<int>(before_t) + 1),
                              smooth_step(y - 0.5 - before_t));
  const double side = std::lerp(sign(static_cast<int>(before_s), weft), sign(static_cast<int>(before_s) + 1, weft),
                                smooth_step(x - 0.5 - before_s));
  const double warp_width = cloth.width * (1.0 + cloth.uneven * slubs((warp + 0.5) / cloth.count, t));
  const double weft_width = cloth.width * (1.0 + cloth.uneven * slubs(s, (weft + 0.5) / cloth.count));
  const double a = thread_height(cloth, x - warp - 0.5, y, std::min(warp_width, 1.0), up);
  const double b = thread_height(cloth, y - weft - 0.5, x, std::min(weft_width, 1.0), -side);
  return std::max({a, b, -0.4});
}

Pattern linen_pattern(std::uint64_t seed) {
  const Cloth cloth{16, [](int warp, int weft) { return (warp + weft) % 2 == 0; }, 0.9, 0.55, 0.25, 0.06};
  const TileNoise slubs(16, 16, seed);
  const TileOctaves fuzz(48, 48, 2, 0.6, seed + 10);
  return [=](double s, double t) {
    const double waver = 0.012 * TileNoise(4, 4, seed + 20)(s, t);
    return cloth_height(cloth, slubs, s + waver, t - waver) + 0.1 * fuzz(s, t);
  };
}

Pattern denim_pattern(std::uint64_t seed) {
  // Three over one: the warp shows, in diagonal ribs.
  const Cloth cloth{20, [](int warp, int weft) { return (warp - weft + 20) % 4 != 0; }, 1.0, 0.7, 0.1, 0.08};
  const TileNoise slubs(20, 20, seed);
  const TileOctaves fuzz(64, 64, 2, 0.6, seed + 10);
  return [=](double s, double t) { return cloth_height(cloth, slubs, s, t) + 0.12 * fuzz(s, t); };
}

Pattern corduroy_pattern(std::uint64_t seed) {
  const TileOctaves pile(64, 64, 2, 0.7, seed);
  const TileNoise waver(3, 6, seed + 5);
  return [=](double s, double t) {
    const double x = 6.0 * s + 0.05 * waver(s, t);
    const double q = 2.0 * (x - std::floor(x)) - 1.0;
    const double wale = std::sqrt(std::max(0.0, 1.0 - std::pow(std::abs(q) / 0.88, 3.0)));
    return wale * (1.0 + 0.1 * pile(s, t)) + 0.03 * pile(s, t);
  };
}

Pattern knit_pattern(std::uint64_t seed) {
  constexpr int columns = 6;
  constexpr int rows = 8;
  const TileOctaves fuzz(48, 48, 2, 0.6, seed);
  return [=](double s, double t) {
    const double x = s * columns;
    const double y = t * rows;
    const double column = std::floor(x);
    const double row = std::floor(y);
    double height = 1.0;
    // The two legs of each stitch rise from its foot in the middle outwards, over the stitch below.
    for (int k = -2; k <= 1; ++k) {
      for (const double side : {-1.0, 1.0}) {
        // In stitches' widths of 4 mm; a row is 3 mm.
        const Vec2 p(side * (x - column - 0.5), 0.75 * (y - row - k));
        const Vec2 foot(0.1, 0.0);
        const Vec2 leg(0.26, 0.92);
        const double along = std::clamp((p - foot).dot(leg) / leg.squaredNorm(), 0.0, 1.0);
        const double apart = (p - foot - along * leg).norm();
        if (apart >= 0.19) continue;
        const double ply = 0.05 * std::sin(2.0 * pi * (4.0 * along + 4.0 * apart));
        const double bow = 1.6 - 3.2 * (along - 0.45) * (along - 0.45);
        height = std::max(height, round_top(apart / 0.19) * (1.0 + ply) + bow);
      }
    }
    return height + 0.06 * fuzz(s, t);
  };
}

Pattern basket_pattern(std::uint64_t seed) {
  const Cloth cloth{12, [](int warp, int weft) { return (warp / 2 + weft / 2) % 2 == 0; }, 0.98, 0.6, 0.05, 0.0};
  const TileNoise slubs(12, 12, seed);
  const TileOctaves fibre(40, 40, 2, 0.6, seed + 10);
  return [=](double s, double t) { return cloth_height(cloth, slubs, s, t) + 0.04 * fibre(s, t); };
}

Pattern leather_pattern(std::uint64_t seed) {
  const ScatteredPoints grain(20, 20, 0.95, seed);
  const TileOctaves warp(10, 10, 2, 0.5, seed + 1);
  const TileOctaves skin(4, 4, 2, 0.5, seed + 5);
  const TileNoise pores(96, 96, seed + 9);
  return [=](double s, double t) {
    const double bend = 0.016;
    const auto cell = grain.nearest(s + bend * warp(s, t), t + bend * warp(s + 0.37, t + 0.61));
    const double inside = cell.second - cell.first;
    const double pillow = 0.55 * smooth_step(inside / 0.55) + 0.45 * smooth_step(inside / 1.2);
    return pillow * (0.8 + 0.2 * grain.chance()(cell.i, cell.j, 3)) + 0.4 * skin(s, t) + 0.04 * pores(s, t);
  };
}

Pattern wood_pattern(std::uint64_t seed) {
  const TileOctaves waver(2, 1, 3, 0.5, seed);
  const ScatteredPoints pores(72, 10, 0.9, seed + 5);
  const TileOctaves fibre(128, 6, 2, 0.6, seed + 9);
  return [=](double s, double t) {
    // Seven years, each from porous early wood to dense late wood.
    const auto year = [&](double at_s, double at_t) {
      const double x = 7.0 * at_s + 1.1 * waver(at_s, at_t);
      return x - std::floor(x);
    };
    const double now = year(s, t);
    const double height = 0.35 * now - 0.35 * smooth_step((now - 0.93) / 0.07) + 0.12 * fibre(s, t);
    const double pit = pores.highest(s, t, 1, [&](double dx, double dy, int i, int j) {
      const double ps = s - dx / 72.0;
      const double pt = t - dy / 10.0;
      const bool early = pores.chance()(i, j, 3) < 1.1 * std::pow(1.0 - year(ps, pt), 2.0) + 0.06;
      if (!early) return 0.0;
      const double length = 0.35 + 0.3 * pores.chance()(i, j, 4);
      return 1.0 - smooth_step(std::hypot(dx / 0.34, dy / length));
    });
    return height - 0.8 * pit;
  };
}

Pattern bark_pattern(std::uint64_t seed) {
  const ScatteredPoints plates(9, 4, 0.95, seed);
  const TileOctaves warp(4, 3, 4, 0.6, seed + 1);
  const TileOctaves rough(12, 4, 4, 0.6, seed + 9);
  return [=](double s, double t) {
    const auto cell = plates.nearest(s + 0.06 * warp(s, t), t + 0.06 * warp(s + 0.4, t + 0.7));
    const double ridge = smooth_step((cell.second - cell.first) / 0.55);
    return ridge * (0.75 + 0.25 * plates.chance()(cell.i, cell.j, 3)) + 0.35 * rough(s, t) * (0.4 + 0.6 * ridge);
  };
}

Pattern orange_pattern(std::uint64_t seed) {
  const ScatteredPoints pores(18, 18, 0.85, seed);
  const TileOctaves skin(6, 6, 2, 0.5, seed + 4);
  return [=](double s, double t) {
    const double pit = pores.highest(s, t, 1, [&](double dx, double dy, int i, int j) {
      const double size = 0.42 + 0.2 * pores.chance()(i, j, 3);
      const double inside = std::max(0.0, 1.0 - (dx * dx + dy * dy) / (size * size));
      return (0.4 + 0.6 * pores.chance()(i, j, 4)) * inside * inside * inside;
    });
    const auto cell = pores.nearest(s, t);
    return 0.6 * skin(s, t) - pit + 0.12 * smooth_step(cell.first / 1.1);
  };
}

Pattern scales_pattern(std::uint64_t seed) {
  constexpr int columns = 7;
  constexpr int rows = 12;
  const CellChance chance(seed);
  return [=](double s, double t) {
    const double x = s * columns;
    const double y = t * rows;
    // A scale hangs from its middle downwards; those of higher rows lie over those below them.
    for (int k = 2; k >= -1; --k) {
      const int row = static_cast<int>(std::floor(y)) + k;
      const double shift = wrapped(row, 2) == 0 ? 0.0 : 0.5;
      const double column = std::floor(x - shift + 0.5);
      const Vec2 p(x - shift - column, 0.62 * (y - row - 0.4));
      const double q = p.norm() / 0.62;
      if (q >= 1.0 || p.y() > 0.62) continue;
      const double lift = 0.35 + 0.65 * std::clamp(0.5 - 0.5 * p.y() / 0.62, 0.0, 1.0);
      const double rim = smooth_step((1.0 - q) / 0.07);
      const double growth = 0.05 * std::cos(2.0 * pi * 6.0 * q);
      const double own = 0.08 * chance(wrapped(static_cast<int>(column), columns), wrapped(row, rows), 1);
      // The highest row whose scale covers the place is what is felt.
      return rim * (lift + growth + own) + (1.0 - rim) * 0.15;
    }
    return 0.0;
  };
}

Pattern pebbles_pattern(std::uint64_t seed) {
  const ScatteredPoints large(5, 5, 0.8, seed);
  const ScatteredPoints middle(9, 9, 0.8, seed + 1);
  const ScatteredPoints small(18, 18, 0.8, seed + 2);
  const TileOctaves grit(48, 48, 2, 0.6, seed + 9);
  const auto stones = [](const ScatteredPoints& points, double s, double t, double size) {
    return points.highest(s, t, 1, [&](double dx, double dy, int i, int j) {
      const CellChance& chance = points.chance();
      const double turn = pi * chance(i, j, 3);
      const double a = std::cos(turn) * dx + std::sin(turn) * dy;
      const double b = std::cos(turn) * dy - std::sin(turn) * dx;
      const double radius = size * (0.75 + 0.25 * chance(i, j, 4));
      const double q = std::hypot(a / radius, b / (radius * (0.6 + 0.35 * chance(i, j, 5))));
      return round_top(std::pow(q, 1.25)) * (0.7 + 0.3 * chance(i, j, 6));
    });
  };
  return [=](double s, double t) {
    const double height =
        std::max({stones(large, s, t, 0.62), 0.66 * stones(middle, s, t, 0.66), 0.36 * stones(small, s, t, 0.7)});
    return height + 0.015 * grit(s, t);
  };
}

Pattern sand_pattern(std::uint64_t seed) {
  const TileOctaves bend(2, 3, 3, 0.45, seed);
  const TileNoise strength(3, 3, seed + 7);
  const TileOctaves grains(128, 128, 1, 0.5, seed + 9);
  return [=](double s, double t) {
    const double x = 8.0 * s + 1.3 * bend(s, t);
    const double phase = x - std::floor(x);
    // Gentle towards the wind, steep in its lee.
    const double profile = phase < 0.68 ? smooth_step(phase / 0.68) : smooth_step((1.0 - phase) / 0.32);
    return profile * (0.8 + 0.35 * strength(s, t)) + 0.04 * grains(s, t);
  };
}

constexpr std::array<PatternItem, 12> grown{{
    {"linen", 11.2e-3, 0.35e-3, linen_pattern, "plain weave of uneven threads, 14 a centimetre"},
    {"denim", 10e-3, 0.3e-3, denim_pattern, "twill three over one, 20 threads a centimetre"},
    {"corduroy", 18e-3, 1.2e-3, corduroy_pattern, "ribbed velvet, eight wales an inch"},
    {"knit", 24e-3, 1.5e-3, knit_pattern, "jersey knit, stitches of 4 mm x 3 mm"},
    {"basket", 0.06, 3e-3, basket_pattern, "wicker of 5 mm, two over two"},
    {"leather", 20e-3, 0.25e-3, leather_pattern, "full-grain cowhide, grains of 1 mm between creases"},
    {"wood", 40e-3, 0.2e-3, wood_pattern, "planed and weathered oak, open pores along t"},
    {"bark", 0.12, 8e-3, bark_pattern, "old tree's bark in plates with deep furrows"},
    {"orange-peel", 22e-3, 0.3e-3, orange_pattern, "rind of an orange, pores of 1 mm"},
    {"fish-scales", 56e-3, 0.6e-3, scales_pattern, "overlapping scales of 8 mm with growth rings"},
    {"pebbles", 0.12, 12e-3, pebbles_pattern, "river gravel of 6 to 30 mm"},
    {"ripple-sand", 0.64, 9e-3, sand_pattern, "sand rippled by wind, 80 mm from crest to crest"},
}};

}  // namespace

std::span<const PatternItem> grown_patterns() {
  return grown;
}

}  // namespace asperity
