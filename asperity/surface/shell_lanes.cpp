// The shell's inverse at several points at once.

#include <cstdint>
#include <cstring>

#include "asperity/core/processor.h"
#include "asperity/surface/detail/four.h"
#include "asperity/surface/shell.h"

namespace asperity {

namespace {

using four::Vectors;
using four::Wide;
using Mask = decltype(Wide{} == Wide{});

/// start + s a + t b
ASPERITY_FOUR void combine(const Vec3& start, const Wide& s, const Vec3& a, const Wide& t, const Vec3& b,
                           Vectors& out) {
  for (int axis = 0; axis < 3; ++axis) out[static_cast<std::size_t>(axis)] = start[axis] + s * a[axis] + t * b[axis];
}
ASPERITY_FOUR bool all(const Mask& mask) {
  return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
}

/// S's derivatives by its three coordinates at four places.
struct Derivatives {
  Vectors u;
  Vectors v;
  Vectors height;
  Vectors across;  ///< u x v
  Wide determinant;
};

ASPERITY_FOUR void derivatives_at(const ShellPrism& prism, const Wide& u, const Wide& v, const Wide& h,
                                  Derivatives& out) {
  const Wide none{};
  combine(prism.edge_u, h, prism.turn_u, none, prism.turn_u, out.u);
  combine(prism.edge_v, h, prism.turn_v, none, prism.turn_v, out.v);
  combine(prism.direction, u, prism.turn_u, v, prism.turn_v, out.height);
  four::cross(out.u, out.v, out.across);
  four::dot(out.across, out.height, out.determinant);
}

/// Newton's steps of ShellPrism::invert, side by side. A place that has settled goes on, which changes nothing but
/// rounding.
ASPERITY_FOUR void invert_wide(const ShellPrism& prism, const std::array<Lanes, 3>& points, ShellPlaces& places) {
  constexpr int most_steps = 16;
  constexpr double enough = ShellPrism::enough_of_step;
  constexpr double far = ShellPrism::far_of_step;
  Wide u;
  Wide v;
  Wide h;
  std::memcpy(&u, places.u.data(), sizeof(u));
  std::memcpy(&v, places.v.data(), sizeof(v));
  std::memcpy(&h, places.height.data(), sizeof(h));
  Mask settled{};
  Mask lost{};
  Derivatives by;
  for (int i = 0; i < most_steps; ++i) {
    derivatives_at(prism, u, v, h, by);
    Vectors rest;
    combine(prism.corner, u, prism.edge_u, v, prism.edge_v, rest);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Wide p;
      std::memcpy(&p, points[axis].data(), sizeof(p));
      rest[axis] = p - rest[axis] - h * by.height[axis];
    }
    Vectors turned;
    four::cross(rest, by.height, turned);
    Wide step_u;
    Wide step_v;
    Wide step_h;
    four::dot(by.v, turned, step_u);
    four::dot(by.u, turned, step_v);
    four::dot(by.across, rest, step_h);
    const Wide per = 1.0 / by.determinant;
    step_u *= -per;
    step_v *= per;
    step_h *= per;
    u += step_u;
    v += step_v;
    h += step_h;
    four::magnitude(step_u, step_u);
    four::magnitude(step_v, step_v);
    const Wide plane = step_u + step_v;
    Wide area;
    four::dot(by.across, by.across, area);
    const Wide fourth = step_h * step_h * (step_h * step_h);
    settled |= (plane <= enough) & (fourth <= area * ((enough * enough) * (enough * enough)));
    // Not a number is as far as can be.
    lost |= ~((plane <= far) & (fourth <= area * ((far * far) * (far * far))));
    if (all(settled | lost)) break;
  }
  derivatives_at(prism, u, v, h, by);
  const Mask reached = settled & ~lost & (by.determinant > 0.0);
  std::memcpy(places.u.data(), &u, sizeof(u));
  std::memcpy(places.v.data(), &v, sizeof(v));
  std::memcpy(places.height.data(), &h, sizeof(h));
  for (std::size_t i = 0; i < lanes; ++i) places.reached[i] = reached[i] != 0;
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void invert_by_avx2(const ShellPrism& prism, const std::array<Lanes, 3>& points,
                                            ShellPlaces& places) noexcept {
  invert_wide(prism, points, places);
}
#endif

}  // namespace

void ShellPrism::invert(const std::array<Lanes, 3>& points, ShellPlaces& places) const noexcept {
#if defined(__x86_64__)
  if (has_avx2()) return invert_by_avx2(*this, points, places);
#endif
  invert_wide(*this, points, places);
}

}  // namespace asperity
