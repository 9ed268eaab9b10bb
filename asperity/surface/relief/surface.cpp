#include "asperity/surface/relief/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/identity.h"
#include "asperity/surface/relief/detail/carried.h"
#include "asperity/surface/relief/detail/enclosed.h"

namespace asperity {

namespace {

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
  // Rounded folds are where penetrations are blended, which lies off the faces.
  if (stitching.folds == FoldMode::keep && !bands_.empty()) narrow_reaches(base_.mesh(), shell_, bands_);
  lay_fillets();
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
  UnsetVector<double> share = fitting_shares();
  for (std::uint32_t face = 0; face < share.size(); ++face) {
    if (share[face] < 1.0) report_.faces_at_fault.push_back(face);
    report_.fitting_share = std::min(report_.fitting_share, share[face]);
  }
  const auto missing = [](const UnsetVector<double>& shares) {
    double sum = 0.0;
    for (const double one : shares) sum += 1.0 - one;
    return sum;
  };
  if (!report_.faces_at_fault.empty() && !report_.directions_relaxed) {
    Shell before = std::move(shell_);
    shell_ = Shell::build(mesh, ShellDirections::relaxed);
    lay_bands();
    UnsetVector<double> relaxed = fitting_shares();
    report_.directions_relaxed = missing(relaxed) < 0.9 * missing(share);
    if (report_.directions_relaxed) {
      share = std::move(relaxed);
    } else {
      shell_ = std::move(before);
      lay_bands();
    }
  }
  if (!report_.faces_at_fault.empty() && missing(share) > 0.0) lower(share);
  float longest = 0.0F;
  for (const Vec3f& direction : shell_.directions) longest = std::max(longest, direction.squaredNorm());
  if (coat_.settings().stitching.folds != FoldMode::keep) fold_depth_ = deepest_fold();
  if (coat_.settings().stitching.folds == FoldMode::round)
    fold_depth_ = std::min(fold_depth_, coat_.settings().stitching.most_rounding);
  reach_ = static_cast<double>(std::sqrt(longest)) * (coat_.amplitude_bound() + fold_depth_);
  grain_ = std::min(coat_.texel_size(), mesh.mean_edge());
  skin_ = std::min(base_.skin(), 1e-3 * grain_);
  find_overlaps(enclose());
}

bool ReliefSurface::any_height() const noexcept {
  // Levels of layers go by those of the first map, and may pass one of their own between two of its.
  return coat_.moves() || (coat_.levels() > 0 && !coat_.layers().empty());
}

void ReliefSurface::lower(std::span<const double> share_of_face) {
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
