#include "asperity/device/stroke.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "asperity/core/suggest.h"
#include "asperity/device/detail/checks.h"

namespace asperity {
namespace {

constexpr std::size_t max_samples = 2'000'000;

Status require_finite(const Vec3& value, const std::string& place) {
  if (value.allFinite()) return success();
  return bad_value("is not finite", place, "three finite coordinates (m)");
}

Status validate_motion(const StrokeSettings& s) {
  ASPERITY_CHECK(require(s.speed > 0.0, "speed", s.speed, "a speed above 0 (m/s)"));
  ASPERITY_CHECK(require(s.approach_speed > 0.0, "approach_speed", s.approach_speed, "a speed above 0 (m/s)"));
  ASPERITY_CHECK(require(s.probe_radius >= 0.0, "probe_radius", s.probe_radius, "a length of 0 or more (m)"));
  ASPERITY_CHECK(require(s.approach_height >= 0.0, "approach_height", s.approach_height, "a length of 0 or more (m)"));
  ASPERITY_CHECK(s.press == PressMode::force
                     ? require(s.normal_force > 0.0, "normal_force", s.normal_force, "a force above 0 (N)")
                     : require(true, "depth", s.depth, "a finite length (m)"));
  if (s.repeats < 1) return bad_value(fmt::format("is {}", s.repeats), "repeats", "1 or more");
  return success();
}

Status validate_sampling(const StrokeSettings& s) {
  if (s.sample_spacing) {
    ASPERITY_CHECK(require(*s.sample_spacing > 0.0, "sample_spacing", *s.sample_spacing, "a length above 0 (m)"));
  }
  if (s.normal_smoothing) {
    ASPERITY_CHECK(
        require(*s.normal_smoothing >= 0.0, "normal_smoothing", *s.normal_smoothing, "a length of 0 or more (m)"));
  }
  return success();
}

Status validate_round(const StrokeSettings& s) {
  ASPERITY_CHECK(require_finite(s.centre, "centre"));
  ASPERITY_CHECK(require(s.radius > 0.0, "radius", s.radius, "a length above 0 (m)"));
  const bool by_pitch = s.type == StrokeType::spiral && s.pitch != 0.0;
  if (by_pitch) return require(s.pitch > 0.0, "pitch", s.pitch, "a length above 0 (m), or 0 to use turns");
  return require(s.turns > 0.0 && s.turns <= 1e4, "turns", s.turns, "a number above 0, up to 10000");
}

/// Two unit vectors that span the plane across `axis`, the same for the same axis: u lies along +x when it can.
struct Plane {
  Vec3 u;
  Vec3 v;
  Vec3 axis;
};

Result<Plane> plane_across(const Vec3& axis) {
  if (!axis.allFinite() || axis.norm() < 1e-300)
    return bad_value("has no direction", "axis", "a vector that is not zero");
  const Vec3 n = axis.normalized();
  const Vec3 seed = std::abs(n.x()) < 0.9 ? Vec3(Vec3::UnitX()) : Vec3(Vec3::UnitZ());
  const Vec3 u = (seed - n * n.dot(seed)).normalized();
  return Plane{u, n.cross(u), n};
}

/// The guide curve: vertices of a polyline in space, before projection.
struct Guide {
  std::vector<Vec3> vertices;
  bool closed = false;
};

double length_of(const std::vector<Vec3>& points) {
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

/// Vertices on a round curve: as many as the sampling asks for, so that chords do not show.
Result<std::size_t> round_vertices(const StrokeSettings& s, double length, double turns) {
  const double wanted = s.sample_spacing ? length / *s.sample_spacing : 2000.0;
  const double count = std::ceil(std::max(wanted, 256.0 * turns));
  if (count > static_cast<double>(max_samples)) {
    return bad_value(fmt::format("gives {:.0f} samples", count), "sample_spacing", "2 million samples at most");
  }
  return static_cast<std::size_t>(count);
}

Result<Guide> circle_guide(const StrokeSettings& s) {
  ASPERITY_CHECK(validate_round(s));
  ASPERITY_TRY(const Plane plane, plane_across(s.axis));
  const double sweep = 2.0 * std::numbers::pi * s.turns;
  ASPERITY_TRY(const std::size_t count, round_vertices(s, sweep * s.radius, s.turns));
  Guide guide;
  guide.closed = s.turns == std::floor(s.turns);
  for (std::size_t i = 0; i <= count; ++i) {
    const double angle = sweep * static_cast<double>(i) / static_cast<double>(count);
    guide.vertices.push_back(s.centre + s.radius * (std::cos(angle) * plane.u + std::sin(angle) * plane.v));
  }
  if (guide.closed) guide.vertices.back() = guide.vertices.front();
  return guide;
}

// Equal steps in the square root of the sweep give windings equal steps in length: r is proportional to the angle.
Result<Guide> spiral_guide(const StrokeSettings& s) {
  ASPERITY_CHECK(validate_round(s));
  ASPERITY_TRY(const Plane plane, plane_across(s.axis));
  const double turns = s.pitch > 0.0 ? s.radius / s.pitch : s.turns;
  if (turns > 1e4) return bad_value(fmt::format("gives {:.0f} windings", turns), "pitch", "10000 windings at most");
  ASPERITY_TRY(const std::size_t count, round_vertices(s, std::numbers::pi * turns * s.radius, turns));
  Guide guide;
  for (std::size_t i = 0; i <= count; ++i) {
    const double fraction = std::sqrt(static_cast<double>(i) / static_cast<double>(count));
    const double angle = 2.0 * std::numbers::pi * turns * fraction;
    guide.vertices.push_back(s.centre + fraction * s.radius * (std::cos(angle) * plane.u + std::sin(angle) * plane.v));
  }
  return guide;
}

Result<Guide> raster_guide(const StrokeSettings& s) {
  ASPERITY_CHECK(require_finite(s.start, "start"));
  ASPERITY_CHECK(require_finite(s.end, "end"));
  ASPERITY_TRY(const Plane plane, plane_across(s.axis));
  ASPERITY_CHECK(require(s.pitch >= 0.0, "pitch", s.pitch, "a length above 0 (m), or 0 to use rows"));
  const Vec3 diagonal = s.end - s.start;
  const double along = diagonal.dot(plane.u);
  const double across = diagonal.dot(plane.v);
  const double lift = diagonal.dot(plane.axis);
  const double wanted = s.pitch > 0.0 ? std::floor(std::abs(across) / s.pitch * (1.0 + 1e-12)) + 1.0 : s.rows;
  if (!(wanted >= 1.0 && wanted <= 1e5)) {
    return bad_value(fmt::format("gives {:.0f} rows", wanted), s.pitch > 0.0 ? "pitch" : "rows", "1 to 100000 rows");
  }
  const int rows = static_cast<int>(wanted);
  const double last = s.pitch > 0.0 ? s.pitch * (rows - 1) / std::max(std::abs(across), 1e-300) : 1.0;
  Guide guide;
  for (int row = 0; row < rows; ++row) {
    const double fraction = rows > 1 ? last * row / (rows - 1) : 0.0;
    const Vec3 first = s.start + fraction * (across * plane.v + lift * plane.axis);
    const Vec3 second = first + along * plane.u;
    guide.vertices.push_back(row % 2 == 0 ? first : second);
    guide.vertices.push_back(row % 2 == 0 ? second : first);
  }
  return guide;
}

Result<Guide> polyline_guide(const StrokeSettings& s) {
  if (s.points.size() < 2) return bad_value(fmt::format("has {}", s.points.size()), "points", "two points or more");
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    ASPERITY_CHECK(require_finite(s.points[i], fmt::format("points[{}]", i)));
  }
  return Guide{s.points, s.points.size() > 2 && s.points.front() == s.points.back()};
}

Result<Guide> guide_curve(const StrokeSettings& s) {
  switch (s.type) {
    case StrokeType::raster: return raster_guide(s);
    case StrokeType::circle: return circle_guide(s);
    case StrokeType::spiral: return spiral_guide(s);
    case StrokeType::polyline: return polyline_guide(s);
    case StrokeType::line:
    case StrokeType::recorded: break;
  }
  ASPERITY_CHECK(require_finite(s.start, "start"));
  ASPERITY_CHECK(require_finite(s.end, "end"));
  return Guide{{s.start, s.end}, false};
}

/// The guide cut into steps of at most `spacing`; its vertices stay.
Result<std::vector<Vec3>> resampled(const std::vector<Vec3>& vertices, double spacing, double length) {
  if (length / spacing > static_cast<double>(max_samples)) {
    return bad_value(fmt::format("gives {:.0f} samples", length / spacing), "sample_spacing",
                     "2 million samples at most");
  }
  std::vector<Vec3> samples{vertices.front()};
  for (std::size_t i = 1; i < vertices.size(); ++i) {
    const Vec3 step = vertices[i] - vertices[i - 1];
    const double pieces = std::max(1.0, std::ceil(step.norm() / spacing * (1.0 - 1e-9)));
    for (double k = 1.0; k <= pieces; k += 1.0) samples.push_back(vertices[i - 1] + (k / pieces) * step);
  }
  return samples;
}

Result<SurfacePoint> projected(const SurfaceProjector& project, const Vec3& p) {
  SurfacePoint foot = project(p);
  const double norm = foot.normal.norm();
  if (!foot.point.allFinite() || !(norm > 0.0) || !std::isfinite(norm)) {
    return bad_value(fmt::format("gives no point with a normal near ({:.6g}, {:.6g}, {:.6g}) m", p.x(), p.y(), p.z()),
                     "surface", "a surface that the stroke can be laid on");
  }
  foot.normal /= norm;
  return foot;
}

/// Appends what lies on the surface between the last sample and `next`. Nearest points jump where the guide crosses the
/// medial axis of the object; the middle of the jump, projected, leads over the surface instead of through the object.
Status bridge(const SurfaceProjector& project, std::vector<SurfacePoint>& path, const SurfacePoint& next,
              double spacing, int depth) {
  const Vec3 from = path.back().point;
  if (depth > 0 && (next.point - from).norm() > 4.0 * spacing) {
    ASPERITY_TRY(const SurfacePoint middle, projected(project, 0.5 * (from + next.point)));
    const double longest = std::max((middle.point - from).norm(), (next.point - middle.point).norm());
    if (longest < 0.95 * (next.point - from).norm()) {
      ASPERITY_CHECK(bridge(project, path, middle, spacing, depth - 1));
      ASPERITY_CHECK(bridge(project, path, next, spacing, depth - 1));
      return success();
    }
  }
  if (path.size() >= max_samples)
    return bad_value("gives too many samples", "sample_spacing", "2 million samples at most");
  path.push_back(next);
  return success();
}

/// Normals averaged over `window` (m) of arc length, centred; the window is cut at the ends of an open path.
std::vector<Vec3> smoothed(const std::vector<Vec3>& normals, const std::vector<double>& arcs, double window,
                           bool closed) {
  const std::size_t count = normals.size();
  // Integral of the normal over arc length, up to each sample.
  std::vector<Vec3> integral(count, Vec3::Zero());
  for (std::size_t i = 1; i < count; ++i) {
    integral[i] = integral[i - 1] + 0.5 * (arcs[i] - arcs[i - 1]) * (normals[i] + normals[i - 1]);
  }
  const double length = arcs.back();
  const auto integral_at = [&](double arc) -> Vec3 {
    const double turns = closed ? std::floor(arc / length) : 0.0;
    const double s = std::clamp(arc - turns * length, 0.0, length);
    const auto above = std::upper_bound(arcs.begin() + 1, arcs.end() - 1, s);
    const auto i = static_cast<std::size_t>(above - arcs.begin());
    const double u = s - arcs[i - 1];
    const Vec3 slope = (normals[i] - normals[i - 1]) / (arcs[i] - arcs[i - 1]);
    return turns * integral.back() + integral[i - 1] + u * normals[i - 1] + 0.5 * u * u * slope;
  };
  std::vector<Vec3> answer(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 mean = integral_at(arcs[i] + 0.5 * window) - integral_at(arcs[i] - 0.5 * window);
    const double norm = mean.norm();
    // Normals that cancel (a blade thinner than the window) have no mean direction: keep the surface's own.
    answer[i] = norm > 0.1 * std::min(window, length) ? Vec3(mean / norm) : normals[i];
  }
  return answer;
}

}  // namespace

Result<StrokeType> find_stroke_type(std::string_view name) {
  if (const std::optional<StrokeType> type = value_named<StrokeType>(name)) return *type;
  const std::string near = nearest_name(name, all_names<StrokeType>());
  const std::string hint = near.empty() ? std::string() : fmt::format("; did you mean \"{}\"?", near);
  return bad_value(fmt::format("stroke type \"{}\" is not known{}", name, hint), "type", name_list<StrokeType>());
}

/// Fills a StrokePath step by step; the path is immutable once it is out.
class StrokeBuilder {
 public:
  StrokeBuilder(const StrokeSettings& settings, const SurfaceProjector& project)
      : settings_(settings), project_(project) {}

  Result<StrokePath> build() {
    if (!project_) return bad_value("there is no surface to lay the stroke on", "surface", "a projector");
    ASPERITY_CHECK(validate_sampling(settings_));
    if (settings_.type == StrokeType::recorded) return build_recorded();
    ASPERITY_CHECK(validate_motion(settings_));
    ASPERITY_CHECK(lay_on_surface());
    if (!path_.closed_ && settings_.repeats > 1 && !settings_.back_and_forth) {
      return bad_value(fmt::format("is {} on a stroke that does not end where it began", settings_.repeats), "repeats",
                       "1, or back_and_forth");
    }
    set_timing();
    return std::move(path_);
  }

 private:
  Status lay_on_surface() {
    ASPERITY_TRY(const Guide guide, guide_curve(settings_));
    const double length = length_of(guide.vertices);
    if (!(length > 0.0) || !std::isfinite(length)) {
      return bad_value("the stroke has no length", to_string(settings_.type), "points that differ");
    }
    const double spacing = settings_.sample_spacing.value_or(length / 2000.0);
    ASPERITY_TRY(const std::vector<Vec3> samples, resampled(guide.vertices, spacing, length));
    ASPERITY_TRY(const SurfacePoint first, projected(project_, samples.front()));
    std::vector<SurfacePoint> feet{first};
    for (std::size_t i = 1; i < samples.size(); ++i) {
      ASPERITY_TRY(const SurfacePoint foot, projected(project_, samples[i]));
      ASPERITY_CHECK(bridge(project_, feet, foot, spacing, 10));
    }
    path_.closed_ = guide.closed;
    return store(feet, spacing, length);
  }

  Status store(const std::vector<SurfacePoint>& feet, double spacing, double guide_length) {
    StrokePath& path = path_;
    for (const SurfacePoint& foot : feet) {
      const double step = path.points_.empty() ? infinity : (foot.point - path.points_.back()).norm();
      if (step < 1e-6 * spacing) continue;
      path.arcs_.push_back(path.arcs_.empty() ? 0.0 : path.arcs_.back() + step);
      path.points_.push_back(foot.point);
      path.normals_.push_back(foot.normal);
    }
    if (path.points_.size() < 2 || path.arcs_.back() < 1e-9 * guide_length) {
      return bad_value("the stroke has no length once it lies on the surface", to_string(settings_.type),
                       "points whose nearest surface points differ");
    }
    const double window = settings_.normal_smoothing.value_or(path.arcs_.back() / 200.0);
    if (window > 0.0) path.normals_ = smoothed(path.normals_, path.arcs_, window, path.closed_);
    return success();
  }

  void set_timing() {
    const StrokeSettings& s = settings_;
    path_.press_ = s.press;
    path_.normal_force_ = s.normal_force;
    path_.contact_height_ = s.probe_radius - (s.press == PressMode::depth ? s.depth : 0.0);
    path_.approach_height_ = s.probe_radius + s.approach_height;
    path_.approach_speed_ = s.approach_speed;
    path_.speed_ = s.speed;
    path_.back_and_forth_ = s.back_and_forth;
    path_.total_distance_ = path_.length() * s.repeats * (s.back_and_forth ? 2.0 : 1.0);
    path_.approach_time_ = std::abs(path_.approach_height_ - path_.contact_height_) / s.approach_speed;
    path_.contact_time_ = path_.total_distance_ / s.speed;
    path_.lift_time_ = path_.approach_time_;
  }

  Status validate_recorded() const {
    const auto& samples = settings_.recorded;
    if (samples.size() < 2) return bad_value(fmt::format("has {} samples", samples.size()), "recorded", "two or more");
    if (samples.size() > max_samples) return bad_value("has too many samples", "recorded", "2 million samples at most");
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::string place = fmt::format("recorded[{}]", i);
      ASPERITY_CHECK(require_finite(samples[i].position, place));
      const double time = samples[i].time.count();
      if (!std::isfinite(time) || (i > 0 && time <= samples[i - 1].time.count())) {
        return bad_value(fmt::format("time is {} s", time), place, "finite times that increase");
      }
    }
    if (settings_.repeats != 1) return bad_value("a recorded stroke is followed once", "repeats", "1");
    if (settings_.back_and_forth) return bad_value("a recorded stroke is followed once", "back_and_forth", "false");
    return success();
  }

  Result<StrokePath> build_recorded() {
    ASPERITY_CHECK(validate_recorded());
    const double begin = settings_.recorded.front().time.count();
    for (const TimedPoint& sample : settings_.recorded) {
      ASPERITY_TRY(const SurfacePoint foot, projected(project_, sample.position));
      const double step = path_.points_.empty() ? 0.0 : (sample.position - path_.points_.back()).norm();
      path_.arcs_.push_back(path_.arcs_.empty() ? 0.0 : path_.arcs_.back() + step);
      path_.points_.push_back(sample.position);
      path_.normals_.push_back(foot.normal);
      path_.times_.push_back(sample.time.count() - begin);
    }
    path_.contact_time_ = path_.times_.back();
    return std::move(path_);
  }

  const StrokeSettings& settings_;
  const SurfaceProjector& project_;
  StrokePath path_;
};

Result<StrokePath> build_stroke(const StrokeSettings& settings, const SurfaceProjector& project) {
  return StrokeBuilder(settings, project).build();
}

StrokeSettings default_stroke(const Box& bounds) {
  StrokeSettings settings;
  if (bounds.empty()) return settings;
  const Vec3 extent = bounds.extent();
  // The side that shows most of the object: across its shortest extent, the top where two are alike.
  int across = 1;
  for (const int axis : {0, 2}) {
    if (extent[axis] < 0.99 * extent[across]) across = axis;
  }
  const int first = (across + 1) % 3;
  const int second = (across + 2) % 3;
  const int along = extent[std::min(first, second)] >= extent[std::max(first, second)] ? std::min(first, second)
                                                                                       : std::max(first, second);
  Vec3 middle = bounds.centre();
  middle[across] = bounds.upper[across];
  settings.start = middle;
  settings.end = middle;
  settings.start[along] -= 0.2 * extent[along];
  settings.end[along] += 0.2 * extent[along];
  const double length = 0.4 * extent[along];
  const double diagonal = bounds.diagonal();
  if (length > 0.0) settings.speed = length / 4.0;
  if (diagonal > 0.0) {
    settings.approach_height = 0.05 * diagonal;
    settings.approach_speed = settings.approach_height / 0.5;
    settings.depth = std::min(settings.depth, 0.02 * diagonal);
  }
  return settings;
}

StrokePath StrokePath::mapped(const std::function<Vec3(const Vec3&)>& place,
                              const std::function<Vec3(const Vec3&)>& direction) const {
  StrokePath out = *this;
  for (Vec3& point : out.points_) point = place(point);
  for (Vec3& normal : out.normals_) normal = direction(normal);
  for (std::size_t i = 1; i < out.arcs_.size(); ++i)
    out.arcs_[i] = out.arcs_[i - 1] + (out.points_[i] - out.points_[i - 1]).norm();
  return out;
}

}  // namespace asperity
