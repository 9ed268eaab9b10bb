#pragma once
// The texture that a surface is felt with, for those who draw or judge it.

#include "asperity/render/instance.h"

namespace asperity {

/// A texture as it is at a place of its surface.
struct TextureShape {
  double height = 0.0;           ///< m, over the smooth surface; crests at 0 in the consistent form
  Vec3 gradient = Vec3::Zero();  ///< along the surface (m/m)
};
/// The texture at a point of the instance's surface, object frame; nothing where there is none. `place`: as the
/// surface names it. Wavelengths below four times `resolution` (m) are
/// faded. [any]
TextureShape texture_at(const Instance& instance, const Place& place, const Vec3& point, const Vec3& normal,
                        double resolution) noexcept;

}  // namespace asperity
