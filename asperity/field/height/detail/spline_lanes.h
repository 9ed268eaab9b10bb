#pragma once
// The quadratic spline of a map at several places at once, and all that one place has in one go, by AVX2 where the
// processor has it. To the bit what HeightMap's own functions answer, which are the oracle. Private to field.

#include "asperity/core/lanes.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// A map of the quadratic spline as it is stored, in an apron of one texel and with one float to spare behind.
struct SplineTexels {
  const float* values = nullptr;
  int width = 0;  ///< texels
  int height = 0;
  Wrap wrap = Wrap::repeat;
  double base = 0.0;  ///< m, on top of the values
};

/// Heights at four places. False where the processor cannot, or a coordinate is not within 2^31: nothing is answered
/// then. [servo]
bool wide_spline_heights(const SplineTexels& texels, const Lanes& s, const Lanes& t, Lanes& heights) noexcept;
/// Height and derivatives at one place, but for what is 0 outside a clamped map. False likewise. [servo]
bool wide_spline_curvature(const SplineTexels& texels, const Vec2& st, HeightCurvature& curvature) noexcept;

}  // namespace asperity
