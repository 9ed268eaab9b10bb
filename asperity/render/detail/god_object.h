#pragma once
// God-object and force shading: the proxy is solved jointly over every instance that constrains it. Private to render.

#include "asperity/render/detail/constraint_geometry.h"
#include "asperity/render/detail/constraint_solve.h"
#include "asperity/render/law_forces.h"

namespace asperity {

/// Direction that force shading turns a contact's force into: the coat's normal map, or the smoothed mesh, on the side
/// touched. Object frame. [servo]
Vec3 shading_normal(const Instance& instance, const Foot& contact) noexcept;

/// Force of one owner among solved planes, world frame: its share of the spring from `goal`, and, for the owner that
/// pushes most, what friction holds (from the goal on to the probe); shaded and damped as its law and material say.
/// [servo]
LawForce owner_force(const Instance& instance, const Material& material, const Pose& pose, std::size_t owner,
                     const ConstraintSolution& solution, const Vec3& goal, const ProbeSample& probe) noexcept;

/// The instances that constrain the proxy this tick, in the world frame. [servo]
class MeshConstraints {
 public:
  static constexpr std::size_t capacity = 4;

  explicit MeshConstraints(double probe_radius) noexcept : radius_(probe_radius) {}
  // Entries point at its own patches.
  MeshConstraints(const MeshConstraints&) = delete;
  MeshConstraints& operator=(const MeshConstraints&) = delete;
  void add(const Instance& instance, ContactState& state) noexcept;
  [[nodiscard]] bool empty() const noexcept { return entries_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }

  void contacts(const Vec3& position, PlaneSet& out) noexcept;
  double sweep(const Segment& motion) noexcept;
  [[nodiscard]] double tolerance() const noexcept { return tolerance_; }
  /// Whether every query was answered from everything around it. [servo]
  [[nodiscard]] bool complete() const noexcept {
    bool all = true;
    for (const Entry& entry : entries_) all = all && entry.mesh.complete();
    return all;
  }
  [[nodiscard]] bool rolls(const ConstraintPlane& plane) const noexcept {
    return radius_ > 0.0 && plane.contact.barycentric.minCoeff() <= 0.0;
  }
  [[nodiscard]] Vec3 foot(const ConstraintPlane& plane) const noexcept {
    const Entry& entry = entries_[plane.owner];
    return entry.at_origin ? plane.contact.point : entry.state->pose.apply(plane.contact.point);
  }

  [[nodiscard]] const Instance& instance(std::size_t index) const noexcept { return *entries_[index].instance; }
  [[nodiscard]] ContactState& state(std::size_t index) noexcept { return *entries_[index].state; }

 private:
  struct Entry {
    const Instance* instance = nullptr;
    ConstraintGeometry mesh;
    ContactState* state = nullptr;
    bool at_origin = true;  ///< identity pose: nothing to transform
  };

  GeneratedPatches patches_;
  FixedVector<Entry, capacity> entries_;
  double radius_;
  double tolerance_ = infinity;
};

}  // namespace asperity
