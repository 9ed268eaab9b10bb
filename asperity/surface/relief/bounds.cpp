// Bounds of first order of a relief over part of a face: of its height, and of where it is in space.

#include "asperity/surface/relief/detail/bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "asperity/core/fixed_vector.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

namespace {

/// The k-th barycentric coordinate and its slopes.
double coordinate_by_u(int k) noexcept {
  return k == 0 ? -1.0 : (k == 1 ? 1.0 : 0.0);
}
double coordinate_by_v(int k) noexcept {
  return k == 0 ? -1.0 : (k == 2 ? 1.0 : 0.0);
}

/// Of the face itself.
WeightForm own_weight(const Stitching& stitching, const StitchBand& band, const FacePart& part) noexcept {
  WeightForm all{1.0, 0.0, 0.0, 0.0};
  for (int k = 0; k < 3; ++k) {
    const double by_u = coordinate_by_u(k);
    const double by_v = coordinate_by_v(k);
    const double at = coordinate(k, part.middle.x(), part.middle.y());
    all = product(all,
                  blend_form(stitching, static_cast<double>(band.rho[k]), at, by_u, by_v, part.spread(by_u, by_v), 0.0),
                  part);
  }
  return all;
}

/// Of another face, at the places of it that the part is projected to.
WeightForm other_weight(const Stitching& stitching, const StitchBand& band, const ProjectedPart& there,
                        const FacePart& part) noexcept {
  const Projection& at = there.middle;
  WeightForm all{1.0, 0.0, 0.0, 0.0};
  for (int k = 0; k < 3; ++k) {
    const double own_u = coordinate_by_u(k);
    const double own_v = coordinate_by_v(k);
    const double by_u = own_u * at.by_u.x() + own_v * at.by_u.y();
    const double by_v = own_u * at.by_v.x() + own_v * at.by_v.y();
    const double bend = std::abs(own_u) * there.bend.x() + std::abs(own_v) * there.bend.y();
    all = product(all,
                  blend_form(stitching, static_cast<double>(band.rho[k]), coordinate(k, at.u, at.v), by_u, by_v,
                             part.spread(by_u, by_v) + bend, bend),
                  part);
  }
  return all;
}

/// Part of a face in another one's coordinates.
FacePart part_there(const ProjectedPart& there, const FacePart& part) noexcept {
  const Projection& at = there.middle;
  FacePart moved = part;
  moved.middle = {at.u, at.v};
  for (int k = 0; k < part.corners; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Vec2 off = part.corner[i] - part.middle;
    moved.corner[i] = moved.middle + off.x() * at.by_u + off.y() * at.by_v;
  }
  moved.pad = part.pad.x() * at.by_u.cwiseAbs() + part.pad.y() * at.by_v.cwiseAbs() + there.bend;
  return moved;
}

/// The largest and least of the k-th coordinate over a part.
double most_of(int k, const FacePart& part, double sign) noexcept {
  return coordinate(k, part.middle.x(), part.middle.y()) + sign * part.spread(coordinate_by_u(k), coordinate_by_v(k));
}

}  // namespace

HeightForm ReliefSurface::form(const ReliefFrame& frame, const FacePart& part) const noexcept {
  HeightForm form;
  if (!reaches_band(frame, part)) {
    form = coat_.form(frame.coat, part);
  } else if (coat_.settings().stitching.folds == FoldMode::keep) {
    form = stitched_form(frame, part);
  } else {
    // Folds that are rounded have no plane of their own: between what `range` says.
    const HeightRange all = range_around(frame, part);
    return HeightForm::level(all.lowest, all.highest);
  }
  if (!frame.lowered) return form;
  const double share = frame.share + part.middle.x() * frame.share_u + part.middle.y() * frame.share_v;
  const double change = part.spread(frame.share_u, frame.share_v);
  return {share * form.height, share * form.u + form.height * frame.share_u,
          share * form.v + form.height * frame.share_v,
          change * part.spread(form.u, form.v) + (std::abs(share) + change) * form.error};
}

HeightRange ReliefSurface::range_around(const ReliefFrame& frame, const FacePart& part) const noexcept {
  if (part.corners == 3 && part.pad.isZero()) return range(frame, part.corner.data());
  Vec2 lower = Vec2::Constant(infinity);
  Vec2 upper = Vec2::Constant(-infinity);
  part.for_each_extreme([&](double u, double v) {
    lower = lower.cwiseMin(Vec2(u, v));
    upper = upper.cwiseMax(Vec2(u, v));
  });
  // The triangle around a rectangle.
  const Vec2 size = upper - lower;
  const Vec2 corners[3] = {lower, {lower.x() + 2.0 * size.x(), lower.y()}, {lower.x(), lower.y() + 2.0 * size.y()}};
  return range(frame, corners);
}

bool ReliefSurface::reaches_band(const ReliefFrame& frame, const FacePart& part) const noexcept {
  if (!frame.stitched) return false;
  for (int k = 0; k < 3; ++k) {
    if (most_of(k, part, -1.0) < static_cast<double>(frame.band.look[k]) ||
        most_of(k, part, 1.0) > 1.0 - static_cast<double>(frame.band.reach[k]))
      return true;
  }
  return false;
}

HeightForm ReliefSurface::stitched_form(const ReliefFrame& frame, const FacePart& part) const noexcept {
  constexpr std::size_t most_faces = 24;
  const Stitching& stitching = coat_.settings().stitching;
  const TriangleMesh& mesh = base_.mesh();
  FixedVector<std::uint32_t, most_faces> faces;
  bool all_there = true;
  const auto add = [&](std::uint32_t other) {
    if (other == no_index || other == frame.face || std::find(faces.begin(), faces.end(), other) != faces.end()) return;
    if (faces.size() == faces.capacity()) {
      all_there = false;
      return;
    }
    faces.push_back(other);
  };
  for (int k = 0; k < 3; ++k) {
    if (most_of(k, part, 1.0) > 1.0 - static_cast<double>(frame.band.reach[k])) {
      for (const std::uint32_t other : mesh.faces_of_vertex(mesh.triangles()[frame.face][static_cast<std::size_t>(k)]))
        add(other);
    }
    if (most_of(k, part, -1.0) < static_cast<double>(frame.band.look[k])) add(mesh.neighbour(frame.face, (k + 1) % 3));
  }
  HeightForm heights[most_faces + 1];
  WeightForm weights[most_faces + 1];
  heights[0] = coat_.form(frame.coat, part);
  weights[0] = own_weight(stitching, frame.band, part);
  const WeightForm seam{frame.seam + part.middle.x() * frame.seam_u + part.middle.y() * frame.seam_v, frame.seam_u,
                        frame.seam_v, 0.0};
  std::size_t count = 1;
  for (const std::uint32_t other : faces) {
    const ShellPrism prism = shell_.prism(mesh, other);
    const ProjectedPart there = project(frame.prism, part, prism);
    all_there = all_there && there.seen;
    if (!all_there) break;
    WeightForm weight = other_weight(stitching, bands_[other], there, part);
    if (frame.partly) weight = product(weight, seam, part);
    if (weight.weight <= 0.0 && weight.rest <= 0.0) continue;
    const FacePart moved = part_there(there, part);
    const HeightForm own = coat_.form(coat_.frame(rest_.mesh(), other, frame.coat.moment), moved);
    heights[count] = {own.height, own.u * there.middle.by_u.x() + own.v * there.middle.by_u.y(),
                      own.u * there.middle.by_v.x() + own.v * there.middle.by_v.y(),
                      own.error + std::abs(own.u) * there.bend.x() + std::abs(own.v) * there.bend.y()};
    weights[count++] = weight;
  }
  if (all_there && count == 1) return heights[0];
  if (all_there && normalise({weights, count}, part)) return mixed({heights, count}, {weights, count}, part);
  // Whatever the weights are they keep between the heights.
  if (all_there) return between({heights, count}, part);
  // Before it is lowered.
  ReliefFrame whole = frame;
  whole.lowered = false;
  const HeightRange all = range_around(whole, part);
  return HeightForm::level(all.lowest, all.highest);
}

ReliefBound ReliefSurface::bound(const ReliefFrame& frame, const FacePart& part) const noexcept {
  return bound_over(frame.prism, form(frame, part), part);
}

}  // namespace asperity
