#include "asperity/render/contact/normal_map.h"

#include <algorithm>

#include "asperity/render/laws/proxy.h"

namespace asperity {

void turn_by_normal_map(NormalMapUse use, const Touched& touch, std::uint32_t face, const Vec3& place, bool world,
                        LawForce& answer) noexcept {
  if (use == NormalMapUse::ignored || !answer.contact) return;
  const ReliefSurface* relief = relief_of(*touch.instance);
  if (relief == nullptr || !relief->coat().maps_on(face).has_normal_map()) return;
  const Coat& coat = relief->coat();
  if (use == NormalMapUse::automatic && coat.lowest() < coat.highest()) return;
  Vec3 mapped = relief->coat_sample(face, place, touch.moment).normal;
  if (world) mapped = touch.turned(mapped);
  // On the side touched; and no slope steeper than ten, of which a texel may speak but no force.
  constexpr double least_rise = 0.1;
  double rise = mapped.dot(answer.normal);
  if (rise < 0.0) {
    mapped = -mapped;
    rise = -rise;
  }
  answer.turns = true;
  answer.turn = answer.force.norm() / std::max(least_rise, rise) * (mapped - rise * answer.normal);
}

void ProxyLaw::finish(const Touched& touch, const Foot& contact, LawForce& answer) const noexcept {
  turn_by_normal_map(normal_map, touch, contact.element, contact.at, true, answer);
}

}  // namespace asperity
