// Where a motion first meets a displaced surface, and which of its points is nearest: both by splitting triangles.

#include <algorithm>
#include <cmath>

#include "asperity/geometry/closest_point.h"
#include "asperity/surface/relief/view.h"

namespace asperity {

namespace {

// Triangles are split until they are this small against a texel: the surface over one is then nearly a plane.
constexpr double leaf_of_texel = 0.5;
constexpr int deepest = 18;
constexpr int stack_capacity = 4 * deepest + 8;

/// Part of a triangle: three corners in its barycentric (u, v).
struct Part {
  Vec2 corner[3];
  int level = 0;
  double key = 0.0;
  double radius = 0.0;  ///< of a ball around its relief (m)
};

void split(const Part& part, Part out[4]) noexcept {
  const Vec2 middle[3] = {0.5 * (part.corner[1] + part.corner[2]), 0.5 * (part.corner[2] + part.corner[0]),
                          0.5 * (part.corner[0] + part.corner[1])};
  for (int k = 0; k < 3; ++k) {
    out[k] = part;
    out[k].corner[(k + 1) % 3] = middle[(k + 2) % 3];
    out[k].corner[(k + 2) % 3] = middle[(k + 1) % 3];
  }
  out[3] = part;
  for (int k = 0; k < 3; ++k) out[3].corner[k] = middle[k];
  for (int k = 0; k < 4; ++k) out[k].level = part.level + 1;
}

Part whole() noexcept {
  Part part;
  part.corner[0] = Vec2(0.0, 0.0);
  part.corner[1] = Vec2(1.0, 0.0);
  part.corner[2] = Vec2(0.0, 1.0);
  return part;
}

/// How often a triangle has to be split to be as small as a leaf.
int leaf_level(const ReliefFrame& frame) noexcept {
  const HeightMap& map = frame.coat.maps->heights();
  double texels = 0.0;
  if (frame.coat.triplanar) {
    const Vec2& tile = frame.coat.maps->tile();
    const double per = std::max(map.width() / tile.x(), map.height() / tile.y());
    texels = per * std::max({frame.coat.point_u.cwiseAbs().maxCoeff(), frame.coat.point_v.cwiseAbs().maxCoeff(),
                             (frame.coat.point_u - frame.coat.point_v).cwiseAbs().maxCoeff()});
  } else {
    const auto span = [&](const Vec2& st) {
      return std::max(std::abs(st.x()) * map.width(), std::abs(st.y()) * map.height());
    };
    texels = std::max({span(frame.coat.st_u), span(frame.coat.st_v), span(frame.coat.st_u - frame.coat.st_v)});
  }
  int level = 0;
  while (level < deepest && texels > leaf_of_texel) {
    texels *= 0.5;
    ++level;
  }
  // Even the flattest map is bent where faces are joined.
  return std::max(level, frame.stitched ? 5 : 2);
}

/// The triangle's own affine frame: barycentric (u, v) of the projection, height over the plane.
struct PlaneFrame {
  Vec3 gradient_u;
  Vec3 gradient_v;
  Vec3 normal;
  explicit PlaneFrame(const ShellPrism& prism) noexcept {
    const Vec3 cross = prism.edge_u.cross(prism.edge_v);
    const double area = cross.squaredNorm();
    gradient_u = prism.edge_v.cross(cross) / area;
    gradient_v = cross.cross(prism.edge_u) / area;
    normal = cross / std::sqrt(area);
  }
  [[nodiscard]] Vec3 turned(const Vec3& vector) const noexcept {
    return {gradient_u.dot(vector), gradient_v.dot(vector), normal.dot(vector)};
  }
};

/// Cuts [from, to] down to where start + t rate lies within [low, high].
bool cut(double start, double rate, double low, double high, double& from, double& to) noexcept {
  if (rate == 0.0) return start >= low && start <= high;
  double enter = (low - start) / rate;
  double leave = (high - start) / rate;
  if (enter > leave) std::swap(enter, leave);
  from = std::max(from, enter);
  to = std::min(to, leave);
  return from <= to;
}

/// A hit on one triangle.
struct PatchHit {
  double t = infinity;
  double u = 0.0;
  double v = 0.0;
};

/// A segment in a face's own plane frame, cut down to where it is within the hull of all of the face's relief.
struct HullPart {
  double from = 0.0;
  double to = 1.0;
  Vec3 start = Vec3::Zero();  ///< of the motion, in the plane's frame
  Vec3 rate = Vec3::Zero();
};

/// False where it is nowhere within the hull before `limit`: no more of the face is looked at then.
bool clip_to_hull(const ReliefSurface& surface, std::uint32_t face, const ShellPrism& prism, const Segment& segment,
                  double limit, HullPart& part) noexcept {
  const PlaneFrame plane(prism);
  part = {0.0, std::min(1.0, limit), plane.turned(segment.from - prism.corner),
          plane.turned(segment.to - segment.from)};
  const Vec3 turned[3] = {plane.turned(prism.direction), plane.turned(prism.direction + prism.turn_u),
                          plane.turned(prism.direction + prism.turn_v)};
  const HeightRange range = surface.range(face);
  // u, v, 1 - u - v and the height over the plane, at six points: exact bounds of their hull.
  double low[4] = {infinity, infinity, infinity, infinity};
  double high[4] = {-infinity, -infinity, -infinity, -infinity};
  for (int corner = 0; corner < 3; ++corner) {
    for (const double height : {range.lowest, range.highest}) {
      const double u = (corner == 1 ? 1.0 : 0.0) + height * turned[corner].x();
      const double v = (corner == 2 ? 1.0 : 0.0) + height * turned[corner].y();
      const double values[4] = {u, v, 1.0 - u - v, height * turned[corner].z()};
      for (int k = 0; k < 4; ++k) {
        low[k] = std::min(low[k], values[k]);
        high[k] = std::max(high[k], values[k]);
      }
    }
  }
  // Room for the rounding of all this: far below a skin.
  const Vec3& start = part.start;
  const Vec3& rate = part.rate;
  const double room_plane = 1e-9 + 1e-12 * (std::abs(start.x()) + std::abs(start.y()));
  const double room_height = 1e-3 * surface.skin() + 1e-14 * std::abs(start.z());
  return cut(start.x(), rate.x(), low[0] - room_plane, high[0] + room_plane, part.from, part.to) &&
         cut(start.y(), rate.y(), low[1] - room_plane, high[1] + room_plane, part.from, part.to) &&
         cut(1.0 - start.x() - start.y(), -rate.x() - rate.y(), low[2] - room_plane, high[2] + room_plane, part.from,
             part.to) &&
         cut(start.z(), rate.z(), low[3] - room_height, high[3] + room_height, part.from, part.to);
}

/// Searches one triangle for the first place where a segment meets its relief. A crossing lies on the curve that the
/// segment is in the shell's coordinates, so that the search is along that curve alone: pieces of it over which the
/// relief is bounded away from it are passed over, others halved.
class PatchRay {
 public:
  PatchRay(const ReliefSurface& surface, const ReliefFrame& frame, const Segment& segment, Sides sides,
           const HullPart& part) noexcept
      : surface_(surface),
        frame_(frame),
        segment_(segment),
        way_(segment.to - segment.from),
        sides_(sides),
        leaf_(leaf_level(frame)),
        part_(part),
        range_(surface.range(frame.face)) {}

  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }

  PatchHit first() noexcept {
    PatchHit best;
    Piece stack[deepest + 2];
    int top = 0;
    stack[top++] = {at(part_.from, guess(part_.from)), at(part_.to, guess(part_.to)), 0};
    while (top > 0) {
      const Piece piece = stack[--top];
      if (passed_over(piece)) continue;
      if (is_leaf(piece)) {
        if (solve(piece, best)) return best;
        continue;
      }
      const Moment middle = halfway(piece);
      // The earlier half first.
      stack[top++] = {middle, piece.to, piece.level + 1};
      stack[top++] = {piece.from, middle, piece.level + 1};
    }
    return {};
  }

 private:
  /// The motion at a time, in the shell's coordinates.
  struct Moment {
    double t = 0.0;
    ShellPlace place;
    double value = infinity;  ///< height over the relief (m), once it is asked for
    bool reached = false;     ///< by the shell
  };
  struct Piece {
    Moment from;
    Moment to;
    int level = 0;
  };

  /// As if directions were the plane's normal.
  [[nodiscard]] ShellPlace guess(double t) const noexcept {
    const Vec3 there = part_.start + t * part_.rate;
    return {there.x(), there.y(), there.z()};
  }

  Moment at(double t, const ShellPlace& near) const noexcept {
    Moment moment{t, near, infinity, false};
    moment.reached = frame_.prism.invert(segment_.from + t * way_, moment.place);
    return moment;
  }

  [[nodiscard]] Moment halfway(const Piece& piece) const noexcept {
    const double t = 0.5 * (piece.from.t + piece.to.t);
    if (!piece.from.reached || !piece.to.reached) {
      const Moment middle = at(t, guess(t));
      if (middle.reached || (!piece.from.reached && !piece.to.reached)) return middle;
      return at(t, piece.from.reached ? piece.from.place : piece.to.place);
    }
    const ShellPlace& a = piece.from.place;
    const ShellPlace& b = piece.to.place;
    const Moment middle = at(t, {0.5 * (a.u + b.u), 0.5 * (a.v + b.v), 0.5 * (a.height + b.height)});
    return middle.reached ? middle : at(t, a);
  }

  void evaluate(Moment& moment) const noexcept {
    if (moment.value < infinity || !moment.reached) return;
    count_.evaluations += surface_.heights_at(frame_, moment.place.u, moment.place.v);
    moment.value = moment.place.height - surface_.height(frame_, moment.place.u, moment.place.v).height;
    // A motion that starts on the surface starts outside it, whatever rounding says.
    if (moment.t == 0.0 && moment.value < 0.0 && moment.value >= -surface_.skin()) moment.value = 0.0;
  }

  /// Whether a piece of the curve is over the face nowhere, or on one side of the relief throughout.
  [[nodiscard]] bool passed_over(const Piece& piece) const noexcept {
    if (!piece.from.reached || !piece.to.reached) {
      // Where the shell does not reach at either end of ever shorter pieces there is no relief.
      constexpr int patience = 4;
      return !piece.from.reached && !piece.to.reached && piece.level >= patience;
    }
    const ShellPlace& a = piece.from.place;
    const ShellPlace& b = piece.to.place;
    ShellPlace bend;
    if (!bends_by(piece, bend)) return false;
    const double beside = overlap + std::max(bend.u, bend.v);
    if (std::max(a.u, b.u) < -beside || std::max(a.v, b.v) < -beside ||
        std::min(a.u + a.v, b.u + b.v) > 1.0 + 2.0 * beside)
      return true;
    // Over all that the face has anywhere, or below: a look at the part itself is dear.
    if (std::min(a.height, b.height) - bend.height > range_.highest) return true;
    if (std::max(a.height, b.height) + bend.height < range_.lowest - (piece.from.t == 0.0 ? surface_.skin() : 0.0))
      return true;
    const FacePart part = FacePart::line({a.u, a.v}, {b.u, b.v}, {bend.u, bend.v});
    count_.bounds += surface_.bounds_of(frame_, part);
    const HeightForm form = surface_.form(frame_, part);
    // Height over the plane that the relief keeps to, at both ends.
    const double half = 0.5 * (form.u * (b.u - a.u) + form.v * (b.v - a.v));
    const double over_from = a.height - form.height + half;
    const double over_to = b.height - form.height - half;
    const double off = form.error + bend.height + std::abs(form.u) * bend.u + std::abs(form.v) * bend.v +
                       1e-12 * (std::abs(a.height) + std::abs(b.height) + std::abs(form.height));
    if (std::min(over_from, over_to) > off) return true;
    return std::max(over_from, over_to) < -off - (piece.from.t == 0.0 ? surface_.skin() : 0.0);
  }

  /// By how much the curve over a piece is off the straight line between its ends, and what it is bent by is known
  /// well enough. From S(c(t)) = p(t): c'' = -2 h' J^-1 (N' (u', v')).
  [[nodiscard]] bool bends_by(const Piece& piece, ShellPlace& bend) const noexcept {
    const ShellPrism& prism = frame_.prism;
    const double du = piece.to.place.u - piece.from.place.u;
    const double dv = piece.to.place.v - piece.from.place.v;
    const double dh = piece.to.place.height - piece.from.place.height;
    const Vec3 turn = (2.0 * dh) * (du * prism.turn_u + dv * prism.turn_v);
    if (turn.isZero(0.0)) {
      bend = {0.0, 0.0, 0.0};
      return true;
    }
    const ShellGradients gradients = shell_gradients(prism, piece.from.place);
    const double second[3] = {std::abs(gradients.u.dot(turn)), std::abs(gradients.v.dot(turn)),
                              std::abs(gradients.height.dot(turn))};
    // An eighth of the second derivative, twice over for what it changes by; each by all three, as they turn into one
    // another.
    const double size = std::abs(du) + std::abs(dv);
    const double along = second[0] + second[1];
    const double per_height = frame_height();
    const double all = along + second[2] / per_height;
    if (!(all <= 0.25 * (size + std::abs(dh) / per_height))) return false;
    bend = {0.25 * (second[0] + 0.25 * all), 0.25 * (second[1] + 0.25 * all),
            0.25 * (second[2] + 0.25 * all * per_height)};
    return true;
  }
  /// What a height is measured by, as an edge measures a coordinate (m).
  [[nodiscard]] double frame_height() const noexcept {
    return std::sqrt(frame_.prism.edge_u.cross(frame_.prism.edge_v).norm());
  }

  [[nodiscard]] bool is_leaf(const Piece& piece) const noexcept {
    if (piece.level >= deepest) return true;
    if (!piece.from.reached || !piece.to.reached) return piece.level >= leaf_;
    const double size =
        std::max(std::abs(piece.to.place.u - piece.from.place.u), std::abs(piece.to.place.v - piece.from.place.v));
    return size <= std::ldexp(1.0, -leaf_) &&
           std::abs(piece.to.place.height - piece.from.place.height) <= std::ldexp(frame_height(), -leaf_);
  }

  /// Looks for a change of sign of the height over the relief between samples within a leaf, and closes in on it.
  bool solve(const Piece& piece, PatchHit& best) const noexcept {
    constexpr int samples = 3;
    const double from = piece.from.t;
    const double to = piece.to.t;
    Moment before = piece.from;
    evaluate(before);
    for (int i = 1; i <= samples; ++i) {
      const double t = i == samples ? to : from + (to - from) * i / samples;
      Moment after = i == samples ? piece.to : at(t, before.reached ? before.place : guess(t));
      evaluate(after);
      Moment first = before;
      Moment last = after;
      if (keep_over_face(first, last)) {
        const bool enters = first.value >= 0.0 && last.value < 0.0;
        const bool leaves = first.value < 0.0 && last.value >= 0.0;
        if ((enters || (leaves && sides_ == Sides::both)) && close_in(first, last, best)) return true;
      }
      before = after;
    }
    return false;
  }

  /// How far inside a side of the triangle a place is (barycentric).
  static double inside(const ShellPlace& place, int side) noexcept {
    return side == 0 ? place.u : side == 1 ? place.v : 1.0 - place.u - place.v;
  }

  /// Moves the two ends together to where the motion is over this face, which is where its relief counts: what its
  /// formula goes on to beyond an edge may rise over the motion once more. Faces overlap by a hair, so that nothing
  /// slips in between. False when it is nowhere over the face between them.
  bool keep_over_face(Moment& first, Moment& last) const noexcept {
    if (!first.reached && !last.reached) return false;
    if (!last.reached && !retreat(first, last)) return false;
    if (!first.reached && !retreat(last, first)) return false;
    for (int side = 0; side < 3; ++side) {
      const double at_first = inside(first.place, side) + overlap;
      const double at_last = inside(last.place, side) + overlap;
      if (at_first < 0.0 && at_last < 0.0) return false;
      if (at_last < 0.0) {
        last = at_side(first, last, side);
      } else if (at_first < 0.0) {
        first = at_side(last, first, side);
        // Beside this face it came in over the neighbour if at all, where the same height had the same sign but for
        // rounding.
        if (first.value < 0.0 && first.value >= -1e-4 * surface_.skin()) first.value = 0.0;
      }
    }
    return first.t < last.t;
  }

  /// Puts the far moment, which the shell does not reach, to the last one found that it does.
  bool retreat(const Moment& near, Moment& far) const noexcept {
    double beyond = far.t;
    far = near;
    for (int i = 0; i < 16; ++i) {
      const Moment middle = at(0.5 * (far.t + beyond), far.place);
      if (middle.reached)
        far = middle;
      else
        beyond = middle.t;
    }
    evaluate(far);
    return far.t != near.t;
  }

  /// The moment between one over the face and one beyond a side of it in which the motion is on that side: by false
  /// position, in the half of the overlap that is next to the face.
  Moment at_side(Moment within, Moment beyond, int side) const noexcept {
    double weight_within = inside(within.place, side) + 0.5 * overlap;
    double weight_beyond = inside(beyond.place, side) + 0.5 * overlap;
    if (weight_within <= 0.0) return within;
    for (int i = 0; i < 60; ++i) {
      double t = within.t + (beyond.t - within.t) * weight_within / (weight_within - weight_beyond);
      if (i % 4 == 3) t = 0.5 * (within.t + beyond.t);
      if (t == within.t || t == beyond.t) break;
      Moment there = at(t, within.place);
      if (!there.reached) break;
      evaluate(there);
      const double weight = inside(there.place, side) + 0.5 * overlap;
      if (std::abs(weight) <= 0.5 * overlap) return there;
      if (weight > 0.0) {
        within = there;
        weight_within = weight;
        weight_beyond *= 0.5;
      } else {
        beyond = there;
        weight_beyond = weight;
        weight_within *= 0.5;
      }
    }
    return within;
  }

  /// The root between two values of different sign: false position, halving where that is slow. The answer is on the
  /// first value's side of it.
  bool close_in(const Moment& first, const Moment& last, PatchHit& best) const noexcept {
    const double enough = 1e-4 * surface_.skin() / way_.norm();
    double from = first.t;
    double to = last.t;
    ShellPlace answer = first.place;
    double weight_from = first.value;
    double weight_to = last.value;
    for (int i = 0; i < 80 && to - from > enough; ++i) {
      double t = from + (to - from) * weight_from / (weight_from - weight_to);
      if (i % 3 == 2 || !(t > from && t < to)) t = 0.5 * (from + to);
      if (t <= from || t >= to) break;
      Moment there = at(t, answer);
      if (!there.reached) return false;
      evaluate(there);
      if ((there.value >= 0.0) == (first.value >= 0.0)) {
        from = t;
        weight_from = there.value;
        answer = there.place;
        weight_to *= 0.5;
      } else {
        to = t;
        weight_to = there.value;
        weight_from *= 0.5;
      }
    }
    best = {from, answer.u, answer.v};
    return true;
  }

  /// Faces overlap by a hair, so that nothing slips in between (barycentric).
  static constexpr double overlap = 1e-9;

  const ReliefSurface& surface_;
  const ReliefFrame& frame_;
  Segment segment_;
  Vec3 way_;
  Sides sides_;
  int leaf_;
  HullPart part_;
  HeightRange range_;  ///< of the heights over all of the face
  mutable WorkCount count_{0, 0, 1};
};

/// Searches triangles for the point of their relief that is nearest to a point.
class ReliefNearestSearch {
 public:
  ReliefNearestSearch(const ReliefSurface& surface, const Vec3& p, double bound, const CoatMoment& moment) noexcept
      : surface_(surface), p_(p), moment_(moment), distance_(bound) {}

  [[nodiscard]] double distance() const noexcept { return distance_; }
  [[nodiscard]] bool found() const noexcept { return place_.frame.face != no_index; }
  [[nodiscard]] const ReliefPlace& place() const noexcept { return place_; }
  [[nodiscard]] const ReliefPoint& spot() const noexcept { return spot_; }
  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }

  /// Starts a descent from a place, and keeps where it ends if that is nearer than all before.
  void descend_from(const ReliefPlace& place) noexcept {
    ReliefPlace at = place;
    ReliefPoint spot = surface_.point(at.frame, at.u, at.v);
    const Goal goal{.point = p_, .may_leave = false, .exactly = true};
    const DescentEnd end = descend(surface_, at, spot, 1.0, goal, count_);
    const double now = (spot.point - p_).norm();
    if (now > distance_ || (now == distance_ && found())) return;
    distance_ = now;
    place_ = at;
    spot_ = spot;
    rests_ = end == DescentEnd::rest;
  }

  void visit(std::uint32_t face) noexcept {
    ReliefPlace here;
    ++count_.frames;
    here.frame = found() && place_.frame.face == face ? place_.frame : surface_.frame(face, moment_);
    const double small = std::ldexp(1.0, -leaf_level(here.frame));
    Part stack[stack_capacity];
    int top = 0;
    if (!window(here.frame, stack[0])) stack[0] = whole();
    constexpr double tiny = 0.05;
    if (is_outside(stack[0]) || (is_small(stack[0], tiny * small) && holds_found(face, stack[0]))) return;
    measure(here.frame, stack[0]);
    top = stack[0].key < distance_ ? 1 : 0;
    while (top > 0) {
      const Part part = stack[--top];
      if (part.key >= distance_) continue;
      if (is_small(part, small) || part.level >= deepest) {
        const Vec2 middle = within_face((part.corner[0] + part.corner[1] + part.corner[2]) / 3.0);
        here.u = middle.x();
        here.v = middle.y();
        ++count_.evaluations;
        const double now = (surface_.point(here.frame, here.u, here.v).point - p_).norm();
        // Before anything is found every leaf that may reach into the bound is tried; after that, a leaf this small
        // whose middle is no nearer lies on the way of a descent that was made already.
        double slack = 2.0;
        if (found())
          slack = holds_found(face, part) ? 0.0 : std::min(0.5, part.radius / std::max(distance_, part.radius));
        if (now < distance_ + slack * part.radius) descend_from(here);
        continue;
      }
      Part parts[4];
      split(part, parts);
      const int below = top;
      for (Part& child : parts) {
        if (is_outside(child)) continue;
        measure(here.frame, child);
        if (child.key >= distance_) continue;
        int slot = top++;
        for (; slot > below && stack[slot - 1].key < child.key; --slot) stack[slot] = stack[slot - 1];
        stack[slot] = child;
      }
    }
  }

 private:
  /// Around the places of a face that can come within the distance of the point: what is that near to it has shell
  /// coordinates that near to its own. False where these are not known well enough, or that is most of the face.
  bool window(const ReliefFrame& frame, Part& part) const noexcept {
    constexpr double most = 0.2;
    const ShellPrism& prism = frame.prism;
    const Vec3 coordinates = PlaneFrame(prism).turned(p_ - prism.corner);
    ShellPlace place{coordinates.x(), coordinates.y(), coordinates.z()};
    // Far from the face it is large in any case.
    if (!(coordinates.cwiseAbs().head<2>().maxCoeff() < 3.0) || !prism.invert(p_, place)) return false;
    const ShellGradients by = shell_gradients(prism, place);
    const double u = by.u.norm();
    const double v = by.v.norm();
    // By how much the shell's Jacobian may change on the way, as a share of itself: then coordinates change by at most
    // twice what they do here.
    const double change = 4.0 * distance_ * by.height.norm() * (u * prism.turn_u.norm() + v * prism.turn_v.norm());
    const Vec2 reach = 2.0 * distance_ * Vec2(u, v) + Vec2::Constant(1e-12);
    if (!(change <= 0.25 && reach.maxCoeff() <= most)) return false;
    const Vec2 lower = Vec2(place.u, place.v) - reach;
    part = whole();
    part.corner[0] = lower;
    part.corner[1] = lower + Vec2(4.0 * reach.x(), 0.0);
    part.corner[2] = lower + Vec2(0.0, 4.0 * reach.y());
    return true;
  }

  static bool is_small(const Part& part, double size) noexcept {
    return (part.corner[1] - part.corner[0]).cwiseAbs().maxCoeff() <= size &&
           (part.corner[2] - part.corner[0]).cwiseAbs().maxCoeff() <= size;
  }
  static bool is_outside(const Part& part) noexcept {
    const auto [a, b, c] = part.corner;
    return std::max({a.x(), b.x(), c.x()}) < 0.0 || std::max({a.y(), b.y(), c.y()}) < 0.0 ||
           std::min({a.sum(), b.sum(), c.sum()}) > 1.0;
  }
  static Vec2 within_face(const Vec2& at) noexcept {
    Vec2 inside = at.cwiseMax(0.0);
    if (inside.sum() > 1.0) inside /= inside.sum();
    return inside;
  }
  /// Whether the nearest point so far, a local minimum, lies in the part or beside it by no more than half its size.
  [[nodiscard]] bool holds_found(std::uint32_t face, const Part& part) const noexcept {
    if (!rests_ || !found() || place_.frame.face != face) return false;
    const Vec2 middle = (part.corner[0] + part.corner[1] + part.corner[2]) / 3.0;
    const Vec2 off = Vec2(place_.u, place_.v) - middle;
    const Vec2 size = (part.corner[1] - part.corner[0]).cwiseAbs() + (part.corner[2] - part.corner[0]).cwiseAbs();
    return std::abs(off.x()) <= size.x() && std::abs(off.y()) <= size.y();
  }

  /// Sets the part's key, which no point of its relief is nearer than.
  void measure(const ReliefFrame& frame, Part& part) noexcept {
    const FacePart triangle = FacePart::triangle(part.corner[0], part.corner[1], part.corner[2]);
    count_.bounds += surface_.bounds_of(frame, triangle);
    const ReliefBound bound = surface_.bound(frame, triangle);
    const double square =
        closest_point_on_triangle(p_, bound.corner[0], bound.corner[1], bound.corner[2]).squared_distance;
    part.key = std::sqrt(std::max(0.0, square)) - bound.error;
    const Vec3 middle = (bound.corner[0] + bound.corner[1] + bound.corner[2]) / 3.0;
    part.radius = 0.0;
    for (const Vec3& corner : bound.corner) part.radius = std::max(part.radius, (corner - middle).norm());
    part.radius += bound.error;
  }

  const ReliefSurface& surface_;
  Vec3 p_;
  CoatMoment moment_;
  double distance_;
  ReliefPlace place_;
  ReliefPoint spot_;
  bool rests_ = false;  ///< at a local minimum
  WorkCount count_;
};

Foot foot_at(const ReliefPlace& place, const ReliefPoint& spot, const Vec3& p) noexcept {
  Foot foot;
  foot.point = spot.point;
  foot.distance = (p - spot.point).norm();
  foot.element = place.frame.face;
  foot.at = {1.0 - place.u - place.v, place.u, place.v};
  foot.normal = spot.front;
  if (foot.normal.dot(p - spot.point) < 0.0) foot.normal = -foot.normal;
  return foot;
}

}  // namespace

template <class Skip>
SweptHit ReliefView::first_met(const Segment& motion, Sides sides, const Skip& skip) const noexcept {
  SweptHit best;
  const Vec3 way = motion.to - motion.from;
  if (!(way.squaredNorm() > 0.0)) return best;
  ReliefPlace place;
  WorkCount count;
  // Nearly all motions are far shorter than a face: the neighbourhood decides.
  surface_->base().index().for_each_along(motion, surface_->boxes(), [&](std::uint32_t face) {
    if (skip(face)) return best.t;
    HullPart part;
    if (!clip_to_hull(*surface_, face, surface_->shell().prism(surface_->base().mesh(), face), motion, best.t, part))
      return best.t;
    const ReliefFrame here = surface_->frame(face, moment_);
    PatchRay ray(*surface_, here, motion, sides, part);
    const PatchHit hit = ray.first();
    count += ray.count();
    if (hit.t < best.t || (!best.hit && hit.t <= 1.0)) {
      best.hit = true;
      best.t = hit.t;
      place = {here, std::clamp(hit.u, 0.0, 1.0), std::clamp(hit.v, 0.0, 1.0)};
      if (place.u + place.v > 1.0) place.v = 1.0 - place.u;
    }
    return best.t;
  });
  tell(cache_->work, count);
  if (!best.hit) return best;
  const ReliefPoint spot = surface_->point(place.frame, place.u, place.v);
  best.contact = foot_at(place, spot, motion.from);
  best.side = spot.front.dot(way) > 0.0 ? -1.0 : 1.0;
  best.contact.normal = best.side * spot.front;
  best.contact.distance = 0.0;
  cache_->relief = {place, spot, true};
  return best;
}

SweptHit ReliefView::first_touch(const Segment& motion, Sides sides) const noexcept {
  return first_met(motion, sides, [](std::uint32_t) { return false; });
}

SweptHit ReliefView::between(const Place& from, const ReliefPoint& start, const Place& to, const ReliefPoint& end,
                             Sides sides) const noexcept {
  if (!surface_->overlapped(from.element) && !surface_->overlapped(to.element)) return {};
  const Segment moved{start.point + from.side() * skin() * start.front, end.point + skin() * (to.side() * end.front)};
  const auto triangles = surface_->base().mesh().triangles();
  return first_met(moved, sides, [&](std::uint32_t face) {
    return share_vertex(triangles[face], triangles[from.element]) ||
           share_vertex(triangles[face], triangles[to.element]);
  });
}

Foot ReliefView::nearest(const Vec3& p, double bound, const Place& start) const noexcept {
  const MeshSurface& base = surface_->base();
  ReliefNearestSearch search(*surface_, p, bound, moment_);
  if (start.element < base.mesh().triangles().size())
    search.descend_from({frame(start.element), start.at[1], start.at[2]});
  if (!search.found() && bound == infinity) {
    const Foot under = base.index().closest(p, infinity, cache_->patch);
    if (!under.found()) return {};
    search.descend_from({surface_->frame(under.element, moment_), under.at[1], under.at[2]});
  }
  if (search.distance() == infinity) return {};
  base.index().for_each_near(p, search.distance(), surface_->boxes(), [&](std::uint32_t face) {
    search.visit(face);
    return search.distance();
  });
  tell(cache_->work, search.count());
  if (!search.found()) return {};
  cache_->relief = {search.place(), search.spot(), true};
  return foot_at(search.place(), search.spot(), p);
}

}  // namespace asperity
