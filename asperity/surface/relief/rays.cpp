// Where a motion first meets a displaced surface: face by face, along the curve that it is in the shell's coordinates.

#include <algorithm>
#include <cmath>
#include <optional>

#include "asperity/surface/relief/detail/search.h"

namespace asperity {

namespace {

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
  Vec2 shear = Vec2::Zero();  ///< what u and v change by along the mean of the directions, by height over the plane
  double rise = 1.0;          ///< of the mean of the directions over the plane
};

/// False where it is nowhere within the hull before `limit`: no more of the face is looked at then.
bool clip_to_hull(const ReliefSurface& surface, std::uint32_t face, const ShellPrism& prism, const Segment& segment,
                  double limit, HullPart& part) noexcept {
  const PlaneFrame plane(prism);
  part = {.from = 0.0,
          .to = std::min(1.0, limit),
          .start = plane.turned(segment.from - prism.corner),
          .rate = plane.turned(segment.to - segment.from)};
  const Vec3 turned[3] = {plane.turned(prism.direction), plane.turned(prism.direction + prism.turn_u),
                          plane.turned(prism.direction + prism.turn_v)};
  const HeightRange range = surface.range(face);
  // Sheared, so that the directions lean as much to one side as to the other: the hull is narrower than the box of what
  // leans.
  const Vec3 mean = (turned[0] + turned[1] + turned[2]) / 3.0;
  if (mean.z() > 0.0) {
    part.shear = mean.head<2>() / mean.z();
    part.rise = mean.z();
  }
  const Vec2& shear = part.shear;
  // u, v, 1 - u - v and the height over the plane, at six points: exact bounds of their hull.
  double low[4] = {infinity, infinity, infinity, infinity};
  double high[4] = {-infinity, -infinity, -infinity, -infinity};
  for (int corner = 0; corner < 3; ++corner) {
    const double lean_u = turned[corner].x() - shear[0] * turned[corner].z();
    const double lean_v = turned[corner].y() - shear[1] * turned[corner].z();
    for (const double height : {range.lowest, range.highest}) {
      const double u = (corner == 1 ? 1.0 : 0.0) + height * lean_u;
      const double v = (corner == 2 ? 1.0 : 0.0) + height * lean_v;
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
  const double from_u = start.x() - shear[0] * start.z();
  const double from_v = start.y() - shear[1] * start.z();
  const double rate_u = rate.x() - shear[0] * rate.z();
  const double rate_v = rate.y() - shear[1] * rate.z();
  const double room_plane = 1e-9 + 1e-12 * (std::abs(start.x()) + std::abs(start.y()) +
                                            (std::abs(shear[0]) + std::abs(shear[1])) * std::abs(start.z()));
  const double room_height = 1e-3 * surface.skin() + 1e-14 * std::abs(start.z());
  return cut(from_u, rate_u, low[0] - room_plane, high[0] + room_plane, part.from, part.to) &&
         cut(from_v, rate_v, low[1] - room_plane, high[1] + room_plane, part.from, part.to) &&
         cut(1.0 - from_u - from_v, -rate_u - rate_v, low[2] - room_plane, high[2] + room_plane, part.from, part.to) &&
         cut(start.z(), rate.z(), low[3] - room_height, high[3] + room_height, part.from, part.to);
}

/// Searches one triangle for the first place where a segment meets its relief. A crossing lies on the curve that the
/// segment is in the shell's coordinates, so that the search is along that curve alone: pieces of it over which the
/// relief is bounded away from it are passed over, others cut to what may meet it, or halved.
class PatchRay {
 public:
  PatchRay(const ReliefSurface& surface, std::uint32_t face, const ShellPrism& prism, const CoatMoment& moment,
           const Segment& segment, Sides sides, const HullPart& part, bool starts_on_it) noexcept
      : surface_(surface),
        face_(face),
        prism_(prism),
        moment_(moment),
        segment_(segment),
        way_(segment.to - segment.from),
        sides_(sides),
        part_(part),
        starts_on_it_(starts_on_it),
        range_(surface.range(face)),
        per_height_(std::sqrt(prism.edge_u.cross(prism.edge_v).norm())) {}

  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }
  /// The face's frame: made when it is first asked for, since most faces are passed over without. [servo]
  [[nodiscard]] const ReliefFrame& frame() const noexcept {
    if (!frame_) frame_.emplace(surface_.frame(face_, moment_));
    return *frame_;
  }

  /// The first hit, if it is no later than `limit`: what is looked at on the way there does not depend on that.
  PatchHit first(double limit) noexcept {
    PatchHit best;
    Piece stack[deepest_part + 3];
    int top = 0;
    stack[top++] = {at(part_.from, guess(part_.from)), at(part_.to, guess(part_.to)), 0, first_look()};
    while (top > 0) {
      Piece piece = stack[--top];
      if (piece.from.t > limit) break;
      if (piece.look > 0.0 && split_off_look(piece, stack[top])) ++top;
      Share share;
      ShellPlace bend;
      const Way way = look_beside(piece, bend, share.bulge);
      if (way == Way::off) continue;
      const bool strip = is_strip(piece, 1.0);
      if (!strip && way == Way::known && bounded_away(piece, bend, share)) continue;
      if (strip || is_strip(piece, share.to - share.from)) {
        if (solve_strip(piece, share, best)) return best;
        continue;
      }
      if (is_leaf(piece)) {
        if (solve(piece, best)) return best;
        continue;
      }
      if (cut_to(share, piece)) {
        stack[top++] = piece;
        continue;
      }
      const Moment middle = halfway(piece, share.bulge);
      // The earlier half first.
      stack[top++] = {middle, piece.to, piece.level + 1, 0.0};
      stack[top++] = {piece.from, middle, piece.level + 1, 0.0};
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
    double look = 0.0;  ///< time from its begin to where it is to be split before anything is known of it, or 0
  };

  /// Where a piece of the curve goes: nowhere over the face or within its heights, somewhere there, or how it bends is
  /// not known.
  enum class Way { off, known, unknown };

  /// The part of a piece that may meet the relief, and by how much the curve is off its chord in the middle.
  struct Share {
    double from = 0.0;
    double to = 1.0;
    ShellPlace bulge;
  };

  /// A motion that starts on the relief mostly meets it again at once: halving what goes on as far as the face does, to
  /// come down to that, would take a bound each time. So the first strip is looked at first, then what is four times as
  /// long, and so on. In time; 0 where it is not so.
  [[nodiscard]] double first_look() const noexcept {
    if (!starts_on_it_) return 0.0;
    const double rise = std::abs(part_.rate.z() / part_.rise) / per_height_;
    const double rate = std::max({std::abs(part_.rate.x() - part_.shear.x() * part_.rate.z()),
                                  std::abs(part_.rate.y() - part_.shear.y() * part_.rate.z()), rise});
    constexpr double within_strip = 0.95;
    const double look = within_strip * strip_leaves * std::ldexp(1.0, -leaf()) / rate;
    constexpr double beside_start = 4.0;
    return part_.from <= beside_start * look ? look : 0.0;
  }

  /// Splits a piece where that is to be done, off its `rest`. False where it is short already.
  [[nodiscard]] bool split_off_look(Piece& piece, Piece& rest) const noexcept {
    constexpr double worth_it = 0.6;
    constexpr double grown = 4.0;
    const double look = piece.look;
    piece.look = 0.0;
    if (!piece.from.reached || !(look < worth_it * (piece.to.t - piece.from.t))) return false;
    const double t = piece.from.t + look;
    const Moment middle =
        at(t, piece.to.reached ? along(piece.from, piece.to, look / (piece.to.t - piece.from.t)) : guess(t));
    if (!middle.reached) return false;
    rest = {middle, piece.to, piece.level, grown * look};
    piece.to = middle;
    return true;
  }

  /// As if all directions were their mean.
  [[nodiscard]] ShellPlace guess(double t) const noexcept {
    const Vec3 there = part_.start + t * part_.rate;
    return {there.x() - part_.shear.x() * there.z(), there.y() - part_.shear.y() * there.z(), there.z() / part_.rise};
  }

  Moment at(double t, const ShellPlace& near) const noexcept {
    Moment moment{t, near, infinity, false};
    moment.reached = prism_.invert(segment_.from + t * way_, moment.place);
    return moment;
  }

  /// Where the curve over a piece is, `share` of the way along it.
  [[nodiscard]] Moment within(const Piece& piece, double share, const ShellPlace& bulge) const noexcept {
    const Moment thought = near(piece, share, bulge);
    return at(thought.t, thought.place);
  }

  /// The same to first order.
  [[nodiscard]] static Moment near(const Piece& piece, double share, const ShellPlace& bulge) noexcept {
    ShellPlace place = along(piece.from, piece.to, share);
    const double off = share * (1.0 - share);
    place.u += off * bulge.u;
    place.v += off * bulge.v;
    place.height += off * bulge.height;
    return {share == 1.0 ? piece.to.t : piece.from.t + share * (piece.to.t - piece.from.t), place, infinity, false};
  }

  [[nodiscard]] Moment halfway(const Piece& piece, const ShellPlace& bulge) const noexcept {
    const double t = 0.5 * (piece.from.t + piece.to.t);
    if (!piece.from.reached || !piece.to.reached) {
      const Moment middle = at(t, guess(t));
      if (middle.reached || (!piece.from.reached && !piece.to.reached)) return middle;
      return at(t, piece.from.reached ? piece.from.place : piece.to.place);
    }
    const Moment middle = within(piece, 0.5, bulge);
    return middle.reached ? middle : at(t, piece.from.place);
  }

  /// Cuts a piece down to the share of it that may meet the relief, where that is much less than all.
  [[nodiscard]] bool cut_to(const Share& share, Piece& piece) const noexcept {
    constexpr double worth_it = 0.6;
    if (share.to - share.from > worth_it) return false;
    Piece less = piece;
    if (share.from > 0.0) less.from = within(piece, share.from, share.bulge);
    if (share.to < 1.0) less.to = within(piece, share.to, share.bulge);
    if (!less.from.reached || !less.to.reached || !(less.from.t < less.to.t)) return false;
    piece = less;
    return true;
  }

  void evaluate(Moment& moment) const noexcept {
    if (moment.value < infinity || !moment.reached) return;
    count_.evaluations += surface_.heights_at(frame(), moment.place.u, moment.place.v);
    moment.value = moment.place.height - surface_.height_alone(frame(), moment.place.u, moment.place.v);
  }

  /// What is known of a piece without a look at its part of the relief, which is dear, as is the frame that it needs.
  /// `bend` and `bulge` as bends_by finds them; only of what is known.
  [[nodiscard]] Way look_beside(const Piece& piece, ShellPlace& bend, ShellPlace& bulge) const noexcept {
    if (!piece.from.reached || !piece.to.reached) {
      // Where the shell does not reach at either end of ever shorter pieces there is no relief.
      constexpr int patience = 4;
      return !piece.from.reached && !piece.to.reached && piece.level >= patience ? Way::off : Way::unknown;
    }
    const ShellPlace& a = piece.from.place;
    const ShellPlace& b = piece.to.place;
    if (!bends_by(piece, bend, bulge)) return Way::unknown;
    const double beside = overlap + std::max(bend.u, bend.v);
    if (std::max(a.u, b.u) < -beside || std::max(a.v, b.v) < -beside ||
        std::min(a.u + a.v, b.u + b.v) > 1.0 + 2.0 * beside)
      return Way::off;
    const bool over = std::min(a.height, b.height) - bend.height > range_.highest;
    const bool below = std::max(a.height, b.height) + bend.height < range_.lowest - room_below(piece);
    return over || below ? Way::off : Way::known;
  }

  /// Whether a piece of the curve, bent by so much, is on one side of the relief throughout. Where it is not, `share`
  /// is the part of it that may be on both.
  [[nodiscard]] bool bounded_away(const Piece& piece, const ShellPlace& bend, Share& share) const noexcept {
    const ShellPlace& a = piece.from.place;
    const ShellPlace& b = piece.to.place;
    const FacePart part = FacePart::line({a.u, a.v}, {b.u, b.v}, {bend.u, bend.v});
    count_.bounds += surface_.bounds_of(frame(), part);
    const HeightForm form = surface_.form(frame(), part);
    // Height over the plane that the relief keeps to, at both ends.
    const double half = 0.5 * (form.u * (b.u - a.u) + form.v * (b.v - a.v));
    const double over_from = a.height - form.height + half;
    const double over_to = b.height - form.height - half;
    const double off = form.error + bend.height + std::abs(form.u) * bend.u + std::abs(form.v) * bend.v +
                       1e-12 * (std::abs(a.height) + std::abs(b.height) + std::abs(form.height));
    if (std::min(over_from, over_to) > off) return true;
    const double below = off + room_below(piece);
    if (std::max(over_from, over_to) < -below) return true;
    share.from = 0.0;
    share.to = 1.0;
    static_cast<void>(cut(over_from, over_to - over_from, -below, off, share.from, share.to));
    return false;
  }

  /// How far below the relief a piece may start and yet go into it.
  [[nodiscard]] double room_below(const Piece& piece) const noexcept {
    return piece.from.t == 0.0 || coming_up_ ? surface_.skin() : 0.0;
  }

  /// By how much the curve over a piece is off the straight line between its ends at most, and whether what it is bent
  /// by is known well enough; `bulge` times s (1 - s) is that to first order. From S(c(t)) = p(t): c'' = -2 h' J^-1 (N'
  /// (u', v')).
  [[nodiscard]] bool bends_by(const Piece& piece, ShellPlace& bend, ShellPlace& bulge) const noexcept {
    const double du = piece.to.place.u - piece.from.place.u;
    const double dv = piece.to.place.v - piece.from.place.v;
    const double dh = piece.to.place.height - piece.from.place.height;
    const Vec3 turn = (2.0 * dh) * (du * prism_.turn_u + dv * prism_.turn_v);
    if (turn.isZero(0.0)) {
      bend = {0.0, 0.0, 0.0};
      return true;
    }
    const ShellGradients gradients = shell_gradients(prism_, piece.from.place);
    bulge = {0.5 * gradients.u.dot(turn), 0.5 * gradients.v.dot(turn), 0.5 * gradients.height.dot(turn)};
    const double second[3] = {2.0 * std::abs(bulge.u), 2.0 * std::abs(bulge.v), 2.0 * std::abs(bulge.height)};
    // An eighth of the second derivative, twice over for what it changes by; each by all three, as they turn into one
    // another.
    const double size = std::abs(du) + std::abs(dv);
    const double along = second[0] + second[1];
    const double all = along + second[2] / per_height_;
    if (!(all <= 0.25 * (size + std::abs(dh) / per_height_))) return false;
    bend = {0.25 * (second[0] + 0.25 * all), 0.25 * (second[1] + 0.25 * all),
            0.25 * (second[2] + 0.25 * all * per_height_)};
    return true;
  }

  /// How often a whole face is halved to a leaf.
  [[nodiscard]] int leaf() const noexcept {
    if (leaf_ < 0) leaf_ = leaf_level(frame());
    return leaf_;
  }

  [[nodiscard]] bool is_leaf(const Piece& piece) const noexcept {
    if (piece.level >= deepest_part) return true;
    if (!piece.from.reached || !piece.to.reached) return piece.level >= leaf();
    return extent(piece) <= std::ldexp(1.0, -leaf());
  }

  /// A few leaves whose heights are asked for side by side, in the time that bounding one of them takes. Where
  /// neighbours have a say a height is dear.
  [[nodiscard]] bool is_strip(const Piece& piece, double share) const noexcept {
    if (!piece.from.reached || !piece.to.reached || share * extent(piece) > strip_leaves * std::ldexp(1.0, -leaf()))
      return false;
    const ShellPlace& a = piece.from.place;
    const ShellPlace& b = piece.to.place;
    return surface_.bounds_of(frame(), FacePart::line({a.u, a.v}, {b.u, b.v}, Vec2::Zero())) == 1;
  }

  /// The shorter a piece is the straighter is the relief beside it.
  [[nodiscard]] int samples_of(const Piece& piece) const noexcept {
    constexpr double straight = 1.0 / 16.0;
    if (!piece.from.reached || !piece.to.reached) return most_samples;
    return extent(piece) <= straight * std::ldexp(1.0, -leaf()) ? 1 : most_samples;
  }

  /// By how much the place changes over a piece, as an edge is 1.
  [[nodiscard]] double extent(const Piece& piece) const noexcept {
    const ShellPlace& a = piece.from.place;
    const ShellPlace& b = piece.to.place;
    return std::max({std::abs(b.u - a.u), std::abs(b.v - a.v), std::abs(b.height - a.height) / per_height_});
  }

  /// What is between two moments, both with their heights: whether the relief is met.
  bool met_between(const Moment& before, const Moment& after, PatchHit& best) noexcept {
    Moment first = before;
    Moment last = after;
    if (!keep_over_face(first, last)) return false;
    // A motion that starts on the surface starts outside it, whatever rounding says; and as long as it only comes up
    // from there it has not gone in.
    if (first.t == 0.0) coming_up_ = first.value < 0.0 && first.value >= -surface_.skin();
    if (coming_up_) {
      if (last.value < 0.0 && last.value >= first.value) return false;
      first.value = 0.0;
      coming_up_ = false;
    }
    const bool enters = first.value >= 0.0 && last.value < 0.0;
    const bool leaves = first.value < 0.0 && last.value >= 0.0;
    return (enters || (leaves && sides_ == Sides::both)) && close_in(first, last, best);
  }

  /// As `solve`, over the share of a strip that may meet the relief.
  bool solve_strip(const Piece& piece, const Share& share, PatchHit& best) noexcept {
    const double step = (share.to - share.from) * extent(piece) * std::ldexp(1.0, leaf());
    const int samples = std::max(1, static_cast<int>(std::ceil(most_samples * step)));
    Moment before = share.from > 0.0 || last_end_.t != piece.from.t ? piece.from : last_end_;
    int next = share.from > 0.0 ? 0 : 1;
    if (next > 0) evaluate(before);
    while (next <= samples) {
      const int count = std::min(samples + 1 - next, static_cast<int>(lanes));
      Moment moments[lanes];
      for (std::size_t i = 0; i < lanes; ++i) {
        const int sample = next + std::min(static_cast<int>(i), count - 1);
        const double at = sample == samples ? share.to : share.from + (share.to - share.from) * sample / samples;
        moments[i] = near(piece, at, share.bulge);
      }
      reach(moments);
      for (int i = 0; i < count; ++i, ++next) {
        const Moment& after = moments[i];
        ++count_.evaluations;
        if (next > 0 && met_between(before, after, best)) return true;
        before = after;
      }
    }
    if (share.to == 1.0) last_end_ = before;
    return false;
  }

  /// Brings moments from where they are thought to be to where they are, with their heights, none of them in a band.
  void reach(Moment (&moments)[lanes]) const noexcept {
    std::array<Lanes, 3> points;
    ShellPlaces places;
    for (std::size_t i = 0; i < lanes; ++i) {
      const Vec3 there = segment_.from + moments[i].t * way_;
      for (std::size_t axis = 0; axis < 3; ++axis) points[axis][i] = there[static_cast<int>(axis)];
      places.u[i] = moments[i].place.u;
      places.v[i] = moments[i].place.v;
      places.height[i] = moments[i].place.height;
    }
    prism_.invert(points, places);
    Lanes heights;
    surface_.heights_alone(frame(), places.u, places.v, heights);
    for (std::size_t i = 0; i < lanes; ++i) {
      moments[i].reached = places.reached[i];
      if (!places.reached[i]) continue;
      moments[i].place = {places.u[i], places.v[i], places.height[i]};
      moments[i].value = places.height[i] - heights[i];
    }
  }

  /// Looks for a change of sign of the height over the relief between samples within a leaf, and closes in on it.
  bool solve(const Piece& piece, PatchHit& best) noexcept {
    const int samples = samples_of(piece);
    const double from = piece.from.t;
    const double to = piece.to.t;
    // Mostly it is where the last leaf ended.
    Moment before = last_end_.t == from ? last_end_ : piece.from;
    evaluate(before);
    for (int i = 1; i <= samples; ++i) {
      const double t = i == samples ? to : from + (to - from) * i / samples;
      Moment after = i == samples ? piece.to : sample(piece, before, t);
      evaluate(after);
      if (met_between(before, after, best)) return true;
      before = after;
    }
    last_end_ = before;
    return false;
  }

  [[nodiscard]] Moment sample(const Piece& piece, const Moment& before, double t) const noexcept {
    if (!before.reached) return at(t, guess(t));
    if (!piece.to.reached) return at(t, before.place);
    return at(t, along(before, piece.to, (t - before.t) / (piece.to.t - before.t)));
  }

  /// The place so far from one moment to another, as if it went straight.
  static ShellPlace along(const Moment& from, const Moment& to, double share) noexcept {
    const ShellPlace& a = from.place;
    const ShellPlace& b = to.place;
    return {a.u + share * (b.u - a.u), a.v + share * (b.v - a.v), a.height + share * (b.height - a.height)};
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

  /// The root between two values of different sign: Chandrupatla's method (1997), the parabola through three of them
  /// where that can be trusted, and halving where not. The answer is on the first value's side of it.
  bool close_in(const Moment& first, const Moment& last, PatchHit& best) const noexcept {
    const double enough = 1e-4 * surface_.skin() / way_.norm();
    Moment latest = first;
    Moment other = last;  // of the other sign
    double share = first.value / (first.value - last.value);
    for (int i = 0; i < 80 && std::abs(other.t - latest.t) > enough; ++i) {
      const double least = 0.5 * enough / std::abs(other.t - latest.t);
      const Moment there = between(latest, other, std::clamp(share, least, 1.0 - least));
      if (!there.reached) return false;
      if (there.t == latest.t || there.t == other.t) break;
      const bool same = (there.value >= 0.0) == (latest.value >= 0.0);
      const Moment third = same ? latest : other;
      if (!same) other = latest;
      latest = there;
      const double xi = (latest.t - other.t) / (third.t - other.t);
      const double phi = (latest.value - other.value) / (third.value - other.value);
      share = 0.5;
      if (phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi) {
        share = latest.value / (other.value - latest.value) * third.value / (other.value - third.value) +
                (third.t - latest.t) / (other.t - latest.t) * latest.value / (third.value - latest.value) *
                    other.value / (third.value - other.value);
      }
    }
    const Moment& answer = (latest.value >= 0.0) == (first.value >= 0.0) ? latest : other;
    best = {answer.t, answer.place.u, answer.place.v};
    return true;
  }

  /// The moment so far from one to another, with its height.
  [[nodiscard]] Moment between(const Moment& from, const Moment& to, double share) const noexcept {
    Moment there = at(from.t + share * (to.t - from.t), along(from, to, share));
    evaluate(there);
    return there;
  }

  // Of a leaf.
  static constexpr int most_samples = 3;
  // A strip is so many times as long.
  static constexpr double strip_leaves = 2.0;
  /// Faces overlap by a hair, so that nothing slips in between (barycentric).
  static constexpr double overlap = 1e-9;

  const ReliefSurface& surface_;
  std::uint32_t face_;
  const ShellPrism& prism_;
  CoatMoment moment_;
  Segment segment_;
  Vec3 way_;
  Sides sides_;
  HullPart part_;
  bool starts_on_it_;  ///< the motion, on the relief of this face or of one beside it
  HeightRange range_;  ///< of the heights over all of the face
  Moment last_end_{-1.0, {}, infinity, false};
  bool coming_up_ = false;  ///< started less than a skin below the relief, and has been nowhere over it yet
  double per_height_;       ///< what a height is measured by, as an edge measures a coordinate (m)
  mutable std::optional<ReliefFrame> frame_;
  mutable int leaf_ = -1;  ///< not known yet
  mutable WorkCount count_{0, 0, 1};
};

}  // namespace

template <class Skip>
SweptHit ReliefView::first_met(const Segment& motion, Sides sides, const Skip& skip, std::uint32_t likely,
                               std::uint32_t starts_on) const noexcept {
  SweptHit best;
  const Vec3 way = motion.to - motion.from;
  if (!(way.squaredNorm() > 0.0)) return best;
  ReliefPlace place;
  WorkCount count;
  // The others are looked at in an order that the tree decides: what each of them answers must not depend on those
  // before it.
  double end = 1.0;
  const auto look_at = [&](std::uint32_t face) {
    if (skip(face)) return best.t;
    HullPart part;
    const ShellPrism prism = surface_->shell().prism(surface_->base().mesh(), face);
    if (!clip_to_hull(*surface_, face, prism, motion, end, part) || part.from > best.t) return best.t;
    PatchRay ray(*surface_, face, prism, moment_, motion, sides, part, starts_on != no_index);
    const PatchHit hit = ray.first(best.t);
    count += ray.count();
    const bool earlier = hit.t < best.t || (hit.t == best.t && (!best.hit || face < place.frame.face));
    if (hit.t <= 1.0 && earlier) {
      best.hit = true;
      best.t = hit.t;
      place = {ray.frame(), std::clamp(hit.u, 0.0, 1.0), std::clamp(hit.v, 0.0, 1.0)};
      if (place.u + place.v > 1.0) place.v = 1.0 - place.u;
    }
    return best.t;
  };
  if (likely != no_index) end = std::min(end, look_at(likely));
  // Nearly all motions are far shorter than a face: the neighbourhood decides.
  surface_->base().index().for_each_along(motion, surface_->boxes(),
                                          [&](std::uint32_t face) { return face == likely ? best.t : look_at(face); });
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

SweptHit ReliefView::first_touch(const Segment& motion, Sides sides, std::uint32_t starts_on) const noexcept {
  return first_met(
      motion, sides, [](std::uint32_t) { return false; }, starts_on, starts_on);
}

SweptHit ReliefView::beside(std::span<const std::uint32_t> faces, const Segment& moved, Sides sides,
                            std::uint32_t likely) const noexcept {
  if (std::none_of(faces.begin(), faces.end(), [&](std::uint32_t face) { return surface_->overlapped(face); }))
    return {};
  const auto triangles = surface_->base().mesh().triangles();
  const auto skip = [&](std::uint32_t face) {
    return std::any_of(faces.begin(), faces.end(),
                       [&](std::uint32_t other) { return share_vertex(triangles[face], triangles[other]); });
  };
  return first_met(moved, sides, skip, likely, no_index);
}

}  // namespace asperity
