#pragma once
// The control points of a relief over a small rectangle, which it keeps between. Private to field.

#include <algorithm>
#include <array>
#include <cstddef>

#include "asperity/field/height/map.h"

namespace asperity {

/// A rectangle on up to so many texels a side is bounded by control points of just its piece.
inline constexpr int most_texels = 6;

/// Control points along one axis, two more than texels: the reconstruction keeps between the least and the greatest.
/// Two are on the first texel, two on the last, one on each between, which is that texel's stored value; the two in the
/// middle of a single texel are one. This is where the outer four lie: at b + before (a - b) + after (c - b), where b
/// is the value of their texel and a, c are those of its neighbours.
struct EndControls {
  double before[4];
  double after[4];
  double at[4];  ///< where on the axis they stand (texels from their texel's centre): a linear height has them there
  [[nodiscard]] double point(int i, double a, double b, double c) const noexcept {
    return b + before[i] * (a - b) + after[i] * (c - b);
  }
};

/// The spline's blossom in a texel: linear in both u and v (texels from its centre), its height where they agree.
inline void place_blossom(EndControls& ends, int i, double u, double v) noexcept {
  ends.before[i] = 0.5 * (0.5 - u) * (0.5 - v);
  ends.after[i] = 0.5 * (0.5 + u) * (0.5 + v);
  ends.at[i] = 0.5 * (u + v);
}

inline void place_linear(EndControls& ends, int i, double u) noexcept {
  ends.before[i] = std::max(0.0, -u);
  ends.after[i] = std::max(0.0, u);
  ends.at[i] = u;
}

inline EndControls end_controls(const TexelSpan& span, Reconstruction reconstruction) noexcept {
  const double leaves_first = span.count == 1 ? span.to : 0.5;
  const double enters_last = span.count == 1 ? span.from : -0.5;
  EndControls ends;
  switch (reconstruction) {
    case Reconstruction::bicubic:  // has another number of control points: CubicControls
    case Reconstruction::quadratic_bspline:
      // From x to y, across the knots k1 ... kn between texels, the spline keeps within the polygon of its blossoms at
      // (x, x), (x, k1), (k1, k2), ... (kn, y), (y, y); those of two knots are its coefficients.
      place_blossom(ends, 0, span.from, span.from);
      place_blossom(ends, 1, span.from, leaves_first);
      place_blossom(ends, 2, enters_last, span.to);
      place_blossom(ends, 3, span.to, span.to);
      break;
    case Reconstruction::bilinear:
      // The ends, and the creases in between: texel centres.
      place_linear(ends, 0, span.from);
      place_linear(ends, 1, std::max(span.from, std::min(leaves_first, 0.0)));
      place_linear(ends, 2, std::min(span.to, std::max(enters_last, 0.0)));
      place_linear(ends, 3, span.to);
      break;
    case Reconstruction::nearest:
      for (int i = 0; i < 4; ++i) place_linear(ends, i, 0.0);
      break;
  }
  return ends;
}

/// Where texel `i` - 1 of a span is stored along its axis. The apron serves for the span's neighbours beyond the
/// border; a span that runs over it goes on at texel 0.
inline std::size_t place(const TexelSpan& span, std::size_t i, int texels) noexcept {
  const int at = span.first + static_cast<int>(i);
  return static_cast<std::size_t>(at <= texels + 1 ? at : at - texels);
}

/// The control points of one row from its stored values, in their place; the last is repeated up to the width.
template <std::size_t width>
void make_points(double (&row)[width], std::size_t last, const EndControls& ends) noexcept {
  const double* end = row + last - 2;
  const double points[4] = {ends.point(0, row[0], row[1], row[2]), ends.point(1, row[0], row[1], row[2]),
                            ends.point(2, end[0], end[1], end[2]), ends.point(3, end[0], end[1], end[2])};
  row[0] = points[0];
  row[1] = points[1];
  row[last - 1] = points[2];
  for (std::size_t x = last; x < width; ++x) row[x] = points[3];
}

/// The cubic spline's blossom between two knots, u, v and w from 0 to 1 on the way: linear in each of them, its height
/// where they agree. As weights of the coefficients of the knot before, both, and the one after.
inline std::array<double, 4> cubic_blossom(double u, double v, double w) noexcept {
  const double first[3][2] = {{1.0 - u, u + 2.0}, {2.0 - u, u + 1.0}, {3.0 - u, u}};
  const double second[2][2] = {{1.0 - v, v + 1.0}, {2.0 - v, v}};
  const double third[2] = {1.0 - w, w};
  std::array<double, 4> weights{};
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t j = 0; j < 2; ++j) {
      for (std::size_t i = 0; i < 2; ++i) weights[k + j + i] += third[k] * second[k][j] * first[k + j][i] / 6.0;
    }
  }
  return weights;
}

/// The control points of the bicubic surface along one axis of a span: four on each gap between texel centres that it
/// touches, of the part of the gap within it.
struct CubicControls {
  static constexpr int most_gaps = most_texels + 1;
  int gaps = 0;
  double at[4 * most_gaps];                      ///< where they stand (texels from the first one's centre)
  std::array<double, 4> weights[4 * most_gaps];  ///< of the four coefficients from that of the gap's own number on
  std::size_t place[most_gaps + 3];              ///< where those coefficients are stored

  CubicControls(const TexelSpan& span, int texels) noexcept {
    const int first = span.from < 0.0 ? span.first - 1 : span.first;
    const int last = std::max(first, span.first + span.count - (span.to > 0.0 ? 1 : 2));
    gaps = last - first + 1;
    for (int gap = 0; gap < gaps; ++gap) {
      const double from = gap > 0 ? 0.0 : span.first + span.from - first;
      const double to = gap + 1 < gaps ? 1.0 : span.first + span.count - 1 + span.to - last;
      weights[4 * gap] = cubic_blossom(from, from, from);
      weights[4 * gap + 1] = cubic_blossom(from, from, to);
      weights[4 * gap + 2] = cubic_blossom(from, to, to);
      weights[4 * gap + 3] = cubic_blossom(to, to, to);
      const double begin = first - span.first + gap;
      for (int k = 0; k < 4; ++k) at[4 * gap + k] = begin + from + (to - from) * k / 3.0;
    }
    // A span that runs over the border goes on at the other; the apron of two serves for its neighbours.
    for (int i = 0; i < gaps + 3; ++i) {
      const int at = first - 1 + i;
      place[i] = static_cast<std::size_t>((at <= texels + 1 ? at : at - texels) + 2);
    }
  }
};

}  // namespace asperity
