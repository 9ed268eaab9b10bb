#pragma once
// God-object and force shading: the proxy is solved jointly over every instance that constrains it. Private to render.

#include "asperity/render/constraint_solve.h"
#include "asperity/render/law_forces.h"

namespace asperity {

/// The instances that constrain the proxy this tick, in the world frame. [servo]
class MeshConstraints {
 public:
  static constexpr std::size_t capacity = 4;

  MeshConstraints(double probe_radius) noexcept : radius_(probe_radius) {}
  void add(const Instance& instance, ContactState& state) noexcept;
  [[nodiscard]] bool empty() const noexcept { return entries_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }

  void contacts(const Vec3& position, PlaneSet& out) noexcept;
  double sweep(const Segment& motion) noexcept;
  [[nodiscard]] double tolerance() const noexcept { return tolerance_; }
  [[nodiscard]] bool rolls(const ConstraintPlane& plane) const noexcept {
    return radius_ > 0.0 && plane.contact.barycentric.minCoeff() <= 0.0;
  }
  [[nodiscard]] Vec3 foot(const ConstraintPlane& plane) const noexcept {
    const Entry& entry = entries_[plane.owner];
    return entry.at_origin ? plane.contact.point : entry.instance->world_from_object.apply(plane.contact.point);
  }

  /// Force of entry `index` for a solved tick, world frame, with the law's shading and the material's damping.
  [[nodiscard]] LawForce force(std::size_t index, const ConstraintSolution& solution, const Vec3& probe,
                               const Vec3& velocity) const noexcept;
  [[nodiscard]] const Instance& instance(std::size_t index) const noexcept { return *entries_[index].instance; }
  [[nodiscard]] const ContactState& state(std::size_t index) const noexcept { return *entries_[index].state; }

 private:
  struct Entry {
    const Instance* instance = nullptr;
    const MeshSurface* mesh = nullptr;
    ContactState* state = nullptr;
    bool at_origin = true;  ///< identity pose: nothing to transform
  };

  FixedVector<Entry, capacity> entries_;
  double radius_;
  double tolerance_ = infinity;
};

}  // namespace asperity
