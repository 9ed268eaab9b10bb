// Masonry, paving, machined and moulded surfaces.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "asperity/field/mesostructure/detail/patterns.h"
#include "asperity/field/mesostructure/detail/tiled_noise.h"

namespace asperity {
namespace {

using std::numbers::pi;

/// Distance from the nearest whole number, 0 to 0.5.
double from_whole(double x) {
  return std::abs(x - std::round(x));
}

/// 0 at whole numbers, 1 half way between them, straight in between.
double triangle(double x) {
  return 2.0 * from_whole(x);
}

/// Distance from a rounded rectangle's outline, negative inside.
double rounded_box(double x, double y, double half_width, double half_height, double rounding) {
  const Vec2 beyond(std::abs(x) - half_width + rounding, std::abs(y) - half_height + rounding);
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0) - rounding;
}

/// A part of a sphere: 1 in the middle, 0 from radius 1 on; `share` is how much of a half sphere it is.
double dome(double q, double share) {
  if (q >= 1.0) return 0.0;
  const double edge = std::sqrt(1.0 - share * share);
  return (std::sqrt(1.0 - share * share * q * q) - edge) / (1.0 - edge);
}

// ---- built ------------------------------------------------------------------------------

Pattern cobbles_pattern(std::uint64_t seed) {
  constexpr int count = 8;
  const CellChance chance(seed);
  const TileOctaves rough(24, 24, 4, 0.6, seed + 1);
  const TileOctaves warp(12, 12, 2, 0.5, seed + 6);
  return [=](double s, double t) {
    const double y = t * count + 0.12 * warp(s, t);
    const int row = static_cast<int>(std::floor(y));
    const double x = s * count + (wrapped(row, 2) == 0 ? 0.0 : 0.5) + 0.12 * warp(s + 0.5, t + 0.3);
    const int column = static_cast<int>(std::floor(x));
    const auto of = [&](unsigned k) { return chance(wrapped(column, count), wrapped(row, count), k); };
    const double dx = x - column - 0.5 - 0.05 * (of(1) - 0.5);
    const double dy = y - row - 0.5 - 0.05 * (of(2) - 0.5);
    const double inside = -rounded_box(dx, dy, 0.43 + 0.03 * of(3), 0.43 + 0.03 * of(4), 0.2);
    const double top = 1.0 - std::pow(1.0 - std::clamp(inside / 0.42, 0.0, 1.0), 3.0);
    return top * (0.85 + 0.15 * of(5) + 0.12 * dx * (of(6) - 0.5)) + 0.06 * rough(s, t);
  };
}

Pattern bricks_pattern(std::uint64_t seed) {
  // Stretcher bond of bricks of 215 mm x 65 mm with joints of 10 mm.
  constexpr int columns = 4;
  constexpr int rows = 12;
  const CellChance chance(seed);
  const TileOctaves face(48, 48, 4, 0.65, seed + 1);
  const TileOctaves edge(64, 64, 2, 0.5, seed + 6);
  return [=](double s, double t) {
    const double y = t * rows;
    const int row = static_cast<int>(std::floor(y));
    const double x = s * columns + (wrapped(row, 2) == 0 ? 0.0 : 0.5);
    const int column = static_cast<int>(std::floor(x));
    const auto of = [&](unsigned k) { return chance(wrapped(column, columns), wrapped(row, rows), k); };
    const double dx = 225.0 * (x - column - 0.5);
    const double dy = 75.0 * (y - row - 0.5);
    const double outside = rounded_box(dx, dy, 107.5, 32.5, 4.0) + 1.5 * edge(s, t);
    const double brick = smooth_step(-outside / 4.0);
    const double tilt = 0.12 * (of(1) - 0.5) * dx / 107.5 + 0.1 * (of(2) - 0.5) * dy / 32.5;
    const double own = 0.85 + 0.15 * of(3) + tilt + 0.1 * face(s, t);
    return brick * own + (1.0 - brick) * 0.12 * face(s + 0.2, t);
  };
}

Pattern roughcast_pattern(std::uint64_t seed) {
  const ScatteredPoints coarse(16, 16, 0.95, seed);
  const ScatteredPoints fine(34, 34, 0.95, seed + 1);
  const TileOctaves ground(6, 6, 5, 0.55, seed + 2);
  const auto thrown = [](const ScatteredPoints& points, double s, double t) {
    return points.highest(s, t, 1, [&](double dx, double dy, int i, int j) {
      const double radius = 0.3 + 0.3 * points.chance()(i, j, 3);
      return points.chance()(i, j, 4) > 0.75 ? 0.0 : radius * dome(std::hypot(dx, dy) / radius, 0.9);
    });
  };
  return [=](double s, double t) {
    const double a = s + 0.01 * ground(s, t);
    const double b = t + 0.01 * ground(s + 0.5, t);
    return thrown(coarse, a, b) + 0.45 * thrown(fine, a, b) + 0.3 * ground(s, t);
  };
}

Pattern paving_pattern(std::uint64_t seed) {
  const TileOctaves grain(96, 96, 2, 0.6, seed);
  return [=](double s, double t) {
    const double q = 66.67 * std::hypot(from_whole(6.0 * s - 0.5), from_whole(6.0 * t - 0.5));
    // Truncated domes of 25 mm with tops of 16 mm, on slabs of two by two.
    const double blister = smooth_step((12.5 - q) / 4.5);
    const double joint = std::min(from_whole(3.0 * s), from_whole(3.0 * t)) * 133.33;
    return blister - 0.3 * (1.0 - smooth_step((joint - 1.0) / 2.0)) + 0.02 * grain(s, t);
  };
}

// ---- made -------------------------------------------------------------------------------

Pattern sandpaper_pattern(std::uint64_t seed) {
  const ScatteredPoints grit(18, 18, 0.95, seed);
  const TileOctaves resin(16, 16, 3, 0.5, seed + 1);
  return [=](double s, double t) {
    // Grains are broken crystals: the lowest of six slanted faces about a point.
    const double height = grit.highest(s, t, 2, [&](double dx, double dy, int i, int j) {
      const CellChance& chance = grit.chance();
      const double size = 0.45 + 0.4 * chance(i, j, 3);
      double top = size * (0.75 + 0.35 * chance(i, j, 4));
      const double turn = 2.0 * pi * chance(i, j, 5);
      const double flat = top * (0.75 + 0.2 * chance(i, j, 6)) + 0.25 * dx * (chance(i, j, 7) - 0.5);
      for (unsigned k = 0; k < 5; ++k) {
        const double angle = turn + 2.0 * pi * (k + 0.7 * chance(i, j, 10 + k)) / 5.0;
        const double reach = 0.8 * size * (0.7 + 0.5 * chance(i, j, 20 + k));
        top = std::min(top, 2.2 * (reach - (std::cos(angle) * dx + std::sin(angle) * dy)));
      }
      return std::min(top, flat);
    });
    return height + 0.12 * resin(s, t);
  };
}

Pattern honeycomb_pattern(std::uint64_t seed) {
  // Seven cells by eight rows: hexagons but for 1 %.
  constexpr int columns = 7;
  constexpr int rows = 8;
  const TileOctaves wax(24, 24, 2, 0.5, seed);
  return [=](double s, double t) {
    const double x = s * columns;
    const double y = t * rows;
    double first = infinity;
    double second = infinity;
    for (int b = -2; b <= 2; ++b) {
      const double row = std::floor(y) + b;
      const double shift = wrapped(static_cast<int>(row), 2) == 0 ? 0.0 : 0.5;
      for (int a = -1; a <= 1; ++a) {
        const double column = std::floor(x - shift) + a;
        const double d = std::hypot(x - column - shift - 0.5, (y - row - 0.5) * 0.5 * std::numbers::sqrt3);
        if (d < first) {
          second = first;
          first = d;
        } else {
          second = std::min(second, d);
        }
      }
    }
    const double wall = 0.5 * (second - first);
    return 1.0 - smooth_step((wall - 0.05) / 0.09) + 0.03 * wax(s, t) - 0.08 * (1.0 - first);
  };
}

Pattern knurl_pattern(std::uint64_t seed) {
  const TileOctaves wear(12, 12, 3, 0.5, seed);
  return [=](double s, double t) {
    // Two families of grooves that cross at 60 degrees leave pyramids; their tips are worn.
    const double a = triangle(7.0 * s + 4.0 * t);
    const double b = triangle(7.0 * s - 4.0 * t);
    return std::min(std::min(a, b), 0.85 + 0.05 * wear(s, t));
  };
}

Pattern plate_pattern(std::uint64_t seed) {
  constexpr int count = 6;
  const TileOctaves rolled(16, 16, 3, 0.5, seed);
  return [=](double s, double t) {
    double height = 0.0;
    const int column = static_cast<int>(std::floor(s * count));
    const int row = static_cast<int>(std::floor(t * count));
    for (int j = row - 1; j <= row + 1; ++j) {
      for (int i = column - 1; i <= column + 1; ++i) {
        const double dx = s * count - i - 0.5;
        const double dy = t * count - j - 0.5;
        const double turn = wrapped(i + j, 2) == 0 ? 1.0 : -1.0;
        const double u = std::numbers::sqrt2 * 0.5 * (dx + turn * dy) / 0.6;
        const double v = std::numbers::sqrt2 * 0.5 * (dy - turn * dx) / 0.17;
        // A lens: narrow towards both ends.
        const double edge = 1.0 - u * u - std::abs(v);
        height = std::max(height, smooth_step(edge / 0.55));
      }
    }
    return height + 0.015 * rolled(s, t);
  };
}

Pattern hammered_pattern(std::uint64_t seed) {
  const ScatteredPoints blows(9, 9, 0.85, seed);
  const TileOctaves wave(3, 3, 2, 0.5, seed + 1);
  return [=](double s, double t) {
    // Every blow leaves a part of a sphere; the deepest counts, the ridges between them are rounded.
    double sum = 0.0;
    blows.near(s, t, 2, [&](double dx, double dy, int i, int j) {
      const double strength = blows.chance()(i, j, 3);
      sum += std::exp(-14.0 * ((dx * dx + dy * dy) * (1.0 + 0.3 * strength) - 0.15 * strength));
    });
    const double height = -std::log(sum) / 14.0;
    return std::min(height, 0.75) + 0.08 * wave(s, t);
  };
}

Pattern milled_pattern(std::uint64_t seed) {
  constexpr int passes = 10;
  const CellChance chance(seed);
  const TileOctaves grain(64, 64, 2, 0.6, seed + 1);
  return [=](double s, double t) {
    // Passes of a ball-nosed cutter side by side, in each the marks of its teeth.
    const double x = s * passes;
    const double u = from_whole(x);
    const int pass = wrapped(static_cast<int>(std::round(x)), passes);
    const double v = from_whole(24.0 * t + chance(pass, 0, 1));
    return 4.0 * u * u + 0.35 * 4.0 * v * v + 0.04 * chance(pass, 0, 2) + 0.03 * grain(s, t);
  };
}

Pattern brushed_pattern(std::uint64_t seed) {
  const TileNoise coarse(3, 40, seed);
  const TileNoise middle(5, 110, seed + 1);
  const TileNoise fine(9, 230, seed + 2);
  return [=](double s, double t) {
    const double scratch = coarse(s, t) + 0.8 * middle(s, t) + 0.7 * fine(s, t);
    return scratch - 0.8 * std::max(0.0, -0.45 - middle(s, t));
  };
}

Pattern file_pattern(std::uint64_t seed) {
  const TileOctaves burr(20, 20, 2, 0.5, seed);
  const auto tooth = [](double x) {
    const double phase = x - std::floor(x);
    return phase < 0.78 ? phase / 0.78 : (1.0 - phase) / 0.22;
  };
  return [=](double s, double t) {
    // The overcut and the shallower upcut part each row into teeth.
    const double a = tooth(10.0 * t + 6.0 * s);
    const double b = tooth(9.0 * t - 8.0 * s);
    return std::min(a, 0.25 + 0.9 * b) + 0.04 * burr(s, t);
  };
}

Pattern ribs_pattern(std::uint64_t seed) {
  const TileOctaves matte(64, 64, 2, 0.6, seed);
  return [=](double s, double t) {
    return smooth_step((0.5 - from_whole(4.0 * s - 0.5) - 0.16) / 0.2) + 0.015 * matte(s, t);
  };
}

Pattern record_pattern(std::uint64_t seed) {
  const TileOctaves music(3, 1, 4, 0.75, seed);
  return [=](double s, double t) {
    // Neighbouring turns carry other music: it changes along t by whole grooves.
    const double groove = std::floor(16.0 * t);
    const double swing = 0.16 * music(s, (groove + 0.5) / 16.0) * 2.0;
    const double across = std::abs(16.0 * t - groove - 0.5 - swing);
    return std::min(0.0, (across - 0.27) / 0.27);
  };
}

Pattern braille_pattern(std::uint64_t seed) {
  // Dots of a cell as the bits 1 2 4 (left, from the top) 8 16 32 (right).
  constexpr std::array<std::uint8_t, 26> letters{1,  3,  9,  25, 17, 11, 27, 19, 10, 26, 5,  7,  13,
                                                 29, 21, 15, 31, 23, 14, 30, 37, 39, 58, 45, 61, 53};
  constexpr std::array<std::string_view, 6> lines{"asperity  ", "renders fi", "ne surface",
                                                  "detail to ", "the hand  ", "by touch  "};
  const TileOctaves paper(48, 48, 3, 0.5, seed);
  return [=](double s, double t) {
    // Ten cells 6 mm apart on six lines 10 mm apart; dots 2.5 mm apart, of 1.5 mm.
    const double x = 60.0 * (s - std::floor(s));
    const double y = 60.0 * (1.0 - (t - std::floor(t)));
    const auto column = std::min(static_cast<std::size_t>(x / 6.0), std::size_t{9});
    const auto line = std::min(static_cast<std::size_t>(y / 10.0), std::size_t{5});
    const char letter = lines[line][column];
    double height = 0.0;
    for (unsigned dot = 0; dot < 6 && letter != ' '; ++dot) {
      if ((letters[static_cast<std::size_t>(letter - 'a')] >> dot & 1U) == 0) continue;
      const double dx = x - 6.0 * static_cast<double>(column) - 1.75 - 2.5 * (dot / 3);
      const double dy = y - 10.0 * static_cast<double>(line) - 2.5 - 2.5 * (dot % 3);
      height = std::max(height, dome(std::hypot(dx, dy) / 0.75, 0.92));
    }
    return height + 0.02 * paper(s, t);
  };
}

Pattern studs_pattern(std::uint64_t seed) {
  const TileNoise gloss(6, 6, seed);
  return [=](double s, double t) {
    // Studs of 4.8 mm, 8 mm apart, their edges rounded by 0.2 mm.
    const double q = 8.0 * std::hypot(from_whole(5.0 * s - 0.5), from_whole(5.0 * t - 0.5));
    return smooth_step((2.5 - q) / 0.25) + 0.002 * gloss(s, t);
  };
}

constexpr std::array<PatternItem, 17> made{{
    {"cobblestones", 0.8, 25e-3, cobbles_pattern, "setts of 100 mm with rounded tops"},
    {"bricks", 0.9, 10e-3, bricks_pattern, "wall of bricks of 215 mm x 65 mm with joints of 10 mm"},
    {"roughcast", 80e-3, 4e-3, roughcast_pattern, "thrown plaster with grains of 2 to 6 mm"},
    {"tactile-paving", 0.4, 5e-3, paving_pattern, "blister paving: domes of 25 mm, 67 mm apart, 5 mm high"},
    {"sandpaper-p240", 1.3e-3, 45e-6, sandpaper_pattern, "abrasive paper P240, grains of 59 um"},
    {"sandpaper-p80", 4.5e-3, 0.16e-3, sandpaper_pattern, "abrasive paper P80, grains of 0.2 mm"},
    {"honeycomb", 37e-3, 1.5e-3, honeycomb_pattern, "wax cells of 5.3 mm with rounded walls"},
    {"knurled-metal", 7e-3, 0.4e-3, knurl_pattern, "diamond knurl at 30 degrees, pitch 1 mm, tips worn"},
    {"diamond-plate", 0.15, 1.8e-3, plate_pattern, "rolled tread plate, lozenges of 30 mm alternately turned"},
    {"hammered-copper", 50e-3, 0.5e-3, hammered_pattern, "sheet beaten with a round hammer, blows of 6 mm"},
    {"ball-milled-steel", 5e-3, 14e-6, milled_pattern, "passes of a ball-nosed cutter of 3 mm, 0.5 mm apart"},
    {"brushed-steel", 10e-3, 6e-6, brushed_pattern, "steel brushed to a satin finish along s"},
    {"file-teeth", 8e-3, 0.3e-3, file_pattern, "double-cut file, 15 teeth a centimetre"},
    {"ribbed-rubber", 12e-3, 1.2e-3, ribs_pattern, "rubber mat with round ribs, 3 mm apart, along t"},
    {"record-groove", 1.6e-3, 30e-6, record_pattern, "a record's grooves, 54 um wide, 100 um apart"},
    {"braille", 0.06, 0.5e-3, braille_pattern, "six lines of braille: dots of 1.5 mm, 2.5 mm apart, 0.5 mm high"},
    {"stud-plate", 40e-3, 1.7e-3, studs_pattern, "toy bricks' studs of 4.8 mm, 8 mm apart"},
}};

}  // namespace

std::span<const PatternItem> made_patterns() {
  return made;
}

}  // namespace asperity
