#include "asperity/surface/relief_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

constexpr int corner_u[3] = {0, 1, 0};
constexpr int corner_v[3] = {0, 0, 1};

const Vec2 whole_triangle[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};

double coordinate(int k, double u, double v) noexcept {
  return k == 0 ? 1.0 - u - v : (k == 1 ? u : v);
}

/// Product of the blends of the three coordinates, with its derivatives along u and v.
struct PlaceWeight {
  double weight = 0.0;
  double u = 0.0;
  double v = 0.0;
};

PlaceWeight place_weight(const Stitching& stitching, const StitchBand& band, double u, double v) noexcept {
  BlendValue one[3];
  for (int k = 0; k < 3; ++k) one[k] = blend_value(stitching, static_cast<double>(band.rho[k]), coordinate(k, u, v));
  const double by[3] = {one[0].slope * one[1].weight * one[2].weight, one[0].weight * one[1].slope * one[2].weight,
                        one[0].weight * one[1].weight * one[2].slope};
  return {one[0].weight * one[1].weight * one[2].weight, by[1] - by[0], by[2] - by[0]};
}

/// Where a place of one triangle lies on another one's plane, seen along the place's own direction, and how that
/// changes with the place.
struct Projection {
  bool seen = false;
  double u = 0.0;
  double v = 0.0;
  Vec2 by_u = Vec2::Zero();  ///< of (u, v) along the first triangle's u
  Vec2 by_v = Vec2::Zero();
};

Projection project(const ShellPrism& from, double u, double v, const ShellPrism& onto) noexcept {
  constexpr double least_cosine = 0.02;
  const Vec3 direction = from.direction_at(u, v);
  const Vec3 cross = onto.edge_u.cross(onto.edge_v);
  const double facing = cross.dot(direction);
  const double area = cross.squaredNorm();
  Projection answer;
  if (!(facing > 0.0) || facing * facing <= least_cosine * least_cosine * area * direction.squaredNorm()) return answer;
  const Vec3 offset = from.base_at(u, v) - onto.corner;
  const double rise = -cross.dot(offset) / facing;
  const Vec3 there = offset + rise * direction;
  const Vec3 gradient_u = onto.edge_v.cross(cross) / area;
  const Vec3 gradient_v = cross.cross(onto.edge_u) / area;
  answer.seen = true;
  answer.u = gradient_u.dot(there);
  answer.v = gradient_v.dot(there);
  const auto change = [&](const Vec3& edge, const Vec3& turn) {
    const double rise_change = -(cross.dot(edge) + rise * cross.dot(turn)) / facing;
    const Vec3 moved = edge + rise * turn + rise_change * direction;
    return Vec2(gradient_u.dot(moved), gradient_v.dot(moved));
  };
  answer.by_u = change(from.edge_u, from.turn_u);
  answer.by_v = change(from.edge_v, from.turn_v);
  return answer;
}

void lower_by_share(const ReliefFrame& frame, double u, double v, HeightJet& jet) noexcept {
  if (!frame.lowered) return;
  const double share = frame.share + u * frame.share_u + v * frame.share_v;
  jet.uu = jet.uu * share + 2.0 * jet.u * frame.share_u;
  jet.uv = jet.uv * share + jet.u * frame.share_v + jet.v * frame.share_u;
  jet.vv = jet.vv * share + 2.0 * jet.v * frame.share_v;
  jet.u = jet.u * share + jet.height * frame.share_u;
  jet.v = jet.v * share + jet.height * frame.share_v;
  jet.height *= share;
}

/// The six points whose hull holds all of the relief over a triangle.
std::array<Vec3, 6> hull_points(const ShellPrism& prism, const HeightRange& range) {
  std::array<Vec3, 6> points;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 base = prism.base_at(corner_u[k], corner_v[k]);
    const Vec3 direction = prism.direction_at(corner_u[k], corner_v[k]);
    points[2 * k] = base + range.lowest * direction;
    points[2 * k + 1] = base + range.highest * direction;
  }
  return points;
}

/// Whether a plane of one of these directions separates two hulls. Cheap, and right for most pairs that boxes let
/// through.
bool separated(const std::array<Vec3, 6>& a, const std::array<Vec3, 6>& b, const Vec3& axis) {
  double a_low = infinity;
  double a_high = -infinity;
  double b_low = infinity;
  double b_high = -infinity;
  for (std::size_t i = 0; i < 6; ++i) {
    a_low = std::min(a_low, axis.dot(a[i]));
    a_high = std::max(a_high, axis.dot(a[i]));
    b_low = std::min(b_low, axis.dot(b[i]));
    b_high = std::max(b_high, axis.dot(b[i]));
  }
  return a_high < b_low || b_high < a_low;
}

/// Tries the directions that separate most pairs: across either triangle, across their edges, from one to the other.
bool hulls_apart(const ShellPrism& one, const std::array<Vec3, 6>& one_hull, const ShellPrism& other,
                 const std::array<Vec3, 6>& other_hull) {
  const Vec3 normal = one.edge_u.cross(one.edge_v);
  const Vec3 other_normal = other.edge_u.cross(other.edge_v);
  if (separated(one_hull, other_hull, normal) || separated(one_hull, other_hull, other_normal)) return true;
  if (separated(one_hull, other_hull, other.base_at(1.0 / 3.0, 1.0 / 3.0) - one.base_at(1.0 / 3.0, 1.0 / 3.0)))
    return true;
  const Vec3 edges[3] = {one.edge_u, one.edge_v, one.edge_v - one.edge_u};
  const Vec3 other_edges[3] = {other.edge_u, other.edge_v, other.edge_v - other.edge_u};
  for (int k = 0; k < 3; ++k) {
    if (separated(one_hull, other_hull, normal.cross(edges[k])) ||
        separated(one_hull, other_hull, other_normal.cross(other_edges[k])))
      return true;
  }
  return false;
}

Error overlap_error(const std::string& what) {
  return Error{ErrorCode::bad_mesh, what, {}, "coat", "a lower relief, or on_overlap \"cure\""};
}

}  // namespace

std::string ReliefReport::advice() const {
  if (fits()) return {};
  std::string text;
  if (!faces_at_fault.empty()) {
    text = fmt::format("the relief folds over itself on {} faces (first: face {})", faces_at_fault.size(),
                       faces_at_fault.front());
    text += fitting_share > 0.0
                ? fmt::format("; lowered to {:.3g} % of its height it fits everywhere", 100.0 * fitting_share)
                : std::string("; lowering it cannot cure all of them");
  }
  if (!blind_vertices.empty()) {
    text += fmt::format("{}{} vertices have no direction that all faces around see from the front (first: vertex {})",
                        text.empty() ? "" : "; ", blind_vertices.size(), blind_vertices.front());
  }
  if (directions_relaxed) text += "; directions were turned to make room";
  if (lowered_vertices > 0)
    text += fmt::format("; rendered lower around {} vertices, at the least {:.3g} %", lowered_vertices,
                        100.0 * least_share);
  return text + "; a base mesh that follows the shape more finely takes higher reliefs";
}

ReliefSurface::ReliefSurface(MeshSurface base, Coat coat) : base_(std::move(base)), coat_(std::move(coat)) {
  fit(ShellDirections::least_squares);
}

Result<ReliefSurface> ReliefSurface::build(MeshSurface base, Coat coat, const ReliefSettings& settings) {
  ReliefSurface relief(std::move(base), std::move(coat));
  if (settings.on_overlap == OnOverlap::refuse && !relief.report_.fits()) {
    // Nothing is rendered, so nothing was lowered.
    relief.report_.lowered_vertices = 0;
    return overlap_error(relief.report_.advice());
  }
  if (settings.directions == ShellDirections::relaxed && !relief.report_.directions_relaxed)
    relief.fit(ShellDirections::relaxed);
  return relief;
}

void ReliefSurface::lay_bands() {
  const Stitching& stitching = coat_.settings().stitching;
  bands_.clear();
  // Folds are rounded whether heights differ over them or not.
  const bool joined = coat_.has_seams() || stitching.folds == FoldMode::round;
  if (joined && stitching.blend != Blend::none) bands_ = stitch_bands(base_.mesh(), shell_, stitching.rho);
}

std::vector<double> ReliefSurface::fitting_shares() const {
  const TriangleMesh& mesh = base_.mesh();
  const Stitching& stitching = coat_.settings().stitching;
  std::vector<double> share(mesh.triangles().size(), 1.0);
  const double margin = !bands_.empty() && stitching.folds == FoldMode::round ? 2.0 * stitching.rho : 0.0;
  const double most = 2.0 * coat_.amplitude_bound() + 1e-12;
  for (std::uint32_t face = 0; face < share.size(); ++face) {
    const ShellInterval room = shell_.prism(mesh, face).injective(margin, most);
    // Nearly every prism has room for all that the coat holds anywhere.
    if (room.upper > room.lower && room.upper >= coat_.highest() && room.lower <= coat_.lowest()) continue;
    const HeightRange heights = range(frame(face), whole_triangle);
    if (room.upper > 0.0 && heights.highest > room.upper) share[face] = room.upper / heights.highest;
    if (room.lower < 0.0 && heights.lowest < room.lower)
      share[face] = std::min(share[face], room.lower / heights.lowest);
    if (!(room.upper > room.lower)) share[face] = 0.0;
  }
  return share;
}

double ReliefSurface::deepest_fold() const {
  const TriangleMesh& mesh = base_.mesh();
  double depth = 0.0;
  for (std::uint32_t face = 0; face < bands_.size(); ++face) {
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
      depth = std::max(depth, 4.0 * static_cast<double>(bands_[face].rho[(k + 2) % 3]) * height * slope);
    }
  }
  return depth;
}

void ReliefSurface::fit(ShellDirections directions) {
  const TriangleMesh& mesh = base_.mesh();
  report_ = {};
  shares_.clear();
  overlapped_.clear();
  fold_depth_ = 0.0;
  shell_ = Shell::build(mesh, directions);
  lay_bands();
  report_.directions_relaxed = directions == ShellDirections::relaxed;
  report_.blind_vertices = shell_.blind_vertices;
  std::vector<double> share = fitting_shares();
  for (std::uint32_t face = 0; face < share.size(); ++face) {
    if (share[face] < 1.0) report_.faces_at_fault.push_back(face);
    report_.fitting_share = std::min(report_.fitting_share, share[face]);
  }
  const auto missing = [](const std::vector<double>& shares) {
    double sum = 0.0;
    for (const double one : shares) sum += 1.0 - one;
    return sum;
  };
  if (!report_.faces_at_fault.empty() && !report_.directions_relaxed) {
    Shell before = std::move(shell_);
    shell_ = Shell::build(mesh, ShellDirections::relaxed);
    lay_bands();
    std::vector<double> relaxed = fitting_shares();
    report_.directions_relaxed = missing(relaxed) < 0.9 * missing(share);
    if (report_.directions_relaxed) {
      share = std::move(relaxed);
    } else {
      shell_ = std::move(before);
      lay_bands();
    }
  }
  if (missing(share) > 0.0) lower(share);
  double longest = 0.0;
  for (const Vec3f& direction : shell_.directions) longest = std::max(longest, static_cast<double>(direction.norm()));
  if (coat_.settings().stitching.folds == FoldMode::round) fold_depth_ = deepest_fold();
  reach_ = longest * (coat_.amplitude_bound() + fold_depth_);
  grain_ = std::min(coat_.texel_size(), mesh.mean_edge());
  skin_ = std::min(base_.skin(), 1e-3 * grain_);
  find_overlaps();
}

void ReliefSurface::lower(const std::vector<double>& share_of_face) {
  const TriangleMesh& mesh = base_.mesh();
  std::vector<float> share(mesh.positions().size(), 1.0F);
  for (std::size_t face = 0; face < share_of_face.size(); ++face) {
    for (const std::uint32_t vertex : mesh.triangles()[face])
      share[vertex] = std::min(share[vertex], static_cast<float>(share_of_face[face]));
  }
  for (const float one : share) {
    if (one < 1.0F) ++report_.lowered_vertices;
    report_.least_share = std::min(report_.least_share, static_cast<double>(one));
  }
  shares_ = std::move(share);
}

void ReliefSurface::find_overlaps() {
  const TriangleMesh& mesh = base_.mesh();
  const auto faces = static_cast<std::uint32_t>(mesh.triangles().size());
  // What the coat holds anywhere; the tight range of a face only where that does not settle it.
  const HeightRange anywhere{std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_};
  std::vector<Box> boxes(faces);
  for (std::uint32_t face = 0; face < faces; ++face) {
    for (const Vec3& point : hull_points(shell_.prism(mesh, face), anywhere)) boxes[face].include(point);
  }
  const auto tight = [&](std::uint32_t face) { return range(frame(face), whole_triangle); };
  const auto apart = [](const Box& a, const Box& b) {
    return a.lower.x() > b.upper.x() || a.lower.y() > b.upper.y() || a.lower.z() > b.upper.z() ||
           b.lower.x() > a.upper.x() || b.lower.y() > a.upper.y() || b.lower.z() > a.upper.z();
  };
  for (std::uint32_t face = 0; face < faces; ++face) {
    const Box& box = boxes[face];
    base_.index().for_each_in_box(box.grown(reach_), [&](std::uint32_t other) {
      if (other <= face || apart(box, boxes[other])) return;
      if (share_vertex(mesh.triangles()[face], mesh.triangles()[other])) return;
      const ShellPrism here = shell_.prism(mesh, face);
      const ShellPrism there = shell_.prism(mesh, other);
      if (hulls_apart(here, hull_points(here, anywhere), there, hull_points(there, anywhere))) return;
      if (hulls_apart(here, hull_points(here, tight(face)), there, hull_points(there, tight(other)))) return;
      ++report_.overlapping_pairs;
      if (overlapped_.empty()) overlapped_.resize(faces, 0);
      overlapped_[face] = overlapped_[other] = 1;
    });
  }
}

std::size_t ReliefSurface::memory_bytes() const noexcept {
  return base_.index().memory_bytes() + coat_.memory_bytes() + shell_.directions.capacity() * sizeof(Vec3f) +
         bands_.capacity() * sizeof(StitchBand) + shares_.capacity() * sizeof(float) + overlapped_.capacity();
}

ReliefFrame ReliefSurface::frame(std::uint32_t face) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  ReliefFrame frame;
  frame.owner = base_.index().identity();
  frame.face = face;
  frame.prism = shell_.prism(mesh, face);
  frame.coat = coat_.frame(mesh, face);
  frame.stitched = !bands_.empty();
  if (frame.stitched) {
    frame.band = bands_[face];
    if (coat_.settings().stitching.folds == FoldMode::keep) {
      // Away from seams nothing needs joining; the say of the faces around fades out over one face.
      const TriangleMesh::Triangle& t = mesh.triangles()[face];
      frame.seam = coat_.seam_at(t[0]) ? 1.0 : 0.0;
      frame.seam_u = (coat_.seam_at(t[1]) ? 1.0 : 0.0) - frame.seam;
      frame.seam_v = (coat_.seam_at(t[2]) ? 1.0 : 0.0) - frame.seam;
      frame.partly = frame.seam_u != 0.0 || frame.seam_v != 0.0;
      frame.stitched = frame.partly || frame.seam > 0.0;
    }
  }
  frame.lowered = !shares_.empty();
  if (frame.lowered) {
    const TriangleMesh::Triangle& t = mesh.triangles()[face];
    frame.share = static_cast<double>(shares_[t[0]]);
    frame.share_u = static_cast<double>(shares_[t[1]]) - frame.share;
    frame.share_v = static_cast<double>(shares_[t[2]]) - frame.share;
  }
  return frame;
}

bool ReliefSurface::in_band(const ReliefFrame& frame, double u, double v) const noexcept {
  if (!frame.stitched) return false;
  for (int k = 0; k < 3; ++k) {
    const double b = coordinate(k, u, v);
    if (b < static_cast<double>(frame.band.look[k]) || b > 1.0 - static_cast<double>(frame.band.reach[k])) return true;
  }
  return false;
}

template <class Visit>
void ReliefSurface::for_each_partner(const ReliefFrame& frame, double u, double v, Visit&& visit) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  for (int k = 0; k < 3; ++k) {
    if (coordinate(k, u, v) <= 1.0 - static_cast<double>(frame.band.reach[k])) continue;
    const std::uint32_t vertex = mesh.triangles()[frame.face][static_cast<std::size_t>(k)];
    for (const std::uint32_t other : mesh.faces_of_vertex(vertex)) {
      if (other != frame.face) visit(other);
    }
    return;
  }
  for (int k = 0; k < 3; ++k) {
    if (coordinate(k, u, v) >= static_cast<double>(frame.band.look[k])) continue;
    const std::uint32_t other = mesh.neighbour(frame.face, (k + 1) % 3);
    if (other != no_index) visit(other);
  }
}

HeightJet ReliefSurface::height(const ReliefFrame& frame, double u, double v) const noexcept {
  if (!in_band(frame, u, v)) {
    HeightJet jet = coat_.jet(frame.coat, u, v);
    lower_by_share(frame, u, v, jet);
    return jet;
  }
  return coat_.settings().stitching.folds == FoldMode::keep ? stitched(frame, u, v) : rounded(frame, u, v);
}

HeightJet ReliefSurface::stitched(const ReliefFrame& frame, double u, double v) const noexcept {
  const Stitching& stitching = coat_.settings().stitching;
  const TriangleMesh& mesh = base_.mesh();
  const PlaceWeight own = place_weight(stitching, frame.band, u, v);
  const HeightJet jet = coat_.jet(frame.coat, u, v);
  const double seam = frame.seam + u * frame.seam_u + v * frame.seam_v;
  PlaceWeight total = own;
  HeightJet sum{own.weight * jet.height,
                own.u * jet.height + own.weight * jet.u,
                own.v * jet.height + own.weight * jet.v,
                own.weight * jet.uu + 2.0 * own.u * jet.u,
                own.weight * jet.uv + own.u * jet.v + own.v * jet.u,
                own.weight * jet.vv + 2.0 * own.v * jet.v};
  for_each_partner(frame, u, v, [&](std::uint32_t other) {
    const ShellPrism prism = shell_.prism(mesh, other);
    const Projection at = project(frame.prism, u, v, prism);
    if (!at.seen) return;
    PlaceWeight there = place_weight(stitching, bands_[other], at.u, at.v);
    if (there.weight <= 0.0) return;
    const HeightJet heights = coat_.jet(coat_.frame(mesh, other), at.u, at.v);
    double weight_u = there.u * at.by_u.x() + there.v * at.by_u.y();
    double weight_v = there.u * at.by_v.x() + there.v * at.by_v.y();
    if (frame.partly) {
      weight_u = seam * weight_u + frame.seam_u * there.weight;
      weight_v = seam * weight_v + frame.seam_v * there.weight;
      there.weight *= seam;
    }
    const double height_u = heights.u * at.by_u.x() + heights.v * at.by_u.y();
    const double height_v = heights.u * at.by_v.x() + heights.v * at.by_v.y();
    const auto second = [&](const Vec2& a, const Vec2& b) {
      return heights.uu * a.x() * b.x() + heights.uv * (a.x() * b.y() + a.y() * b.x()) + heights.vv * a.y() * b.y();
    };
    total.weight += there.weight;
    total.u += weight_u;
    total.v += weight_v;
    sum.height += there.weight * heights.height;
    sum.u += weight_u * heights.height + there.weight * height_u;
    sum.v += weight_v * heights.height + there.weight * height_v;
    sum.uu += there.weight * second(at.by_u, at.by_u) + 2.0 * weight_u * height_u;
    sum.uv += there.weight * second(at.by_u, at.by_v) + weight_u * height_v + weight_v * height_u;
    sum.vv += there.weight * second(at.by_v, at.by_v) + 2.0 * weight_v * height_v;
  });
  // The second derivatives leave out those of the weights and of the projection: they guide steps, forces never see
  // them.
  const double per = 1.0 / total.weight;
  HeightJet blended;
  blended.height = sum.height * per;
  blended.u = (sum.u - blended.height * total.u) * per;
  blended.v = (sum.v - blended.height * total.v) * per;
  blended.uu = (sum.uu - 2.0 * blended.u * total.u) * per;
  blended.uv = (sum.uv - blended.u * total.v - blended.v * total.u) * per;
  blended.vv = (sum.vv - 2.0 * blended.v * total.v) * per;
  lower_by_share(frame, u, v, blended);
  return blended;
}

FieldSample ReliefSurface::round_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept {
  const Stitching& stitching = coat_.settings().stitching;
  const Vec3 p = frame.prism.point(place);
  double weights = 0.0;
  double values = 0.0;
  double heights = 0.0;
  Vec3 weight_gradient = Vec3::Zero();
  Vec3 value_gradient = Vec3::Zero();
  const auto add = [&](const ReliefFrame& one, const ShellPlace& at) {
    const PlaceWeight weight = place_weight(stitching, one.band, at.u, at.v);
    if (weight.weight <= 0.0) return;
    const FieldSample own = own_field(one, at);
    const ShellGradients gradients = shell_gradients(one.prism, at);
    const Vec3 slope = weight.u * gradients.u + weight.v * gradients.v;
    weights += weight.weight;
    values += weight.weight * own.value;
    heights += weight.weight * own.height;
    weight_gradient += slope;
    value_gradient += own.value * slope + weight.weight * own.gradient;
  };
  add(frame, place);
  for_each_partner(frame, place.u, place.v, [&](std::uint32_t other) {
    const ReliefFrame there = this->frame(other);
    const Projection guess = project(frame.prism, place.u, place.v, there.prism);
    if (!guess.seen) return;
    ShellPlace at{guess.u, guess.v, place.height};
    if (there.prism.invert(p, at)) add(there, at);
  });
  FieldSample sample;
  sample.element = frame.face;
  sample.value = values / weights;
  sample.height = heights / weights;
  sample.gradient = (value_gradient - sample.value * weight_gradient) / weights;
  return sample;
}

HeightJet ReliefSurface::rounded(const ReliefFrame& frame, double u, double v) const noexcept {
  // The root of Phi along the shell's ray, by Newton's method: Phi rises along it by about 1 a metre of height.
  HeightJet jet = coat_.jet(frame.coat, u, v);
  lower_by_share(frame, u, v, jet);
  constexpr int most_steps = 12;
  const Vec3 direction = frame.prism.direction_at(u, v);
  ShellPlace at{u, v, jet.height};
  FieldSample sample;
  for (int i = 0; i < most_steps; ++i) {
    sample = round_field(frame, at);
    const double rise = sample.gradient.dot(direction);
    if (!(rise > 0.1)) break;
    const double step = sample.value / rise;
    at.height -= step;
    if (std::abs(step) <= 1e-15 * (1.0 + std::abs(at.height))) break;
    if (std::abs(step) <= 1e-9 * skin_) break;
  }
  const double rise = std::max(0.1, sample.gradient.dot(direction));
  // Over folds too sharp to be rounded the root may run away: no farther than `range` says.
  at.height =
      std::clamp(at.height, std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_);
  jet.height = at.height;
  jet.u = -sample.gradient.dot(frame.prism.edge_u + at.height * frame.prism.turn_u) / rise;
  jet.v = -sample.gradient.dot(frame.prism.edge_v + at.height * frame.prism.turn_v) / rise;
  return jet;
}

ReliefPoint ReliefSurface::point(const ReliefFrame& frame, double u, double v) const noexcept {
  ReliefPoint point;
  point.jet = height(frame, u, v);
  const Vec3 direction = frame.prism.direction_at(u, v);
  point.position = frame.prism.base_at(u, v) + point.jet.height * direction;
  point.along_u = frame.prism.edge_u + point.jet.u * direction + point.jet.height * frame.prism.turn_u;
  point.along_v = frame.prism.edge_v + point.jet.v * direction + point.jet.height * frame.prism.turn_v;
  point.outward = point.along_u.cross(point.along_v);
  const double size = point.outward.norm();
  if (size > 0.0) point.outward /= size;
  return point;
}

HeightRange ReliefSurface::range(const ReliefFrame& frame, const Vec2 corners[3]) const noexcept {
  HeightRange all = coat_.range(frame.coat, corners);
  const auto include = [&](const HeightRange& other) {
    all.lowest = std::min(all.lowest, other.lowest);
    all.highest = std::max(all.highest, other.highest);
  };
  bool rounds = false;
  if (frame.stitched) {
    const TriangleMesh& mesh = base_.mesh();
    const Vec2 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    double size = 0.0;
    for (int k = 0; k < 3; ++k) size = std::max(size, (corners[k] - middle).cwiseAbs().maxCoeff());
    // A small triangle is projected by its corners, with room for the projection's bend; a large one may have all that
    // the other face says anywhere.
    constexpr double small = 0.06;
    constexpr double room = 1.6;
    const auto add = [&](std::uint32_t other) {
      const CoatFrame coat = coat_.frame(mesh, other);
      Vec2 there[3] = {Vec2(-0.4, -0.4), Vec2(1.8, -0.4), Vec2(-0.4, 1.8)};
      if (size <= small) {
        const ShellPrism prism = shell_.prism(mesh, other);
        Projection at[3];
        bool seen = true;
        for (int k = 0; k < 3; ++k) {
          at[k] = project(frame.prism, corners[k].x(), corners[k].y(), prism);
          seen = seen && at[k].seen;
        }
        if (seen) {
          const Vec2 centre((at[0].u + at[1].u + at[2].u) / 3.0, (at[0].v + at[1].v + at[2].v) / 3.0);
          for (int k = 0; k < 3; ++k) there[k] = centre + room * (Vec2(at[k].u, at[k].v) - centre);
        }
      }
      include(coat_.range(coat, there));
    };
    bool in_edge = false;
    for (int k = 0; k < 3; ++k) {
      double least = infinity;
      double most = -infinity;
      for (int c = 0; c < 3; ++c) {
        const double b = coordinate(k, corners[c].x(), corners[c].y());
        least = std::min(least, b);
        most = std::max(most, b);
      }
      if (most > 1.0 - static_cast<double>(frame.band.reach[k])) {
        const std::uint32_t vertex = mesh.triangles()[frame.face][static_cast<std::size_t>(k)];
        for (const std::uint32_t other : mesh.faces_of_vertex(vertex)) {
          if (other != frame.face) add(other);
        }
        in_edge = true;
      } else if (least < static_cast<double>(frame.band.look[k])) {
        const std::uint32_t other = mesh.neighbour(frame.face, (k + 1) % 3);
        if (other != no_index) add(other);
        in_edge = true;
      }
    }
    rounds = in_edge && coat_.settings().stitching.folds == FoldMode::round;
  }
  if (frame.lowered) {
    double least = infinity;
    double most = -infinity;
    for (int k = 0; k < 3; ++k) {
      const double share = frame.share + corners[k].x() * frame.share_u + corners[k].y() * frame.share_v;
      least = std::min(least, share);
      most = std::max(most, share);
    }
    all = {std::min(all.lowest * least, all.lowest * most), std::max(all.highest * least, all.highest * most)};
  }
  // The root of a rounded fold may lie anywhere that `rounded` lets it.
  if (rounds) {
    include({std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_});
  }
  return all;
}

bool ReliefSurface::locate(const Vec3& p, Hint& hint, ReliefFrame& frame, ShellPlace& place) const noexcept {
  constexpr int most_walks = 24;
  constexpr double inside = -1e-10;
  const Foot foot = base_.closest(p, infinity, hint);
  if (!foot.found()) return false;
  const TriangleMesh& mesh = base_.mesh();
  std::uint32_t face = foot.element;
  place = {foot.barycentric[1], foot.barycentric[2], 0.0};
  const double above = mesh.face_normal(face).dot(p - foot.point);
  place.height = std::copysign(foot.distance, above);
  for (int walk = 0; walk < most_walks; ++walk) {
    if (hint.relief.frame.owner != base_.index().identity() || hint.relief.frame.face != face)
      hint.relief.frame = this->frame(face);
    const ShellPrism& prism = hint.relief.frame.prism;
    if (!prism.invert(p, place) && !prism.invert_anew(p, place)) return false;
    const Vec3 barycentric = place.barycentric();
    int out = 0;
    if (barycentric.minCoeff(&out) >= inside) {
      frame = hint.relief.frame;
      return true;
    }
    const std::uint32_t other = mesh.neighbour(face, (out + 1) % 3);
    if (other == no_index) return false;
    // Guess: the same height over the common edge.
    const Vec3 edge = hint.relief.frame.prism.base_at(place.u, place.v);
    face = other;
    const Vec3 guess = barycentric_frame(mesh, face).coordinates(edge);
    place.u = guess[1];
    place.v = guess[2];
  }
  return false;
}

FieldSample ReliefSurface::own_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept {
  HeightJet jet = coat_.jet(frame.coat, place.u, place.v);
  lower_by_share(frame, place.u, place.v, jet);
  const ShellGradients gradients = shell_gradients(frame.prism, place);
  return {place.height - jet.height, gradients.height - jet.u * gradients.u - jet.v * gradients.v, jet.height,
          frame.face};
}

FieldSample ReliefSurface::field(const ReliefFrame& frame, const ShellPlace& place) const noexcept {
  if (!in_band(frame, place.u, place.v)) return own_field(frame, place);
  if (coat_.settings().stitching.folds == FoldMode::round) return round_field(frame, place);
  const HeightJet jet = stitched(frame, place.u, place.v);
  const ShellGradients gradients = shell_gradients(frame.prism, place);
  return {place.height - jet.height, gradients.height - jet.u * gradients.u - jet.v * gradients.v, jet.height,
          frame.face};
}

FieldSample ReliefSurface::eval(const Vec3& p, Hint& hint) const noexcept {
  ReliefFrame owner;
  ShellPlace place;
  if (locate(p, hint, owner, place)) return field(owner, place);
  const Foot nearest = base_.closest(p, infinity, hint);
  FieldSample sample;
  if (!nearest.found()) return sample;
  const TriangleMesh& mesh = base_.mesh();
  const bool outside = (p - nearest.point).dot(pseudonormal(mesh, nearest.element, nearest.barycentric)) >= 0.0;
  const CoatSample coat = coat_.sample(mesh, nearest.element, nearest.barycentric);
  sample.gradient = outside ? nearest.normal : Vec3(-nearest.normal);
  if (nearest.distance == 0.0) sample.gradient = mesh.face_normal(nearest.element);
  sample.gradient -= coat.gradient;
  sample.height = coat.height;
  sample.value = (outside ? nearest.distance : -nearest.distance) - coat.height;
  sample.element = nearest.element;
  return sample;
}

}  // namespace asperity
