#include "asperity/render/custom_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/identity.h"
#include "asperity/core/suggest.h"
#include "asperity/render/detail/iso_proxy.h"

namespace asperity {

namespace {

struct Registered {
  std::vector<std::string> names;
  std::vector<CustomLawFactory> factories;
};

Registered& registry() {
  static Registered all;
  return all;
}

}  // namespace

FieldSample TouchedSurface::eval(const Vec3& p) const noexcept {
  if (const IsoSurface* iso = iso_of(instance_->surface)) {
    // The level and the threshold of this tick.
    const IsoView view = felt_view(*iso, *slot_);
    FieldSample sample;
    FieldJet jet;
    if (!view.sample(p, slot_->hint.iso, jet)) return sample;
    const double length = jet.gradient.norm();
    if (!(length > 0.0)) return sample;
    sample.value = view.sigma * (jet.value - view.threshold) / length;
    sample.gradient = (view.sigma / length) * jet.gradient;
    sample.element = element_at(*instance_, p, *slot_);
    return sample;
  }
  return std::visit([&](const auto& surface) { return surface->eval(p, slot_->hint); }, instance_->surface);
}

Foot TouchedSurface::closest(const Vec3& p, double bound) const noexcept {
  if (const IsoSurface* iso = iso_of(instance_->surface))
    return felt_view(*iso, *slot_).closest(p, bound, slot_->hint.iso);
  return std::visit([&](const auto& surface) { return surface->closest(p, bound, slot_->hint); }, instance_->surface);
}

CustomLaw::CustomLaw(std::string name) : name_(std::move(name)), identity_(next_identity()) {}

LawForce CustomLaw::force(const Instance& instance, const Material& material, const Vec3& probe, const Vec3& velocity,
                          Seconds dt, ContactState& slot) const noexcept {
  CustomLawState& state = slot.custom;
  if (state.law != identity_) {
    reset_(state.bytes.data());
    state.law = identity_;
  }
  // It has been asked now: what was before the first tick in reach is known.
  slot.seen_outside = true;
  slot.iso.started = true;
  const TouchedSurface surface(instance, slot);
  const CustomForce answer = force_(law_.get(), surface, material, probe, velocity, dt, state.bytes.data());
  LawForce force;
  force.height = answer.height;
  const bool finite = answer.force.allFinite() && answer.point.allFinite() && answer.normal.allFinite() &&
                      std::isfinite(answer.penetration) && std::isfinite(answer.height);
  if (!answer.contact || !finite) return force;
  force.contact = true;
  force.force = answer.force;
  force.point = answer.point;
  force.normal = answer.normal;
  force.penetration = answer.penetration;
  force.element = answer.element;
  force.damped = answer.damped;
  if (answer.damped) force.push = std::max(0.0, answer.force.dot(answer.normal));
  return force;
}

Status register_custom_law(std::string name, CustomLawFactory factory) {
  Registered& all = registry();
  if (!is_plain_name(name))
    return Error{ErrorCode::bad_value,
                 fmt::format("\"{}\" is no name of a law", name),
                 {},
                 "name",
                 "lower-case letters, digits and hyphens"};
  const auto taken = [&](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (taken(all.names) || taken(law_names()))
    return Error{ErrorCode::bad_value, fmt::format("there is a law \"{}\" already", name), {}, "name", "another name"};
  if (!factory)
    return Error{ErrorCode::bad_value,
                 fmt::format("the law \"{}\" has no factory", name),
                 {},
                 "factory",
                 "a function that makes it"};
  all.names.push_back(std::move(name));
  all.factories.push_back(std::move(factory));
  return success();
}

const std::vector<std::string>& custom_law_names() {
  return registry().names;
}

Result<Law> make_custom_law(std::string_view name, NamedNumbers numbers) {
  const Registered& all = registry();
  const auto found = std::find(all.names.begin(), all.names.end(), name);
  // The list of all laws is law_by_name's to tell.
  if (found == all.names.end()) return law_by_name(name);
  ASPERITY_TRY(const CustomLaw law, all.factories[static_cast<std::size_t>(found - all.names.begin())](numbers));
  ASPERITY_CHECK(numbers.all_taken());
  return Law(std::make_shared<const CustomLaw>(law.made_from(std::move(numbers))));
}

}  // namespace asperity
