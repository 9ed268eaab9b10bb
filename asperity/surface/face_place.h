#pragma once

namespace asperity {

/// A place on one face: `Frame` holds what evaluating the surface over it needs, and its number as `face`.
template <class Frame>
struct FacePlace {
  Frame frame;
  double u = 0.0;  ///< barycentric coordinates of the second and third corner
  double v = 0.0;
  [[nodiscard]] double coordinate(int k) const noexcept { return k == 0 ? 1.0 - u - v : (k == 1 ? u : v); }
};

}  // namespace asperity
