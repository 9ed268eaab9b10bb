#include "asperity/surface/custom/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "asperity/core/identity.h"
#include "asperity/core/suggest.h"
#include "asperity/core/units.h"

namespace asperity {

namespace {

constexpr int most_landings = 48;       // Newton steps onto the surface
constexpr int most_samples = 4096;      // at which a field is measured
constexpr double counted = 1.0 + 1e-6;  // rounding of what a field says of itself

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

struct Registered {
  std::vector<std::string> names;
  std::vector<CustomSurfaceFactory> factories;
};

Registered& registry() {
  static Registered all;
  return all;
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
    const auto too_steep = [&](const std::string& where, double change) {
      return bad_value(fmt::format("is {:.6g}, and {} the value changes by {:.6g} a metre", lipschitz, where, change),
                       "lipschitz",
                       "the largest change of the value by metre: searches would pass through the surface");
    };
    if (steepest > lipschitz * counted) return too_steep("at " + at(p), steepest);
    if (i > 0 && std::abs(here.value - value_before) > lipschitz * counted * (p - before).norm())
      return too_steep(fmt::format("between {} and {}", at(before), at(p)),
                       std::abs(here.value - value_before) / (p - before).norm());
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
    any = any || (land(q) && holds(q));
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

/// Leads q along the gradient onto the surface.
bool CustomSurface::land(Vec3& q, WorkMeter* asked) const noexcept {
  const double least = 1e-6 * facts_.lipschitz;
  for (int i = 0; i < most_landings; ++i) {
    const FieldSample here = eval(q);
    tell(asked, {1, 0, 0});
    const double slope = here.gradient.norm();
    if (!(slope > least) || !std::isfinite(here.value)) return false;
    // Where the field is flat its slope says nothing of how far the surface is.
    const double far = 4.0 * std::abs(here.value) / facts_.lipschitz;
    const double step = std::min(std::abs(here.value) / slope, far);
    q -= std::copysign(step / slope, here.value) * here.gradient;
    if (step <= settled()) return true;
  }
  return false;
}

Status register_custom_surface(std::string name, CustomSurfaceFactory factory) {
  Registered& all = registry();
  if (!is_plain_name(name))
    return bad_value(fmt::format("\"{}\" is no name of a surface", name), "name",
                     "lower-case letters, digits and hyphens");
  if (std::find(all.names.begin(), all.names.end(), name) != all.names.end())
    return bad_value(fmt::format("a surface \"{}\" is registered already", name), "name", "another name");
  if (!factory)
    return bad_value(fmt::format("the surface \"{}\" has no factory", name), "factory", "a function that makes it");
  all.names.push_back(std::move(name));
  all.factories.push_back(std::move(factory));
  return success();
}

Result<CustomSurface> make_custom_surface(std::string_view name, NamedNumbers& numbers) {
  const Registered& all = registry();
  const auto found = std::find(all.names.begin(), all.names.end(), name);
  if (found == all.names.end()) {
    const std::string near = nearest_name(name, all.names);
    return bad_value(fmt::format("\"{}\" is no surface that this program knows{}", name,
                                 near.empty() ? std::string() : fmt::format("; did you mean \"{}\"?", near)),
                     "type",
                     all.names.empty() ? "a program that registers it (docs/methods/custom.md)" : listed(all.names));
  }
  ASPERITY_TRY(CustomSurface surface, all.factories[static_cast<std::size_t>(found - all.names.begin())](numbers));
  ASPERITY_CHECK(numbers.all_taken());
  return surface;
}

}  // namespace asperity
