#include "asperity/surface/relief/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/identity.h"
#include "asperity/core/parallel_for.h"

namespace asperity {

namespace {

constexpr int corner_u[3] = {0, 1, 0};
constexpr int corner_v[3] = {0, 0, 1};

const Vec2 whole_triangle[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};

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
  return refused(ErrorCode::bad_mesh, what, "coat", "a lower relief, or on_overlap \"cure\"");
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

ReliefSurface::ReliefSurface(MeshSurface base, Coat coat, MeshSurface rest)
    : identity_(next_identity()), base_(std::move(base)), rest_(std::move(rest)), coat_(std::move(coat)) {
  fit(ShellDirections::least_squares);
}

// Braces: the check comes before the coat is moved.
ReliefSurface::ReliefSurface(MeshSurface base, Coat coat)
    : ReliefSurface{(static_cast<void>(coat.check_fits(base.mesh()).value()), base), std::move(coat), base} {}

Result<ReliefSurface> ReliefSurface::build(MeshSurface base, Coat coat, const ReliefSettings& settings) {
  ASPERITY_CHECK(coat.check_fits(base.mesh()));
  ReliefSurface relief(base, std::move(coat), base);
  ASPERITY_CHECK(relief.settle(settings));
  return relief;
}

Result<std::shared_ptr<const ReliefSurface>> make_relief(MeshSurface base, CoatParts parts, const CoatSettings& coat,
                                                         const ReliefSettings& relief) {
  ASPERITY_TRY(Coat laid, Coat::build(base.mesh(), std::move(parts), coat));
  ASPERITY_TRY(ReliefSurface surface, ReliefSurface::build(std::move(base), std::move(laid), relief));
  return std::make_shared<const ReliefSurface>(std::move(surface));
}

Result<std::shared_ptr<const ReliefSurface>> make_relief(MeshSurface base, Mesostructure maps, const CoatSettings& coat,
                                                         const ReliefSettings& relief) {
  CoatParts parts;
  parts.maps.push_back(std::make_shared<const Mesostructure>(std::move(maps)));
  return make_relief(std::move(base), std::move(parts), coat, relief);
}

Status ReliefSurface::settle(const ReliefSettings& settings) {
  settings_ = settings;
  if (settings.on_overlap == OnOverlap::refuse && !report_.fits()) {
    // Nothing is rendered, so nothing was lowered.
    report_.lowered_vertices = 0;
    return overlap_error(report_.advice());
  }
  if (settings.directions == ShellDirections::relaxed && !report_.directions_relaxed) fit(ShellDirections::relaxed);
  return success();
}

void ReliefSurface::lay_bands() {
  const Stitching& stitching = coat_.settings().stitching;
  bands_.clear();
  // Folds are rounded whether heights differ over them or not.
  const bool joined = coat_.has_seams() || stitching.folds != FoldMode::keep;
  const bool blended = stitching.blend != Blend::none || stitching.folds == FoldMode::fillet;
  if (joined && blended) bands_ = stitch_bands(base_.mesh(), shell_, stitching.rho);
  lay_fillets();
}

std::vector<double> ReliefSurface::fitting_shares() const {
  const TriangleMesh& mesh = base_.mesh();
  const Stitching& stitching = coat_.settings().stitching;
  std::vector<double> share(mesh.triangles().size(), 1.0);
  const double margin = !bands_.empty() && stitching.folds != FoldMode::keep ? 2.0 * stitching.rho : 0.0;
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
  if (coat_.settings().stitching.folds != FoldMode::keep) fold_depth_ = deepest_fold();
  if (coat_.settings().stitching.folds == FoldMode::round)
    fold_depth_ = std::min(fold_depth_, coat_.settings().stitching.most_rounding);
  reach_ = longest * (coat_.amplitude_bound() + fold_depth_);
  grain_ = std::min(coat_.texel_size(), mesh.mean_edge());
  skin_ = std::min(base_.skin(), 1e-3 * grain_);
  const std::vector<Box> boxes = enclose();
  boxes_ = base_.index().enclosed(boxes);
  find_overlaps(boxes);
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

std::vector<Box> ReliefSurface::enclose() {
  const TriangleMesh& mesh = base_.mesh();
  const std::size_t faces = mesh.triangles().size();
  std::vector<Box> boxes(faces);
  ranges_.assign(faces, {});  // nothing is known of any face yet
  const FacePart whole = FacePart::triangle(whole_triangle[0], whole_triangle[1], whole_triangle[2]);
  // Levels of layers go by those of the first map, and may pass one of their own between two of its.
  const bool anything = coat_.moves() || (coat_.levels() > 0 && !coat_.layers().empty());
  // Rounded outwards by more than a float rounds.
  const auto rounded = [](double value, double sign) {
    return static_cast<float>(value + sign * 1e-6 * std::abs(value) + sign * 1e-30);
  };
  parallel_for(faces, {.grain = 256}, [&](std::size_t i) {
    const auto face = static_cast<std::uint32_t>(i);
    HeightRange all{infinity, -infinity};
    Box box;
    if (anything) {
      all = {std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_};
      for (const Vec3& point : hull_points(shell_.prism(mesh, face), all)) box.include(point);
    } else {
      for (int level = 0; level <= coat_.levels(); ++level) {
        const ReliefFrame frame = this->frame(face, {static_cast<double>(level), 0.0});
        const HeightRange range = this->range(frame, whole_triangle);
        all = {std::min(all.lowest, range.lowest), std::max(all.highest, range.highest)};
        // Two ways to enclose it: what both hold.
        Box slab;
        for (const Vec3& point : hull_points(frame.prism, range)) slab.include(point);
        const ReliefBound bound = this->bound(frame, whole);
        Box around;
        for (const Vec3& corner : bound.corner) around.include(corner);
        around = around.grown(bound.error);
        around.lower = around.lower.cwiseMax(slab.lower);
        around.upper = around.upper.cwiseMin(slab.upper);
        box.include(around.lower);
        box.include(around.upper);
      }
    }
    boxes[i] = box;
    ranges_[i] = {rounded(all.lowest, -1.0), rounded(all.highest, 1.0)};
  });
  return boxes;
}

void ReliefSurface::find_overlaps(const std::vector<Box>& boxes) {
  const TriangleMesh& mesh = base_.mesh();
  const auto apart = [](const Box& a, const Box& b) {
    return a.lower.x() > b.upper.x() || a.lower.y() > b.upper.y() || a.lower.z() > b.upper.z() ||
           b.lower.x() > a.upper.x() || b.lower.y() > a.upper.y() || b.lower.z() > a.upper.z();
  };
  base_.index().for_each_meeting(boxes, [&](std::uint32_t face, std::uint32_t other) {
    if (share_vertex(mesh.triangles()[face], mesh.triangles()[other]) || apart(boxes[face], boxes[other])) return;
    const ShellPrism here = shell_.prism(mesh, face);
    const ShellPrism there = shell_.prism(mesh, other);
    if (hulls_apart(here, hull_points(here, range(face)), there, hull_points(there, range(other)))) return;
    ++report_.overlapping_pairs;
    if (overlapped_.empty()) overlapped_.resize(mesh.triangles().size(), 0);
    overlapped_[face] = overlapped_[other] = 1;
  });
}

std::size_t ReliefSurface::memory_bytes() const noexcept {
  return base_.index().memory_bytes() + coat_.memory_bytes() + shell_.directions.capacity() * sizeof(Vec3f) +
         bands_.capacity() * sizeof(StitchBand) + shares_.capacity() * sizeof(float) + overlapped_.capacity() +
         ranges_.capacity() * sizeof(FaceRange) + boxes_.memory_bytes();
}

ReliefFrame ReliefSurface::frame(std::uint32_t face, const CoatMoment& moment) const noexcept {
  const TriangleMesh& mesh = base_.mesh();
  ReliefFrame frame;
  frame.owner = identity_;
  frame.face = face;
  frame.prism = shell_.prism(mesh, face);
  frame.coat = coat_.frame(rest_.mesh(), face, moment);
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

}  // namespace asperity
