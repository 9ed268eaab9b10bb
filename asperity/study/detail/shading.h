#pragma once
// Light on what rays met. Private to study.

#include <array>
#include <span>
#include <vector>

#include "asperity/study/detail/ray_cast.h"

namespace asperity {

using Colour = std::array<float, 3>;  ///< sRGB, 0 to 1

/// Colours with their depths (m; infinity where nothing is), row by row.
struct Shaded {
  int width = 0;
  int height = 0;
  std::vector<Colour> colours;
  std::vector<float> depths;
};

/// Matte light material under a low key light, a sky and a little occlusion in hollows, on a near-white ground.
/// `up` is the touched side's direction. Pixels in `edges` show the mean of their quarters. [main]
Shaded shade(const PixelGrid& grid, std::span<const EdgePixel> edges, const Camera& camera, const Vec3& up);

}  // namespace asperity
