#pragma once
// The atlas of a closed relief: over faces what closing found, beside them the closed surface as it goes on.

#include <array>
#include <cstdint>
#include <vector>

#include "asperity/surface/relief/closing.h"
#include "asperity/surface/relief/detail/relief_samples.h"

namespace asperity {

/// Made when all faces are closed; faces may then be filled in any order.
class ClosedBorders {
 public:
  ClosedBorders(const ReliefSurface& surface, const ReliefSamples& samples, const CoatMoment& moment,
                const ClosedRelief& closed);
  /// Heights over and beside a face, and the rises beside it.
  void fill(std::uint32_t face, ClosedRelief& closed) const;

 private:
  /// Height at a texel of a face, which lies over it: raised as it was closed, or as it was.
  [[nodiscard]] double height(const ClosedRelief& closed, const AtlasTile& tile, std::uint32_t face, int i, int j,
                              bool raised) const noexcept;
  struct Slopes {
    double height = 0.0;
    double u = 0.0;
    double v = 0.0;
  };
  [[nodiscard]] Slopes slopes(const ClosedRelief& closed, std::uint32_t face, double u, double v,
                              bool raised) const noexcept;
  struct Beside {
    double height = 0.0;
    std::uint32_t face = no_index;  ///< whose prism holds the surface there
    ShellPlace place;
    ShellPrism prism;
  };
  [[nodiscard]] bool follow(const ClosedRelief& closed, const Vec3& origin, const Vec3& direction, bool raised,
                            Beside& beside) const;

  const ReliefSurface& surface_;
  const ReliefSamples& samples_;
  CoatMoment moment_;
  int texels_;
  double tolerance_;
  /// Texels that hold the surface as it goes on.
  struct BesideTexel {
    int i;
    int j;
    std::array<int, 2> nearest;  ///< over the triangle
    std::array<bool, 3> over;    ///< beyond the edge opposite to this corner
    bool anew;                   ///< no neighbour of the one before
  };
  std::vector<BesideTexel> beside_;
  /// Texels farther out: each takes after another one.
  struct Copy {
    int i;
    int j;
    std::array<int, 2> from;
  };
  std::vector<Copy> copies_;
};

}  // namespace asperity
