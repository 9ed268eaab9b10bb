#pragma once

#include "asperity/core/fixed_vector.h"
#include "asperity/core/math.h"
#include "asperity/core/names.h"

namespace asperity {

/// Which side of a sheet can be touched. `front` is the side the normals point to.
enum class Sides : std::uint8_t { both, front };
/// As in scene files.
template <>
struct Names<Sides> {
  static constexpr auto table = std::to_array<Named<Sides>>({{Sides::front, "front"}, {Sides::both, "both"}});
};

/// A place where a probe touches, or the place of a surface nearest to a point.
struct Foot {
  Vec3 point = Vec3::Zero();         ///< on the surface (m)
  Vec3 normal = Vec3::Zero();        ///< unit, from the surface towards the query point; the face's own inside a face
  double distance = infinity;        ///< from the query point (m), not negative
  std::uint32_t element = no_index;  ///< face, cell or patch; no_index: nothing there
  Vec3 at = Vec3::Zero();            ///< within `element`: as Place::at
  [[nodiscard]] bool found() const noexcept { return element != no_index; }
};

/// First touch of a moving ball (or point: radius 0).
struct SweptHit {
  bool hit = false;
  double t = 1.0;  ///< fraction of the motion at which it happens
  Foot contact;    ///< valid when hit
  /// Of smooth surfaces: 1 when they are met from the front, -1 from the back; `contact.normal` is on that side.
  double side = 1.0;
};

/// A point meets a smooth surface: `side` 1 from the front, -1 from the back. [servo]
inline SweptHit point_touch(double t, double side, const Vec3& point, const Vec3& front, std::uint32_t element,
                            const Vec3& at) noexcept {
  return {true, t, {point, side * front, 0.0, element, at}, side};
}

/// More planes than three are never active at once; the others are kept until the solve has chosen.
using ContactSet = FixedVector<Foot, 24>;

}  // namespace asperity
