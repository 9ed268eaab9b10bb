#pragma once
// A point of a surface, as the surface names it.

#include <cstdint>

#include "asperity/core/math.h"

namespace asperity {

/// A place on one side of a surface: part of what a probe carries from tick to tick and of what a tick answers, never a
/// cache. The surface evaluates it (`SurfaceView::at`), and finds it again after it has moved. Which instance's it is,
/// its owner says.
struct Place {
  std::uint32_t element = no_index;  ///< face of a mesh or relief, patch, cell; no_index: nowhere
  bool back = false;                 ///< touched from the back
  /// Within the element: barycentric coordinates on meshes and reliefs, (u, v, 0) on parametric surfaces; elsewhere the
  /// point itself (m, object frame).
  Vec3 at = Vec3::Zero();
  [[nodiscard]] bool known() const noexcept { return element != no_index; }
  /// 1: touched from the front, -1: from the back. [servo]
  [[nodiscard]] double side() const noexcept { return back ? -1.0 : 1.0; }
};

}  // namespace asperity
