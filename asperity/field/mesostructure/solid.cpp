#include "asperity/field/mesostructure/solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/core/rng.h"

namespace asperity {
namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
// Squares of what lies within are finite, divided by any wavelength too.
constexpr double farthest = 1e100;

// What the lattice noise of gradients along cube edges, of length sqrt(2), can reach: the largest over the cell, and
// over all directions, of the sum over the corners of what each can add at most, rounded up.
constexpr double most_noise = 1.0364;
constexpr double most_noise_slope = 3.751;
constexpr double most_noise_bend = 14.6;

Status check_length(double value, const char* place) {
  if (std::isfinite(value) && value >= 1e-12) return success();
  return bad_value(fmt::format("is {} m", value), place, "a finite length above 0 (1e-12 m or more)");
}

Status check_finite(const Vec3& value, const char* place) {
  if (value.allFinite()) return success();
  return bad_value("is not finite", place, "three finite numbers");
}

Status check_noise(const SolidSpec& spec) {
  ASPERITY_CHECK(check_finite(spec.drift, "drift"));
  if (spec.octaves < 1 || spec.octaves > 8)
    return bad_value(fmt::format("there are to be {}", spec.octaves), "octaves", "1 to 8");
  if (!(spec.persistence >= 0.0 && spec.persistence <= 1.0))
    return bad_value(fmt::format("is {}", spec.persistence), "persistence", "0 to 1");
  return success();
}

Status check(const SolidSpec& spec) {
  ASPERITY_CHECK(check_length(spec.amplitude, "amplitude"));
  ASPERITY_CHECK(check_length(spec.wavelength, "wavelength"));
  if (spec.kind == SolidKind::noise) return check_noise(spec);
  if (!std::isfinite(spec.frequency)) return bad_value("is not finite", "frequency", "a finite frequency (Hz)");
  ASPERITY_CHECK(check_finite(spec.centre, "centre"));
  if (!std::isfinite(spec.phase)) return bad_value("is not finite", "phase", "a finite angle (rad)");
  const double length = spec.direction.norm();
  const bool directed = spec.kind == SolidKind::waves || spec.kind == SolidKind::lattice;
  if (directed && !(std::isfinite(length) && length > 1e-100))
    return bad_value("has no direction", "direction", "three finite numbers that are not all 0");
  if (spec.kind == SolidKind::pulse && !(spec.frequency > 0.0))
    return bad_value(fmt::format("is {} Hz: the pulse would never rise", spec.frequency), "frequency", "above 0 Hz");
  return success();
}

/// Bounds of the cosine over the closed interval `middle` +- `half`.
HeightRange cosine_range(double middle, double half) noexcept {
  const double slack = 1e-12 * (1.0 + std::abs(middle));
  half += slack;
  if (!(half < std::numbers::pi)) return {-1.0, 1.0};
  const auto passes = [&](double angle) { return std::abs(std::remainder(middle - angle, two_pi)) <= half; };
  const double a = std::cos(middle - half);
  const double b = std::cos(middle + half);
  return {passes(std::numbers::pi) ? -1.0 : std::min(a, b) - 1e-15, passes(0.0) ? 1.0 : std::max(a, b) + 1e-15};
}

/// Least and greatest distance of a box from a point.
struct DistanceRange {
  double nearest = 0.0;
  double farthest = 0.0;
};
DistanceRange distance_range(const Vec3& point, const Vec3& centre, const Vec3& half_extent) noexcept {
  const Vec3 apart = (centre - point).cwiseAbs();
  return {(apart - half_extent).cwiseMax(0.0).norm(), (apart + half_extent).norm()};
}

// ---- lattice noise ----------------------------------------------------------------------

/// The twelve edges of a cube, four of them twice so that four bits choose (Perlin 2002); one cache line.
alignas(64) constexpr std::int8_t edges[16][4] = {{1, 1, 0, 0}, {-1, 1, 0, 0}, {1, -1, 0, 0}, {-1, -1, 0, 0},
                                                  {1, 0, 1, 0}, {-1, 0, 1, 0}, {1, 0, -1, 0}, {-1, 0, -1, 0},
                                                  {0, 1, 1, 0}, {0, -1, 1, 0}, {0, 1, -1, 0}, {0, -1, -1, 0},
                                                  {1, 1, 0, 0}, {-1, 1, 0, 0}, {0, -1, 1, 0}, {0, -1, -1, 0}};

/// A quintic from 0 to 1 with its derivatives, those of both ends 0.
struct Fade {
  double value = 0.0;
  double first = 0.0;
  double second = 0.0;
  explicit Fade(double t) noexcept
      : value(t * t * t * (t * (6.0 * t - 15.0) + 10.0)),
        first(30.0 * t * t * (t * (t - 2.0) + 1.0)),
        second(60.0 * t * (t * (2.0 * t - 3.0) + 1.0)) {}
};

/// Value, gradient and second derivatives in units of the cell.
struct CellJet {
  double f = 0.0;
  double x = 0.0, y = 0.0, z = 0.0;
  double xx = 0.0, yy = 0.0, zz = 0.0, xy = 0.0, xz = 0.0, yz = 0.0;
};

/// The plane through a lattice point with its gradient.
struct Corner {
  double f, x, y, z;
  Corner(std::uint64_t hash, double dx, double dy, double dz) noexcept {
    hash ^= hash >> 31U;
    hash *= 0x9E3779B97F4A7C15ULL;
    const std::int8_t* edge = edges[hash >> 60U];
    x = edge[0];
    y = edge[1];
    z = edge[2];
    f = x * dx + y * dy + z * dz;
  }
};

/// Between two corners along x.
CellJet mixed_along_x(const Corner& a, const Corner& b, const Fade& u) noexcept {
  const double f = b.f - a.f;
  const double x = b.x - a.x;
  const double y = b.y - a.y;
  const double z = b.z - a.z;
  CellJet jet;
  jet.f = a.f + u.value * f;
  jet.x = a.x + u.value * x + u.first * f;
  jet.y = a.y + u.value * y;
  jet.z = a.z + u.value * z;
  jet.xx = u.second * f + 2.0 * u.first * x;
  jet.xy = u.first * y;
  jet.xz = u.first * z;
  return jet;
}

CellJet mixed_along_y(const CellJet& a, const CellJet& b, const Fade& v) noexcept {
  const double f = b.f - a.f;
  const double x = b.x - a.x;
  const double y = b.y - a.y;
  const double z = b.z - a.z;
  CellJet jet;
  jet.f = a.f + v.value * f;
  jet.x = a.x + v.value * x;
  jet.y = a.y + v.value * y + v.first * f;
  jet.z = a.z + v.value * z;
  jet.xx = a.xx + v.value * (b.xx - a.xx);
  jet.xz = a.xz + v.value * (b.xz - a.xz);
  jet.xy = a.xy + v.value * (b.xy - a.xy) + v.first * x;
  jet.yy = v.second * f + 2.0 * v.first * y;
  jet.yz = v.first * z;
  return jet;
}

CellJet mixed_along_z(const CellJet& a, const CellJet& b, const Fade& w) noexcept {
  const double f = b.f - a.f;
  CellJet jet;
  jet.f = a.f + w.value * f;
  jet.x = a.x + w.value * (b.x - a.x);
  jet.y = a.y + w.value * (b.y - a.y);
  jet.z = a.z + w.value * (b.z - a.z) + w.first * f;
  jet.xx = a.xx + w.value * (b.xx - a.xx);
  jet.yy = a.yy + w.value * (b.yy - a.yy);
  jet.xy = a.xy + w.value * (b.xy - a.xy);
  jet.xz = a.xz + w.value * (b.xz - a.xz) + w.first * (b.x - a.x);
  jet.yz = a.yz + w.value * (b.yz - a.yz) + w.first * (b.y - a.y);
  jet.zz = w.second * f + 2.0 * w.first * (b.z - a.z);
  return jet;
}

/// The cell a coordinate lies in. Coordinates beyond what doubles tell apart to a cell read as 0.
struct Cell {
  std::uint64_t hash;
  double offset;
  Cell(double coordinate, std::uint64_t factor) noexcept {
    if (!(std::abs(coordinate) < 0x1p50)) [[unlikely]]
      coordinate = 0.0;
    const auto towards_zero = static_cast<std::int64_t>(coordinate);
    const std::int64_t index = towards_zero - (static_cast<double>(towards_zero) > coordinate ? 1 : 0);
    offset = coordinate - static_cast<double>(index);
    hash = static_cast<std::uint64_t>(index) * factor;
  }
};

constexpr std::uint64_t factor_x = 0xD6E8FEB86659FD93ULL;
constexpr std::uint64_t factor_y = 0xA0761D6478BD642FULL;
constexpr std::uint64_t factor_z = 0xE7037ED1A0B428DBULL;

CellJet noise_at(const Vec3& cells, std::uint64_t key) noexcept {
  const Cell cx(cells.x(), factor_x);
  const Cell cy(cells.y(), factor_y);
  const Cell cz(cells.z(), factor_z);
  const Fade u(cx.offset);
  const auto edge = [&](std::uint64_t hash, double dy, double dz) {
    return mixed_along_x(Corner(hash, cx.offset, dy, dz), Corner(hash + factor_x, cx.offset - 1.0, dy, dz), u);
  };
  const Fade v(cy.offset);
  const auto face = [&](std::uint64_t hash, double dz) {
    return mixed_along_y(edge(hash, cy.offset, dz), edge(hash + factor_y, cy.offset - 1.0, dz), v);
  };
  const std::uint64_t hash = key + cx.hash + cy.hash + cz.hash;
  return mixed_along_z(face(hash, cz.offset), face(hash + factor_z, cz.offset - 1.0), Fade(cz.offset));
}

}  // namespace

Result<SolidMesostructure> SolidMesostructure::build(const SolidSpec& spec) {
  ASPERITY_CHECK(check(spec));
  SolidMesostructure solid;
  solid.spec_ = spec;
  if (spec.kind == SolidKind::waves || spec.kind == SolidKind::lattice) {
    const Vec3 first = spec.direction.normalized();
    const Vec3 second = first.unitOrthogonal();
    solid.spec_.direction = first;
    solid.axes_.col(0) = first;
    solid.axes_.col(1) = second;
    solid.axes_.col(2) = first.cross(second);
  }
  if (spec.kind == SolidKind::noise) {
    Rng rng(spec.seed);
    double sum = 0.0;
    for (int k = 0; k < spec.octaves; ++k) sum += std::pow(spec.persistence, k);
    for (int k = 0; k < spec.octaves; ++k) {
      Octave& octave = solid.octaves_[static_cast<std::size_t>(k)];
      octave.shift = Vec3(rng.uniform(), rng.uniform(), rng.uniform());
      octave.key = (static_cast<std::uint64_t>(rng.next()) << 32U) | rng.next();
      octave.frequency = std::exp2(k) / spec.wavelength;
      octave.amplitude = spec.amplitude * std::pow(spec.persistence, k) / (sum * most_noise);
    }
  }
  return solid;
}

/// The part of a wave's angle that is the same everywhere (rad); whole turns are left out first.
double SolidMesostructure::turn(double time) const noexcept {
  const double turns = spec_.frequency * time;
  return spec_.phase - two_pi * (turns - std::floor(turns));
}

double SolidMesostructure::beat(double time) const noexcept {
  const double turns = spec_.frequency * time;
  return 0.5 * spec_.amplitude * (1.0 - std::cos(two_pi * (turns - std::floor(turns))));
}

SolidJet SolidMesostructure::wave_jet(const Vec3& axis, double amplitude, const Vec3& p, double time) const noexcept {
  const double number = two_pi / spec_.wavelength;
  const double angle = number * axis.dot(p) + turn(time);
  const double height = amplitude * std::cos(angle);
  SolidJet jet;
  jet.height = height;
  jet.gradient = (-amplitude * number * std::sin(angle)) * axis;
  jet.second = (-height * number * number) * (axis * axis.transpose());
  return jet;
}

SolidJet SolidMesostructure::ring_jet(const Vec3& p, double time) const noexcept {
  const double number = two_pi / spec_.wavelength;
  const double rounding = 0.25 * spec_.wavelength;
  const Vec3 arm = p - spec_.centre;
  const double distance = std::sqrt(arm.squaredNorm() + rounding * rounding);
  const double angle = number * (distance - rounding) + turn(time);
  const double height = spec_.amplitude * std::cos(angle);
  const double slope = -spec_.amplitude * number * std::sin(angle);
  const Vec3 outward = arm / distance;
  const Mat3 along = outward * outward.transpose();
  SolidJet jet;
  jet.height = height;
  jet.gradient = slope * outward;
  jet.second = (-height * number * number) * along + (slope / distance) * (Mat3::Identity() - along);
  return jet;
}

SolidJet SolidMesostructure::noise_jet(const Vec3& p, double time) const noexcept {
  const Vec3 carried = p - time * spec_.drift;
  SolidJet jet;
  for (const Octave& octave : octaves()) {
    const CellJet cell = noise_at(octave.frequency * carried + octave.shift, octave.key);
    const double slope = octave.amplitude * octave.frequency;
    const double bend = slope * octave.frequency;
    jet.height += octave.amplitude * cell.f;
    jet.gradient += slope * Vec3(cell.x, cell.y, cell.z);
    Mat3 second;
    second << cell.xx, cell.xy, cell.xz, cell.xy, cell.yy, cell.yz, cell.xz, cell.yz, cell.zz;
    jet.second += bend * second;
  }
  return jet;
}

SolidJet SolidMesostructure::pulse_jet(const Vec3& p, double time) const noexcept {
  SolidJet jet;
  const Vec3 arm = (p - spec_.centre) / spec_.wavelength;
  const double inside = 1.0 - arm.squaredNorm();
  if (!(inside > 0.0)) return jet;
  const double height = beat(time);
  jet.height = height * inside * inside * inside;
  jet.gradient = (-6.0 * height * inside * inside / spec_.wavelength) * arm;
  jet.second = (6.0 * height * inside / (spec_.wavelength * spec_.wavelength)) *
               (4.0 * (arm * arm.transpose()) - inside * Mat3::Identity());
  return jet;
}

SolidJet SolidMesostructure::jet(const Vec3& p, double time) const noexcept {
  SolidJet jet;
  if (!(p.cwiseAbs().maxCoeff() < farthest && std::abs(time) < farthest) || !p.allFinite()) [[unlikely]]
    return jet;
  switch (spec_.kind) {
    case SolidKind::waves: return wave_jet(spec_.direction, spec_.amplitude, p, time);
    case SolidKind::lattice:
      for (int i = 0; i < 3; ++i) {
        const SolidJet wave = wave_jet(axes_.col(i), spec_.amplitude / 3.0, p, time);
        jet.height += wave.height;
        jet.gradient += wave.gradient;
        jet.second += wave.second;
      }
      return jet;
    case SolidKind::rings: return ring_jet(p, time);
    case SolidKind::noise: return noise_jet(p, time);
    case SolidKind::pulse: return pulse_jet(p, time);
  }
  return jet;
}

HeightRange SolidMesostructure::wave_range(const Vec3& axis, double amplitude, const Vec3& centre,
                                           const Vec3& half_extent, double time) const noexcept {
  const double number = two_pi / spec_.wavelength;
  const HeightRange range =
      cosine_range(number * axis.dot(centre) + turn(time), number * axis.cwiseAbs().dot(half_extent));
  return {amplitude * range.lowest, amplitude * range.highest};
}

HeightRange SolidMesostructure::noise_range(const Vec3& centre, const Vec3& half_extent, double time) const noexcept {
  const Vec3 carried = centre - time * spec_.drift;
  HeightRange range;
  for (const Octave& octave : octaves()) {
    const Vec3 half = octave.frequency * half_extent;
    const double radius = half.norm();
    double low = -most_noise;
    double high = most_noise;
    if (radius < 2.0 * most_noise / most_noise_slope) {
      const CellJet cell = noise_at(octave.frequency * carried + octave.shift, octave.key);
      const double first = Vec3(cell.x, cell.y, cell.z).cwiseAbs().dot(half);
      const double reach = std::min(most_noise_slope * radius, first + 0.5 * most_noise_bend * radius * radius) + 1e-12;
      low = std::max(low, cell.f - reach);
      high = std::min(high, cell.f + reach);
    }
    range.lowest += octave.amplitude * low;
    range.highest += octave.amplitude * high;
  }
  return range;
}

HeightRange SolidMesostructure::range(const Vec3& centre, const Vec3& half_extent, double time) const noexcept {
  const double most = spec_.amplitude;
  const Vec3 half = half_extent.cwiseAbs();
  const bool far = !((centre.cwiseAbs() + half).maxCoeff() < farthest && std::abs(time) < farthest);
  if (far || !centre.allFinite() || !half.allFinite()) [[unlikely]]
    return {-most, most};
  switch (spec_.kind) {
    case SolidKind::waves: return wave_range(spec_.direction, most, centre, half, time);
    case SolidKind::lattice: {
      HeightRange sum;
      for (int i = 0; i < 3; ++i) {
        const HeightRange wave = wave_range(axes_.col(i), most / 3.0, centre, half, time);
        sum.lowest += wave.lowest;
        sum.highest += wave.highest;
      }
      return sum;
    }
    case SolidKind::rings: {
      const double rounding = 0.25 * spec_.wavelength;
      const DistanceRange distance = distance_range(spec_.centre, centre, half);
      const double number = two_pi / spec_.wavelength;
      const double from = number * (std::hypot(distance.nearest, rounding) - rounding);
      const double to = number * (std::hypot(distance.farthest, rounding) - rounding);
      const HeightRange cosine = cosine_range(0.5 * (from + to) + turn(time), 0.5 * (to - from));
      return {most * cosine.lowest, most * cosine.highest};
    }
    case SolidKind::noise: return noise_range(centre, half, time);
    case SolidKind::pulse: {
      const DistanceRange distance = distance_range(spec_.centre, centre, half);
      const auto bump = [&](double d, double slack) {
        const double q = d / spec_.wavelength;
        const double inside = std::max(0.0, 1.0 - q * q + slack);
        return inside * inside * inside;
      };
      const double height = beat(time);
      return {height * bump(distance.farthest, -1e-13), height * bump(distance.nearest, 1e-13)};
    }
  }
  return {-most, most};
}

SolidPlane SolidMesostructure::noise_plane(const Vec3& centre, const Vec3& half_extent, double time) const noexcept {
  const Vec3 carried = centre - time * spec_.drift;
  SolidPlane plane;
  for (const Octave& octave : octaves()) {
    const double radius = octave.frequency * half_extent.norm();
    const double reach = 0.5 * most_noise_bend * radius * radius + 1e-12;
    if (reach >= most_noise) {
      plane.error += octave.amplitude * most_noise;
      continue;
    }
    const CellJet cell = noise_at(octave.frequency * carried + octave.shift, octave.key);
    plane.height += octave.amplitude * cell.f;
    plane.gradient += octave.amplitude * octave.frequency * Vec3(cell.x, cell.y, cell.z);
    plane.error += octave.amplitude * reach;
  }
  return plane;
}

double SolidMesostructure::most_bend() const noexcept {
  const double number = two_pi / spec_.wavelength;
  switch (spec_.kind) {
    case SolidKind::waves: return spec_.amplitude * number * number;
    // A third each along three axes at right angles.
    case SolidKind::lattice: return spec_.amplitude * number * number / 3.0;
    // The rounded distance bends by at most one over its rounding, a quarter wavelength.
    case SolidKind::rings: return spec_.amplitude * (number * number + number * 4.0 / spec_.wavelength);
    // (1 - q^2)^3 by q: 6 (1 - q^2) (5 q^2 - 1) along the radius, -6 (1 - q^2)^2 across.
    case SolidKind::pulse: return 6.0 * spec_.amplitude / (spec_.wavelength * spec_.wavelength);
    case SolidKind::noise: break;
  }
  return infinity;
}

SolidPlane SolidMesostructure::plane(const Vec3& centre, const Vec3& half_extent, double time) const noexcept {
  const HeightRange all = range(centre, half_extent, time);
  const SolidPlane level{0.5 * (all.lowest + all.highest), Vec3::Zero(), 0.5 * (all.highest - all.lowest)};
  const Vec3 half = half_extent.cwiseAbs();
  const bool far = !((centre.cwiseAbs() + half).maxCoeff() < farthest && std::abs(time) < farthest);
  if (far) [[unlikely]]
    return level;
  SolidPlane sloped;
  if (spec_.kind == SolidKind::noise) {
    sloped = noise_plane(centre, half, time);
  } else {
    const SolidJet here = jet(centre, time);
    sloped = {here.height, here.gradient, 0.5 * most_bend() * half.squaredNorm() + 1e-15 * spec_.amplitude};
  }
  return sloped.error < level.error ? sloped : level;
}

bool SolidMesostructure::moves() const noexcept {
  return spec_.kind == SolidKind::noise ? !spec_.drift.isZero(0.0) : spec_.frequency != 0.0;
}

double SolidMesostructure::grain() const noexcept {
  return spec_.kind == SolidKind::noise ? std::ldexp(spec_.wavelength, 1 - spec_.octaves) : spec_.wavelength;
}

double SolidMesostructure::most_speed() const noexcept {
  if (spec_.kind == SolidKind::pulse) return 0.5 * two_pi * spec_.frequency * spec_.amplitude;
  if (spec_.kind != SolidKind::noise) return two_pi * std::abs(spec_.frequency) * spec_.amplitude;
  double slope = 0.0;
  for (const Octave& octave : octaves()) {
    slope += most_noise_slope * octave.amplitude * octave.frequency;
  }
  return slope * spec_.drift.norm();
}

}  // namespace asperity
