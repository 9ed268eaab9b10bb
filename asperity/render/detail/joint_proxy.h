#pragma once
// The proxy law where one relief and a point are not all: a ball, several surfaces at once. Private to render.

#include "asperity/render/detail/constraint_geometry.h"
#include "asperity/render/detail/constraint_solve.h"
#include "asperity/render/detail/smooth_surface.h"
#include "asperity/render/law_forces.h"

namespace asperity {

/// The instances whose proxy is solved jointly this tick, in the world frame. [servo]
class JointProxy {
 public:
  static constexpr std::size_t capacity = 4;

  explicit JointProxy(double probe_radius) noexcept : radius_(probe_radius) {}
  // Entries point at its own patches.
  JointProxy(const JointProxy&) = delete;
  JointProxy& operator=(const JointProxy&) = delete;
  void add(const Instance& instance, ContactState& state) noexcept;

  /// Leads the ball from `from` to the place nearest to `goal` that the surfaces around leave free: planes of what it
  /// touches, the point nearest to the goal within them (at most three active), a motion there that passes nothing,
  /// pushed out of what it meets; accepted only where it ends nearer to the goal. [servo]
  ConstraintSolution solve(const Vec3& from, const Vec3& goal) noexcept;
  /// The planes that the ball touches at a place, for friction. [servo]
  void touched(const Vec3& position, PlaneSet& out) noexcept;
  /// Where the ball is pushed out of smooth surfaces that it overlaps; `clear` tells whether it overlaps none any more.
  /// [servo]
  [[nodiscard]] Vec3 pushed_out(Vec3 position, bool& clear) noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }
  /// Whether every query was answered from everything around it. [servo]
  [[nodiscard]] bool complete() const noexcept {
    bool all = true;
    for (const Entry& entry : entries_) all = all && (entry.smooth || entry.mesh.complete());
    return all;
  }
  [[nodiscard]] const Instance& instance(std::size_t index) const noexcept { return *entries_[index].instance; }
  [[nodiscard]] ContactState& state(std::size_t index) const noexcept { return *entries_[index].state; }

 private:
  struct Entry {
    const Instance* instance = nullptr;
    ConstraintGeometry mesh;  ///< where nothing is smooth
    SmoothSurface smooth;     ///< law proxy on a relief or an isosurface
    ContactState* state = nullptr;
  };

  [[nodiscard]] double gap(const Entry& entry) const noexcept;
  [[nodiscard]] bool foot_plane(std::size_t index, const Vec3& position, ConstraintPlane& plane,
                                double& distance) noexcept;
  [[nodiscard]] double free_share(const Segment& motion) noexcept;
  void remember(const ConstraintPlane& plane) noexcept;

  GeneratedPatches patches_;
  FixedVector<Entry, capacity> entries_;
  FixedVector<ConstraintPlane, 6> feet_;  ///< of smooth surfaces, found while the ball moved
  double radius_;
  double margin_ = 0.0;  ///< by which the ball is blown up, so that a point has a surface of its own (m)
  double tolerance_ = infinity;
  double longest_step_ = infinity;
};

}  // namespace asperity
