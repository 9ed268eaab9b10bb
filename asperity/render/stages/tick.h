#pragma once
// One tick, from stage to stage: everything that a stage finds out is here for the next, and for a debugger.

#include "asperity/render/felt.h"
#include "asperity/render/scene.h"
#include "asperity/render/state.h"

namespace asperity {

/// What one touched instance answers, world frame.
struct Part {
  Touched* touch = nullptr;
  LawForce law;
  double stiffness = 0.0;  ///< N/m, where it is touched
};

/// One tick. [servo]
struct Tick {
  Tick(const Scene& in, ProxyState& of, ProxyCache& with, const ProbeSample& told, Seconds since,
       ForceSample& answered) noexcept
      : scene(in), state(of), cache(with), workspace(told), dt(since), out(answered) {}

  /// How far the probe is told to go until the next tick (m, in the scene).
  [[nodiscard]] Vec3 ahead() const noexcept { return dt.count() * probe->twist.linear; }

  const Scene& scene;
  ProxyState& state;
  ProxyCache& cache;
  const ProbeSample& workspace;  ///< the probe as the device tells it
  Seconds dt;

  // sample
  const ProbeSample* probe = &workspace;  ///< in the scene
  FixedVector<ProbeSample, 1> in_scene;   ///< that, where the scene is not the workspace
  bool direct = true;                     ///< the scene is the workspace
  bool first = false;                     ///< of the state
  bool changed = false;                   ///< another scene than at the last tick

  // reach
  FixedVector<Touched, most_contacts> touches;
  FixedVector<Pose, most_contacts> earlier;  ///< of the last tick, of instances that may have moved since
  int level = 0;                             ///< of volumes

  // carry
  bool surfaces_moved = false;  ///< a surface has moved and may have come into the proxy

  // constrain
  FixedVector<Part, most_contacts> parts;
  Vec3 felt = Vec3::Zero();  ///< the proxy to be shown: without skins
  bool converged = true;
  bool open = false;     ///< the budget was spent before the proxy was at rest
  bool limited = false;  ///< less was rendered than there would have been, for want of energy

  // add
  ForceSample& out;
  double strongest = -1.0;  ///< N, of the contacts so far
};

/// Forgets one of a probe's contacts, and keeps what the hand has put into it. [servo]
inline void let_go(ProxyState& state, std::size_t contact) noexcept {
  Contact& gone = state.contacts[contact];
  for (HeldForce* held : {&gone.push, &gone.drag, &gone.draw}) state.account.release(*held);
  state.contacts.swap_remove(contact);
}
/// Whether a sample is a place at all. [servo]
inline bool is_place(const ProbeSample& probe) noexcept {
  // No device is a thousand kilometres away: such a number is as broken as a NaN, and would leave the searches' range.
  constexpr double farthest = 1e6;
  if (!(probe.pose.position.squaredNorm() < farthest * farthest)) return false;
  // 0 times a number is 0; times an infinity or no number it is none.
  return 0.0 * (probe.pose.orientation.coeffs().sum() + probe.twist.linear.sum() + probe.twist.angular.sum() +
                probe.time.count()) ==
         0.0;
}
/// Takes the probe into the scene and the state into the scene's snapshot. False where the sample is no place. [servo]
bool sample(Tick& tick) noexcept;
/// Finds the instances that the tick's motion can reach. [servo]
void reach(Tick& tick) noexcept;
/// Tells where they are now and what is felt of them, and takes the proxy along with what has moved. [servo]
void carry(Tick& tick) noexcept;
/// Leads the proxy to where they stop it: the laws that move the proxy. [servo]
void constrain(Tick& tick) noexcept;
/// Sums up: the proxy's force with friction and texture, the laws without a proxy, attraction, field effects. [servo]
void add(Tick& tick) noexcept;
/// On which side of the surfaces that may move the probe is, for the next `carry`. [servo]
void remember_sides(Tick& tick) noexcept;
/// Hands the force over from the last scene's, tells what is to be told, and remembers. [servo]
void answer(Tick& tick) noexcept;

}  // namespace asperity
