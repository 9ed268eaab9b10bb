#pragma once
// The one book of what the hand has put in and may get back (docs/methods/energy.md).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "asperity/core/math.h"
#include "asperity/core/names.h"

namespace asperity {

/// Why a force would give the hand more than the hand has put into it.
enum class Giver : std::uint8_t {
  spring,      ///< the contact itself: an edge where two slopes meet, a solve that did not settle
  stiffness,   ///< a stiffer place
  motion,      ///< a surface that moves or deforms
  change,      ///< another scene
  level,       ///< another level or threshold of a volume
  friction,    ///< beside what its spring holds
  shading,     ///< lateral force of force shading
  attraction,  ///< of a magnet, from outside
  effect,      ///< of a field without a surface
  custom,      ///< a program's own law
  handover,    ///< of the force before a change
  count
};
/// As in reports.
template <>
struct Names<Giver> {
  static constexpr auto table = std::to_array<Named<Giver>>({{Giver::spring, "spring"},
                                                             {Giver::stiffness, "stiffness"},
                                                             {Giver::motion, "motion"},
                                                             {Giver::change, "change"},
                                                             {Giver::level, "level"},
                                                             {Giver::friction, "friction"},
                                                             {Giver::shading, "shading"},
                                                             {Giver::attraction, "attraction"},
                                                             {Giver::effect, "effect"},
                                                             {Giver::custom, "custom"},
                                                             {Giver::handover, "handover"}});
};

/// A force as it was rendered, and by how much it changes with a motion: frozen, it is a spring.
struct HeldForce {
  Vec3 force = Vec3::Zero();  ///< N, world
  double energy = 0.0;        ///< J, that it may give back
  float stiffness = 0.0F;     ///< N/m; 0: free until now
  bool softened = false;      ///< something else was rendered than there would have been
};

/// The part of a law's force that is held now.
struct Spring {
  Vec3 force = Vec3::Zero();  ///< N, world
  double stiffness = 0.0;     ///< N/m, above 0: the most by which it changes with a motion
  /// J, the energy whose slope it is, 0 where it ends: below 0 in a well. Not told: that of a spring that draws so
  /// hard.
  std::optional<double> stored = std::nullopt;
  bool keeps = false;  ///< no energy's slope: it holds whatever is put into it
  /// J, that so strong a spring holds. [servo]
  [[nodiscard]] double least() const noexcept { return force.squaredNorm() / (2.0 * stiffness); }
};

/// Energy that the hand has put in beyond what the forces hold, and that they may give back. At no tick has the hand
/// got more than it put in: every force that is held asks `hold`, every other one `spend`; what cannot be paid is not
/// rendered. (Formulation D6, amendment 6; the proof is in docs/methods/energy.md.)
class EnergyAccount {
 public:
  /// J: what a spring of 1 N/mm holds when it is stretched by about 3 mm. A limit only on what may come back later
  /// through something else than it was put in by: a force returns what it holds in any case.
  static constexpr double default_capacity = 5e-3;

  /// What one giver has asked for and been paid (J) since the start.
  struct Flow {
    double asked = 0.0;
    double paid = 0.0;
  };

  [[nodiscard]] double level() const noexcept { return level_; }  ///< J; below 0: owed
  [[nodiscard]] const Flow& flow(Giver giver) const noexcept { return flows_[static_cast<std::size_t>(giver)]; }
  /// By how much the forces of the last tick have changed per metre of the hand's motion, or may have (N/m).
  [[nodiscard]] double stiffness() const noexcept { return stiffness_; }

  /// By the hand, since the last tick (m, world).
  [[nodiscard]] const Vec3& moved() const noexcept { return moved_; }

  /// Begins a tick: books what the forces that nothing holds have done since the last one. `capacity`: J. At the
  /// first one what is held is nobody's gift: the hand begins with it. [servo]
  void open(const Vec3& moved, double capacity, bool first) noexcept {
    if (has_loose_) {
      level_ -= loose_.dot(moved) - advanced_;
      loose_ = Vec3::Zero();
      advanced_ = 0.0;
      has_loose_ = false;
    }
    stiffness_ = 0.0;
    first_ = first;
    moved_ = moved;
    capacity_ = capacity;
    level_ = std::min(level_, capacity_);
  }
  /// What is kept from the last tick, in another scene's axes and scale. [servo]
  template <class Turn>
  void turn(const Turn& turned) noexcept {
    loose_ = turned(loose_);
  }
  /// Takes in energy (J); what exceeds the capacity is lost. [servo]
  void fill(double energy) noexcept { level_ = std::max(level_, std::min(capacity_, level_ + std::max(0.0, energy))); }
  /// The share that may be rendered of a force that is held: as much as the frozen force holds after the hand's motion,
  /// and as the account pays. Remembers what is rendered. [servo]
  [[gnu::always_inline]] double hold(Giver giver, HeldForce& held, const Spring& spring) noexcept {
    // What the hand has really put in, and what the force, held still over the tick, gave too much or took too little
    // of it.
    const double put_in = held.energy - held.force.dot(moved_);
    const double stiffness = held.stiffness > 0.0F ? static_cast<double>(held.stiffness) : spring.stiffness;
    double now = spring.stored ? *spring.stored : spring.least();
    if (spring.keeps) now = std::max(now, put_in);
    const bool covered = now <= put_in || now <= put_in + 0.5 * stiffness * moved_.squaredNorm();
    if (!covered || held.softened || giver == Giver::stiffness) return hold_less(giver, held, spring, put_in, now);
    stiffness_ += stiffness;
    fill(put_in - now);
    held = {spring.force, now, static_cast<float>(spring.stiffness), false};
    return 1.0;
  }
  /// What was held is let go: what the hand has put into it may come back later. [servo]
  void release(HeldForce& held) noexcept {
    if (!(held.stiffness > 0.0F)) return;
    const auto stiffness = static_cast<double>(held.stiffness);
    const double put_in = held.energy - held.force.dot(moved_);
    fill(put_in);
    // Out of a well: what is missing to its edge.
    level_ += std::min(0.0, put_in + 0.5 * stiffness * moved_.squaredNorm());
    stiffness_ += stiffness;
    held = {};
  }
  /// The share that may be rendered of a force that nothing holds, over the tick that comes: against the hand all of
  /// it, along with it as much as the account pays in advance. `ahead`: how far the hand is told to go (m); where that
  /// is not known the last motion stands for it. [servo]
  double spend(Giver giver, const Vec3& force, const Vec3& ahead) noexcept {
    constexpr double changeover = 0.1;  // cosine between force and motion over which taking turns into giving
    constexpr double plenty = 1e-6;     // J: below that it fades
    const Vec3& way = ahead.isZero(0.0) ? moved_ : ahead;
    const double given = force.dot(way);
    const double most = force.norm() * way.norm();
    double share = 1.0;
    if (most > 0.0 && given > -changeover * most) {
      // Gone where it would begin to give: continuous, and never a loan.
      const double along = std::min(1.0, 1.0 + given / (changeover * most));
      const double giving = along * along * (3.0 - 2.0 * along);
      const double can = std::clamp(level_ / std::max(given, plenty), 0.0, 1.0);
      share = 1.0 + giving * (can - 1.0);
      const double paid = share * std::max(0.0, given);
      Flow& flow = flows_[static_cast<std::size_t>(giver)];
      flow.asked += std::max(0.0, given);
      flow.paid += paid;
      level_ -= paid;
      advanced_ += paid;
    }
    take(share * force);
    return share;
  }
  /// The same for a force of which nobody knows whether it takes: wherever a hand goes that moves by at most `way` (m).
  /// [servo]
  double spend_anywhere(Giver giver, const Vec3& force, double way) noexcept {
    const double given = force.norm() * way;
    if (!(given > 0.0)) return 1.0;
    const double share = std::min(1.0, std::max(0.0, level_) / given);
    Flow& flow = flows_[static_cast<std::size_t>(giver)];
    flow.asked += given;
    flow.paid += share * given;
    level_ -= share * given;
    advanced_ += share * given;
    take(share * force);
    return share;
  }
  /// Calls each(member) for everything that it remembers, in one order: for images of it. [any]
  template <class Account, class Each>
  static void each_member(Account& account, const Each& each) {
    auto& [level, capacity, first, has_loose, moved, loose, advanced, stiffness, flows] = account;
    each(level);
    each(capacity);
    each(first);
    each(has_loose);
    each(moved);
    each(loose);
    each(advanced);
    each(stiffness);
    for (auto& [asked, paid] : flows) {
      each(asked);
      each(paid);
    }
  }
  /// A force that only ever takes: nothing is asked of it. [servo]
  void take(const Vec3& force) noexcept {
    loose_ += force;
    has_loose_ = true;
  }

 private:
  /// Pays up to `energy` (J) and answers how much it paid. [servo]
  double pay(Giver giver, double energy) noexcept {
    const double wanted = std::max(0.0, energy);
    const double paid = std::min(wanted, std::max(0.0, level_));
    Flow& flow = flows_[static_cast<std::size_t>(giver)];
    flow.asked += wanted;
    flow.paid += paid;
    level_ -= paid;
    return paid;
  }
  /// What is left of `hold` where it is not plain that all of the force may be rendered.
  [[gnu::noinline]] double hold_less(Giver giver, HeldForce& held, const Spring& spring, double put_in,
                                     double now) noexcept {
    // Of sums of products: a spring that is held at rest is not to be softened by its last digit.
    constexpr double rounding = 1e-9;
    const auto before = static_cast<double>(held.stiffness);
    double stiffness = before > 0.0 ? before : spring.stiffness;
    const double way = moved_.squaredNorm();
    double lag = 0.5 * stiffness * way;
    if (giver == Giver::spring && !held.softened) {
      // By as much as it has changed over the hand's motion, which alone has changed it. Twice: all of it may be at the
      // beginning, where two slopes meet.
      constexpr double third_order = 0.1;
      const double seen = way > 0.0 ? std::sqrt((spring.force - held.force).squaredNorm() / way) : 0.0;
      stiffness = std::max(stiffness, 2.0 * seen) + third_order * stiffness;
      lag = 0.5 * stiffness * way;
    } else if (giver == Giver::stiffness || held.softened) {
      // Of what goes on as stiff as it was: the rest is the place's, not the motion's.
      lag = std::min(lag, 0.5 * (held.force - before / spring.stiffness * spring.force).dot(moved_));
    }
    stiffness_ += stiffness;
    const double left = put_in + lag;
    // Less than its potential would do: by so much the frozen force can give at most.
    const double needed = std::min(now, spring.least());
    double share = 1.0;
    if (now <= left) {
      fill(put_in - now);
    } else if (!first_) {
      const double wanted = needed - left;
      const double paid = wanted > rounding * std::abs(needed) ? pay(giver, wanted) : 0.0;
      now = left + paid;
      if (now - needed < -rounding * std::abs(needed)) {
        share = share_of(now, needed, before / spring.stiffness);
        now = share * needed;
      }
    }
    // Never free while it is held.
    constexpr double faintest = 1e-12;
    held = {share * spring.force, now, static_cast<float>(std::max(share, faintest) * spring.stiffness), share != 1.0};
    return share;
  }
  /// The share of a force with the energy `now` that has `allowed`, which is less. In a well that is more than all of
  /// it: no shallower than it was, and no steeper either (`most`).
  double share_of(double allowed, double now, double most) noexcept {
    const double share = now > 0.0   ? std::max(0.0, allowed / now)
                         : now < 0.0 ? std::clamp(allowed / now, 1.0, std::max(1.0, most))
                                     : 1.0;
    level_ -= std::max(0.0, share * now - allowed);
    return share;
  }

  double level_ = 0.0;
  double capacity_ = default_capacity;
  bool first_ = false;
  bool has_loose_ = false;
  Vec3 moved_ = Vec3::Zero();  ///< m, world: by the hand, since the last tick
  Vec3 loose_ = Vec3::Zero();  ///< N, world: rendered at the last tick, held by nothing
  double advanced_ = 0.0;      ///< J, paid for that
  double stiffness_ = 0.0;
  std::array<Flow, static_cast<std::size_t>(Giver::count)> flows_{};
};

}  // namespace asperity
