#include "asperity/geometry/triangle_index.h"

#include <algorithm>
#include <cmath>

#include "asperity/core/identity.h"

namespace asperity {

namespace {

// Beyond this many mean edges one traversal along the motion is cheaper than filling a patch; beyond so many it is
// cheaper than a search around its start, where there are more triangles than a patch can hold.
constexpr double long_motion_in_edges = 12.0;
constexpr double crowded_motion_in_edges = 0.5;
constexpr double patch_slack_in_edges = 1.0;
// The first part of a longer motion that is looked at by itself.
constexpr double first_look_in_edges = 0.25;
// A ball that slides along a face looks so many times its motion around, an edge at most; but only where it would stay
// on the face for so many more.
constexpr double look_in_motions = 8.0;
constexpr double least_slides = 3.0;

}  // namespace

TriangleIndex::TriangleIndex(std::shared_ptr<const Inside> inside, std::uint64_t lineage)
    : inside_(std::move(inside)), identity_(next_identity()), lineage_(lineage) {
  if (lineage_ == 0) lineage_ = identity_;
  tolerance_ = ContactTolerance::of(mesh().mean_edge(), mesh().bounds());
}

TriangleIndex TriangleIndex::build(TriangleMesh mesh, SearchStructure structure, const BvhSettings& settings) {
  const auto inside = std::make_shared<Inside>(std::move(mesh));
  if (structure == SearchStructure::bvh) {
    inside->built_cost = inside->structure.emplace<Bvh>(Bvh::build(inside->mesh, settings)).cost();
  } else {
    inside->structure.emplace<TriangleOctree>(TriangleOctree::build(inside->mesh));
  }
  return {inside, 0};
}

double TriangleIndex::cost_ratio() const noexcept {
  const Bvh* bvh = std::get_if<Bvh>(&inside_->structure);
  return bvh != nullptr ? bvh->cost() / inside_->built_cost : 1.0;
}

std::size_t TriangleIndex::memory_bytes() const noexcept {
  return mesh().memory_bytes() +
         std::visit([](const auto& structure) { return structure.memory_bytes(); }, inside_->structure);
}

FirstHit TriangleIndex::first_hit(const Segment& segment) const noexcept {
  return std::visit([&](const auto& structure) { return structure.first_hit(segment); }, inside_->structure);
}

Foot TriangleIndex::closest(const Vec3& p, double bound) const noexcept {
  const ClosestHit hit =
      std::visit([&](const auto& structure) { return structure.closest(p, bound); }, inside_->structure);
  return hit.face == no_index ? Foot{}
                              : triangle_foot(hit.face, hit.point, p, mesh().face_normal(hit.face), tolerance_);
}

Foot TriangleIndex::closest(const Vec3& p, double bound, TrianglePatch& patch) const noexcept {
  const Bvh* bvh = std::get_if<Bvh>(&inside_->structure);
  if (patch.owner != identity_) patch.last_face = no_index;
  ClosestHit best;
  double reach = bound;
  const auto offer = [&](std::uint32_t face) {
    const ClosestHit hit = near_at(face, p);
    if (hit.point.squared_distance > bound * bound || !hit.before(best)) return;
    best = hit;
    reach = std::sqrt(hit.point.squared_distance);
  };
  if (patch.last_face != no_index) offer(patch.last_face);
  if (bvh != nullptr && patch.owner == identity_ && reach < patch.certified - (p - patch.centre).norm()) {
    const double error = bvh->error(p);
    bvh->scan(patch, p, reach, [&](std::uint32_t face, double distance, const Vec3&) {
      if (distance <= reach + error && face != patch.last_face) offer(face);
    });
  } else {
    // A rounding farther, so that nothing as near as the best is beyond.
    const double within = best.face != no_index ? reach * (1.0 + 1e-12) : reach;
    const ClosestHit hit =
        std::visit([&](const auto& structure) { return structure.closest(p, within); }, inside_->structure);
    if (hit.before(best)) best = hit;
    if (best.face != no_index) {
      gather(p, std::sqrt(best.point.squared_distance) + patch_slack_in_edges * mesh().mean_edge(), patch);
    }
  }
  if (best.face == no_index) return {};
  patch.last_face = best.face;
  return triangle_foot(best.face, best.point, p, mesh().face_normal(best.face), tolerance_);
}

void TriangleIndex::gather(const Vec3& centre, double reach, TrianglePatch& patch) const noexcept {
  if (patch.owner != identity_) patch.beside.face = no_index;
  if (const Bvh* bvh = std::get_if<Bvh>(&inside_->structure)) return bvh->gather(centre, reach, identity_, patch);
  // The octree keeps to the papers and has no gathering of its own: an empty certificate sends every query to the tree.
  patch.owner = identity_;
  patch.centre = centre;
  patch.certified = 0.0;
  patch.count = 0;
}

bool TriangleIndex::ensure(const Vec3& position, double reach, TrianglePatch& patch) const noexcept {
  if (patch.covers(identity_, position, reach)) return true;
  patch.rested = false;
  // Where a patch filled nearby was too small, more triangles lie within reach than it can hold: do not try again.
  const double edge = mesh().mean_edge();
  if (patch.owner == identity_ && patch.certified < reach && (position - patch.centre).norm() < edge) return false;
  gather(position, reach + patch_slack_in_edges * edge, patch);
  return patch.covers(identity_, position, reach);
}

template <class Visit>
void TriangleIndex::scan_ball(const Vec3& position, double reach, TrianglePatch& patch, Visit&& visit) const noexcept {
  if (const Bvh* bvh = std::get_if<Bvh>(&inside_->structure)) {
    if (ensure(position, reach, patch)) {
      bvh->scan(patch, position, reach, visit);
    } else {
      bvh->scan(position, reach, visit);
    }
    return;
  }
  Box box;
  box.include(position);
  std::get_if<TriangleOctree>(&inside_->structure)->for_each_in_box(box.grown(reach), [&](std::uint32_t face) {
    const auto [a, b, c] = mesh().corners(face);
    const TrianglePoint at = closest_point_on_triangle(position, a, b, c);
    visit(face, std::sqrt(at.squared_distance), Vec3(position - at.point));
  });
}

double TriangleIndex::error(const Vec3& position) const noexcept {
  const Bvh* bvh = std::get_if<Bvh>(&inside_->structure);
  return bvh != nullptr ? bvh->error(position) : 0.0;
}

bool TriangleIndex::below(std::uint32_t face, const Foot& rest) const noexcept {
  // What is below the plane that a ball rests on is never touched before that.
  double highest = -infinity;
  for (const Vec3& corner : mesh().corners(face)) highest = std::max(highest, rest.normal.dot(corner - rest.point));
  return highest <= tolerance_.rounding;
}

void TriangleIndex::look_beside(const Vec3& position, const Foot& rest, double reach,
                                TrianglePatch& patch) const noexcept {
  TrianglePatch::Beside& beside = patch.beside;
  beside.centre = position;
  beside.clear = reach;
  beside.listed.clear();
  const double margin = error(position);
  const bool rested = patch.rested;
  scan_ball(position, reach, patch, [&](std::uint32_t face, double distance, const Vec3&) {
    if (face == rest.element || below(face, rest)) return;
    TrianglePatch::Beside::One one{face, distance - margin};
    if (beside.listed.push_back(one)) return;
    for (TrianglePatch::Beside::One& other : beside.listed) {
      if (other.distance > one.distance) std::swap(one, other);
    }
    beside.clear = std::min(beside.clear, one.distance);
  });
  // What it rests on is where it was, whatever the patch has been filled with.
  patch.rested = rested;
}

const Foot* TriangleIndex::rests_on_face(const Vec3& position, double radius, Sides sides,
                                         const TrianglePatch& patch) const noexcept {
  if (!(radius > 0.0) || !patch.rested || patch.owner != identity_ || patch.rest_contacts.size() != 1 ||
      patch.rest_position != position || patch.rest_radius != radius || patch.rest_sides != sides)
    return nullptr;
  const Foot& rest = patch.rest_contacts[0];
  return rest.at.minCoeff() > 0.0 ? &rest : nullptr;
}

bool TriangleIndex::passes_others(const Segment& motion, const Foot& rest, double radius,
                                  TrianglePatch& patch) const noexcept {
  const double length = (motion.to - motion.from).norm();
  if (!(length < glide_of_radius * radius)) return false;
  const double touch = radius + touch_in_skins * tolerance_.skin;
  const double within = touch + passed_within(length, radius);
  const double margin = error(motion.to);
  const bool rested = patch.rested;
  bool free = true;
  scan_ball(motion.to, within, patch, [&](std::uint32_t face, double distance, const Vec3&) {
    if (!free || face == rest.element || distance > within + margin || below(face, rest)) return;
    const ClosestHit end = near_at(face, motion.to);
    const auto [a, b, c] = mesh().corners(face);
    free = stays_off(a, b, c, motion, end.point, touch);
  });
  patch.rested = rested;
  return free;
}

bool TriangleIndex::slides(const Segment& motion, double radius, Sides sides, TrianglePatch& patch) const noexcept {
  if (rests_on_face(motion.from, radius, sides, patch) == nullptr) return false;
  Foot& rest = patch.rest_contacts[0];
  const auto [a, b, c] = mesh().corners(rest.element);
  const TrianglePoint at = closest_point_on_triangle(motion.to, a, b, c);
  const double touch = radius + touch_in_skins * tolerance_.skin;
  const double blocked = radius + (blocked_in_skins + reached_in_skins) * tolerance_.skin + tolerance_.rounding;
  if (!(at.barycentric.minCoeff() > 0.0) || at.squared_distance > touch * touch ||
      at.squared_distance <= blocked * blocked || rest.normal.dot(motion.to - at.point) < 0.0)
    return false;
  TrianglePatch::Beside& beside = patch.beside;
  const double length = (motion.to - motion.from).norm();
  const auto arrive = [&] {
    patch.rested = true;
    patch.rest_position = motion.to;
    rest.point = at.point;
    rest.distance = std::sqrt(at.squared_distance);
    rest.at = at.barycentric;
    return true;
  };
  const bool known = beside.face == rest.element && beside.radius == radius && beside.normal == rest.normal;
  double moved = infinity;
  if (known) moved = std::max((motion.to - beside.centre).norm(), (motion.from - beside.centre).norm());
  if (beside.clear - moved <= touch) {
    // A list is made where it stays for longer; else what is around is looked at for this motion alone.
    const Vec3 leaves = rest.at - at.barycentric;
    if (!known || (at.barycentric - least_slides * leaves).minCoeff() <= 0.0) {
      beside.face = rest.element;
      beside.radius = radius;
      beside.normal = rest.normal;
      beside.clear = -infinity;
      return passes_others(motion, rest, radius, patch) && arrive();
    }
    look_beside(motion.from, rest, touch + std::min(look_in_motions * length, mesh().mean_edge()), patch);
    moved = length;
    if (beside.clear - moved <= touch) return false;
  }
  for (const TrianglePatch::Beside::One& one : beside.listed) {
    if (one.distance - moved > touch) continue;
    const ClosestHit end = near_at(one.face, motion.to);
    if (end.point.squared_distance <= touch * touch) return false;
    const auto [p, q, r] = mesh().corners(one.face);
    if (!stays_off(p, q, r, motion, end.point, touch)) return false;
  }
  return arrive();
}

bool TriangleIndex::glides(const Segment& motion, double length, double radius, Sides sides, double touch,
                           TrianglePatch& patch) const noexcept {
  const Vec3& end = motion.to;
  const double margin = error(end);
  const double blocked = radius + blocked_in_skins * tolerance_.skin;
  const double within = touch + passed_within(length, radius);
  NearTriangles near;
  bool free = true;
  scan_ball(end, within, patch, [&](std::uint32_t face, double distance, const Vec3&) {
    if (distance > within + margin || !free) return;
    const ClosestHit at = near_at(face, end);
    const auto [a, b, c] = mesh().corners(face);
    free = stays_off(a, b, c, motion, at.point, blocked);
    near.offer(at, touch);
  });
  if (!free) return false;
  ContactSet contacts;
  touch_all(near, end, sides, contacts);
  remember(end, radius, sides, contacts, patch);
  return true;
}

SweptHit TriangleIndex::sweep(const Segment& motion, double radius, Sides sides, TrianglePatch& patch) const noexcept {
  if (slides(motion, radius, sides, patch)) return {};
  const Vec3 direction = motion.to - motion.from;
  const double first_part = first_look_in_edges * mesh().mean_edge() / direction.norm();
  if (first_part >= 0.5) return sweep_part(motion, radius, sides, patch);
  // A probe that leaves one face usually drops right onto the next: look near before searching the whole way.
  SweptHit hit = sweep_part({motion.from, motion.from + first_part * direction}, radius, sides, patch);
  if (!hit.hit) return sweep_part(motion, radius, sides, patch);
  hit.t *= first_part;
  return hit;
}

SweptHit TriangleIndex::sweep_part(const Segment& motion, double radius, Sides sides,
                                   TrianglePatch& patch) const noexcept {
  const Vec3 direction = motion.to - motion.from;
  const double length = direction.norm();
  const double grown = radius + (stopped_in_skins + reached_in_skins) * tolerance_.skin;
  const double blocked = radius + (blocked_in_skins + reached_in_skins) * tolerance_.skin;
  SweptHit best;
  if (length == 0.0) return best;
  const auto sweep_face = [&](std::uint32_t face) {
    const auto [a, b, c] = mesh().corners(face);
    sweep_triangle(face, a, b, c, motion, radius, sides, tolerance_, best);
    return best.t;
  };
  const double touch = radius + touch_in_skins * tolerance_.skin;
  const auto crowded = [&] {
    return length > crowded_motion_in_edges * mesh().mean_edge() && std::holds_alternative<Bvh>(inside_->structure) &&
           !ensure(motion.from, touch + length, patch);
  };
  const bool long_motion = length > long_motion_in_edges * mesh().mean_edge();
  if (!long_motion && length < glide_of_radius * radius && glides(motion, length, radius, sides, touch, patch)) {
    return best;
  }
  if (long_motion || crowded()) {
    for_each_along(motion, grown, sweep_face);
    return best;
  }
  const double margin = error(motion.from);
  const auto resting_on = [&](std::uint32_t face) {
    // What the ball rests on cannot be hit by a motion that does not go into it: it stays beyond that plane.
    if (!patch.rested || patch.rest_position != motion.from || patch.rest_radius != radius) return false;
    for (const Foot& contact : patch.rest_contacts) {
      if (contact.element != face) continue;
      const double off = contact.normal.dot(motion.from - contact.point);
      return off + std::min(0.0, contact.normal.dot(direction)) > blocked + tolerance_.rounding;
    }
    return false;
  };
  FixedVector<std::uint32_t, 16> near_end;
  bool all_near_end = true;
  scan_ball(motion.from, touch + length, patch, [&](std::uint32_t face, double distance, const Vec3& offset) {
    // The distance is convex: along the motion it stays above its tangent at the start. Single precision tells feet
    // apart only by their distances, so that it may take one as far from the foot as the square root of its rounding.
    double bound = distance > margin ? distance - margin + offset.dot(direction) / distance : 0.0;
    if (bound > grown) {
      const double beyond = (bound - touch) * distance;
      if (beyond > 0.0 && beyond * beyond > 4.0 * margin * (distance + margin) * length * length) return;
      const TrianglePoint at = near_at(face, motion.from).point;
      const double exactly = std::sqrt(at.squared_distance);
      bound = exactly + (motion.from - at.point).dot(direction) / exactly;
    }
    if (bound > touch) return;
    if (bound <= grown && !resting_on(face)) sweep_face(face);
    all_near_end = near_end.push_back(face) && all_near_end;
  });
  if (!best.hit && all_near_end) {
    // What touches at the end was among them: the next question is about the contacts there.
    NearTriangles near;
    for (const std::uint32_t face : near_end) near.offer(near_at(face, motion.to), touch);
    ContactSet contacts;
    touch_all(near, motion.to, sides, contacts);
    remember(motion.to, radius, sides, contacts, patch);
  }
  return best;
}

ClosestHit TriangleIndex::near_at(std::uint32_t face, const Vec3& position) const noexcept {
  const auto [a, b, c] = mesh().corners(face);
  return {face, closest_point_on_triangle(position, a, b, c)};
}

void TriangleIndex::touch_all(const NearTriangles& near, const Vec3& position, Sides sides,
                              ContactSet& out) const noexcept {
  for (const ClosestHit& at : near) {
    const auto [a, b, c] = mesh().corners(at.face);
    add_triangle_contact(at, a, b, c, position, sides, tolerance_, out);
  }
  settle_edge_contacts(
      position, tolerance_, [&](std::uint32_t face) { return mesh().corners(face); }, out);
}

void TriangleIndex::remember(const Vec3& position, double radius, Sides sides, const ContactSet& contacts,
                             TrianglePatch& patch) const noexcept {
  patch.rested = patch.owner == identity_ && contacts.size() <= patch.rest_contacts.capacity();
  if (!patch.rested) return;
  patch.rest_position = position;
  patch.rest_radius = radius;
  patch.rest_sides = sides;
  patch.rest_contacts.clear();
  for (const Foot& contact : contacts) patch.rest_contacts.push_back(contact);
}

void TriangleIndex::contacts(const Vec3& position, double radius, Sides sides, TrianglePatch& patch,
                             ContactSet& out) const noexcept {
  if (patch.rested && patch.owner == identity_ && patch.rest_position == position && patch.rest_radius == radius &&
      patch.rest_sides == sides) {
    for (const Foot& contact : patch.rest_contacts) out.push_back(contact);
    return;
  }
  const double reach = radius + touch_in_skins * tolerance_.skin;
  const double margin = error(position);
  NearTriangles near;
  scan_ball(position, reach, patch, [&](std::uint32_t face, double distance, const Vec3&) {
    if (distance <= reach + margin) near.offer(near_at(face, position), reach);
  });
  touch_all(near, position, sides, out);
  remember(position, radius, sides, out, patch);
}

}  // namespace asperity
