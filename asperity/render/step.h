#pragma once

#include <array>
#include <cstddef>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/samples.h"
#include "asperity/material/friction.h"
#include "asperity/render/energy_tank.h"
#include "asperity/render/scene.h"
#include "asperity/surface/surface.h"

namespace asperity {

/// What one probe remembers of an isosurface between ticks. The virtual contact point and the magnet keep in it the
/// contact point p_c (`point`), the direction they push (`normal`), the last probe (`previous`), the stiffness felt
/// (`value`; 0 in free space) and whether they pushed at the last tick (`crossed`).
struct IsoContact {
  std::uint64_t field = 0;       ///< identity of the field that the rest belongs to; 0: none yet
  double threshold = 0.0;        ///< felt now: on its way to the scene's own
  int level = 0;                 ///< of the field, felt at the last tick
  Vec3 point = Vec3::Zero();     ///< of the surface, while touching (object frame)
  Vec3 normal = Vec3::Zero();    ///< unit, on the side touched; cross-uncross: the gradient saved at the crossing
  Vec3 previous = Vec3::Zero();  ///< cross-uncross: the probe at the last tick (object frame)
  double value = 0.0;            ///< cross-uncross: the field there
  bool crossed = false;          ///< cross-uncross: the flag of the paper
  bool started = false;          ///< cross-uncross: `previous` and `value` are of a tick
};

/// What one probe remembers of a texture that it touches.
struct TextureState {
  bool held = false;           ///< the next three are of the last tick
  Vec3 force = Vec3::Zero();   ///< of the relief (N, object frame)
  double potential = 0.0;      ///< of the relief (J)
  double penetration = 0.0;    ///< to the relief (m); below 0 over a valley
  double book = 0.0;           ///< J: what it has taken beyond what its potential holds; below 0: given
  Vec3 across = Vec3::Zero();  ///< direction across the lay, where it was known last
};

/// A place on a mesh that goes along with it.
struct SurfaceAnchor {
  std::uint32_t face = no_index;
  /// On triangles: u, v and height are asked for when the surface has changed, and follow from the next three (object
  /// frame): the face's corners, the place and the proxy as they were.
  bool raw = false;
  std::array<Vec3, 3> corners = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  Vec3 point = Vec3::Zero();
  Vec3 proxy = Vec3::Zero();
  double u = 0.0;  ///< barycentric coordinates of the second and third corner
  double v = 0.0;
  double height = 0.0;  ///< of the proxy over the face (m)
};

/// What a law that a program has added remembers.
struct CustomLawState {
  std::uint64_t law = 0;  ///< that it belongs to; 0: none
  alignas(16) std::array<std::byte, 64> bytes{};
};

/// What one probe remembers of one instance between ticks.
struct ContactState {
  std::uint32_t instance = no_index;
  std::size_t law = std::variant_npos;  ///< that the rest belongs to: index in Law
  Hint hint;
  /// Force laws without a proxy: the probe has been seen outside, so that being inside now means having come in from
  /// the front. False at the start and after leaving over a rim.
  bool seen_outside = false;
  bool touching = false;  ///< pushed at the last tick; for the proxy on a relief: held by the surface at hint.relief
  bool sliding = false;   ///< proxy: friction was overcome at the last tick
  Vec3 turned = Vec3::Zero();  ///< consistent force shading: its lateral force of the last tick (N, world)
  /// What that has taken from the hand and not yet given back (J); laws of implicit surfaces: what may be spent where
  /// the local stiffness rises.
  double turn_budget = 0.0;
  Pose pose;                  ///< of the instance at this tick
  Pose pose_before;           ///< at the last one
  std::uint64_t lineage = 0;  ///< of the mesh whose face and corners `anchor` is of; 0: none
  SurfaceAnchor anchor;       ///< where it was touched at the last tick, to be found again when the surface has moved
  bool side_known = false;    ///< `outside` is of the last tick
  bool outside = false;       ///< of a surface that changes: the free probe was on the front of it
  double potential = 0.0;     ///< J: what a law without a proxy and the surface's attraction held at the last tick
  double share = 1.0;         ///< of their force that is rendered: less where a change was not paid for
  bool counted = false;       ///< `potential` is of the last tick
  bool in_touch = false;      ///< law that moves the proxy: it was held here at the last tick
  bool placed = false;        ///< `pose` is of the last tick
  bool moved = false;         ///< the instance has changed under the probe since the last tick
  bool noted = false;         ///< `lineage` and `side_known` are of this scene
  bool level_known = false;   ///< hint.moment's level is one that was felt
  bool moment_known = false;
  bool moment_changed = false;  ///< another state of the coat is felt than at the last tick
  double stiffness = 0.0;       ///< N/m: what a law without a proxy pushed with at the last tick
  double attraction = 0.0;      ///< J: potential of what draws the probe, at the last tick
  bool attraction_known = false;
  double debt = 0.0;       ///< J: what the surface's attraction owes; it rests until that is paid
  double side = 1.0;       ///< proxy on a relief: 1 when touched from the front, -1 from the back
  ReliefPoint point;       ///< proxy on a relief, while touching: the surface at hint.relief (object frame)
  IsoContact iso;          ///< on an isosurface
  FrictionState friction;  ///< of the friction law, where it is not within the proxy (object frame)
  TextureState texture;
  CustomLawState custom;
};

/// All that a probe carries from tick to tick. Copying it never allocates; assigning `ProxyState{}` resets it. One per
/// probe.
struct ProxyState {
  Vec3 proxy = Vec3::Zero();  ///< m, world; rests one skin above what it touches
  std::uint64_t epoch = 0;    ///< of the scene it belongs to; 0: no tick yet
  FixedVector<ContactState, 4> contacts;
  Vec3 previous_probe = Vec3::Zero();  ///< m, world, of the last tick
  /// Of the spring between probe and proxy: what a tick may hold at most, and what changes of the scene may spend.
  EnergyTank tank;
  double stiffness = 0.0;               ///< N/m of that spring as rendered at the last tick; 0: free
  Vec3 force = Vec3::Zero();            ///< N, scene: answered at the last tick
  Vec3 residual = Vec3::Zero();         ///< N, scene: what is left of the force before the last change of the scene
  Vec3 workspace_probe = Vec3::Zero();  ///< m: the probe at the last tick, before the view
  View view;                            ///< of the last tick
  bool sliding = false;                 ///< several surfaces at once: friction was overcome at the last tick
  /// Level at which volumes larger than memory are felt: -1, the finest that is in memory; 0 or more, this one, as a
  /// replay does after having it fetched.
  int wanted_level = -1;
};

/// Reads what the next tick may need of volumes larger than memory, at their finest level or at `state.wanted_level`,
/// and waits for it: for runs that are not in real time, and for replays. Errors: file_truncated. [main]
Status fetch_volumes(const Scene& scene, const ProxyState& state, const ProbeSample& probe);

/// One tick: the force that the hand should feel with the probe there (N, world).
///
/// Pure apart from `state`. Never allocates, locks, throws, logs or touches a file. `dt` is the time since the last
/// call; no law assumes a rate. A probe sample that is not finite answers no force and the flag input_not_finite, and
/// leaves the state as it was. [servo]
ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt) noexcept;

}  // namespace asperity
