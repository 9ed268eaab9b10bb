// Where the faces of a relief meet in folds: rounding, and what it does to the heights.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/parallel_for.h"
#include "asperity/surface/relief/detail/halfspaces.h"
#include "asperity/surface/relief/detail/partners.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

namespace {

/// How far a face across has lost its say, from 0 to 1, at a place that is `share` of the way to the band's end.
struct Fade {
  double value = 0.0;
  double slope = 0.0;  ///< by share
};

Fade fade_at(double share) noexcept {
  const double t = std::clamp(2.0 * share - 1.0, 0.0, 1.0);
  return {t * t * t * (10.0 + t * (6.0 * t - 15.0)), 60.0 * t * t * (1.0 - t) * (1.0 - t)};
}

/// Derivatives of the k-th barycentric coordinate along u and v.
Vec2 coordinate_change(int k) noexcept {
  return k == 0 ? Vec2(-1.0, -1.0) : (k == 1 ? Vec2(1.0, 0.0) : Vec2(0.0, 1.0));
}

/// Sine of the fold over an edge: above 0 where it is concave, the faces turned towards each other.
double fold_sine(const TriangleMesh& mesh, std::uint32_t face, int edge, std::uint32_t other) noexcept {
  const auto corners = mesh.corners(face);
  const auto k = static_cast<std::size_t>(edge);
  const Vec3 along = (corners[(k + 1) % 3] - corners[k]).normalized();
  return -mesh.face_normal(face).cross(mesh.face_normal(other)).dot(along);
}

/// A face with its height, as a ball in a fold meets it.
struct Wall {
  double distance = 0.0;
  Vec3 gradient = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
};

/// Distance from the fillet that a ball of `radius` in the fold of some walls leaves, and its gradient; from the
/// nearest of them where the ball touches none. `skin`: length that rounding is told by (m).
FieldSample from_fillet(std::span<const Wall> walls, double radius, const Vec3& radius_gradient, double skin) noexcept {
  HalfSpace spaces[8];
  for (std::size_t i = 0; i < walls.size(); ++i) spaces[i] = {walls[i].normal, radius - walls[i].distance};
  const NearestInHalfSpaces centre = nearest_in_halfspaces({spaces, walls.size()}, 1e-12 * (radius + skin));
  FieldSample fillet;
  fillet.value = infinity;
  fillet.gradient = Vec3::Zero();
  const double away = centre.point.norm();
  if (centre.found && away > 0.0) {
    fillet.value = radius - away;
    double sum = 0.0;
    for (int k = 0; k < centre.count; ++k) {
      const double part = centre.force[k] / away;
      sum += part;
      fillet.gradient += part * walls[centre.active[k]].gradient;
    }
    fillet.gradient += (1.0 - sum) * radius_gradient;
    return fillet;
  }
  // Farther than the radius from all of them; or walls that nearly oppose each other, and no ball fits.
  for (const Wall& wall : walls) {
    if (wall.distance >= fillet.value) continue;
    fillet.value = wall.distance;
    fillet.gradient = wall.gradient;
  }
  return fillet;
}

// As many as make starting a thread pay.
constexpr std::size_t folds_a_share = 1024;
// A fold flatter than this is none.
constexpr double flat_fold = 1e-9;

}  // namespace

void ReliefSurface::lay_fillets() {
  fillets_.clear();
  fillet_reach_.clear();
  const Stitching& stitching = coat_.settings().stitching;
  if (stitching.folds != FoldMode::fillet || bands_.empty()) return;
  const TriangleMesh& mesh = base_.mesh();
  const std::size_t vertices = mesh.positions().size();
  fillet_reach_.resize(vertices);
  parallel_for(vertices, {.grain = folds_a_share}, [&](std::size_t i) {
    const auto vertex = static_cast<std::uint32_t>(i);
    float least = 1.0F;
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex))
      least = std::min(least, bands_[face].reach[mesh.corner_of(face, vertex)]);
    fillet_reach_[i] = least;
  });
  // Of the largest ball over each edge: the radius.
  UnsetVector<std::array<float, 3>> fits(bands_.size());
  parallel_for(fits.size(), {.grain = folds_a_share}, [&](std::size_t i) {
    const auto face = static_cast<std::uint32_t>(i);
    for (int edge = 0; edge < 3; ++edge) fits[i][static_cast<std::size_t>(edge)] = fillet_over(face, edge);
  });
  fillets_.resize(vertices);
  parallel_for(vertices, {.grain = folds_a_share}, [&](std::size_t i) {
    const auto vertex = static_cast<std::uint32_t>(i);
    auto radius = static_cast<float>(stitching.fillet_radius);
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
      const std::size_t k = mesh.corner_of(face, vertex);
      radius = std::min({radius, fits[face][k], fits[face][(k + 2) % 3]});
    }
    fillets_[i] = radius;
  });
}

float ReliefSurface::fillet_over(std::uint32_t face, int edge) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  const std::uint32_t other = mesh.neighbour(face, edge);
  constexpr float any = std::numeric_limits<float>::infinity();
  if (other == no_index) return any;
  const double sine = fold_sine(mesh, face, edge, other);
  if (sine < -flat_fold) return 0.0F;
  if (!(sine > flat_fold)) return any;
  // The fillet touches each face a tangent of half the fold away from the edge: within the inner half of the band,
  // where the face across has its whole say.
  const auto corners = mesh.corners(face);
  const auto k = static_cast<std::size_t>(edge);
  const double twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
  const double height = twice_area / (corners[(k + 1) % 3] - corners[k]).norm();
  const double cosine = mesh.face_normal(face).dot(mesh.face_normal(other));
  const double half_tangent = sine / std::max(1e-6, 1.0 + cosine);
  return static_cast<float>(0.45 * static_cast<double>(band_to(face, edge)) * height / half_tangent);
}

float ReliefSurface::band_to(std::uint32_t face, int edge) const noexcept {
  // Not wider than what the faces around either end see of each other, so that both sides of every edge agree.
  const TriangleMesh::Triangle& t = base_.mesh().triangles()[face];
  const auto k = static_cast<std::size_t>(edge);
  return std::min({bands_[face].look[(k + 2) % 3], fillet_reach_[t[k]], fillet_reach_[t[(k + 1) % 3]]});
}

double ReliefSurface::least_fillet() const noexcept {
  return fillets_.empty() ? 0.0 : static_cast<double>(*std::min_element(fillets_.begin(), fillets_.end()));
}

double ReliefSurface::deepest_fold() const {
  const TriangleMesh& mesh = base_.mesh();
  if (coat_.settings().stitching.folds == FoldMode::fillet) {
    // A ball in a corner lies as far from it as the corner's direction is long; and the face across, seen along
    // directions that lean away from it by a band's share, stands that much higher.
    double longest = 1.0;
    for (const Vec3f& direction : shell_.directions) longest = std::max(longest, static_cast<double>(direction.norm()));
    return coat_.settings().stitching.fillet_radius * (1.25 * longest - 1.0 + 0.05) +
           0.25 * (coat_.highest() - coat_.lowest());
  }
  const ParallelSettings shares{.grain = folds_a_share};
  // Each thread's on a cache line of its own.
  struct alignas(64) Depth {
    double value = 0.0;
  };
  std::vector<Depth> deepest(parallel_workers(bands_.size(), shares));
  parallel_for(bands_.size(), shares, [&](std::size_t i, unsigned worker) {
    const auto face = static_cast<std::uint32_t>(i);
    const auto corners = mesh.corners(face);
    const double twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    for (int edge = 0; edge < 3; ++edge) {
      const auto k = static_cast<std::size_t>(edge);
      const std::uint32_t other = mesh.neighbour(face, edge);
      if (other == no_index) continue;
      // Within a band of half width w the other plane runs off by at most w times the tangent of the fold; folds
      // sharper than 70 degrees are rounded no deeper than those.
      const double cosine = std::max(0.3, mesh.face_normal(face).dot(mesh.face_normal(other)));
      const double slope = std::sqrt(std::max(0.0, 1.0 / (cosine * cosine) - 1.0));
      const double height = twice_area / (corners[(k + 1) % 3] - corners[k]).norm();
      deepest[worker].value =
          std::max(deepest[worker].value, 4.0 * static_cast<double>(bands_[face].rho[(k + 2) % 3]) * height * slope);
    }
  });
  double depth = 0.0;
  for (const Depth& one : deepest) depth = std::max(depth, one.value);
  return depth;
}

double ReliefSurface::share_across(const ReliefFrame& frame, const ShellPlace& place, const ShellGradients& gradients,
                                   std::uint32_t other, Vec3& gradient) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  const TriangleMesh::Triangle& corners = mesh.triangles()[frame.face];
  // Of the ways to the ends of the bands around common vertices and the common edge the least counts.
  double share = 1.0;
  const auto offer = [&](double distance, double width, const Vec2& change) {
    if (!(distance < width * share)) return;
    share = distance / width;
    gradient = Vec3(change.x() * gradients.u + change.y() * gradients.v) / width;
  };
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t vertex = corners[static_cast<std::size_t>(k)];
    const auto& there = mesh.triangles()[other];
    if (there[0] != vertex && there[1] != vertex && there[2] != vertex) continue;
    if (!(fillets_[vertex] > 0.0F)) continue;
    offer(1.0 - coordinate(k, place.u, place.v), static_cast<double>(fillet_reach_[vertex]), -coordinate_change(k));
  }
  for (int edge = 0; edge < 3; ++edge) {
    if (mesh.neighbour(frame.face, edge) != other || fold_sine(mesh, frame.face, edge, other) < -flat_fold) continue;
    const int k = (edge + 2) % 3;
    offer(std::max(0.0, coordinate(k, place.u, place.v)), static_cast<double>(band_to(frame.face, edge)),
          coordinate_change(k));
  }
  return share;
}

FieldSample ReliefSurface::fillet_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  const TriangleMesh::Triangle& corners = mesh.triangles()[frame.face];
  const Vec3 p = frame.prism.point(place);
  const ShellGradients gradients = shell_gradients(frame.prism, place);
  const auto along = [&](const Vec2& by) { return Vec3(by.x() * gradients.u + by.y() * gradients.v); };
  double radius = 0.0;
  Vec3 radius_gradient = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const auto at_vertex = static_cast<double>(fillets_[corners[static_cast<std::size_t>(k)]]);
    radius += at_vertex * coordinate(k, place.u, place.v);
    radius_gradient += at_vertex * along(coordinate_change(k));
  }
  // What a face that has lost its say is moved away by: more than any two faces differ.
  const double gone = 2.0 * (coat_.settings().stitching.fillet_radius + coat_.highest() - coat_.lowest());

  FixedVector<Wall, 8> walls;
  // Distance from a face with its height: its penetration, which is along the directions, measured along its normal.
  double lean = 1.0;
  Vec3 lean_gradient = Vec3::Zero();
  double height = 0.0;
  const auto wall_of = [&](const ReliefFrame& one, const ShellPlace& at) {
    const FieldSample own = own_field(one, at);
    const ShellGradients by = shell_gradients(one.prism, at);
    Wall wall;
    wall.normal = one.prism.edge_u.cross(one.prism.edge_v).normalized();
    lean = wall.normal.dot(one.prism.direction_at(at.u, at.v));
    lean_gradient = wall.normal.dot(one.prism.turn_u) * by.u + wall.normal.dot(one.prism.turn_v) * by.v;
    wall.distance = lean * own.value;
    wall.gradient = lean * own.gradient + own.value * lean_gradient;
    height = own.height;
    return wall;
  };
  const auto add = [&](std::uint32_t other) {
    Vec3 share_gradient = Vec3::Zero();
    const double share = share_across(frame, place, gradients, other, share_gradient);
    if (share >= 1.0) return;
    const ReliefFrame there = this->frame(other, frame.coat.moment);
    const Projection guess = project(frame.prism, place.u, place.v, there.prism);
    if (!guess.seen) return;
    ShellPlace at{guess.u, guess.v, place.height};
    if (!there.prism.invert(p, at)) return;
    Wall wall = wall_of(there, at);
    const Fade fade = fade_at(share);
    wall.distance += gone * fade.value;
    wall.gradient += gone * fade.slope * share_gradient;
    walls.push_back(wall);
  };
  for_each_partner(frame, place.u, place.v, add);
  const Wall own = wall_of(frame, place);
  const double own_height = height;
  if (!walls.push_back(own)) walls[walls.size() - 1] = own;

  FieldSample sample = from_fillet({walls.begin(), walls.end()}, radius, radius_gradient, skin_);
  // As the face's own field beside the band: penetration along the directions.
  sample.element = frame.face;
  sample.height = own_height;
  sample.value /= lean;
  sample.gradient = (sample.gradient - sample.value * lean_gradient) / lean;
  return sample;
}

/// A face that may have a say at places over one place of another face, and where the last of them was over it.
struct ReliefSurface::RoundPartner {
  ReliefFrame frame;
  ShellPlace place;
  Vec3 last;            ///< that place (m)
  double beyond = 0.0;  ///< how far beyond having a say it was, in its coordinates
  double change = 0.0;  ///< how fast those change around it, and twice as much (1/m); where `beyond` is above 0
  /// Over the place `over` of `from`; whether any of it is seen from there.
  bool begin(const ReliefFrame& from, const ShellPlace& over, const ReliefFrame& own) {
    const Projection guess = project(from.prism, over.u, over.v, own.prism);
    if (!guess.seen) return false;
    frame = own;
    place = {guess.u, guess.v, over.height};
    return true;
  }
  /// Takes note of where it is now; whether it may have a say there.
  bool move_to(const ShellPlace& at, const Vec3& point) {
    place = at;
    last = point;
    beyond = 0.0;
    for (int k = 0; k < 3; ++k)
      beyond = std::max(beyond, -coordinate(k, at.u, at.v) - static_cast<double>(frame.band.rho[k]));
    if (beyond <= 0.0) return true;
    const ShellGradients by = shell_gradients(frame.prism, at);
    change = 2.0 * std::max({by.u.norm(), by.v.norm(), (by.u + by.v).norm()});
    return false;
  }
};

/// Sums over the faces that have a say at a place, each by its weight.
class ReliefSurface::RoundSum {
 public:
  RoundSum(const ReliefSurface& surface, const ReliefFrame& frame, const ShellPlace& place)
      : surface_(surface), face_(frame.face), point_(frame.prism.point(place)) {
    add(frame, place);
  }
  /// From where the face's place was before, if it was anywhere.
  void add(RoundPartner& partner) {
    if (partner.beyond > 0.0 && partner.beyond > partner.change * (point_ - partner.last).norm()) return;
    ShellPlace at = partner.place;
    partner.beyond = 0.0;
    if (partner.frame.prism.invert(point_, at) && partner.move_to(at, point_)) add(partner.frame, at);
  }
  [[nodiscard]] FieldSample sample() const {
    FieldSample sample;
    sample.element = face_;
    sample.value = values_ / weights_;
    sample.height = heights_ / weights_;
    sample.gradient = (value_gradient_ - sample.value * weight_gradient_) / weights_;
    return sample;
  }

 private:
  void add(const ReliefFrame& one, const ShellPlace& at) {
    const HeightJet weight = place_weight(surface_.coat_.settings().stitching, one.band, at.u, at.v);
    if (weight.height <= 0.0) return;
    const FieldSample own = surface_.own_field(one, at);
    const ShellGradients gradients = shell_gradients(one.prism, at);
    const Vec3 slope = weight.u * gradients.u + weight.v * gradients.v;
    weights_ += weight.height;
    values_ += weight.height * own.value;
    heights_ += weight.height * own.height;
    weight_gradient_ += slope;
    value_gradient_ += own.value * slope + weight.height * own.gradient;
  }

  const ReliefSurface& surface_;
  std::uint32_t face_;
  Vec3 point_;
  double weights_ = 0.0;
  double values_ = 0.0;
  double heights_ = 0.0;
  Vec3 weight_gradient_ = Vec3::Zero();
  Vec3 value_gradient_ = Vec3::Zero();
};

FieldSample ReliefSurface::round_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept {
  if (coat_.settings().stitching.folds == FoldMode::fillet) return fillet_field(frame, place);
  RoundSum sum(*this, frame, place);
  for_each_partner(frame, place.u, place.v, [&](std::uint32_t other) {
    RoundPartner partner;
    if (partner.begin(frame, place, this->frame(other, frame.coat.moment))) sum.add(partner);
  });
  return sum.sample();
}

HeightJet ReliefSurface::rounded(const ReliefFrame& frame, double u, double v) const noexcept {
  // The root of Phi along the shell's ray, by Newton's method: Phi rises along it by about 1 a metre of height.
  HeightJet jet = coat_.jet(frame.coat, u, v);
  lower_by_share(frame, u, v, jet);
  constexpr int most_steps = 12;
  const Vec3 direction = frame.prism.direction_at(u, v);
  ShellPlace at{u, v, jet.height};
  // Faces are the same all the way up the ray: made ready once, unless they are many.
  FixedVector<RoundPartner, 12> partners;
  bool all = coat_.settings().stitching.folds != FoldMode::fillet;
  if (all) {
    for_each_partner(frame, u, v, [&](std::uint32_t other) {
      RoundPartner partner;
      if (all && partner.begin(frame, at, this->frame(other, frame.coat.moment))) all = partners.push_back(partner);
    });
  }
  const auto field_at = [&] {
    if (!all) return round_field(frame, at);
    RoundSum sum(*this, frame, at);
    for (RoundPartner& partner : partners) sum.add(partner);
    return sum.sample();
  };
  FieldSample sample;
  for (int i = 0; i < most_steps; ++i) {
    sample = field_at();
    const double rise = sample.gradient.dot(direction);
    if (!(rise > 0.1)) break;
    const double step = sample.value / rise;
    at.height -= step;
    if (std::abs(step) <= 1e-15 * (1.0 + std::abs(at.height))) break;
    if (std::abs(step) <= 1e-9 * skin_) break;
  }
  const double rise = std::max(0.1, sample.gradient.dot(direction));
  const Stitching& stitching = coat_.settings().stitching;
  if (stitching.folds == FoldMode::round && std::isfinite(stitching.most_rounding))
    at.height = std::clamp(at.height, jet.height - stitching.most_rounding, jet.height + stitching.most_rounding);
  // Over folds too sharp to be rounded the root may run away: no farther than `range` says.
  at.height =
      std::clamp(at.height, std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_);
  jet.height = at.height;
  jet.u = -sample.gradient.dot(frame.prism.edge_u + at.height * frame.prism.turn_u) / rise;
  jet.v = -sample.gradient.dot(frame.prism.edge_v + at.height * frame.prism.turn_v) / rise;
  return jet;
}

}  // namespace asperity
