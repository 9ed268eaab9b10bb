#pragma once

#include <cstdint>

#include "asperity/core/math.h"
#include "asperity/geometry/contact.h"
#include "asperity/geometry/simd_kernels.h"

namespace asperity {

/// The part of a search structure around the last query, with a certificate: every leaf that comes nearer than
/// `certified` to `centre` is listed. A later query whose ball lies inside that ball is answered from the list alone,
/// exactly. Beside it, the contacts at the last resting place, so that the next tick starts from them without a search.
///
/// It is a cache in the caller's hands, copyable and disposable: an empty patch, or one of another mesh
/// (`owner` differs), is never read, only refilled. [servo]
struct TrianglePatch {
  static constexpr std::uint32_t capacity = 64;

  std::uint64_t owner = 0;             ///< identity of the index that filled it; 0: nothing
  Vec3 centre = Vec3::Zero();          ///< m
  double certified = -1.0;             ///< m
  std::uint32_t count = 0;             ///< leaves
  std::uint32_t last_face = no_index;  ///< that was nearest last time: its distance bounds the next search

  bool rested = false;  ///< whether the following four are valid
  Sides rest_sides = Sides::both;
  double rest_radius = 0.0;           ///< m, without skin
  Vec3 rest_position = Vec3::Zero();  ///< m
  FixedVector<Foot, 4> rest_contacts;

  /// Of a ball that rests on one face: what else it may come to touch while it slides along that.
  struct Beside {
    struct One {
      std::uint32_t face = no_index;
      double distance = 0.0;  ///< from `centre`, at least (m)
    };
    std::uint32_t face = no_index;
    double radius = 0.0;         ///< m, without skin
    Vec3 normal = Vec3::Zero();  ///< of the face, on the ball's side
    Vec3 centre = Vec3::Zero();  ///< m: where the ball was
    double clear = -infinity;    ///< from there, at least, to what is neither listed nor below the face's plane (m)
    FixedVector<One, 8> listed;
  } beside;

  // Left uninitialised: only `count` entries are ever read. All in the structure's own units.
  float nearest[capacity / 8];  ///< per block of eight leaves: least distance to `centre`, ascending
  std::uint32_t leaf[capacity];
  CylindersOf8 bounds[capacity / 8];

  TrianglePatch() noexcept {}  // NOLINT: see above

  /// Whether everything that touches the ball (position, radius) is listed. [servo]
  [[nodiscard]] bool covers(std::uint64_t index, const Vec3& position, double radius) const noexcept {
    return owner == index && (position - centre).norm() + radius < certified;
  }
};

}  // namespace asperity
