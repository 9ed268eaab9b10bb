#pragma once
// Where a ball rests on the samples of a relief while it holds a point as low as it can: for closing.

#include <cstdint>

#include "asperity/core/fixed_vector.h"
#include "asperity/surface/relief/detail/halfspaces.h"
#include "asperity/surface/relief/detail/relief_samples.h"

namespace asperity {

/// A line over a place of the base.
struct ShellRay {
  Vec3 origin;
  Vec3 direction;
  [[nodiscard]] Vec3 at(double height) const { return origin + height * direction; }
};

/// A relief around a node of its samples, to second order in steps of the grid: through the node and the six around it.
struct ReliefPatch {
  std::uint32_t face = no_index;
  int i = 0;
  int j = 0;
  int cuts = 0;
  Vec3 point;  ///< m, and its changes a step
  Vec3 along_i;
  Vec3 along_j;
  Vec3 second_ii;
  Vec3 second_ij;
  Vec3 second_jj;

  /// Around the node that is nearest to (i, j) of those with six around them.
  ReliefPatch(const ReliefSamples& samples, const ShellPrism& prism, std::uint32_t face, int i, int j);
  [[nodiscard]] Vec3 at(double a, double b) const {
    return point + a * (along_i + 0.5 * a * second_ii + b * second_ij) + b * (along_j + 0.5 * b * second_jj);
  }
  [[nodiscard]] Vec3 tangent_i(double a, double b) const { return along_i + a * second_ii + b * second_ij; }
  [[nodiscard]] Vec3 tangent_j(double a, double b) const { return along_j + a * second_ij + b * second_jj; }
  /// Unit, outward.
  [[nodiscard]] Vec3 normal(double a, double b) const { return tangent_i(a, b).cross(tangent_j(a, b)).normalized(); }
};

/// A node of the samples, and whether it stands for itself alone rather than for the surface around it.
struct ContactNode {
  std::uint32_t face = no_index;
  int i = 0;
  int j = 0;
  bool alone = false;
};

/// Where a ball touches the surface.
struct BallContact {
  ShellPrism prism;
  ReliefPatch patch;
  bool alone = false;
  bool at_edge = false;  ///< held by an edge of the face
  double a = 0.0;        ///< steps from the patch's node
  double b = 0.0;
  Vec3 edge = Vec3::Zero();  ///< unit, along that edge
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  ///< unit, towards the ball's centre from outside
  double distance = 0.0;       ///< signed, of the centre (m)

  BallContact(const ReliefSamples& samples, const ContactNode& node);
  [[nodiscard]] ContactNode node() const {
    return {patch.face, patch.i + static_cast<int>(std::lround(a)), patch.j + static_cast<int>(std::lround(b)), alone};
  }
};
using BallContacts = FixedVector<BallContact, 8>;

/// A ball that lies wholly outside, and what it rests on.
struct RestingBall {
  Vec3 centre = Vec3::Zero();
  int count = 0;  ///< contacts that hold it, at most three
  ContactNode node[3];
  Vec3 point[3];
  Mat3 cone = Mat3::Zero();  ///< with three: from an offset from the centre to its shares of theirs
};

/// Rests balls of one radius. One thread's own; faces are begun with start_anew for answers that do not depend on what
/// went before.
class BallSolver {
 public:
  BallSolver(const ReliefSurface& surface, const ReliefSamples& samples, const CoatMoment& moment, double radius);

  void start_anew() noexcept { near_.start_anew(); }
  /// Whether nothing is in a ball, to within `share` of the radius.
  [[nodiscard]] bool is_free(const Vec3& centre, double share);
  /// Lowest height over the ray, at or above `lowest`, at which a free ball holds the point, starting with a ball at
  /// `start.centre` on its contacts. That ball in `rest`. Not a number where none was found.
  [[nodiscard]] double settle(const ShellRay& ray, double lowest, const RestingBall& start, RestingBall& rest);
  /// The same from a ball that is let down the ray until it touches.
  [[nodiscard]] double settle_from_above(const ShellRay& ray, double lowest, RestingBall& rest);
  /// Whether the way up the ray leads through the surface, or `to` is no number: then the ball is on another side.
  [[nodiscard]] bool beyond_wall(const ShellRay& ray, double from, double to) const;

 private:
  /// Moves a contact to the surface's point that is nearest to the centre, as far as its face leads there.
  void follow(BallContact& contact, const Vec3& centre) const;
  void measure(BallContact& contact, const Vec3& centre) const;
  [[nodiscard]] bool at_rim(const BallContact& contact) const;
  /// Of a contact's surface, as a ball's centre sees it moving along `way`: curvature times radius.
  [[nodiscard]] double bend(const BallContact& contact, const Vec3& way) const;
  enum class Found { nothing, known, added };
  Found add_deepest(const Vec3& centre, bool at_rest);
  void prune();
  struct Move {
    Vec3 by = Vec3::Zero();
    bool known = false;        ///< false: the contacts leave no place
    bool rolls = false;        ///< off a ridge, or farther than steps are trusted
    double rest_of_way = 0.0;  ///< length of what is left to go but along a way that gains nearly nothing (m)
    NearestInHalfSpaces rest;
  };
  [[nodiscard]] Move move_from(const Vec3& centre, const Vec3& held) const;
  void keep(const Vec3& centre, const NearestInHalfSpaces& rest, RestingBall& ball) const;

  const ReliefSurface& surface_;
  const ReliefSamples& samples_;
  CoatMoment moment_;
  double radius_;
  NearSamples near_;
  BallContacts contacts_;
};

}  // namespace asperity
