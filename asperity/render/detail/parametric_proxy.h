#pragma once
// The proxy law on one parametric surface touched by a point. Private to render.

#include "asperity/render/detail/proxy.h"
#include "asperity/surface/parametric_surface.h"

namespace asperity {

/// One tick on one parametric surface, object frame: from the state's place, or from `from` through free space, towards
/// `probe`. While touching, the state's hint.parametric is the place, iso.point and iso.normal the point and the normal
/// on the side touched, and `at_rest` is the surface there. [servo]
ProxyRest solve_on_parametric(const ParametricSurface& surface, Sides sides, const Friction& friction, const Vec3& from,
                              const Vec3& probe, ContactState& state, ParametricJet& at_rest) noexcept;

}  // namespace asperity
