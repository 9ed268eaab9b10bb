#include "asperity/surface/relief/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "asperity/core/identity.h"
#include "asperity/core/parallel_for.h"
#include "asperity/surface/relief/detail/bounds.h"
#include "asperity/surface/relief/detail/carried.h"
#include "asperity/surface/relief/detail/slabs.h"

namespace asperity {

namespace {

// As many as make starting a thread pay where a face takes a tenth of a microsecond.
constexpr std::size_t cheap_faces_a_share = 2048;

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

ReliefSurface::ReliefSurface(MeshSurface base, Coat coat, MeshSurface rest, std::shared_ptr<CarriedHeights> carried)
    : identity_(next_identity()),
      base_(std::move(base)),
      rest_(std::move(rest)),
      coat_(std::move(coat)),
      carried_(std::move(carried)) {
  fit(ShellDirections::least_squares);
}

// Braces: the check comes before the coat is moved.
ReliefSurface::ReliefSurface(MeshSurface base, Coat coat)
    : ReliefSurface{(static_cast<void>(coat.check_fits(base.mesh()).value()), base), std::move(coat), base,
                    std::make_shared<CarriedHeights>()} {}

Result<ReliefSurface> ReliefSurface::build(MeshSurface base, Coat coat, const ReliefSettings& settings) {
  ASPERITY_CHECK(coat.check_fits(base.mesh()));
  ReliefSurface relief(base, std::move(coat), base, std::make_shared<CarriedHeights>());
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
  parallel_for(share.size(), {.grain = cheap_faces_a_share}, [&](std::size_t i) {
    const auto face = static_cast<std::uint32_t>(i);
    // Nearly every prism has room for all that the coat holds anywhere.
    const ShellPrism prism = shell_.prism(mesh, face);
    if (prism.holds(margin, coat_.amplitude_bound())) return;
    const ShellInterval room = prism.injective(margin, most);
    if (room.upper > room.lower && room.upper >= coat_.highest() && room.lower <= coat_.lowest()) return;
    const HeightRange heights = range(frame(face), whole_triangle);
    if (room.upper > 0.0 && heights.highest > room.upper) share[i] = room.upper / heights.highest;
    if (room.lower < 0.0 && heights.lowest < room.lower) share[i] = std::min(share[i], room.lower / heights.lowest);
    if (!(room.upper > room.lower)) share[i] = 0.0;
  });
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
  const std::size_t faces = mesh.triangles().size();
  const auto room = std::make_unique_for_overwrite<RoundedSlab[]>(faces);
  const std::span<RoundedSlab> slabs(room.get(), faces);
  const std::vector<Box> boxes = enclose(slabs);
  boxes_ = base_.index().enclosed(boxes);
  find_overlaps(boxes, slabs);
}

bool ReliefSurface::any_height() const noexcept {
  // Levels of layers go by those of the first map, and may pass one of their own between two of its.
  return coat_.moves() || (coat_.levels() > 0 && !coat_.layers().empty());
}

bool ReliefSurface::on_its_own(std::uint32_t face) const noexcept {
  const TriangleMesh::Triangle& t = base_.mesh().triangles()[face];
  const bool joins = coat_.settings().stitching.folds != FoldMode::keep;
  for (const std::uint32_t vertex : t) {
    if (!bands_.empty() && (joins || coat_.seam_at(vertex))) return false;
    if (!shares_.empty() && shares_[vertex] != 1.0F) return false;
  }
  return true;
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

std::vector<Box> ReliefSurface::enclose(std::span<RoundedSlab> slabs) {
  const TriangleMesh& mesh = base_.mesh();
  const std::size_t faces = mesh.triangles().size();
  std::vector<Box> boxes(faces);
  ranges_.assign(faces, {});
  const FacePart whole = FacePart::triangle(whole_triangle[0], whole_triangle[1], whole_triangle[2]);
  const bool anything = any_height();
  const std::vector<CarriedHeight>& carried = carried_->heights;
  // Rounded outwards by more than a float rounds.
  const auto rounded = [](double value, double sign) {
    return static_cast<float>(value + sign * 1e-6 * std::abs(value) + sign * 1e-30);
  };
  parallel_for(faces, {.grain = carried.empty() ? 256 : cheap_faces_a_share}, [&](std::size_t i) {
    const auto face = static_cast<std::uint32_t>(i);
    const ShellPrism prism = shell_.prism(mesh, face);
    HeightRange all{infinity, -infinity};
    Box box;
    if (anything) {
      all = {std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_};
      box = box_around({prism, all});
    } else {
      const bool known = !carried.empty() && on_its_own(face);
      for (int level = 0; level <= coat_.levels(); ++level) {
        CarriedHeight height;
        if (known) {
          height = carried[i * static_cast<std::size_t>(coat_.levels() + 1) + static_cast<std::size_t>(level)];
        } else {
          const ReliefFrame frame = this->frame(face, {static_cast<double>(level), 0.0});
          height = {this->range(frame, whole_triangle), form(frame, whole)};
        }
        all = {std::min(all.lowest, height.range.lowest), std::max(all.highest, height.range.highest)};
        // Two ways to enclose it: what both hold.
        const Box slab = box_around({prism, height.range});
        const ReliefBound bound = bound_over(prism, height.form, whole);
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
    slabs[i] = rounded_slab({prism, range(face)}, mesh.bounds().centre());
  });
  return boxes;
}

void ReliefSurface::find_overlaps(const std::vector<Box>& boxes, std::span<const RoundedSlab> slabs) {
  const TriangleMesh& mesh = base_.mesh();
  std::atomic<std::uint32_t> pairs{0};
  overlapped_.assign(boxes.size(), 0);
  const auto mark = [&](std::uint32_t face) {
    std::atomic_ref<std::uint8_t>(overlapped_[face]).store(1, std::memory_order_relaxed);
  };
  base_.index().for_each_meeting(boxes, boxes_, [&](std::uint32_t face, std::uint32_t other) {
    if (surely_apart(slabs[face], slabs[other]) || !boxes[face].overlaps(boxes[other])) return;
    if (slabs_apart({shell_.prism(mesh, face), range(face)}, {shell_.prism(mesh, other), range(other)})) return;
    pairs.fetch_add(1, std::memory_order_relaxed);
    mark(face);
    mark(other);
  });
  report_.overlapping_pairs = pairs;
  if (pairs == 0) overlapped_ = {};
}

std::size_t ReliefSurface::memory_bytes() const noexcept {
  return base_.index().memory_bytes() + coat_.memory_bytes() + shell_.directions.capacity() * sizeof(Vec3f) +
         bands_.capacity() * sizeof(StitchBand) + shares_.capacity() * sizeof(float) + overlapped_.capacity() +
         ranges_.capacity() * sizeof(FaceRange) + boxes_.memory_bytes() + carried_->bytes;
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
