#include "asperity/surface/parametric/detail/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace asperity {

namespace {

using std::numbers::pi;

// Profile of the vase: heights (share of the whole) and radii of the widest place, the neck and the ends.
constexpr double belly_height = 0.3;
constexpr double neck_height = 0.8;
constexpr double bottom_radius = 0.7;  // of the widest
constexpr double lip_flare = 0.25;     // of the way from the neck back to the widest

/// The curve that turns about the z axis: distance from the axis a and height b by v, with the direction of its tangent
/// (cos phi, sin phi), which turns at the rates phi1 and phi2.
struct Profile {
  double a = 0.0, a1 = 0.0, a2 = 0.0;
  double b = 0.0, b1 = 0.0, b2 = 0.0;
  double cosine = 0.0, sine = 1.0;
  double phi1 = 0.0, phi2 = 0.0;
};

/// From one radius to the next with first and second derivatives that vanish at both.
void rise(double t, double from, double to, double length, double& a, double& a1, double& a2, double& a3) noexcept {
  const double d = to - from;
  a = from + d * t * t * t * (10.0 + t * (6.0 * t - 15.0));
  a1 = d * 30.0 * t * t * (1.0 - t) * (1.0 - t) / length;
  a2 = d * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / (length * length);
  a3 = d * 60.0 * (1.0 - 6.0 * t * (1.0 - t)) / (length * length * length);
}

Profile vase_profile(const ParametricSettings& s, double v) noexcept {
  Profile p;
  double a3 = 0.0;
  const double belly = belly_height * s.height;
  const double neck = neck_height * s.height;
  const double narrow = s.neck * s.radius;
  if (v < belly) {
    rise(v / belly, bottom_radius * s.radius, s.radius, belly, p.a, p.a1, p.a2, a3);
  } else if (v < neck) {
    rise((v - belly) / (neck - belly), s.radius, narrow, neck - belly, p.a, p.a1, p.a2, a3);
  } else {
    const double lip = narrow + lip_flare * (s.radius - narrow);
    rise((v - neck) / (s.height - neck), narrow, lip, s.height - neck, p.a, p.a1, p.a2, a3);
  }
  p.b = v;
  p.b1 = 1.0;
  const double square = 1.0 + p.a1 * p.a1;
  const double length = std::sqrt(square);
  p.cosine = p.a1 / length;
  p.sine = 1.0 / length;
  p.phi1 = -p.a2 / square;
  p.phi2 = -a3 / square + 2.0 * p.a2 * p.a2 * p.a1 / (square * square);
  return p;
}

/// A circle of radius r at distance R from the axis.
Profile circle(double R, double r, double v) noexcept {
  const double c = std::cos(v);
  const double s = std::sin(v);
  return {R + r * c, -r * s, -r * c, r * s, r * c, -r * s, -s, c, 1.0, 0.0};
}

Profile profile_of(const ParametricSettings& s, double v) noexcept {
  switch (s.shape) {
    case ParametricShape::cylinder: return {s.radius, 0.0, 0.0, v, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0};
    case ParametricShape::sphere: return circle(0.0, s.radius, v);
    case ParametricShape::torus: return circle(s.radius, s.tube, v);
    default: return vase_profile(s, v);
  }
}

void revolved(const ParametricSettings& s, const Vec2& uv, ParametricJet& out, NormalJet* normals) noexcept {
  const double c = std::cos(uv.x());
  const double sn = std::sin(uv.x());
  const Profile p = profile_of(s, uv.y());
  const auto at = [&](double radial, double axial) { return Vec3(radial * c, radial * sn, axial); };
  const auto around = [&](double size) { return Vec3(-size * sn, size * c, 0.0); };
  out.point = at(p.a, p.b);
  out.u = around(p.a);
  out.v = at(p.a1, p.b1);
  out.uu = at(-p.a, 0.0);
  out.uv = around(p.a1);
  out.vv = at(p.a2, p.b2);
  if (normals == nullptr) return;
  // n = (sin phi, -cos phi): dn/dphi is the tangent, whose own derivative is -n.
  normals->n = at(p.sine, -p.cosine);
  normals->u = around(p.sine);
  normals->v = at(p.phi1 * p.cosine, p.phi1 * p.sine);
  normals->uu = at(-p.sine, 0.0);
  normals->uv = around(p.phi1 * p.cosine);
  const double turn = p.phi1 * p.phi1;
  normals->vv = at(p.phi2 * p.cosine - turn * p.sine, p.phi2 * p.sine + turn * p.cosine);
}

void ramp(const ParametricSettings& s, const Vec2& uv, ParametricJet& out, NormalJet* normals) noexcept {
  const double c = std::cos(uv.x());
  const double sn = std::sin(uv.x());
  const double v = uv.y();
  const double k = s.scale;
  const double v2 = v * v;
  out.point = k * Vec3(v * c, v * sn, v * v2 + 3.0 * uv.x());
  out.u = k * Vec3(-v * sn, v * c, 3.0);
  out.v = k * Vec3(c, sn, 3.0 * v2);
  out.uu = k * Vec3(-v * c, -v * sn, 0.0);
  out.uv = k * Vec3(-sn, c, 0.0);
  out.vv = k * Vec3(0.0, 0.0, 6.0 * v);
  if (normals == nullptr) return;
  // S_u x S_v over the scale squared; its length does not depend on u.
  const double q = 3.0 * v * v2;
  const Vec3 m(q * c - 3.0 * sn, 3.0 * c + q * sn, -v);
  const Vec3 m_u(-q * sn - 3.0 * c, -3.0 * sn + q * c, 0.0);
  const Vec3 m_v(9.0 * v2 * c, 9.0 * v2 * sn, -1.0);
  const Vec3 m_uv(-9.0 * v2 * sn, 9.0 * v2 * c, 0.0);
  const Vec3 m_vv(18.0 * v * c, 18.0 * v * sn, 0.0);
  const double square = q * q + 9.0 + v2;
  const double g = 1.0 / std::sqrt(square);
  const double square1 = 18.0 * v2 * q + 2.0 * v;     // d(square)/dv
  const double square2 = 30.0 * 9.0 * v2 * v2 + 2.0;  // and again
  const double g1 = -0.5 * g * g * g * square1;
  const double g2 = -0.5 * g * g * g * square2 + 0.75 * g * g * g * g * g * square1 * square1;
  normals->n = g * m;
  normals->u = g * m_u;
  normals->v = g * m_v + g1 * m;
  normals->uu = -g * Vec3(m.x(), m.y(), 0.0);
  normals->uv = g * m_uv + g1 * m_u;
  normals->vv = g * m_vv + 2.0 * g1 * m_v + g2 * m;
}

Status check_length(double value, const char* place) {
  constexpr double shortest = 1e-6;
  constexpr double longest = 1e3;
  if (value >= shortest && value <= longest) return success();
  return bad_value(fmt::format("is {}", value), place, "a length of 1 um to 1 km");
}

}  // namespace

void shape_jet(const ParametricSettings& settings, const Vec2& uv, ParametricJet& out, NormalJet* normals) noexcept {
  out.height = 0.0;
  if (settings.shape == ParametricShape::plane) {
    out = {};
    out.point = Vec3(uv.x() - 0.5 * settings.width, uv.y() - 0.5 * settings.depth, 0.0);
    out.u = Vec3::UnitX();
    out.v = Vec3::UnitY();
    if (normals == nullptr) return;
    *normals = {};
    normals->n = Vec3::UnitZ();
  } else if (settings.shape == ParametricShape::ramp) {
    ramp(settings, uv, out, normals);
  } else {
    revolved(settings, uv, out, normals);
  }
}

FeatureSample feature_heights(const ParametricSettings& settings, const Vec2& uv) noexcept {
  FeatureSample sum;
  for (const SurfaceFeature& feature : settings.features) {
    const FeatureSample one = feature.sample(uv.cwiseProduct(settings.tile));
    sum.height += one.height;
    sum.gradient += one.gradient;
  }
  sum.gradient = sum.gradient.cwiseProduct(settings.tile);
  return sum;
}

void shape_range(const ParametricSettings& settings, Vec2& lower, Vec2& upper) {
  lower = Vec2::Zero();
  switch (settings.shape) {
    case ParametricShape::plane: upper = Vec2(settings.width, settings.depth); break;
    case ParametricShape::cylinder:
    case ParametricShape::vase: upper = Vec2(2.0 * pi, settings.height); break;
    case ParametricShape::sphere:
      lower = Vec2(0.0, -0.5 * pi);
      upper = Vec2(2.0 * pi, 0.5 * pi);
      break;
    case ParametricShape::torus: upper = Vec2(2.0 * pi, 2.0 * pi); break;
    case ParametricShape::ramp:
      lower = Vec2(0.0, 1.0);
      upper = Vec2(pi, 3.0);
      break;
  }
}

Status check_shape(const ParametricSettings& s) {
  const std::vector<std::string>& taken = parametric_parameters(s.shape);
  const auto takes = [&](const char* name) { return std::find(taken.begin(), taken.end(), name) != taken.end(); };
  const std::pair<const char*, double> lengths[] = {{"width", s.width}, {"depth", s.depth},   {"radius", s.radius},
                                                    {"tube", s.tube},   {"height", s.height}, {"scale", s.scale}};
  for (const auto& [name, length] : lengths) {
    if (takes(name)) ASPERITY_CHECK(check_length(length, name));
  }
  if (takes("tube") && !(s.tube <= 0.95 * s.radius)) {
    return bad_value(fmt::format("is {} on a radius of {}", s.tube, s.radius), "tube",
                     "at most 0.95 of the radius, so that the torus stays open in the middle");
  }
  if (takes("neck") && !(s.neck >= 0.05 && s.neck <= 0.95))
    return bad_value(fmt::format("is {}", s.neck), "neck", "0.05 to 0.95 of the widest radius");
  for (int k = 0; k < 2; ++k) {
    if (!(s.tile[k] >= 1e-6 && s.tile[k] <= 1e3)) {
      return bad_value(fmt::format("is {}", s.tile[k]), fmt::format("tile[{}]", k),
                       "a length of 1 um to 1 km per unit of the parameter");
    }
  }
  return success();
}

const char* parametric_name(ParametricShape shape) {
  return to_string(shape);
}

const std::vector<std::string>& parametric_names() {
  return all_names<ParametricShape>();
}

const std::vector<std::string>& parametric_parameters(ParametricShape shape) {
  static const std::vector<std::string> of_shape[] = {
      {"width", "depth", "tile"},            // plane
      {"radius", "height", "tile"},          // cylinder
      {"radius", "tile"},                    // sphere
      {"radius", "tube", "tile"},            // torus
      {"radius", "height", "neck", "tile"},  // vase
      {"scale", "tile"},                     // ramp
  };
  return of_shape[static_cast<std::size_t>(shape)];
}

}  // namespace asperity
