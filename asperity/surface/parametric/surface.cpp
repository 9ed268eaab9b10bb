#include "asperity/surface/parametric/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/core/identity.h"
#include "asperity/core/rng.h"
#include "asperity/core/units.h"
#include "asperity/surface/parametric/detail/shapes.h"
#include "asperity/surface/tangents.h"

namespace asperity {

namespace {

// Bounds that were sampled rather than derived are widened by these factors: shapes are sampled at a thousand places of
// smooth formulas, random and measured features at places that may miss their steepest one.
constexpr double shape_margin = 1.1;
constexpr double feature_margin = 2.0;
constexpr int shape_places = 1024;
constexpr std::size_t most_features = 16;
// Share of the radius of curvature that features may use up.
constexpr double most_of_radius = 0.95;

/// Bounds of a feature's slope (m/m) and of how fast that changes away from edges (1/m), in the plane of the features.
struct Steepness {
  double slope = 0.0;
  double bend = 0.0;
};

/// Of what has no formula, over the part of the plane that is laid on.
Steepness sampled_steepness(const SurfaceFeature& feature, const Vec2& lower, const Vec2& upper) {
  constexpr int places = 20000;
  Rng rng(1);
  const double apart = feature.wavelength() / 32.0;
  Steepness out;
  for (int i = 0; i < places; ++i) {
    const Vec2 place(rng.uniform(lower.x(), upper.x()), rng.uniform(lower.y(), upper.y()));
    const Vec2 here = feature.sample(place).gradient;
    out.slope = std::max(out.slope, here.norm());
    for (int k = 0; k < 2; ++k) {
      const Vec2 there = feature.sample(place + apart * (k == 0 ? Vec2::UnitX() : Vec2::UnitY())).gradient;
      // Of a symmetric 2 x 2 matrix no entry of a column says more than half of what the norm may be.
      out.bend = std::max(out.bend, std::numbers::sqrt2 * (there - here).norm() / apart);
    }
  }
  return {feature_margin * out.slope, feature_margin * out.bend};
}

Steepness steepness(const SurfaceFeature& feature, const Vec2& lower, const Vec2& upper) {
  const FeatureSpec& spec = feature.spec();
  const double w = 2.0 * std::numbers::pi / spec.wavelength.x();
  const double c = spec.amplitude;
  switch (spec.kind) {
    case FeatureKind::grating:
    case FeatureKind::circular_grating: return {c * w, c * w * w};
    case FeatureKind::grid: {
      const double across = 2.0 * std::numbers::pi / spec.wavelength.y();
      return {c * std::hypot(w, across), c * (w * w + across * across)};
    }
    case FeatureKind::triangular: return {4.0 * c / spec.wavelength.x(), 0.0};
    case FeatureKind::serrated: return {2.0 * c / (spec.wavelength.x() * std::min(spec.wall, 1.0 - spec.wall)), 0.0};
    case FeatureKind::noise:
    case FeatureKind::map: break;
  }
  return sampled_steepness(feature, lower, upper);
}

/// Curvatures of the smooth shape along its principal directions: eigenvalues of dn/dx (1/m).
bool curvatures(const ParametricJet& jet, const NormalJet& normals, double& least, double& most) {
  const double e = jet.u.squaredNorm();
  const double f = jet.u.dot(jet.v);
  const double g = jet.v.squaredNorm();
  const double det = e * g - f * f;
  if (!(det > 1e-24 * (e + g) * (e + g))) return false;
  const double uu = normals.u.dot(jet.u);
  const double uv = normals.u.dot(jet.v);
  const double vv = normals.v.dot(jet.v);
  const double mean = 0.5 * (uu * g - 2.0 * uv * f + vv * e) / det;
  const double gauss = (uu * vv - uv * uv) / det;
  const double apart = std::sqrt(std::max(0.0, mean * mean - gauss));
  least = mean - apart;
  most = mean + apart;
  return true;
}

}  // namespace

Result<ParametricSurface> ParametricSurface::build(const ParametricSettings& settings) {
  if (static_cast<std::size_t>(settings.shape) >= parametric_names().size())
    return bad_value("is no parametric surface", "shape", "one of parametric_names()");
  ASPERITY_CHECK(check_shape(settings));
  if (settings.features.size() > most_features) {
    return refused(ErrorCode::too_large, fmt::format("holds {}", settings.features.size()), "features",
                   fmt::format("at most {} features", most_features));
  }
  ParametricSurface surface;
  surface.settings_ = settings;
  shape_range(settings, surface.lower_, surface.upper_);
  surface.closed_[0] = of_revolution(settings.shape);
  surface.closed_[1] = settings.shape == ParametricShape::torus;
  const bool encloses = settings.shape == ParametricShape::sphere || settings.shape == ParametricShape::torus;
  surface.sides_ = encloses ? Sides::front : Sides::both;
  ASPERITY_CHECK(surface.measure());
  ASPERITY_CHECK(surface.check_features());
  surface.make_patches();
  surface.identity_ = next_identity();
  return surface;
}

Status ParametricSurface::measure() {
  Steepness sum;
  double shortest = infinity;
  const Vec2 corner[2] = {lower_.cwiseProduct(settings_.tile), upper_.cwiseProduct(settings_.tile)};
  for (const SurfaceFeature& feature : settings_.features) {
    limits_.lowest += feature.lowest();
    limits_.highest += feature.highest();
    folds_ = folds_ || has_edges(feature.spec().kind);
    const Steepness one = steepness(feature, corner[0], corner[1]);
    sum.slope += one.slope;
    sum.bend += one.bend;
    shortest = std::min(shortest, feature.wavelength());
  }
  const double height = std::max(limits_.highest, -limits_.lowest);
  limits_.slope_u = sum.slope * settings_.tile.x();
  limits_.slope_v = sum.slope * settings_.tile.y();
  // All shapes are alike at every u: turned, or turned and raised.
  double normal_u = 0.0;
  double normal_v = 0.0;
  double sharpest = 0.0;
  double widest_u = 0.0;
  double narrowest = infinity;
  Box outline;
  for (int i = 0; i <= shape_places; ++i) {
    const Vec2 uv(lower_.x(), lower_.y() + (upper_.y() - lower_.y()) * i / shape_places);
    ParametricJet jet;
    NormalJet normals;
    shape_jet(settings_, uv, jet, &normals);
    limits_.shape_uu = std::max(limits_.shape_uu, jet.uu.norm() + height * normals.uu.norm());
    limits_.shape_uv = std::max(limits_.shape_uv, jet.uv.norm() + height * normals.uv.norm());
    limits_.shape_vv = std::max(limits_.shape_vv, jet.vv.norm() + height * normals.vv.norm());
    normal_u = std::max(normal_u, normals.u.norm());
    normal_v = std::max(normal_v, normals.v.norm());
    widest_u = std::max(widest_u, jet.u.norm());
    for (int k = 0; k < 4; ++k) {
      ParametricJet around;
      shape_jet(settings_, Vec2(lower_.x() + (upper_.x() - lower_.x()) * k / 4.0, uv.y()), around, nullptr);
      outline.include(around.point);
    }
    double least = 0.0;
    double most = 0.0;
    if (!curvatures(jet, normals, least, most)) continue;
    sharpest = std::max({sharpest, std::abs(least), std::abs(most)});
    for (const double curvature : {least, most}) {
      const double reach = curvature > 0.0 ? -limits_.lowest : limits_.highest;
      if (reach * std::abs(curvature) <= most_of_radius) continue;
      return bad_value(
          fmt::format("reach {} {} the surface, which bends there with a radius of {}", format_length(reach),
                      curvature > 0.0 ? "below" : "above", format_length(1.0 / std::abs(curvature))),
          "features",
          fmt::format("heights of at most {} there, or a larger surface",
                      format_length(most_of_radius / std::abs(curvature))));
    }
    // At the poles of a sphere features depend on v alone.
    const double around = settings_.shape == ParametricShape::sphere ? infinity : jet.u.norm() / settings_.tile.x();
    const double lean = settings_.shape == ParametricShape::ramp
                            ? std::abs(jet.u.cross(jet.v).norm() / (jet.u.norm() * jet.v.norm()))
                            : 1.0;
    narrowest = std::min(narrowest, lean * std::min(around, jet.v.norm() / settings_.tile.y()));
  }
  limits_.shape_uu *= shape_margin;
  limits_.shape_uv *= shape_margin;
  limits_.shape_vv *= shape_margin;
  const Vec2& tile = settings_.tile;
  limits_.uu = limits_.shape_uu + 2.0 * limits_.slope_u * shape_margin * normal_u + sum.bend * tile.x() * tile.x();
  limits_.uv = limits_.shape_uv + shape_margin * (limits_.slope_u * normal_v + limits_.slope_v * normal_u) +
               sum.bend * tile.x() * tile.y();
  limits_.vv = limits_.shape_vv + 2.0 * limits_.slope_v * shape_margin * normal_v + sum.bend * tile.y() * tile.y();
  const double size = outline.diagonal();
  stride_ = std::min(0.25 / std::max(sharpest, 1e-12), 0.125 * size);
  if (!settings_.features.empty()) stride_ = std::min(stride_, shortest * narrowest / 12.0);
  grain_ = std::min(stride_, 0.005 * size);
  skin_ = 1e-5 * grain_;
  return success();
}

Status ParametricSurface::check_features() const {
  if (settings_.features.empty()) return success();
  constexpr int places = 97;
  const double heights = std::max(limits_.highest - limits_.lowest, 1e-12);
  const auto differ = [&](const Vec2& a, const Vec2& b) {
    const double step = std::abs(feature_heights(settings_, a).height - feature_heights(settings_, b).height);
    return step > 1e-6 * heights;
  };
  for (int k = 0; k < 2; ++k) {
    if (!closed_[k]) continue;
    for (int i = 0; i <= places; ++i) {
      Vec2 start = lower_ + (upper_ - lower_) * i / places;
      start[k] = lower_[k];
      Vec2 end = start;
      end[k] = upper_[k];
      if (!differ(start, end)) continue;
      return refused(ErrorCode::mismatch,
                     fmt::format("step where {} comes back to where it started, after {} of the plane of the features",
                                 k == 0 ? "u" : "v", format_length((upper_[k] - lower_[k]) * settings_.tile[k])),
                     "features",
                     "wavelengths (noise: periods) that go a whole number of times into that, or another tile");
    }
  }
  if (settings_.shape != ParametricShape::sphere) return success();
  for (const double v : {lower_.y(), upper_.y()}) {
    for (int i = 0; i <= places; ++i) {
      const Vec2 place(upper_.x() * i / places, v);
      const bool slopes =
          feature_heights(settings_, place).gradient.norm() > 1e-6 * (limits_.slope_u + limits_.slope_v);
      if (!slopes && !differ(Vec2(lower_.x(), v), place)) continue;
      return refused(ErrorCode::mismatch, "are not level at the poles of the sphere", "features",
                     "features that depend on v alone and have a crest or a valley at v = -90 and 90 degrees");
    }
  }
  return success();
}

void ParametricSurface::make_patches() {
  int levels = 5;
  double shortest = infinity;
  for (const SurfaceFeature& feature : settings_.features) shortest = std::min(shortest, feature.wavelength());
  const Vec2 size = upper_ - lower_;
  while (levels < ParametricPatches::most_levels &&
         size.cwiseProduct(settings_.tile).maxCoeff() / (1 << levels) > 0.25 * shortest)
    ++levels;
  const int side = 1 << levels;
  const Vec2 step = size / side;
  std::vector<Box> leaves;
  leaves.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  // A surface stays this near to the patch spanned by its corners: interpolation between two points of a curve errs by
  // an eighth of the second derivative times the square of their distance.
  const double bulge = 0.125 * (limits_.shape_uu * step.x() * step.x() + limits_.shape_vv * step.y() * step.y());
  const double rest = 0.25 * (limits_.slope_u * step.x() + limits_.slope_v * step.y());
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const Vec2 corner = lower_ + Vec2(column * step.x(), row * step.y());
      // Without features the limits are 0, and so are both.
      double low = infinity;
      double high = -infinity;
      for (int k = 0; k < 4; ++k) {
        const Vec2 place = corner + Vec2((k & 1 ? 0.75 : 0.25) * step.x(), (k & 2 ? 0.75 : 0.25) * step.y());
        const double h = feature_heights(settings_, place).height;
        low = std::min(low, h - rest);
        high = std::max(high, h + rest);
      }
      low = std::max(low, limits_.lowest);
      high = std::min(high, limits_.highest);
      Box box;
      for (int k = 0; k < 4; ++k) {
        ParametricJet jet;
        NormalJet normals;
        shape_jet(settings_, corner + Vec2((k & 1) * step.x(), ((k & 2) >> 1) * step.y()), jet, &normals);
        box.include(jet.point + low * normals.n);
        box.include(jet.point + high * normals.n);
      }
      leaves.push_back(box.grown(bulge));
      bounds_.include(leaves.back());
    }
  }
  patches_ = ParametricPatches(levels, leaves);
}

ParametricJet ParametricSurface::jet(const Vec2& uv) const noexcept {
  ParametricJet out;
  if (settings_.features.empty()) {
    shape_jet(settings_, uv, out, nullptr);
    return out;
  }
  NormalJet n;
  shape_jet(settings_, uv, out, &n);
  FeatureSample sum;
  double uu = 0.0;
  double cross = 0.0;
  double vv = 0.0;
  const Vec2 place = uv.cwiseProduct(settings_.tile);
  for (const SurfaceFeature& feature : settings_.features) {
    const FeatureSample here = feature.sample(place);
    sum.height += here.height;
    sum.gradient += here.gradient;
    if (has_edges(feature.spec().kind)) continue;
    if (feature.spec().kind == FeatureKind::grating) {
      // Of a cosine the second derivative is the height itself.
      const double w = 2.0 * std::numbers::pi / feature.spec().wavelength.x();
      const Vec2 across = feature.across(place);
      const double bend = -w * w * here.height;
      uu += bend * across.x() * across.x();
      cross += bend * across.x() * across.y();
      vv += bend * across.y() * across.y();
      continue;
    }
    const double apart = 1e-6 * feature.wavelength();
    const Vec2 along_u = (feature.sample(place + Vec2(apart, 0.0)).gradient - here.gradient) / apart;
    const Vec2 along_v = (feature.sample(place + Vec2(0.0, apart)).gradient - here.gradient) / apart;
    uu += along_u.x();
    cross += 0.5 * (along_u.y() + along_v.x());
    vv += along_v.y();
  }
  const Vec2& tile = settings_.tile;
  const double h = sum.height;
  const double h_u = sum.gradient.x() * tile.x();
  const double h_v = sum.gradient.y() * tile.y();
  out.height = h;
  out.point += h * n.n;
  out.u += h_u * n.n + h * n.u;
  out.v += h_v * n.n + h * n.v;
  out.uu += uu * tile.x() * tile.x() * n.n + 2.0 * h_u * n.u + h * n.uu;
  out.uv += cross * tile.x() * tile.y() * n.n + h_u * n.v + h_v * n.u + h * n.uv;
  out.vv += vv * tile.y() * tile.y() * n.n + 2.0 * h_v * n.v + h * n.vv;
  return out;
}

Vec3 ParametricSurface::normal(const ParametricJet& jet) const noexcept {
  const Vec3 cross = jet.u.cross(jet.v);
  const double length = cross.norm();
  if (length > 1e-100) return cross / length;
  // The poles of a sphere.
  const double far = jet.point.norm();
  return far > 0.0 ? Vec3(jet.point / far) : Vec3(Vec3::UnitZ());
}

double ParametricSurface::clearance(const Vec2& uv, const Vec3& point) const noexcept {
  ParametricJet shape;
  NormalJet n;
  shape_jet(settings_, uv, shape, &n);
  const double height = feature_heights(settings_, uv).height;
  const Vec3 off = point - shape.point - height * n.n;
  shape.u += height * n.u;
  shape.v += height * n.v;
  Vec3 du;
  Vec3 dv;
  parameter_gradients(shape.u, shape.v, du, dv);
  const Vec2 below = uv + Vec2(du.dot(off), dv.dot(off));
  return n.n.dot(off) + height - feature_heights(settings_, below).height;
}

Vec2 ParametricSurface::within_range(const Vec2& uv) const noexcept {
  Vec2 out = uv;
  for (int k = 0; k < 2; ++k) {
    if (closed_[k] && (out[k] < lower_[k] || out[k] >= upper_[k])) {
      const double period = upper_[k] - lower_[k];
      out[k] -= period * std::floor((out[k] - lower_[k]) / period);
    }
    out[k] = std::clamp(out[k], lower_[k], upper_[k]);
  }
  return out;
}

std::uint32_t ParametricSurface::element_of(const Vec2& uv) const noexcept {
  const std::uint32_t side = patches_.count();
  const Vec2 share = (within_range(uv) - lower_).cwiseQuotient(upper_ - lower_) * static_cast<double>(side);
  const auto cell = [&](double x) { return std::min(side - 1, static_cast<std::uint32_t>(std::max(0.0, x))); };
  return cell(share.y()) * side + cell(share.x());
}

Mat3 ParametricSurface::shape_operator(const ParametricJet& jet) const noexcept {
  const Vec3 n = normal(jet);
  return asperity::shape_operator(jet.u, jet.v, n.dot(jet.uu), n.dot(jet.uv), n.dot(jet.vv));
}

std::size_t ParametricSurface::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this) + patches_.memory_bytes();
  for (const SurfaceFeature& feature : settings_.features) bytes += feature.memory_bytes();
  return bytes;
}

}  // namespace asperity
