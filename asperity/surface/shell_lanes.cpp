// The shell's inverse at several points at once.

#include <cstdint>
#include <cstring>

#include "asperity/surface/shell.h"

namespace asperity {

namespace {

// Split in halves, or further, where registers are not as wide.
using Wide = double __attribute__((vector_size(sizeof(Lanes))));
using Mask = std::int64_t __attribute__((vector_size(sizeof(Lanes))));

struct WideVector {
  Wide x, y, z;
};

/// start + s a + t b
[[gnu::always_inline]] inline void combine(const Vec3& start, const Wide& s, const Vec3& a, const Wide& t,
                                           const Vec3& b, WideVector& out) {
  out.x = start.x() + s * a.x() + t * b.x();
  out.y = start.y() + s * a.y() + t * b.y();
  out.z = start.z() + s * a.z() + t * b.z();
}
[[gnu::always_inline]] inline void cross(const WideVector& a, const WideVector& b, WideVector& out) {
  out.x = a.y * b.z - a.z * b.y;
  out.y = a.z * b.x - a.x * b.z;
  out.z = a.x * b.y - a.y * b.x;
}
[[gnu::always_inline]] inline void dot(const WideVector& a, const WideVector& b, Wide& out) {
  out = a.x * b.x + a.y * b.y + a.z * b.z;
}
[[gnu::always_inline]] inline void load(const Lanes& from, Wide& to) {
  std::memcpy(&to, from.data(), sizeof(to));
}
[[gnu::always_inline]] inline bool all(const Mask& mask) {
  return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
}

/// Newton's steps of ShellPrism::invert, side by side. A place that has settled goes on, which changes nothing but
/// rounding.
[[gnu::always_inline]] inline void invert_wide(const ShellPrism& prism, const std::array<Lanes, 3>& points,
                                               ShellPlaces& places) {
  constexpr int most_steps = 16;
  Wide u;
  Wide v;
  Wide h;
  WideVector p;
  load(places.u, u);
  load(places.v, v);
  load(places.height, h);
  load(points[0], p.x);
  load(points[1], p.y);
  load(points[2], p.z);
  Mask settled{};
  Mask lost{};
  WideVector du;
  WideVector dv;
  WideVector dh;
  WideVector across;
  const Wide none{};
  for (int i = 0; i < most_steps; ++i) {
    combine(prism.edge_u, h, prism.turn_u, none, prism.turn_u, du);
    combine(prism.edge_v, h, prism.turn_v, none, prism.turn_v, dv);
    combine(prism.direction, u, prism.turn_u, v, prism.turn_v, dh);
    WideVector base;
    combine(prism.corner, u, prism.edge_u, v, prism.edge_v, base);
    const WideVector rest{p.x - base.x - h * dh.x, p.y - base.y - h * dh.y, p.z - base.z - h * dh.z};
    cross(du, dv, across);
    Wide det;
    dot(across, dh, det);
    const Wide per = 1.0 / det;
    WideVector turned;
    cross(rest, dh, turned);
    Wide step_u;
    Wide step_v;
    Wide step_h;
    dot(dv, turned, step_u);
    dot(du, turned, step_v);
    dot(across, rest, step_h);
    step_u *= -per;
    step_v *= per;
    step_h *= per;
    u += step_u;
    v += step_v;
    h += step_h;
    const Wide plane = (step_u < 0.0 ? -step_u : step_u) + (step_v < 0.0 ? -step_v : step_v);
    Wide area;
    dot(across, across, area);
    const Wide fourth = step_h * step_h * (step_h * step_h);
    constexpr double enough = ShellPrism::enough_of_step;
    constexpr double far = ShellPrism::far_of_step;
    settled |= (plane <= enough) & (fourth <= area * ((enough * enough) * (enough * enough)));
    // Not a number is as far as can be.
    lost |= ~((plane <= far) & (fourth <= area * ((far * far) * (far * far))));
    if (all(settled | lost)) break;
  }
  combine(prism.edge_u, h, prism.turn_u, none, prism.turn_u, du);
  combine(prism.edge_v, h, prism.turn_v, none, prism.turn_v, dv);
  combine(prism.direction, u, prism.turn_u, v, prism.turn_v, dh);
  cross(du, dv, across);
  Wide det;
  dot(across, dh, det);
  const Mask reached = settled & ~lost & (det > 0.0);
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
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return invert_by_avx2(*this, points, places);
#endif
  invert_wide(*this, points, places);
}

}  // namespace asperity
