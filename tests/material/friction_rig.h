#pragma once
// What the friction tests drive the laws with.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "asperity/material/friction.h"

namespace asperity {

inline const std::vector<FrictionKind>& all_friction_kinds() {
  static const std::vector<FrictionKind> kinds{FrictionKind::implicit_coulomb,
                                               FrictionKind::viscous,
                                               FrictionKind::coulomb,
                                               FrictionKind::karnopp,
                                               FrictionKind::dahl,
                                               FrictionKind::hayward_armstrong,
                                               FrictionKind::lugre};
  return kinds;
}

inline bool has_spring(FrictionKind kind) {
  return kind != FrictionKind::viscous && kind != FrictionKind::coulomb;
}

inline FrictionLaw law_of(FrictionKind kind, Formulation formulation = Formulation::consistent) {
  FrictionLaw law;
  law.kind = kind;
  law.formulation = formulation;
  return law;
}

/// One contact that is moved over a plane, tick by tick.
struct FrictionRig {
  FrictionLaw law;
  FrictionContact contact;
  FrictionState state;

  /// Puts the probe down: the first tick.
  FrictionRig& put_down() {
    contact.motion.setZero();
    contact.velocity.setZero();
    friction_force(law, contact, state);
    return *this;
  }
  /// Moves by `motion` within one tick, at the speed that this is.
  Vec3 move(const Vec3& motion) {
    contact.motion = motion;
    contact.velocity = motion / contact.dt.count();
    return friction_force(law, contact, state);
  }
  /// Moves at a velocity for a while; the last force.
  Vec3 drag(const Vec3& velocity, double duration) {
    Vec3 force = Vec3::Zero();
    const int ticks = static_cast<int>(std::lround(duration / contact.dt.count()));
    for (int tick = 0; tick < ticks; ++tick) force = move(velocity * contact.dt.count());
    return force;
  }
  [[nodiscard]] double energy() const { return friction_energy(state); }
};

/// A plane in z = 0, 0.6 N of push.
inline FrictionRig rig_of(const FrictionLaw& law, double still, double sliding) {
  FrictionRig rig;
  rig.law = law;
  rig.contact.push = 0.6;
  rig.contact.coefficients.still = still;
  rig.contact.coefficients.sliding = sliding;
  return rig.put_down();
}

}  // namespace asperity
