#include "asperity/render/contact/planes.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace asperity {

namespace {

// Two planes count as independent above this squared sine of the angle between them.
constexpr double least_determinant = 1e-12;

/// Rounding of products of coordinates that add up to `size` (m), with room.
double rounding_of(double size) noexcept {
  return 1e-14 * size + 1e-300;
}

class ActiveSet {
 public:
  ActiveSet(const Vec3& goal, const PlaneSet& planes, bool with_skin) noexcept : goal_(goal), planes_(planes) {
    double size = goal.norm();
    for (std::size_t i = 0; i < planes.size(); ++i) {
      const double offset = planes[i].offset + (with_skin ? planes[i].skin : 0.0);
      violation_[i] = offset - planes[i].normal.dot(goal);
      size += std::abs(violation_[i]);
    }
    tolerance_ = rounding_of(size);
  }

  PlaneProjection solve() noexcept {
    constexpr std::size_t few = 4;
    if (planes_.size() > few && by_most_missed()) return best_;
    among_.clear();
    for (std::size_t i = 0; i < planes_.size(); ++i) among_.push_back(i);
    try_all();
    return best_;
  }

 private:
  using Active = PlaneProjection::Active;

  /// The same choice where there are many planes: from what holds so far to that and the plane that this misses most.
  bool by_most_missed() noexcept {
    // Each is farther from the goal than the one before.
    const std::size_t most_rounds = 2 * planes_.size();
    best_.point = goal_;
    best_.active.clear();
    Vec3 moved = Vec3::Zero();
    for (std::size_t round = 0; round < most_rounds; ++round) {
      std::size_t missed = 0;
      double worst = -infinity;
      for (std::size_t i = 0; i < planes_.size(); ++i) {
        const double by = violation_[i] - planes_[i].normal.dot(moved);
        if (by > worst) worst = by, missed = i;
      }
      if (worst <= (best_.active.empty() ? 0.0 : tolerance_)) {
        best_.feasible = true;
        return true;
      }
      among_.clear();
      among_.push_back(missed);
      for (const Active& one : best_.active) {
        if (one.plane == missed) return false;
        among_.push_back(one.plane);
      }
      std::sort(among_.begin(), among_.end());
      try_all();
      if (!best_.feasible) return false;
      moved.setZero();
      for (const Active& one : best_.active) moved += one.multiplier * planes_[one.plane].normal;
    }
    return false;
  }

  void try_all() noexcept {
    const std::size_t n = among_.size();
    if (none()) return;
    for (const std::size_t i : among_) {
      if (violation_[i] > 0.0 && accept({{i, violation_[i]}})) return;
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        if (pair(among_[i], among_[j])) return;
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        for (std::size_t k = j + 1; k < n; ++k) {
          if (triple(among_[i], among_[j], among_[k])) return;
        }
      }
    }
  }

  [[nodiscard]] double gram(std::size_t i, std::size_t j) const noexcept {
    return planes_[i].normal.dot(planes_[j].normal);
  }

  bool none() noexcept {
    least_worst_ = 0.0;
    for (const std::size_t i : among_) least_worst_ = std::max(least_worst_, violation_[i]);
    best_.point = goal_;
    best_.active.clear();
    best_.feasible = least_worst_ <= 0.0;
    return best_.feasible;
  }

  bool pair(std::size_t i, std::size_t j) noexcept {
    const double g = gram(i, j);
    const double determinant = 1.0 - g * g;
    if (determinant < least_determinant) return false;
    const double a = (violation_[i] - g * violation_[j]) / determinant;
    const double b = (violation_[j] - g * violation_[i]) / determinant;
    return a >= 0.0 && b >= 0.0 && accept({{i, a}, {j, b}});
  }

  bool triple(std::size_t i, std::size_t j, std::size_t k) noexcept {
    const Vec3 jk = planes_[j].normal.cross(planes_[k].normal);
    const Vec3 ki = planes_[k].normal.cross(planes_[i].normal);
    const Vec3 ij = planes_[i].normal.cross(planes_[j].normal);
    const double determinant = planes_[i].normal.dot(jk);
    if (determinant * determinant < least_determinant) return false;
    // The corner seen from the goal, expressed in the three normals.
    const Vec3 offset = (violation_[i] * jk + violation_[j] * ki + violation_[k] * ij) / determinant;
    const double a = offset.dot(jk) / determinant;
    const double b = offset.dot(ki) / determinant;
    const double c = offset.dot(ij) / determinant;
    return a >= 0.0 && b >= 0.0 && c >= 0.0 && accept({{i, a}, {j, b}, {k, c}});
  }

  /// Takes the choice if it violates no plane; remembers the least bad one otherwise.
  bool accept(std::initializer_list<Active> active) noexcept {
    Vec3 moved = Vec3::Zero();
    for (const Active& one : active) moved += one.multiplier * planes_[one.plane].normal;
    double worst = 0.0;
    for (const std::size_t i : among_) worst = std::max(worst, violation_[i] - planes_[i].normal.dot(moved));
    const bool feasible = worst <= tolerance_;
    if (!feasible && worst >= least_worst_) return false;
    least_worst_ = worst;
    best_.feasible = feasible;
    best_.point = goal_ + moved;
    best_.active.clear();
    for (const Active& one : active) {
      if (one.multiplier > 0.0) best_.active.push_back(one);
    }
    return feasible;
  }

  const Vec3& goal_;
  const PlaneSet& planes_;
  FixedVector<std::size_t, PlaneSet::capacity()> among_;  ///< planes that are to hold
  double violation_[PlaneSet::capacity()];
  double tolerance_ = 0.0;
  double least_worst_ = 0.0;
  PlaneProjection best_;
};

/// The same choices where there is one plane.
PlaneProjection project_onto_one(const Vec3& goal, const ConstraintPlane& plane, bool with_skin) noexcept {
  PlaneProjection best;
  const double violation = plane.offset + (with_skin ? plane.skin : 0.0) - plane.normal.dot(goal);
  best.point = goal;
  best.feasible = violation <= 0.0;
  if (best.feasible) return best;
  const Vec3 moved = Vec3::Zero() + violation * plane.normal;
  const double worst = std::max(0.0, violation - plane.normal.dot(moved));
  const bool feasible = worst <= rounding_of(goal.norm() + std::abs(violation));
  if (!feasible && worst >= violation) return best;
  best.feasible = feasible;
  best.point = goal + moved;
  best.active.push_back({0, violation});
  return best;
}

}  // namespace

PlaneProjection project_onto_planes(const Vec3& goal, const PlaneSet& planes, bool with_skin) noexcept {
  if (planes.size() == 1) return project_onto_one(goal, planes[0], with_skin);
  return ActiveSet(goal, planes, with_skin).solve();
}

bool onto_all(const PlaneSet& planes, Vec3& p) noexcept {
  constexpr double least_angle = 1e-3;
  // One after another, each along what the ones before leave free.
  FixedVector<Vec3, 3> across;
  for (const ConstraintPlane& plane : planes) {
    Vec3 way = plane.normal;
    for (const Vec3& other : across) way -= way.dot(other) * other;
    const double length = way.norm();
    if (!(length > least_angle) || across.size() == across.capacity()) return false;
    way /= length;
    // The earlier planes stay as they are: `way` lies in all of them.
    p += (plane.offset + plane.skin - plane.normal.dot(p)) / length * way;
    across.push_back(way);
  }
  return true;
}

}  // namespace asperity
