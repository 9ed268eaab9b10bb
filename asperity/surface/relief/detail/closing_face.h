#pragma once
// Closing over one face: its texels from coarse to fine, most of them by bounds.

#include <array>
#include <cstdint>
#include <vector>

#include "asperity/core/fixed_vector.h"
#include "asperity/surface/relief/closing.h"
#include "asperity/surface/relief/detail/closing_ball.h"

namespace asperity {

/// What closing did over one face.
struct ClosedFace {
  std::uint32_t texels = 0;
  std::uint32_t changed = 0;    ///< that rose by more than the tolerance
  std::uint32_t unsettled = 0;  ///< over which no place of the ball was found
  double largest_rise = 0.0;    ///< m, of the changed
};

/// One thread's own; what it answers of a face does not depend on the faces before `start_anew`.
class FaceCloser {
 public:
  FaceCloser(const ReliefSurface& surface, const ReliefSamples& samples, const CoatMoment& moment, double radius,
             double tolerance);
  void start_anew() noexcept { solver_.start_anew(); }
  /// Finds by how much every texel over the face rises, into `closed.rise`.
  ClosedFace close(std::uint32_t face, ClosedRelief& closed);

 private:
  struct Texel {
    int i = 0;  ///< in texels
    int j = 0;
    ShellRay ray;
    double scale = 1.0;   ///< length of the ray's direction
    double lowest = 0.0;  ///< the relief's height (m)
  };
  /// What is known of the height over a texel (m): it is settled where both are one, and known where they are close.
  struct Known {
    double lower = 0.0;
    double upper = 0.0;
    std::uint32_t ball = no_index;  ///< that holds it at `upper`
  };
  [[nodiscard]] Texel texel_at(int i, int j) const;
  [[nodiscard]] bool at_rim(const Texel& texel) const;
  [[nodiscard]] Known& known(int i, int j) {
    return known_[static_cast<std::size_t>(i * (2 * texels_ + 3 - i) / 2 + j)];
  }
  /// Texels whose i and j are multiples of `stride`, and of no more than that.
  void close_texels(int stride, bool coarsest);
  /// Bounds by the texels on both sides of it, at i - di, j - dj and i + di, j + dj; whether they are close.
  bool bound(const Texel& texel, int di, int dj);
  void settle_texel(const Texel& texel, const Known* before);
  [[nodiscard]] Known settle(const Texel& texel, const Known* before, const RestingBall& own);
  /// Height at which the ray enters a ball; not a number where it does not, or where that is inside of the relief.
  [[nodiscard]] double entered(const RestingBall& ball, const Texel& texel) const;
  /// Whether what holds a ball holds it lowest there.
  [[nodiscard]] bool holds_lowest(const RestingBall& ball, const Vec3& place) const;
  [[nodiscard]] RestingBall own_ball(const Texel& texel) const;
  /// Ways off the relief where faces meet.
  struct Normals {
    FixedVector<Vec3, 24> directions;
    bool at_rim = false;
  };
  /// Normals of the relief over the faces that meet in a texel on an edge or a corner of this one, its own first; at a
  /// rim also what leads out over it.
  [[nodiscard]] Normals normals_around(const Texel& texel) const;
  void add_normals(std::uint32_t face, const double (&share)[3], Normals& normals) const;
  /// Whether a free ball rests on a texel where the relief may have a crease: on any normal between those around.
  /// Then `centre` is that ball's.
  bool rests_on_crease(const Texel& texel, Vec3& centre);
  /// Whether some contact of a ball lies in another one.
  [[nodiscard]] bool blocks(const RestingBall& ball, const Vec3& centre) const;
  std::uint32_t add(const RestingBall& ball);
  /// What is taken between the bounds: the relief's own where it may be that, else their middle.
  [[nodiscard]] double height_of(const Known& known, double lowest) const {
    return known.lower <= lowest && known.upper - lowest <= 0.8 * tolerance_ ? lowest
                                                                             : 0.5 * (known.lower + known.upper);
  }
  /// Offers each texel the balls of its neighbours, which are free too: a rest that was found need not be the lowest.
  void relax(bool forward);
  ClosedFace write(ClosedRelief& closed, const AtlasTile& tile);
  void mend(ClosedRelief& closed, const AtlasTile& tile) const;

  const ReliefSurface& surface_;
  const ReliefSamples& samples_;
  CoatMoment moment_;
  double radius_;
  double tolerance_;
  BallSolver solver_;
  std::uint32_t face_ = no_index;
  int texels_ = 0;
  int nodes_a_texel_ = 1;
  ShellPrism prism_{};
  std::vector<RestingBall> balls_;
  std::vector<Known> known_;
  std::vector<std::array<int, 2>> unsettled_;
};

}  // namespace asperity
