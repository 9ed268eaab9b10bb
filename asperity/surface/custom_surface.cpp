#include "asperity/surface/custom_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "asperity/core/identity.h"
#include "asperity/core/suggest.h"
#include "asperity/core/units.h"

namespace asperity {

namespace {

constexpr int most_steps = 512;         // of one motion
constexpr int most_landings = 48;       // Newton steps onto the surface
constexpr int most_descents = 32;       // steps along it
constexpr double settled = 1e-3;        // of a skin: two places are one
constexpr double touch_share = 0.5;     // of a skin: nearer than this is touched
constexpr int most_samples = 4096;      // at which a field is measured
constexpr double counted = 1.0 + 1e-6;  // rounding of what a field says of itself

bool inside(const Box& box, const Vec3& p) noexcept {
  return (p.array() >= box.lower.array()).all() && (p.array() <= box.upper.array()).all();
}

/// Cuts the part of a ray, by its length, that lies in a box.
void clip(const Box& box, const Vec3& from, const Vec3& direction, double& begin, double& end) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (direction[k] == 0.0) {
      if (from[k] < box.lower[k] || from[k] > box.upper[k]) end = -infinity;
      continue;
    }
    const double a = (box.lower[k] - from[k]) / direction[k];
    const double b = (box.upper[k] - from[k]) / direction[k];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
}

/// Evenly spread places of a unit cube (Roberts 2018, R3).
Vec3 spread(int index) {
  constexpr double steps[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  Vec3 place;
  for (int k = 0; k < 3; ++k) {
    const double whole = 0.5 + index * steps[k];
    place[k] = whole - std::floor(whole);
  }
  return place;
}

std::string at(const Vec3& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) m", p.x(), p.y(), p.z());
}

}  // namespace

Result<CustomSurface> CustomSurface::build(std::shared_ptr<const void> field, std::size_t bytes,
                                           const CustomQueries* queries, const CustomFacts& facts, std::string type) {
  CustomSurface surface;
  surface.field_ = std::move(field);
  surface.bytes_ = bytes;
  surface.queries_ = queries;
  surface.facts_ = facts;
  surface.type_ = std::move(type);
  const Box& box = facts.bounds;
  const double diagonal = box.diagonal();
  constexpr double largest = 1e5;
  if (!(box.lower.allFinite() && box.upper.allFinite() && (box.extent().array() > 0.0).all() && diagonal < largest &&
        box.lower.cwiseAbs().maxCoeff() < largest))
    return bad_value("is no box", "bounds", "a finite lower corner below the upper one (m), within 100 km");
  if (!(facts.lipschitz > 0.0 && std::isfinite(facts.lipschitz)))
    return bad_value(fmt::format("is {}", facts.lipschitz), "lipschitz",
                     "above 0: the largest change of the value by metre");
  if (!(facts.bend > 0.0)) return bad_value(fmt::format("is {}", facts.bend), "bend", "above 0 (1/m)");
  if (!(facts.grain >= 0.0 && std::isfinite(facts.grain)))
    return bad_value(fmt::format("is {}", facts.grain), "grain", "a length above 0 (m), or 0 for a default");
  if (facts.grain == 0.0) surface.facts_.grain = 0.01 * diagonal;
  surface.skin_ = std::min(1e-6 * diagonal, 1e-4 * surface.facts_.grain);
  surface.identity_ = next_identity();
  ASPERITY_CHECK(surface.measure());
  return surface;
}

Status CustomSurface::measure() const {
  const Box& box = facts_.bounds;
  const double apart = 1e-6 * box.diagonal();
  const double lipschitz = facts_.lipschitz;
  int bad_gradients = 0;
  Vec3 bad_place = Vec3::Zero();
  bool any = false;
  Vec3 before;
  double value_before = 0.0;
  for (int i = 0; i < most_samples; ++i) {
    const Vec3 p = box.lower + spread(i).cwiseProduct(box.extent());
    const FieldSample here = eval(p);
    const Vec3 direction = (spread(i + most_samples) - Vec3::Constant(0.5)).normalized();
    const FieldSample ahead = eval(p + apart * direction);
    const FieldSample behind = eval(p - apart * direction);
    if (!std::isfinite(here.value) || !std::isfinite(ahead.value) || !std::isfinite(behind.value))
      return bad_value(fmt::format("answers a value that is not finite at {}", at(p)), "eval",
                       "finite values in the box");
    const double slope = (ahead.value - behind.value) / (2.0 * apart);
    const double rounding = 1e-12 * (std::abs(here.value) + lipschitz * box.diagonal()) / apart;
    const double steepest =
        std::max(std::abs(slope) - rounding, here.gradient.allFinite() ? here.gradient.norm() : 0.0);
    if (steepest > lipschitz * counted)
      return bad_value(
          fmt::format("is {:.6g}, and at {} the value changes by {:.6g} a metre", lipschitz, at(p), steepest),
          "lipschitz", "the largest change of the value by metre: searches would pass through the surface");
    if (i > 0 && std::abs(here.value - value_before) > lipschitz * counted * (p - before).norm())
      return bad_value(fmt::format("is {:.6g}, and between {} and {} the value changes by {:.6g} a metre", lipschitz,
                                   at(before), at(p), std::abs(here.value - value_before) / (p - before).norm()),
                       "lipschitz",
                       "the largest change of the value by metre: searches would pass through the surface");
    constexpr double share = 0.02;
    if (!(std::abs(here.gradient.dot(direction) - slope) <= share * lipschitz + rounding)) {
      ++bad_gradients;
      bad_place = p;
    }
    const bool bends_here = facts_.sides == Sides::both || behind.value > 0.0;
    if (bends_here && !has_folds() && here.value > 0.0 &&
        (ahead.gradient - behind.gradient).norm() > 2.0 * apart * facts_.bend * 1.01 + 1e-9 * lipschitz)
      return bad_value(fmt::format("is {:.6g}, and at {} the gradient changes by {:.6g} a metre", facts_.bend, at(p),
                                   (ahead.gradient - behind.gradient).norm() / (2.0 * apart)),
                       "bend", "the largest change of the gradient by metre, or none where there are edges");
    Vec3 q = p;
    any = any || (land(q) && inside(box.grown(skin_), q));
    before = p;
    value_before = here.value;
  }
  // Edges and centres have no gradient; they are met seldom.
  if (bad_gradients > most_samples / 20)
    return bad_value(fmt::format("answers a gradient that is not the value's, at {} for one", at(bad_place)), "eval",
                     "value and gradient of one function");
  if (!any) return bad_value("holds no point where the value is 0", "bounds", "a box around the surface (m)");
  return success();
}

FieldSample CustomSurface::eval(const Vec3& p) const noexcept {
  FieldSample sample = queries_->eval(field_.get(), p);
  if (sample.element == no_index) sample.element = 0;
  return sample;
}

Vec3 CustomSurface::outward(const Vec3& p) const noexcept {
  const Vec3 gradient = eval(p).gradient;
  const double length = gradient.norm();
  return length > 0.0 && std::isfinite(length) ? Vec3(gradient / length) : Vec3(Vec3::Zero());
}

/// Leads q along the gradient onto the surface.
bool CustomSurface::land(Vec3& q) const noexcept {
  const double least = 1e-6 * facts_.lipschitz;
  for (int i = 0; i < most_landings; ++i) {
    const FieldSample here = eval(q);
    const double slope = here.gradient.norm();
    if (!(slope > least) || !std::isfinite(here.value)) return false;
    // Where the field is flat its slope says nothing of how far the surface is.
    const double far = 4.0 * std::abs(here.value) / facts_.lipschitz;
    const double step = std::min(std::abs(here.value) / slope, far);
    q -= std::copysign(step / slope, here.value) * here.gradient;
    if (step <= settled * skin_) return true;
  }
  return false;
}

/// Leads q along the surface to where it is nearest to p. False when q does not reach the surface.
bool CustomSurface::descend(const Vec3& p, Vec3& q) const noexcept {
  if (!land(q)) return false;
  double pace = 1.0;
  const auto along = [&](const Vec3& place) {
    const Vec3 normal = outward(place);
    const Vec3 offset = p - place;
    return Vec3(offset - offset.dot(normal) * normal);
  };
  Vec3 way = along(q);
  for (int i = 0; i < most_descents; ++i) {
    if (way.norm() <= settled * skin_) break;
    Vec3 next = q + pace * way;
    const bool nearer = land(next) && (p - next).squaredNorm() < (p - q).squaredNorm();
    if (!nearer) {
      pace *= 0.3;
      if (pace * way.norm() <= settled * skin_) break;
      continue;
    }
    const Vec3 moved = next - q;
    const Vec3 left = along(next);
    // The pace that would have come to rest at once (Barzilai and Borwein 1988).
    const double slower = moved.dot(way - left);
    pace = slower > 0.0 ? std::clamp(moved.squaredNorm() / slower, 0.01, 100.0) : std::min(2.0 * pace, 100.0);
    q = next;
    way = left;
  }
  return true;
}

Foot CustomSurface::foot_at(const Vec3& p, const Vec3& q) const noexcept {
  Foot foot;
  foot.point = q;
  const FieldSample there = eval(q);
  foot.element = there.element;
  const Vec3 offset = p - q;
  foot.distance = offset.norm();
  if (foot.distance > skin_) {
    foot.normal = offset / foot.distance;
  } else {
    foot.normal = eval(p).value < 0.0 ? Vec3(-outward(q)) : outward(q);
  }
  return foot;
}

/// Every nearest place that the descents find.
void CustomSurface::feet(const Vec3& p, double bound, Hint& hint, ContactSet& out) const noexcept {
  const FieldSample here = eval(p);
  // The value cannot change faster: nothing is nearer.
  const double least = std::abs(here.value) / facts_.lipschitz;
  if (!(least <= bound)) return;
  const Box box = facts_.bounds.grown(skin_);
  const auto look_from = [&](Vec3 q) {
    if (!descend(p, q) || !inside(box, q) || !((p - q).norm() <= bound)) return;
    for (const Foot& other : out) {
      if ((other.point - q).norm() <= 1e-2 * facts_.grain) return;
    }
    out.push_back(foot_at(p, q));
  };
  look_from(p);
  if (hint.iso.has_foot) look_from(hint.iso.foot);
  double reach = least;
  for (const Foot& foot : out) reach = std::max(reach, foot.distance);
  // Closer to the surface than it bends there is one nearest place.
  if (reach <= 0.1 * facts_.grain) return;
  constexpr double corners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  constexpr double length = 0.5773502691896258;
  for (const auto& corner : corners) look_from(p + 0.7 * length * reach * Vec3(corner[0], corner[1], corner[2]));
}

Foot CustomSurface::closest(const Vec3& p, double bound, Hint& hint) const noexcept {
  if (queries_->closest != nullptr) return queries_->closest(field_.get(), p, bound, hint);
  ContactSet found;
  feet(p, bound, hint, found);
  Foot best;
  for (const Foot& foot : found) {
    if (foot.distance < best.distance) best = foot;
  }
  hint.iso.has_foot = best.found();
  if (best.found()) hint.iso.foot = best.point;
  return best;
}

void CustomSurface::contacts(const Vec3& position, double radius, Sides sides, Hint& hint,
                             ContactSet& out) const noexcept {
  if (queries_->contacts != nullptr) return queries_->contacts(field_.get(), position, radius, sides, hint, out);
  ContactSet found;
  if (queries_->closest != nullptr) {
    const Foot foot = closest(position, radius + skin_, hint);
    if (foot.found()) found.push_back(foot);
  } else {
    feet(position, radius + skin_, hint, found);
  }
  for (const Foot& foot : found) {
    if (sides == Sides::front && foot.normal.dot(outward(foot.point)) < 0.0) continue;
    out.push_back(foot);
  }
}

SweptHit CustomSurface::segment(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept {
  if (queries_->segment != nullptr) return queries_->segment(field_.get(), motion, radius, sides, hint);
  return radius > 0.0 ? trace_ball(motion, radius, sides, hint) : trace(motion, sides);
}

SweptHit CustomSurface::trace(const Segment& motion, Sides sides) const noexcept {
  SweptHit hit;
  const Vec3 way = motion.to - motion.from;
  const double length = way.norm();
  if (!(length > 0.0)) return hit;
  const Vec3 direction = way / length;
  double t = 0.0;
  double end = length;
  clip(facts_.bounds.grown(0.01 * facts_.bounds.diagonal()), motion.from, direction, t, end);
  if (!(t <= end)) return hit;
  const double touched = touch_share * skin_ * facts_.lipschitz;
  FieldSample here = eval(motion.from + t * direction);
  double side = here.value < 0.0 ? -1.0 : 1.0;
  // From within a solid nothing is touched until the way has come out of it.
  bool counts = sides == Sides::both || side > 0.0;
  const auto touch = [&](double distance) {
    hit.hit = true;
    hit.t = std::min(1.0, distance / length);
    const Vec3 place = motion.from + distance * direction;
    Vec3 q = place;
    if (!land(q) || (q - place).norm() > 0.01 * facts_.grain) q = place;
    hit.contact.point = q;
    hit.contact.normal = side * outward(q);
    hit.contact.distance = (place - q).norm();
    hit.contact.element = eval(q).element;
    return hit;
  };
  for (int step = 0; step < most_steps; ++step) {
    const double clear = side * here.value;
    const double rate = side * here.gradient.dot(direction);
    double ahead = touch_share * skin_;
    const bool close = clear <= touched;
    if (close) {
      if (counts && rate < 0.0) return touch(t);
    } else {
      ahead = clear / facts_.lipschitz;
      if (!has_folds() && (side > 0.0 || facts_.sides == Sides::both))
        ahead = std::max(ahead, (rate + std::sqrt(rate * rate + 2.0 * facts_.bend * clear)) / facts_.bend);
      if (t + ahead >= end) return hit;
    }
    const double before = t;
    t = std::min(t + ahead, end);
    here = eval(motion.from + t * direction);
    if (side * here.value < 0.0) {
      if (counts) {
        double low = before;
        double high = t;
        while (high - low > touch_share * skin_) {
          const double middle = 0.5 * (low + high);
          if (middle <= low || middle >= high) break;
          (side * eval(motion.from + middle * direction).value < 0.0 ? high : low) = middle;
        }
        return touch(low);
      }
      side = -side;
      counts = true;
    }
    if (t >= end) return hit;
  }
  // Along a surface for long: rather stopped early than let through.
  return counts ? touch(t) : hit;
}

SweptHit CustomSurface::trace_ball(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept {
  constexpr double smallest_step = 0.05;  // of the radius
  SweptHit hit;
  const Vec3 way = motion.to - motion.from;
  const double length = way.norm();
  if (!(length > 0.0)) return hit;
  const Vec3 direction = way / length;
  double t = 0.0;
  for (int step = 0; step < most_steps; ++step) {
    const Vec3 centre = motion.from + t * direction;
    const double value = eval(centre).value;
    const Foot foot = closest(centre, infinity, hint);
    const double certain = std::abs(value) / facts_.lipschitz - radius;
    const bool counts = foot.found() && (sides == Sides::both || value >= 0.0);
    const double clear = counts ? foot.distance - radius : certain;
    if (counts && clear <= 0.75 * skin_ && foot.normal.dot(direction) < 0.0) {
      hit.hit = true;
      hit.t = t / length;
      hit.contact = foot;
      return hit;
    }
    t += std::max({clear, certain, clear > skin_ ? 0.25 * skin_ : smallest_step * radius});
    if (t >= length) return hit;
  }
  return hit;
}

namespace {

struct Registered {
  std::vector<std::string> names;
  std::vector<CustomSurfaceFactory> factories;
};

Registered& registry() {
  static Registered all;
  return all;
}

}  // namespace

Status register_custom_surface(std::string name, CustomSurfaceFactory factory) {
  Registered& all = registry();
  if (!is_plain_name(name))
    return Error{ErrorCode::bad_value,
                 fmt::format("\"{}\" is no name of a surface", name),
                 {},
                 "name",
                 "lower-case letters, digits and hyphens"};
  if (std::find(all.names.begin(), all.names.end(), name) != all.names.end())
    return Error{
        ErrorCode::bad_value, fmt::format("a surface \"{}\" is registered already", name), {}, "name", "another name"};
  if (!factory)
    return Error{ErrorCode::bad_value,
                 fmt::format("the surface \"{}\" has no factory", name),
                 {},
                 "factory",
                 "a function that makes it"};
  all.names.push_back(std::move(name));
  all.factories.push_back(std::move(factory));
  return success();
}

Result<CustomSurface> make_custom_surface(std::string_view name, NamedNumbers& numbers) {
  const Registered& all = registry();
  const auto found = std::find(all.names.begin(), all.names.end(), name);
  if (found == all.names.end()) {
    std::string list;
    for (const std::string& known : all.names) list += (list.empty() ? "" : ", ") + known;
    const std::string near = nearest_name(name, all.names);
    return Error{ErrorCode::bad_value,
                 fmt::format("\"{}\" is no surface that this program knows{}", name,
                             near.empty() ? std::string() : fmt::format("; did you mean \"{}\"?", near)),
                 {},
                 "type",
                 list.empty() ? std::string("a program that registers it (docs/methods/custom.md)") : list};
  }
  ASPERITY_TRY(CustomSurface surface, all.factories[static_cast<std::size_t>(found - all.names.begin())](numbers));
  ASPERITY_CHECK(numbers.all_taken());
  return surface;
}

const std::vector<std::string>& custom_surface_names() {
  return registry().names;
}

}  // namespace asperity
