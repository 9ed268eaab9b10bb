#pragma once
// A stroke: the path that a simulated hand follows over a surface, with its timing.

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/core/units.h"

namespace asperity {

/// A point on a surface with its unit normal, outward. World frame (m).
struct SurfacePoint {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitY();
};

/// The surface point nearest to a point in space. Used while a stroke is built, never afterwards. [build]
using SurfaceProjector = std::function<SurfacePoint(const Vec3&)>;

/// A position at a time (s since the first sample; m, world).
struct TimedPoint {
  Seconds time{0.0};
  Vec3 position = Vec3::Zero();
};

/// Shape of the path.
enum class StrokeType { line, raster, circle, spiral, polyline, recorded };
/// As in scene files.
template <>
struct Names<StrokeType> {
  static constexpr auto table = std::to_array<Named<StrokeType>>({{StrokeType::line, "line"},
                                                                  {StrokeType::raster, "raster"},
                                                                  {StrokeType::circle, "circle"},
                                                                  {StrokeType::spiral, "spiral"},
                                                                  {StrokeType::polyline, "polyline"},
                                                                  {StrokeType::recorded, "recorded"}});
};
/// What is held along the path: a depth or a force.
enum class PressMode {
  depth,  ///< the probe is led at `depth` below the surface
  force,  ///< the hand presses with `normal_force`
};

/// The type called `name`. Errors: bad_value with the nearest name and the list. [build]
Result<StrokeType> find_stroke_type(std::string_view name);

/// What a stroke is made from. World frame, SI. Each geometric field says which types read it; the others leave it
/// alone.
struct StrokeSettings {
  StrokeType type = StrokeType::line;
  Vec3 start = Vec3::Zero();         ///< line: first end; raster: first corner (m)
  Vec3 end = Vec3::Zero();           ///< line: other end; raster: opposite corner (m)
  Vec3 centre = Vec3::Zero();        ///< circle, spiral (m)
  Vec3 axis = Vec3::UnitY();         ///< circle, spiral, raster: normal of the plane it is drawn in; not zero
  double radius = 0.01;              ///< circle; spiral: the outermost winding (m), above 0
  double turns = 1.0;                ///< circle; spiral when `pitch` is 0; above 0
  double pitch = 0.0;                ///< raster: between rows, spiral: between windings (m); 0: from `rows` or `turns`
  int rows = 5;                      ///< raster when `pitch` is 0; 1 or more
  std::vector<Vec3> points;          ///< polyline: two or more (m)
  std::vector<TimedPoint> recorded;  ///< recorded: the probe's own positions, two or more, times increasing

  // A recorded stroke is followed as it is: it brings its own speed, depth and approach, and is not repeated.
  double speed = 0.02;  ///< along the surface (m/s), above 0
  PressMode press = PressMode::depth;
  double depth = 0.001;       ///< PressMode::depth (m); negative stays above the surface
  double probe_radius = 0.0;  ///< of the ball that is led (m), 0 or more: depths and heights are its lowest point's
  double normal_force = 1.0;  ///< PressMode::force (N), above 0
  double approach_height = 0.005;  ///< above the surface, where the stroke starts and ends (m), 0 or more
  double approach_speed = 0.02;    ///< towards and away from the surface (m/s), above 0
  int repeats = 1;                 ///< traversals; 1 or more
  bool back_and_forth = false;     ///< every traversal goes there and back; an open stroke repeats only so

  std::optional<double>
      sample_spacing;  ///< between stored samples (m), above 0; default: 1/2000 of the stroke's length
  std::optional<double> normal_smoothing;  ///< the normal is averaged over this length (m), 0 or more; default: 1/200
};

/// Where in its course a stroke is.
enum class StrokePhase { approach, contact, lift, done };

/// Where the stroke is at one time. World frame, SI.
struct StrokePose {
  Vec3 point = Vec3::Zero();        ///< on the surface
  Vec3 normal = Vec3::UnitY();      ///< unit, outward
  Vec3 tangent = Vec3::UnitX();     ///< unit, in the direction of travel
  double height = 0.0;              ///< of the target over `point` along `normal`; negative is below the surface
  Vec3 target = Vec3::Zero();       ///< point + height * normal: what the hand aims at
  Vec3 velocity = Vec3::Zero();     ///< of `target` (m/s), exact
  Vec3 normal_rate = Vec3::Zero();  ///< change of `normal` (1/s), exact
  double arc = 0.0;                 ///< arc length of `point` from the stroke's first end, 0 ... length()
  double distance = 0.0;            ///< travelled along the surface since the contact phase began
  StrokePhase phase = StrokePhase::approach;
};

/// Immutable: a dense polyline on the surface, by arc length, and the timing over it.
///
/// Led by its lowest point the probe starts at `approach_height` over the stroke's first point, goes straight down to
/// the depth (press depth) or to the surface (press force), follows the surface at constant speed and goes straight up
/// again. Positions are continuous; velocity jumps where one phase ends and at corners.
class StrokePath {
 public:
  /// An empty path: no length, no duration, its pose the origin and done. Others come from build_stroke().
  StrokePath() = default;

  /// Where the stroke is at `time` since its start; clamped to its ends. Does not allocate. [servo]
  [[nodiscard]] StrokePose pose(Seconds time) const noexcept;

  [[nodiscard]] Seconds duration() const noexcept { return Seconds(approach_time_ + contact_time_ + lift_time_); }
  [[nodiscard]] Seconds contact_begin() const noexcept { return Seconds(approach_time_); }
  [[nodiscard]] Seconds contact_end() const noexcept { return Seconds(approach_time_ + contact_time_); }
  /// Length of one traversal in one direction (m).
  [[nodiscard]] double length() const noexcept { return arcs_.empty() ? 0.0 : arcs_.back(); }
  [[nodiscard]] bool closed() const noexcept { return closed_; }
  /// Force (N) that PressMode::force asks for; 0 in mode depth.
  [[nodiscard]] double normal_force() const noexcept { return press_ == PressMode::force ? normal_force_ : 0.0; }
  [[nodiscard]] PressMode press() const noexcept { return press_; }
  [[nodiscard]] double approach_speed() const noexcept { return approach_speed_; }
  /// True for a recorded stroke, whose points are the probe's own and need not lie on a surface.
  [[nodiscard]] bool recorded() const noexcept { return !times_.empty(); }
  /// The stored samples, for pictures: points on the surface, their normals, arc lengths.
  [[nodiscard]] std::span<const Vec3> points() const noexcept { return points_; }
  [[nodiscard]] std::span<const Vec3> normals() const noexcept { return normals_; }
  [[nodiscard]] std::span<const double> arcs() const noexcept { return arcs_; }
  /// The same samples at other places, with their arc lengths measured anew; for asking about places, not for timing.
  /// [build]
  [[nodiscard]] StrokePath mapped(const std::function<Vec3(const Vec3&)>& place,
                                  const std::function<Vec3(const Vec3&)>& direction) const;

 private:
  friend class StrokeBuilder;
  [[nodiscard]] StrokePose pose_at_arc(double arc, double direction, double speed, double height,
                                       double climb) const noexcept;
  [[nodiscard]] StrokePose recorded_pose(double time) const noexcept;

  std::vector<Vec3> points_;
  std::vector<Vec3> normals_;
  std::vector<double> arcs_;
  std::vector<double> times_;  // recorded strokes only
  bool closed_ = false;
  PressMode press_ = PressMode::depth;
  double normal_force_ = 0.0;
  double contact_height_ = 0.0;
  double approach_height_ = 0.0;
  double approach_speed_ = 1.0;
  double speed_ = 1.0;
  double total_distance_ = 0.0;
  bool back_and_forth_ = false;
  double approach_time_ = 0.0;
  double contact_time_ = 0.0;
  double lift_time_ = 0.0;
};

/// Builds the path: draws the guide curve, projects it onto the surface (except a recorded stroke) and smooths the
/// normals. Errors: bad_value with the setting's name as place (not finite, out of range, a stroke without length, more
/// than 2 million samples, a projection that is not finite). [build]
Result<StrokePath> build_stroke(const StrokeSettings& settings, const SurfaceProjector& project);

/// A stroke that suits an object of these bounds when nobody asked for another: a line over the side that shows most of
/// it (across its shortest extent, towards +; the top, y, where extents are alike), through the middle, over 40 % of
/// that side's longer edge, in about four seconds; approach and lift from 5 % of the object's diagonal. [any]
StrokeSettings default_stroke(const Box& bounds);

}  // namespace asperity
