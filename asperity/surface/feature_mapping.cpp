#include "asperity/surface/feature_mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "asperity/surface/coat.h"

namespace asperity {
namespace {

using std::numbers::pi;

constexpr double longest = 10.0;  // m
// Share of the squared distance that an axis has to have before its planes count: below a third, so that one is always
// above it.
constexpr double box_threshold = 0.2;
// Nearer to the axis than this (m) a longitude means nothing.
constexpr double on_axis = 1e-12;
// Share of a wavelength by which the pattern may miss itself where it comes back.
constexpr double seam_tolerance = 1e-4;

std::string shown(const Vec3& v) {
  return fmt::format("is {:.6g}, {:.6g}, {:.6g}", v.x(), v.y(), v.z());
}

Status check_mapping_length(double value, const char* place) {
  if (value > 0.0 && value <= longest) return success();
  return bad_value(fmt::format("is {:.6g} m", value), place, fmt::format("a length above 0, at most {:g} m", longest));
}

Status check_frame(const FeatureMappingSettings& settings) {
  constexpr double rounding = 1e-6;
  if (!(settings.origin.norm() <= 1e3))
    return bad_value(shown(settings.origin) + " m", "origin", "a place within 1000 m");
  if (!(std::abs(settings.axis.norm() - 1.0) <= rounding))
    return bad_value(shown(settings.axis), "axis", "a vector of length 1");
  if (!(std::abs(settings.reference.norm() - 1.0) <= rounding))
    return bad_value(shown(settings.reference), "reference", "a vector of length 1");
  if (!(std::abs(settings.reference.dot(settings.axis)) <= rounding))
    return bad_value(shown(settings.reference), "reference", "a vector at right angles to the axis");
  return success();
}

bool is_round(IntermediateSurface surface) {
  return surface == IntermediateSurface::cylinder || surface == IntermediateSurface::sphere;
}

Status check_range(const Vec2& range) {
  constexpr double turn = 2.0 * pi;
  constexpr double rounding = 1e-9;
  const double width = range.y() - range.x();
  if (std::abs(range.x()) <= turn && width > 0.0 && width <= turn + rounding) return success();
  return bad_value(fmt::format("goes from {:.6g} to {:.6g} rad", range.x(), range.y()), "range",
                   "two angles, the first within one turn of 0, the second above it by one turn (6.28319 rad) at most");
}

/// Lengths near by of which a whole number fits `around`, "1.2 mm or 1.3 mm".
std::string fitting(double around, double wanted) {
  const double count = around / wanted;
  const double fewer = std::max(1.0, std::floor(count));
  const double more = std::max(1.0, std::ceil(count));
  // So many digits that what is copied from the message fits.
  if (fewer == more) return fmt::format("{:.9g} m", around / more);
  return fmt::format("{:.9g} m or {:.9g} m", around / fewer, around / more);
}

Error no_fit(double turns, const char* of_what, std::string place, std::string accepted) {
  return refused(ErrorCode::mismatch,
                 fmt::format("{:.6g} {} go once around: the pattern would not close", turns, of_what), std::move(place),
                 std::move(accepted) + ", or a cylinder or sphere with a range, at whose seam it may step");
}

}  // namespace

Result<FeatureMapping> FeatureMapping::build(const FeatureMappingSettings& settings) {
  FeatureMapping mapping;
  mapping.settings_ = settings;
  if (settings.surface == IntermediateSurface::uv) {
    for (int k = 0; k < 2; ++k) ASPERITY_CHECK(check_mapping_length(settings.tile[k], "tile"));
    return mapping;
  }
  ASPERITY_CHECK(check_frame(settings));
  mapping.second_ = settings.axis.cross(settings.reference);
  if (is_round(settings.surface)) {
    ASPERITY_CHECK(check_mapping_length(settings.radius, "radius"));
    if (settings.range) {
      ASPERITY_CHECK(check_range(*settings.range));
      mapping.middle_ = settings.range->mean();
      mapping.half_ = 0.5 * (settings.range->y() - settings.range->x());
    }
  }
  if (settings.surface == IntermediateSurface::box) {
    for (int k = 0; k < 3; ++k) ASPERITY_CHECK(check_mapping_length(settings.half_extent[k], "half_extent"));
  }
  return mapping;
}

void FeatureMapping::map_box(const Vec3& local, MappedPlaces& out) const noexcept {
  const Vec3 edges[3] = {settings_.reference, second_, settings_.axis};
  const Vec3 scaled = local.cwiseQuotient(settings_.half_extent);
  Vec3 half_square_gradient = Vec3::Zero();  // of |scaled|^2 / 2
  Vec3 scaled_gradient[3];
  for (int a = 0; a < 3; ++a) {
    scaled_gradient[a] = edges[a] / settings_.half_extent[a];
    half_square_gradient += scaled[a] * scaled_gradient[a];
  }
  const Vec3 excess = (scaled.array().square() - box_threshold * scaled.squaredNorm()).max(0.0);
  const double total = excess.squaredNorm();
  const auto place_of = [&](int a) {
    const int u = (a + 1) % 3;
    const int v = (a + 2) % 3;
    return MappedPlace{Vec2(local[u], local[v]), edges[u], edges[v], 1.0, Vec3::Zero()};
  };
  if (!(total > 0.0)) {  // in the very middle
    out.push_back(place_of(2));
    return;
  }
  Vec3 gradients[3];
  Vec3 total_gradient = Vec3::Zero();
  for (int a = 0; a < 3; ++a) {
    gradients[a] = 4.0 * excess[a] * (scaled[a] * scaled_gradient[a] - box_threshold * half_square_gradient);
    total_gradient += gradients[a];
  }
  const double per_total = 1.0 / total;
  for (int a = 0; a < 3; ++a) {
    if (!(excess[a] > 0.0)) continue;
    MappedPlace place = place_of(a);
    place.weight = excess[a] * excess[a] * per_total;
    place.dweight = (gradients[a] - place.weight * total_gradient) * per_total;
    out.push_back(place);
  }
}

void FeatureMapping::map(const Vec3& point, MappedPlaces& out) const noexcept {
  out.clear();
  const Vec3 from_origin = point - settings_.origin;
  const Vec3 local(settings_.reference.dot(from_origin), second_.dot(from_origin), settings_.axis.dot(from_origin));
  if (settings_.surface == IntermediateSurface::box) return map_box(local, out);
  MappedPlace& place = *out.emplace_back();
  if (settings_.surface == IntermediateSurface::plane) {
    place.uv = local.head<2>();
    place.du = settings_.reference;
    place.dv = second_;
    return;
  }
  if (settings_.surface == IntermediateSurface::uv) return;
  const double squared = local.x() * local.x() + local.y() * local.y();
  const double distance = std::sqrt(squared);
  const bool off_axis = distance > on_axis;
  const double radius = settings_.radius;
  double angle = std::atan2(local.y(), local.x());
  if (settings_.range) angle = std::remainder(angle - middle_, 2.0 * pi) + half_;
  place.uv.x() = radius * angle;
  if (off_axis) place.du = (radius / squared) * (local.x() * second_ - local.y() * settings_.reference);
  if (settings_.surface == IntermediateSurface::cylinder) {
    place.uv.y() = local.z();
    place.dv = settings_.axis;
    return;
  }
  place.uv.y() = radius * std::atan2(local.z(), distance);
  if (!off_axis) return;
  const Vec3 outward = (local.x() * settings_.reference + local.y() * second_) / distance;
  place.dv = (radius / (squared + local.z() * local.z())) * (distance * settings_.axis - local.z() * outward);
}

MappedPlace FeatureMapping::on_mesh(const TriangleMesh& mesh, std::uint32_t face, const Vec3& point) const noexcept {
  MappedPlace place;
  if (!mesh.has_uvs()) return place;
  const BarycentricFrame frame = barycentric_frame(mesh, face);
  const std::array<Vec2f, 3> corners = mesh.uvs(face);
  const Vec3 from_corner = point - frame.corner;
  place.uv = corners[0].cast<double>();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 corner = corners[k].cast<double>();
    place.du += corner.x() * frame.gradient[k];
    place.dv += corner.y() * frame.gradient[k];
  }
  place.uv += Vec2(place.du.dot(from_corner), place.dv.dot(from_corner));
  place.uv = place.uv.cwiseProduct(settings_.tile);
  place.du *= settings_.tile.x();
  place.dv *= settings_.tile.y();
  return place;
}

double FeatureMapping::circumference() const noexcept {
  return is_round(settings_.surface) && !settings_.range ? 2.0 * pi * settings_.radius : 0.0;
}

FeatureMapping::Seam FeatureMapping::seam() const noexcept {
  return {middle_ + pi, settings_.radius * (half_ + pi), settings_.radius * (half_ - pi)};
}

void FeatureMapping::count_angle_twice(const Vec3& point, const Vec3& normal, MappedPlace& place) const noexcept {
  if (settings_.surface != IntermediateSurface::cylinder) return;
  const Vec3 from_origin = point - settings_.origin;
  const Vec3 around = settings_.axis.cross(from_origin);  // as long as the distance from the axis
  const double squared = around.squaredNorm();
  // At a given distance the surface climbs by -(normal . around) / (normal . axis) per radian. One that turns about the
  // axis does not climb, but for rounding: no height tells the angle there.
  constexpr double level = 1e-9;
  const double leaning = normal.dot(around);
  if (!(leaning * leaning > level * level * squared)) return;
  const double by_height = -normal.dot(settings_.axis) / leaning;
  const double unit = settings_.radius * (settings_.range ? 2.0 * half_ : 2.0 * pi);
  place.du += (settings_.radius * by_height * unit / std::sqrt(squared)) * settings_.axis;
}

Status FeatureMapping::check(const SurfaceFeature& feature) const {
  const double around = circumference();
  if (around == 0.0) return success();
  const FeatureSpec& spec = feature.spec();
  // Of the way once around, along u' and v' of the feature.
  const double along_u = around * std::abs(std::cos(spec.direction));
  const double along_v = around * std::abs(std::sin(spec.direction));
  const double turns_u = along_u / spec.wavelength.x();
  const double turns_v = along_v / spec.wavelength.y();
  const auto misses = [](double turns) { return std::abs(turns - std::round(turns)) > seam_tolerance; };
  switch (spec.kind) {
    case FeatureKind::grating:
    case FeatureKind::triangular:
    case FeatureKind::serrated:
      if (!misses(turns_u)) return success();
      return no_fit(turns_u, "wavelengths", "wavelength", fitting(along_u, spec.wavelength.x()) + " for this radius");
    case FeatureKind::grid: {
      // Half a wavelength along both is the same grid again.
      if (!misses(turns_u + turns_v) && !misses(turns_u - turns_v)) return success();
      const bool first = misses(turns_u);
      return no_fit(first ? turns_u : turns_v, "wavelengths", "wavelength",
                    fmt::format("{} along {} of the grid's axes for this radius",
                                first ? fitting(along_u, spec.wavelength.x()) : fitting(along_v, spec.wavelength.y()),
                                first ? "the first" : "the second"));
    }
    case FeatureKind::noise: {
      const double turns = around / spec.period.x();
      if (misses(turns))
        return no_fit(turns, "periods of the noise", "period",
                      fitting(around, spec.period.x()) + " along u for this radius");
      return success();
    }
    case FeatureKind::map:
      if (spec.heights->wrap() != Wrap::repeat)
        return no_fit(turns_u, "maps that do not repeat", "heights", "a map that repeats");
      if (misses(turns_u))
        return no_fit(turns_u, "maps", "wavelength", fitting(along_u, spec.wavelength.x()) + " for this radius");
      if (misses(turns_v))
        return no_fit(turns_v, "maps", "wavelength",
                      fitting(along_v, spec.wavelength.y()) + " as its second number for this radius");
      return success();
    case FeatureKind::circular_grating: break;
  }
  return refused(ErrorCode::mismatch, "circles do not close around a cylinder or a sphere", "kind",
                 "another kind of feature, a plane, a box or texture coordinates to map it by, or a range, at whose "
                 "seam it may step");
}

}  // namespace asperity
