#pragma once
// What a surface is made of at one place, and what it does beside pushing.

#include "asperity/render/felt.h"

namespace asperity {

/// What an implicit surface is made of at p (object frame): stored there, or the instance's own. [servo]
Material material_at(const ImplicitSurface& surface, const Material& own, const Vec3& p, SparseHint& hint) noexcept;
/// Whether what an instance is made of may differ from place to place. [servo]
bool has_local_material(const Instance& instance) noexcept;
/// What it is made of at a place of its surface: `rests`, where that is known, or else the one nearest to p (object
/// frame), with its coat as it is at a moment. [servo]
Material local_material(const Instance& instance, const Place& rests, const Vec3& p, const CoatMoment& moment,
                        SurfaceCache& cache) noexcept;
/// The same where a tick touches it. [servo]
inline Material local_material(const Touched& touch, const Vec3& p) noexcept {
  return local_material(*touch.instance, touch.resting_place(), p, touch.moment, *touch.cache);
}

/// Holds what an instance is made of where that differs from place to place.
using MaterialRoom = FixedVector<Material, 1>;
/// The same, without a copy where it is made of one thing. [servo]
inline const Material& material_there(const Touched& touch, const Vec3& place, MaterialRoom& room) noexcept {
  if (!touch.facts->varies) return touch.instance->material;
  room.clear();
  return *room.emplace_back() = local_material(touch, place);
}

/// A place on a coated mesh.
struct CoatPlace {
  bool found = false;
  ReliefFrame frame;
  double u = 0.0;
  double v = 0.0;
};
/// `rests`, where that is known, or else the place over the base's point nearest to p (object frame). [servo]
CoatPlace coat_place(const ReliefView& view, const Place& rests, const Vec3& p) noexcept;
/// Direction of least friction there, unit, in the face's plane (zero where there is none), and how strong it is.
/// [servo]
Vec3 mapped_lay(const ReliefSurface& relief, const CoatPlace& place, double& strength) noexcept;

/// How a surface draws the probe from outside.
struct Attraction {
  Vec3 force = Vec3::Zero();  ///< N, object frame
  double potential = 0.0;     ///< J, 0 out of reach and negative nearer
  double stiffness = 0.0;     ///< N/m, the most by which it changes with a motion
  bool felt = false;          ///< in reach
};
/// Of a coated mesh at p (object frame): the slope of -m e^2 / 6 (1 - (Phi / e)^2)^3 with m the magnetism there, e its
/// band and Phi the relief's height below p; constant in Phi inside. A loop in it does no work. [servo]
Attraction attraction_at(const Touched& touch, const Vec3& p) noexcept;
/// How far from the surface it is felt (m, hand); 0: none. [any]
double attraction_reach(const Instance& instance) noexcept;

}  // namespace asperity
