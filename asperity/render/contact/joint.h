#pragma once
// The joint solve: one proxy, a point or a ball, among the surfaces around it; not for a point on one smooth surface.

#include <algorithm>
#include <span>

#include "asperity/render/contact/generated_geometry.h"
#include "asperity/render/contact/planes.h"
#include "asperity/render/felt.h"

namespace asperity {

/// Facets for as many instances as one tick may hold, on the stack of a tick that needs them.
using GeneratedPatches = FixedVector<GeneratedPatch, most_contacts>;

/// The instances whose proxy is solved jointly this tick, in the world frame.
class JointSolve {
 public:
  static constexpr double rest_on_triangles = 1e-3;  ///< of a skin: moves no longer are not worth making
  /// `patches`: where facets may be generated; `work`: what the tick may look at. [servo]
  JointSolve(double probe_radius, GeneratedPatches* patches, const WorkMeter& work) noexcept
      : radius_(probe_radius), patches_(patches), work_(work) {}
  void add(Touched& touch) noexcept;

  /// Leads the ball from `from` to the place nearest to `goal` that the surfaces around leave free (Zilles and
  /// Salisbury 1995). Repeats: planes of what it touches; the point nearest to the goal within them (at most three
  /// active); a motion there that passes nothing. Among smooth surfaces the ball is pushed out of what it meets, and a
  /// motion is accepted only where it ends nearer to the goal. [servo]
  ConstraintSolution solve(const Vec3& from, const Vec3& goal) noexcept;
  /// A point led along one mesh to an edge or a vertex, where no friction holds it: by the planes of the faces around.
  /// Not converged where they do not hold it there, or are not known to be all; `solve` is to be asked then. [servo]
  [[nodiscard]] ConstraintSolution on_border(const Place& place, const Vec3& goal) const noexcept;
  /// The same as `solve` with the friction of the plane that pushes most: each round leads the proxy to the probe as
  /// far as the cone lets it go (joint_friction.h). `goal` becomes where a proxy without friction would have been led.
  /// [servo]
  template <class FrictionOf>
  ConstraintSolution solve_with_friction(const Vec3& from, const Vec3& probe, bool& sliding, Vec3& goal,
                                         const FrictionOf& friction_of) noexcept;
  /// Pushes the ball out of smooth surfaces that it overlaps, past nothing else; whether it overlaps none any more.
  /// [servo]
  [[nodiscard]] bool push_out(Vec3& position) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }
  [[nodiscard]] Touched& touch(std::size_t index) const noexcept { return *entries_[index].touch; }
  /// Whether every query was answered from everything around it. [servo]
  [[nodiscard]] bool complete() const noexcept;
  /// Tells the contact of entry `index` where it is touched, or nearest. [servo]
  void remember_places(std::size_t index, const ConstraintSolution& solution) noexcept;
  /// Where a point begins that the last tick has left at `position`: on what it touches there. A skin off it may be
  /// behind another surface. [servo]
  [[nodiscard]] Vec3 put_down(const Vec3& position) noexcept;
  /// A place where a point is held, a skin off what holds it: from there it may fly. [servo]
  [[nodiscard]] Vec3 lifted(const Vec3& position) const noexcept;

 private:
  struct Entry {
    Touched* touch = nullptr;
    GeneratedPatch* patch = nullptr;  ///< facets, where the law makes them
    bool smooth = false;
    double skin = 0.0;
    double grain = 0.0;   ///< smooth: smallest length over which it changes (m)
    double direct = 0.0;  ///< smooth: direction_from
    bool folds = false;
    Place near;  ///< smooth: found last, to be tried first
  };

  /// A smooth surface that a point touches: its place there, world frame.
  struct Held {
    std::uint32_t owner = 0;
    Place place;
    Vec3 point = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  ///< unit, away from the side that is touched
  };
  /// A place that a ball may rest on, found by a look and followed until the next.
  struct Followed {
    std::size_t index = 0;
    Foot foot;
    Vec3 position = Vec3::Zero();  ///< of the ball, where that was the foot (world)
    bool stays = false;            ///< the place itself, whatever it is led to
  };
  using HeldSet = FixedVector<Held, 6>;
  struct Met {
    bool hit = false;
    double t = 1.0;
    std::size_t owner = 0;
    SweptHit what;
  };
  static constexpr std::size_t no_owner = most_contacts;
  enum class Move {
    none,
    nearer,
    learned,  ///< of something in the way
    rest,     ///< pressed into a crease, nowhere along which it would be nearer
  };

  /// What a step along a crease keeps to.
  struct Along {
    FixedVector<std::size_t, 4> which;  ///< of held_
    PlaneSet walls;
    bool pressed = false;  ///< against all that the way is along
    [[nodiscard]] bool keeps_to(std::size_t one) const noexcept {
      return std::find(which.begin(), which.end(), one) != which.end();
    }
  };

  /// Whether it is a point, and led along the surfaces themselves.
  [[nodiscard]] bool leads_point() const noexcept { return radius_ == 0.0 && smooth_ && !facets_; }
  /// Or a ball, by all that it may rest on.
  [[nodiscard]] bool leads_ball() const noexcept { return radius_ > 0.0 && smooth_ && !facets_; }
  [[nodiscard]] double margin() const noexcept { return leads_point() ? margin_ : std::max(margin_, blown_up_); }
  [[nodiscard]] double gap(const Entry& entry) const noexcept { return margin() + entry.skin; }
  [[nodiscard]] bool touches(const Held& held, const Vec3& position) const noexcept;
  void hold(std::size_t index, const Place& place, const Vec3& normal, Held& held) const noexcept;
  void attach(const Vec3& position) noexcept;
  DescentEnd walk(Held& held, const Vec3& goal, bool may_leave, int moves,
                  std::uint32_t work = Goal::no_limit) const noexcept;
  [[nodiscard]] ConstraintPlane plane_at(const Held& held) const noexcept;
  void planes_at(const Vec3& position, PlaneSet& out) noexcept;
  [[nodiscard]] Vec3 off(const HeldSet& on, std::size_t owner, const Vec3& position) const noexcept;
  [[nodiscard]] Met first_met(const Segment& motion, const HeldSet& from, const HeldSet& to) noexcept;
  std::size_t hold_to(const Met& met) noexcept;
  [[nodiscard]] bool onto(HeldSet& on, const PlaneSet& walls, Vec3& position) noexcept;
  bool come_to(std::span<const std::size_t> which, const PlaneSet& walls, Vec3 place, Vec3& proxy) noexcept;
  [[nodiscard]] bool slide(std::size_t which, const Vec3& goal, Vec3& proxy, std::size_t& stopped) noexcept;
  [[nodiscard]] bool along_crease(std::size_t which, std::size_t stopped, const Vec3& goal, const PlaneSet& planes,
                                  PlaneProjection& projection) const noexcept;
  [[nodiscard]] bool fly(const Vec3& goal, Vec3& proxy) noexcept;
  [[nodiscard]] Along along(const PlaneSet& planes, const PlaneProjection& projection, const PlaneSet& also,
                            const Vec3& position, bool whole) const noexcept;
  [[nodiscard]] bool clear_of_others(const Along& along, const Vec3& position, HeldSet& held) const noexcept;
  [[nodiscard]] Move come_to_met(std::size_t met, Along& along, const Vec3& place, const Vec3& goal,
                                 Vec3& proxy) noexcept;
  [[nodiscard]] Move step_between(const PlaneSet& planes, const PlaneProjection& projection, const Vec3& goal,
                                  Vec3& proxy) noexcept;
  void release(const Vec3& position) noexcept;
  void settle_point(const Vec3& goal, ConstraintSolution& solution) noexcept;
  void remember_held(std::size_t index, const ConstraintSolution& solution) noexcept;
  void explain(const Vec3& goal, ConstraintSolution& solution) noexcept;

  /// Whether all that a ball may rest on there is known: told at once, or followed from one look to the next.
  [[nodiscard]] bool knows_feet(const Entry& entry) const noexcept;
  [[nodiscard]] bool tells_nearest_alone(const Entry& entry) const noexcept;
  [[nodiscard]] bool foot_plane(std::size_t index, const Vec3& position, ConstraintPlane& plane) noexcept;
  [[nodiscard]] bool plane_off(std::size_t index, const Vec3& local, const Foot& foot, Place& place,
                               ConstraintPlane& plane) const noexcept;
  [[nodiscard]] const PlaneSet& feet_planes(std::size_t index, const Vec3& position) noexcept;
  [[nodiscard]] static Foot led_to(const Entry& entry, const Vec3& local, const Foot& foot) noexcept;
  void keep_following(std::size_t index, const Vec3& position, double within, ContactSet& feet) noexcept;
  [[nodiscard]] bool same_place(std::size_t index, const Foot& a, const Foot& b) const noexcept;
  void follow(const Followed& one) noexcept;
  void followed_planes(std::size_t index, const Vec3& position, PlaneSet& out) noexcept;
  void touched(const Vec3& position, PlaneSet& out) noexcept;
  void rests_on(const Vec3& position, PlaneSet& out) noexcept;
  [[nodiscard]] ConstraintPlane plane_of(std::size_t index, const Foot& contact) const noexcept;
  void triangle_planes(std::size_t index, const Vec3& position, double within, PlaneSet& out) noexcept;
  [[nodiscard]] double free_share(const Segment& motion) noexcept;
  [[nodiscard]] double free_share_of_ball(Entry& entry, const Segment& motion) noexcept;
  [[nodiscard]] bool advance(const Vec3& step, const Vec3& goal, Vec3& proxy) noexcept;
  [[nodiscard]] Vec3 over_what_is_near(const Vec3& position, double gone, const Vec3& goal) noexcept;
  void keep_near(const PlaneSet& earlier, const Vec3& position, PlaneSet& planes) const noexcept;
  [[nodiscard]] Vec3 rolled(const PlaneSet& planes, const PlaneProjection& flat, const Vec3& proxy) const noexcept;
  void settle_on_triangles(const Vec3& goal, ConstraintSolution& solution) noexcept;
  void settle_among_smooth(const Vec3& goal, ConstraintSolution& solution) noexcept;
  using CutSet = FixedVector<ConstraintPlane, 8>;
  struct BallMove;
  [[nodiscard]] Mat3 bend_of(const ConstraintPlane& plane, const Vec3& position) const noexcept;
  [[nodiscard]] Vec3 bent_step(const PlaneSet& planes, const PlaneProjection& flat, const Vec3& proxy, const Vec3& goal,
                               double stiffest, double& gain) const noexcept;
  /// Whether planes hold the ball that would have it so far (m) from where it is. [servo]
  [[nodiscard]] bool explains(double off) const noexcept {
    constexpr double most_gaps = 100.0;
    return off <= most_gaps * (margin() + widest_skin_) + tolerance_;
  }
  /// Whether a ball has spent the budget. One look may take all of it: it comes nearer first. [servo]
  [[nodiscard]] bool may_end() const noexcept { return work_.spent() && nearer_; }
  /// Whether a ball was still on its way there. [servo]
  [[nodiscard]] bool was_cut(const ConstraintSolution& solution) const noexcept {
    return leads_ball() && !solution.converged && work_.spent();
  }
  void recall(const Vec3& position, PlaneSet& planes) noexcept;
  [[nodiscard]] double free_around(const Vec3& position, double far) noexcept;
  [[nodiscard]] double swept_share(const Segment& motion, CutSet& met) noexcept;
  [[nodiscard]] static double overlap(const PlaneSet& planes, const Vec3& position) noexcept;
  [[nodiscard]] bool restore(Vec3& position, PlaneSet& around, CutSet& met) noexcept;
  void with_cuts(const CutSet& cuts, const Vec3& position, PlaneSet& planes) const noexcept;
  [[nodiscard]] bool plan(const Vec3& proxy, const PlaneSet& planes, BallMove& move) noexcept;
  [[nodiscard]] bool make(BallMove& move, Vec3& proxy, PlaneSet& planes) noexcept;
  void learn(const CutSet& met, BallMove& move) noexcept;
  [[nodiscard]] bool leap(const BallMove& move, Vec3& proxy, PlaneSet& planes) noexcept;
  void settle_ball(const Vec3& goal, ConstraintSolution& solution) noexcept;
  void share_out(const Vec3& goal, ConstraintSolution& solution) noexcept;
  void remember(const ConstraintPlane& plane) noexcept;
  [[nodiscard]] double distance_to_foot(const ConstraintPlane& plane, const Vec3& position) const noexcept;
  [[nodiscard]] bool loosen(const Vec3& position) noexcept;
  /// Whether a ball rests on an edge or corner of a mesh.
  [[nodiscard]] bool rolls(const ConstraintPlane& plane) const noexcept;
  [[nodiscard]] Vec3 edge_of(const ConstraintPlane& plane) const noexcept;

  double radius_;
  GeneratedPatches* patches_;
  const WorkMeter& work_;
  FixedVector<Entry, most_contacts> entries_;
  /// What feet_planes has answered last: a position is asked about again where the ball comes to be there.
  struct LastFeet {
    std::size_t index = no_owner;
    Vec3 position = Vec3::Zero();
    double beyond = 0.0;
    PlaneSet planes;
  } last_feet_;
  FixedVector<Followed, 48> followed_;
  bool nearer_ = false;                   ///< a ball has come nearer to the goal by what is worth a tick
  bool following_ = false;                ///< nothing is looked for beside these
  FixedVector<ConstraintPlane, 6> feet_;  ///< found while the ball moved
  bool met_ = false;                      ///< the last advance has found more of them
  double stride_ = 0.0;                   ///< how far it was to go (m)
  bool smooth_ = false;                   ///< any of them is
  bool facets_ = false;                   ///< any of them is generated
  HeldSet held_;                          ///< a point: what it touches
  bool attached_ = false;                 ///< that is known
  double margin_ = 0.0;          ///< by which the ball is blown up, so that a point has a surface of its own (m)
  double blown_up_ = 0.0;        ///< as much at least, for what may touch two places of one surface at once (m)
  double widest_skin_ = 0.0;     ///< m
  double tolerance_ = infinity;  ///< below which a further move is not worth making (m)
};

/// Where a contact is on a mesh, and how far the proxy is over its face.
struct OnFace {
  /// `normal`: away from the face, on the proxy's side (object frame); `proxy`: world frame. [servo]
  OnFace(const Touched& touch, const Foot& foot, const Vec3& normal, const Vec3& proxy) noexcept
      : place{foot.element, false, foot.at} {
    const Vec3 face = std::get_if<TriangleView>(&touch.view)->surface().mesh().face_normal(foot.element);
    place.back = normal.dot(face) < 0.0;
    height = face.dot(touch.to_local(proxy) - foot.point);
  }
  Place place;
  double height = 0.0;  ///< m, along the face's own normal
};

/// The plane of one owner that pushes most; nullptr: none does. [servo]
const ConstraintPlane* strongest_plane(std::size_t owner, const ConstraintSolution& solution) noexcept;
/// Force of one owner among solved planes, world frame: its share of the spring from `goal`, and, for the owner that
/// pushes most, what friction holds (from the goal on to the probe); finished and damped as its law and material say.
/// [servo]
LawForce owner_force(const Touched& touch, const Material& material, std::size_t owner,
                     const ConstraintSolution& solution, const Vec3& goal, const ProbeSample& probe) noexcept;

}  // namespace asperity
