// Queries of a parametric surface: patches are bounded and halved until Newton's method is certain, or nothing is left.

#include <algorithm>
#include <cmath>

#include "asperity/surface/parametric/detail/shapes.h"
#include "asperity/surface/parametric/view.h"
#include "asperity/surface/tangents.h"

namespace asperity {

namespace {

// Halvings a query may make; one that needs more answers what it holds by then, on the safe side.
constexpr int most_nodes = 50000;
// Patches that wait: one for each halving of a depth-first search.
constexpr int most_waiting = 128;
constexpr int most_newton = 12;
// Share of the skin below which a patch counts as a point.
constexpr double point_of_skin = 0.1;
// Share of the surface's size to which a nearest distance is found.
constexpr double closest_of_size = 1e-9;

/// A rectangle of the parameters.
struct Patch {
  Vec2 centre = Vec2::Zero();
  Vec2 half = Vec2::Zero();
};

/// Where a patch certainly lies: no farther than `radius` from a parallelogram around `point`.
struct Bound {
  ParametricJet jet;            ///< of the surface at the centre; first derivatives alone
  Vec3 along_u = Vec3::Zero();  ///< sides of the parallelogram by the parameters
  Vec3 along_v = Vec3::Zero();
  Vec3 n = Vec3::Zero();   ///< unit normal of the parallelogram
  Vec3 du = Vec3::Zero();  ///< gradients of the parameters on it (1/m)
  Vec3 dv = Vec3::Zero();
  double ku = 0.0;  ///< their lengths
  double kv = 0.0;
  double radius = 0.0;  ///< m
  double reach = 0.0;   ///< no point of the patch is farther from `point` (m)
  double part_u = 0.0;  ///< of the radius, by halving either parameter
  double part_v = 0.0;
  bool edge = false;    ///< features may have an edge in the patch
  double side_u = 0.0;  ///< half lengths (m)
  double side_v = 0.0;
};

class Patches {
 public:
  explicit Patches(const ParametricSurface& surface) noexcept
      : surface_(surface), settings_(surface.settings()), limits_(surface.limits()) {
    own_u_ = of_revolution(settings_.shape) && settings_.features.empty();
  }

  [[nodiscard]] Patch leaf(std::uint32_t column, std::uint32_t row, std::uint32_t side) const noexcept {
    Patch out;
    const Vec2 size = (surface_.upper() - surface_.lower()) / static_cast<double>(side);
    out.half = 0.5 * size;
    out.centre = surface_.lower() + Vec2((column + 0.5) * size.x(), (row + 0.5) * size.y());
    return out;
  }

  [[nodiscard]] Bound bound(const Patch& patch) const noexcept {
    Bound out;
    const double p = patch.half.x();
    const double q = patch.half.y();
    Vec3 flat_u;
    Vec3 flat_v;
    first(patch.centre, out.jet, flat_u, flat_v);
    // Around the axis |S_uu| is |S_u|, which is far less than anywhere near the poles of a sphere.
    const double uu = own_u_ ? std::min(limits_.shape_uu, flat_u.norm() + limits_.shape_uv * q) : limits_.shape_uu;
    const double cross = limits_.shape_uv * p * q;
    const double flat_radius_u = 0.5 * (uu * p * p + cross);
    const double flat_radius_v = 0.5 * (limits_.shape_vv * q * q + cross);
    Vec3& along_u = out.along_u;
    Vec3& along_v = out.along_v;
    along_u = out.jet.u;
    along_v = out.jet.v;
    if (settings_.features.empty()) {
      out.part_u = flat_radius_u;
      out.part_v = flat_radius_v;
    } else {
      // Two ways: along the features' own slope at the centre, or on the plain shape and as thick as they may be here.
      out.part_u = 0.5 * (limits_.uu * p * p + limits_.uv * p * q);
      out.part_v = 0.5 * (limits_.vv * q * q + limits_.uv * p * q);
      const double thick_u = flat_radius_u + limits_.slope_u * p;
      const double thick_v = flat_radius_v + limits_.slope_v * q;
      out.edge = has_edge(patch);
      if (out.edge || out.part_u + out.part_v > thick_u + thick_v) {
        out.part_u = thick_u;
        out.part_v = thick_v;
        along_u = flat_u;
        along_v = flat_v;
      }
    }
    out.radius = out.part_u + out.part_v;
    out.side_u = p * along_u.norm();
    out.side_v = q * along_v.norm();
    out.reach = out.side_u + out.side_v + out.radius;
    const Vec3 normal = along_u.cross(along_v);
    const double square = normal.squaredNorm();
    if (!(square > 1e-200)) {
      out.radius = out.reach;
      return out;
    }
    out.n = normal / std::sqrt(square);
    out.du = along_v.cross(normal) / square;
    out.dv = normal.cross(along_u) / square;
    out.ku = out.du.norm();
    out.kv = out.dv.norm();
    return out;
  }

  /// By how much S_u x S_v may differ from that of the centre, anywhere in the patch; infinite across edges.
  [[nodiscard]] double normal_change(const Patch& patch, const Bound& bound) const noexcept {
    if (bound.edge) return infinity;
    const double p = patch.half.x();
    const double q = patch.half.y();
    const bool plain = settings_.features.empty();
    const double uu = plain ? limits_.shape_uu : limits_.uu;
    const double uv = plain ? limits_.shape_uv : limits_.uv;
    const double vv = plain ? limits_.shape_vv : limits_.vv;
    const double change_u = (own_u_ ? std::min(uu, bound.jet.u.norm() + uv * q) : uu) * p + uv * q;
    const double change_v = uv * p + vv * q;
    return bound.jet.u.norm() * change_v + bound.jet.v.norm() * change_u + change_u * change_v;
  }

  /// The half of a patch to look at after its other half, which `patch` becomes.
  [[nodiscard]] static Patch halve(Patch& patch, const Bound& bound) noexcept {
    // While a patch is far from flat its longer side is halved, later the one along which it bends more.
    constexpr double flat = 0.1;
    const bool by_bend = bound.radius < flat * (bound.side_u + bound.side_v) && bound.part_u != bound.part_v;
    const int k = (by_bend ? bound.part_u > bound.part_v : bound.side_u > bound.side_v) ? 0 : 1;
    Patch other = patch;
    patch.half[k] *= 0.5;
    other.half = patch.half;
    patch.centre[k] -= patch.half[k];
    other.centre[k] += patch.half[k];
    return other;
  }

  /// First derivatives of the surface, and of the plain shape at the same height above itself.
  void first(const Vec2& uv, ParametricJet& jet, Vec3& flat_u, Vec3& flat_v) const noexcept {
    if (settings_.features.empty()) {
      shape_jet(settings_, uv, jet, nullptr);
      flat_u = jet.u;
      flat_v = jet.v;
      return;
    }
    NormalJet n;
    shape_jet(settings_, uv, jet, &n);
    const FeatureSample h = feature_heights(settings_, uv);
    jet.point += h.height * n.n;
    flat_u = jet.u + h.height * n.u;
    flat_v = jet.v + h.height * n.v;
    jet.u = flat_u + h.gradient.x() * n.n;
    jet.v = flat_v + h.gradient.y() * n.n;
    jet.height = h.height;
  }

 private:
  /// Whether features with edges may have one in the patch. Straight ridges have none between two places across them
  /// that are nearer to each other than a flank is wide and have the same slope.
  [[nodiscard]] bool has_edge(const Patch& patch) const noexcept {
    if (!surface_.has_folds()) return false;
    for (const SurfaceFeature& feature : settings_.features) {
      const FeatureSpec& spec = feature.spec();
      if (!has_edges(spec.kind)) continue;
      const Vec2 place = patch.centre.cwiseProduct(settings_.tile);
      const Vec2 across = feature.across(place);
      const double reach = across.cwiseAbs().dot(patch.half.cwiseProduct(settings_.tile)) * (1.0 + 1e-9);
      const double share = spec.kind == FeatureKind::serrated ? std::min(spec.wall, 1.0 - spec.wall) : 0.5;
      if (2.0 * reach >= share * spec.wavelength.x()) return true;
      const Vec2 one = feature.sample(place - reach * across).gradient;
      const Vec2 other = feature.sample(place + reach * across).gradient;
      if ((one - other).norm() > 1e-9 * (one.norm() + other.norm())) return true;
    }
    return false;
  }

  const ParametricSurface& surface_;
  const ParametricSettings& settings_;
  const ParametricLimits& limits_;
  bool own_u_ = false;
};

/// First crossing of a segment with the surface.
class Crossing {
 public:
  Crossing(const ParametricSurface& surface, const Segment& motion, Sides sides) noexcept
      : surface_(surface),
        patches_(surface),
        from_(motion.from),
        way_(motion.to - motion.from),
        sides_(sides),
        length_(way_.norm()),
        rounding_(1e-13 * surface.bounds().diagonal()),
        until_(1.0 + 1e-12) {}

  void run(const ParametricPatches& tree) noexcept {
    if (!(length_ > 0.0)) return;
    tree.along({from_, from_ + way_}, until_,
               [&](std::uint32_t column, std::uint32_t row) { refine(patches_.leaf(column, row, tree.count())); });
  }

  bool found = false;
  double t = 1.0;
  Vec2 uv = Vec2::Zero();
  /// Each with the surface in its middle.
  [[nodiscard]] WorkCount count() const noexcept { return {2 * static_cast<std::uint32_t>(nodes_), 0, 0}; }

 private:
  /// Part of the segment that comes within the bound; empty where first > last.
  struct Part {
    double first = 0.0;
    double last = 1.0;
  };

  void clip(Part& part, const Vec3& along, const Vec3& centre, double half) const noexcept {
    const double start = along.dot(from_ - centre);
    const double rate = along.dot(way_);
    const double wide = half * (1.0 + 1e-9) + rounding_ * along.norm();
    if (std::abs(rate) <= 1e-300) {
      if (std::abs(start) > wide) part.last = -1.0;
      return;
    }
    const double a = (-wide - start) / rate;
    const double b = (wide - start) / rate;
    part.first = std::max(part.first, std::min(a, b));
    part.last = std::min(part.last, std::max(a, b));
  }

  [[nodiscard]] Part part_within(const Patch& patch, const Bound& bound) const noexcept {
    Part part;
    part.last = until_;
    clip(part, way_ / length_, bound.jet.point, bound.reach);
    if (bound.ku <= 0.0) return part;
    clip(part, bound.n, bound.jet.point, bound.radius);
    clip(part, bound.du, bound.jet.point, patch.half.x() + bound.radius * bound.ku);
    clip(part, bound.dv, bound.jet.point, patch.half.y() + bound.radius * bound.kv);
    return part;
  }

  void take(double at, const Vec2& place) noexcept {
    if (found && at >= t) return;
    found = true;
    t = std::clamp(at, 0.0, 1.0);
    uv = place;
    until_ = t;
  }

  void refine(const Patch& leaf) noexcept {
    Patch waiting[most_waiting];
    int size = 0;
    waiting[size++] = leaf;
    while (size > 0) {
      Patch patch = waiting[--size];
      const Bound bound = patches_.bound(patch);
      const Part part = part_within(patch, bound);
      if (!(part.first <= part.last) || !(part.first < until_)) continue;
      const Vec3 normal = bound.jet.u.cross(bound.jet.v);
      const double against = normal.dot(way_);
      ++nodes_;
      const bool last =
          bound.reach <= point_of_skin * surface_.skin() || nodes_ >= most_nodes || size + 2 > most_waiting;
      if (last) {
        if (sides_ == Sides::both || against < 0.0) take(part.first, patch.centre);
        continue;
      }
      const bool once = std::abs(against) > 1.5 * patches_.normal_change(patch, bound) * length_;
      if (once && sides_ == Sides::front && against > 0.0) continue;
      if (once && solve(patch, bound)) continue;
      Patch other = Patches::halve(patch, bound);
      // The half that the segment comes to first is looked at first.
      const Vec3 towards = other.centre.x() != patch.centre.x() ? bound.du : bound.dv;
      if (towards.dot(way_) < 0.0) std::swap(patch, other);
      waiting[size++] = other;
      waiting[size++] = patch;
    }
  }

  /// Newton's method in a patch that the segment's line crosses at most once. False when it does not settle.
  bool solve(const Patch& patch, const Bound& bound) noexcept {
    ParametricJet jet = bound.jet;
    Vec2 place = patch.centre;
    for (int i = 0; i < most_newton; ++i) {
      Vec3 du;
      Vec3 dv;
      parameter_gradients(jet.u, jet.v, du, dv);
      const Vec3 normal = jet.u.cross(jet.v);
      const double rate = normal.dot(way_);
      if (rate == 0.0) return false;
      const double at = normal.dot(jet.point - from_) / rate;
      const Vec3 apart = from_ + at * way_ - jet.point;
      if (apart.norm() <= 2.0 * rounding_) {
        // Neighbours overlap a little, so that nothing slips through between them.
        constexpr double overlap = 1.0 + 1e-6;
        const Vec2 off = (place - patch.centre).cwiseAbs();
        if (off.x() > overlap * patch.half.x() || off.y() > overlap * patch.half.y()) return true;
        if (at >= 0.0 && at < until_) take(at, surface_.within_range(place));
        return true;
      }
      place += Vec2(du.dot(apart), dv.dot(apart));
      if (!((place - patch.centre).cwiseAbs().cwiseQuotient(patch.half).maxCoeff() < 4.0)) return false;
      Vec3 flat_u;
      Vec3 flat_v;
      patches_.first(place, jet, flat_u, flat_v);
    }
    return false;
  }

  const ParametricSurface& surface_;
  Patches patches_;
  Vec3 from_;
  Vec3 way_;
  Sides sides_;
  double length_;
  double rounding_;
  double until_;
  int nodes_ = 0;
};

/// Nearest place of the whole surface.
class Nearest {
 public:
  Nearest(const ParametricSurface& surface, const Vec3& p, double bound, WorkMeter* work) noexcept
      : surface_(surface), work_(work), patches_(surface), p_(p), best_(bound) {
    tolerance_ = closest_of_size * surface.bounds().diagonal();
    limit_ = best_ - tolerance_;
  }

  /// Descends from a place to the nearest one around, and keeps that where it is the best.
  void take(const Vec2& from) noexcept {
    const ParametricView view = surface_.view(work_);
    ParametricSpot at = view.spot(from);
    Place place{0, at.front.dot(p_ - at.point) < 0.0, {from.x(), from.y(), 0.0}};
    view.descend(place, at, {.point = p_, .may_leave = false, .exactly = true});
    const double distance = (at.point - p_).norm();
    if (!(distance <= best_)) return;
    found = true;
    best_ = distance;
    limit_ = best_ - tolerance_;
    uv = place.at.head<2>();
    spot = at;
  }
  void run(const ParametricPatches& tree) noexcept {
    tree.near(p_, limit_,
              [&](std::uint32_t column, std::uint32_t row) { refine(patches_.leaf(column, row, tree.count())); });
  }

  bool found = false;
  Vec2 uv = Vec2::Zero();
  ParametricSpot spot;
  [[nodiscard]] double distance() const noexcept { return best_; }
  /// Each with the surface in its middle.
  [[nodiscard]] WorkCount count() const noexcept { return {2 * static_cast<std::uint32_t>(nodes_), 0, 0}; }

 private:
  [[nodiscard]] double least(const Patch& patch, const Bound& bound) const noexcept {
    const Vec3 off = p_ - bound.jet.point;
    const double around = off.norm() - bound.reach;
    if (bound.ku <= 0.0) return around;
    const double up = bound.n.dot(off);
    const double u = bound.du.dot(off);
    const double v = bound.dv.dot(off);
    const double p = patch.half.x();
    const double q = patch.half.y();
    // Beside the parallelogram the nearest place is on an edge that faces the point.
    double beside = std::abs(u) > p || std::abs(v) > q ? infinity : 0.0;
    const Vec3 flat = off - up * bound.n;
    if (std::abs(u) > p) beside = from_edge(flat - std::copysign(p, u) * bound.along_u, bound.along_v, q);
    if (std::abs(v) > q)
      beside = std::min(beside, from_edge(flat - std::copysign(q, v) * bound.along_v, bound.along_u, p));
    return std::max(around, std::hypot(up, beside) - bound.radius);
  }

  /// Distance of `off` from the segment -half to half along `edge`.
  [[nodiscard]] static double from_edge(const Vec3& off, const Vec3& edge, double half) noexcept {
    const double at = std::clamp(off.dot(edge) / edge.squaredNorm(), -half, half);
    return (off - at * edge).norm();
  }

  void refine(const Patch& leaf) noexcept {
    Patch waiting[most_waiting];
    int size = 0;
    waiting[size++] = leaf;
    while (size > 0) {
      Patch patch = waiting[--size];
      if (++nodes_ > most_nodes) return;
      const Bound bound = patches_.bound(patch);
      if (least(patch, bound) >= limit_) continue;
      if ((bound.jet.point - p_).norm() < best_) take(surface_.within_range(patch.centre));
      if (bound.reach <= tolerance_ || size + 2 > most_waiting) continue;
      Patch other = Patches::halve(patch, bound);
      const bool in_u = other.centre.x() != patch.centre.x();
      if ((in_u ? bound.du : bound.dv).dot(p_ - bound.jet.point) > 0.0) std::swap(patch, other);
      waiting[size++] = other;
      waiting[size++] = patch;
    }
  }

  const ParametricSurface& surface_;
  WorkMeter* work_;
  Patches patches_;
  Vec3 p_;
  double best_;
  double limit_ = 0.0;
  double tolerance_ = 0.0;
  int nodes_ = 0;
};

}  // namespace

Foot ParametricView::nearest(const Vec3& p, double bound, const Place& start) const noexcept {
  Foot foot;
  if (!(bound >= 0.0)) return foot;
  Nearest search(*surface_, p, bound, work_);
  if (start.known()) search.take(surface_->within_range(start.at.head<2>()));
  search.run(surface_->patches_);
  tell(work_, search.count());
  if (!search.found) return foot;
  foot.point = search.spot.point;
  foot.distance = search.distance();
  const Vec3 off = p - foot.point;
  foot.normal = foot.distance > 1e-3 * skin() ? Vec3(off / foot.distance) : search.spot.front;
  foot.element = surface_->element_of(search.uv);
  foot.at = {search.uv.x(), search.uv.y(), 0.0};
  return foot;
}

SweptHit ParametricView::first_touch(const Segment& motion, Sides sides) const noexcept {
  Crossing crossing(*surface_, motion, sides);
  crossing.run(surface_->patches_);
  tell(work_, crossing.count());
  if (!crossing.found) return {};
  const ParametricSpot there = spot(crossing.uv);
  const double side = there.front.dot(motion.to - motion.from) > 0.0 ? -1.0 : 1.0;
  return point_touch(crossing.t, side, there.point, there.front, surface_->element_of(crossing.uv),
                     {crossing.uv.x(), crossing.uv.y(), 0.0});
}

FieldSample ParametricView::eval(const Vec3& p) const noexcept {
  FieldSample sample;
  const Foot foot = nearest(p, infinity);
  if (!foot.found()) return sample;
  const ParametricSpot there = spot(foot.at.head<2>());
  const double side = foot.normal.dot(there.front) < 0.0 ? -1.0 : 1.0;
  sample.value = side * foot.distance;
  sample.gradient = side * foot.normal;
  sample.height = there.height;
  sample.element = foot.element;
  return sample;
}

}  // namespace asperity
