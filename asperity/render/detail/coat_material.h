#pragma once
// What the maps on a coat make of its material, and what a surface does beside pushing. Private to render.

#include "asperity/render/scene.h"
#include "asperity/surface/surface.h"

namespace asperity {

/// A place on a coated mesh.
struct CoatPlace {
  bool found = false;
  ReliefFrame frame;
  double u = 0.0;
  double v = 0.0;
};
/// The place that the proxy of the law proxy rests on, if the hint holds it, or else the one over the base's point
/// nearest to p (object frame). [servo]
CoatPlace coat_place(const Instance& instance, const ReliefSurface& relief, const Vec3& p, Hint& hint) noexcept;
/// The instance's material with what the maps say there. [servo]
Material mapped_material(const Instance& instance, const ReliefSurface& relief, const CoatPlace& place) noexcept;
/// Direction of least friction there, unit, in the face's plane (zero where there is none), and how strong it is.
/// [servo]
Vec3 mapped_lay(const ReliefSurface& relief, const CoatPlace& place, double& strength) noexcept;

/// How a surface draws the probe from outside.
struct Attraction {
  Vec3 force = Vec3::Zero();  ///< N, object frame
  double potential = 0.0;     ///< J, 0 out of reach and negative nearer
};
/// Of a coated mesh at p (object frame): the slope of -m e^2 / 6 (1 - (Phi / e)^2)^3 with m the magnetism there, e its
/// band and Phi the relief's height below p; constant in Phi inside. A loop in it does no work. [servo]
Attraction attraction_at(const Instance& instance, const Vec3& p, Hint& hint) noexcept;
/// How far from the surface it is felt (m, hand); 0: none. [any]
double attraction_reach(const Instance& instance) noexcept;

}  // namespace asperity
