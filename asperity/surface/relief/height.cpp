// Heights and points of a relief over its faces, and where a place in space lies in its shell.

#include <algorithm>
#include <cmath>
#include <cstring>

#include "asperity/core/processor.h"
#include "asperity/surface/relief/detail/four_prisms.h"
#include "asperity/surface/relief/detail/partners.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

bool ReliefSurface::within_bands(const StitchBand& band, double u, double v) noexcept {
  for (int k = 0; k < 3; ++k) {
    const double b = coordinate(k, u, v);
    if (b < static_cast<double>(band.look[k]) || b > 1.0 - static_cast<double>(band.reach[k])) return true;
  }
  return false;
}

template <class PartnerOf>
double ReliefSurface::stitched_height(const ReliefFrame& frame, double u, double v,
                                      const PartnerOf& partner_of) const noexcept {
  const Stitching& stitching = coat_.settings().stitching;
  double weights = weight_alone(stitching, frame.band, u, v);
  double sum = weights * coat_.height(frame.coat, u, v);
  const double seam = frame.partly ? frame.seam + u * frame.seam_u + v * frame.seam_v : 1.0;
  for_each_partner(frame, u, v, [&](std::uint32_t other) {
    const ReliefPartner& partner = partner_of(other);
    const ProjectedPlace place = project_place(frame.prism, u, v, partner.prism);
    if (!place.seen || !has_say(bands_[other], place.u, place.v)) return;
    const double weight = seam * weight_alone(stitching, bands_[other], place.u, place.v);
    if (weight <= 0.0) return;
    weights += weight;
    sum += weight * coat_.height(partner.coat, place.u, place.v);
  });
  const double whole = sum / weights;
  return frame.lowered ? whole * (frame.share + u * frame.share_u + v * frame.share_v) : whole;
}

double ReliefSurface::height_alone(const ReliefFrame& frame, double u, double v) const noexcept {
  if (in_band(frame, u, v)) {
    if (coat_.settings().stitching.folds != FoldMode::keep) return rounded(frame, u, v).height;
    ReliefPartner partner;
    return stitched_height(frame, u, v, [&](std::uint32_t face) -> const ReliefPartner& {
      partner = {face, shell_.prism(base_.mesh(), face), coat_.frame(rest_.mesh(), face, frame.coat.moment)};
      return partner;
    });
  }
  const double whole = coat_.height(frame.coat, u, v);
  return frame.lowered ? whole * (frame.share + u * frame.share_u + v * frame.share_v) : whole;
}

void ReliefSurface::heights_alone(const ReliefFrame& frame, const Lanes& u, const Lanes& v,
                                  Lanes& heights) const noexcept {
  coat_.heights(frame.coat, u, v, heights);
  for (std::size_t i = 0; i < lanes; ++i) {
    if (in_band(frame, u[i], v[i])) {
      heights[i] = height_alone(frame, u[i], v[i]);
    } else if (frame.lowered) {
      heights[i] *= frame.share + u[i] * frame.share_u + v[i] * frame.share_v;
    }
  }
}

void ReliefSurface::heights_alone(const ReliefFrame& frame, const Lanes& u, const Lanes& v, ReliefPartners& partners,
                                  Lanes& heights) const noexcept {
  if (coat_.settings().stitching.folds != FoldMode::keep) return heights_alone(frame, u, v, heights);
  coat_.heights(frame.coat, u, v, heights);
  for (std::size_t i = 0; i < lanes; ++i) {
    if (in_band(frame, u[i], v[i])) {
      heights[i] = stitched_height(frame, u[i], v[i], [&](std::uint32_t face) -> const ReliefPartner& {
        ReliefPartner& partner = partners.of(face);
        if (partner.face != face)
          partner = {face, shell_.prism(base_.mesh(), face), coat_.frame(rest_.mesh(), face, frame.coat.moment)};
        return partner;
      });
    } else if (frame.lowered) {
      heights[i] *= frame.share + u[i] * frame.share_u + v[i] * frame.share_v;
    }
  }
}

namespace {

/// Of the shell's points at four places from a point, squared.
ASPERITY_FOUR void squares_of_four(const ShellPrism& prism, const Lanes& u, const Lanes& v, const Lanes& heights,
                                   const Vec3& from, Lanes& squares) {
  four::Vectors off;
  four::offsets(prism, u, v, heights, from, off);
  four::Wide sum{};
  for (const four::Wide& one : off) sum += one * one;
  std::memcpy(squares.data(), &sum, sizeof(sum));
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void squares_by_avx2(const ShellPrism& prism, const Lanes& u, const Lanes& v,
                                             const Lanes& heights, const Vec3& from, Lanes& squares) noexcept {
  squares_of_four(prism, u, v, heights, from, squares);
}
#endif

}  // namespace

void ReliefSurface::squared_distances(const ReliefFrame& frame, const Lanes& u, const Lanes& v, const Vec3& from,
                                      Lanes& squares) const noexcept {
  Lanes heights;
  heights_alone(frame, u, v, heights);
#if defined(__x86_64__)
  if (has_avx2()) return squares_by_avx2(frame.prism, u, v, heights, from, squares);
#endif
  squares_of_four(frame.prism, u, v, heights, from, squares);
}

HeightJet ReliefSurface::height(const ReliefFrame& frame, double u, double v, bool blended) const noexcept {
  if (!blended) {
    HeightJet jet = coat_.jet(frame.coat, u, v);
    lower_by_share(frame, u, v, jet);
    return jet;
  }
  return coat_.settings().stitching.folds == FoldMode::keep ? stitched(frame, u, v) : rounded(frame, u, v);
}

HeightJet ReliefSurface::stitched(const ReliefFrame& frame, double u, double v) const noexcept {
  const Stitching& stitching = coat_.settings().stitching;
  const TriangleMesh& mesh = base_.mesh();
  HeightJet weights = place_weight(stitching, frame.band, u, v);
  HeightJet sum = product(weights, coat_.jet(frame.coat, u, v));
  const HeightJet seam{frame.seam + u * frame.seam_u + v * frame.seam_v, frame.seam_u, frame.seam_v, 0.0, 0.0, 0.0};
  for_each_partner(frame, u, v, [&](std::uint32_t other) {
    const ShellPrism prism = shell_.prism(mesh, other);
    const ProjectedPlace place = project_place(frame.prism, u, v, prism);
    if (!place.seen || !has_say(bands_[other], place.u, place.v)) return;
    const HeightJet own = place_weight(stitching, bands_[other], place.u, place.v);
    if (own.height <= 0.0) return;
    const Projection at = with_changes(place, frame.prism);
    const ProjectionBend bend = bend_of(place, frame.prism);
    HeightJet weight = seen_from(own, at, bend);
    if (frame.partly) weight = product(seam, weight);
    const HeightJet there = coat_.jet(coat_.frame(rest_.mesh(), other, frame.coat.moment), at.u, at.v);
    weights.add(weight);
    sum.add(product(weight, seen_from(there, at, bend)));
  });
  HeightJet blended = quotient(sum, weights, 1.0 / weights.height);
  lower_by_share(frame, u, v, blended);
  return blended;
}

namespace {

/// The corners of a triangle that holds what another face says of a small triangle of a face, with room for the
/// projection's bend.
bool corners_across(const ShellPrism& own, const Vec2 corners[3], const ShellPrism& other, Vec2 (&there)[3]) noexcept {
  constexpr double room = 1.6;
  Projection at[3];
  for (int k = 0; k < 3; ++k) {
    at[k] = project(own, corners[k].x(), corners[k].y(), other);
    if (!at[k].seen) return false;
  }
  const Vec2 centre((at[0].u + at[1].u + at[2].u) / 3.0, (at[0].v + at[1].v + at[2].v) / 3.0);
  for (int k = 0; k < 3; ++k) there[k] = centre + room * (Vec2(at[k].u, at[k].v) - centre);
  return true;
}

}  // namespace

HeightRange ReliefSurface::range(const ReliefFrame& frame, const Vec2 corners[3]) const noexcept {
  HeightRange all = coat_.range(frame.coat, corners);
  const auto include = [&](const HeightRange& other) {
    all.lowest = std::min(all.lowest, other.lowest);
    all.highest = std::max(all.highest, other.highest);
  };
  bool rounds = false;
  const double bounded = coat_.settings().stitching.most_rounding;
  const bool near_own = coat_.settings().stitching.folds == FoldMode::round && std::isfinite(bounded);
  if (frame.stitched && !near_own) {
    const TriangleMesh& mesh = base_.mesh();
    const Vec2 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    double size = 0.0;
    for (int k = 0; k < 3; ++k) size = std::max(size, (corners[k] - middle).cwiseAbs().maxCoeff());
    // A small triangle is projected by its corners; a large one may have all that the other face says anywhere.
    constexpr double small = 0.06;
    const auto add = [&](std::uint32_t other) {
      const CoatFrame coat = coat_.frame(rest_.mesh(), other, frame.coat.moment);
      Vec2 there[3] = {Vec2(-0.4, -0.4), Vec2(1.8, -0.4), Vec2(-0.4, 1.8)};
      if (size <= small) corners_across(frame.prism, corners, shell_.prism(mesh, other), there);
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
    rounds = in_edge && coat_.settings().stitching.folds != FoldMode::keep;
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
  if (frame.stitched && near_own) {
    all.lowest -= bounded;
    all.highest += bounded;
  }
  // The root of a rounded fold may lie anywhere that `rounded` lets it.
  if (rounds) {
    include({std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_});
  }
  return all;
}

const ReliefFrame* ReliefSurface::locate(const Vec3& p, SurfaceCache& cache, const CoatMoment& moment,
                                         ShellPlace& place) const noexcept {
  constexpr int most_walks = 24;
  constexpr double inside = -1e-10;
  const Foot foot = base_.index().closest(p, infinity, cache.patch);
  if (!foot.found()) return nullptr;
  const TriangleMesh& mesh = base_.mesh();
  std::uint32_t face = foot.element;
  place = {foot.at[1], foot.at[2], 0.0};
  const auto [a, b, c] = mesh.corners(face);
  const double above = (b - a).cross(c - a).dot(p - foot.point);
  place.height = std::copysign(foot.distance, above);
  for (int walk = 0; walk < most_walks; ++walk) {
    ReliefCache& last = cache.relief;
    if (!holds(last.place.frame, face, moment)) {
      last.place.frame = this->frame(face, moment);
      last.evaluated = false;
    }
    const ShellPrism& prism = last.place.frame.prism;
    if (!prism.invert(p, place) && !prism.invert_anew(p, place)) return nullptr;
    const Vec3 barycentric = place.barycentric();
    int out = 0;
    if (barycentric.minCoeff(&out) >= inside) return &last.place.frame;
    const std::uint32_t other = mesh.neighbour(face, (out + 1) % 3);
    if (other == no_index) return nullptr;
    // Guess: the same height over the common edge.
    const Vec3 edge = prism.base_at(place.u, place.v);
    face = other;
    const Vec3 guess = barycentric_frame(mesh, face).coordinates(edge);
    place.u = guess[1];
    place.v = guess[2];
  }
  return nullptr;
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
  if (coat_.settings().stitching.folds != FoldMode::keep) return round_field(frame, place);
  const HeightJet jet = stitched(frame, place.u, place.v);
  const ShellGradients gradients = shell_gradients(frame.prism, place);
  return {place.height - jet.height, gradients.height - jet.u * gradients.u - jet.v * gradients.v, jet.height,
          frame.face};
}

FieldSample ReliefSurface::eval(const Vec3& p, SurfaceCache& cache, const CoatMoment& moment) const noexcept {
  ShellPlace place;
  if (const ReliefFrame* owner = locate(p, cache, moment, place)) return field(*owner, place);
  const Foot nearest = base_.index().closest(p, infinity, cache.patch);
  FieldSample sample;
  if (!nearest.found()) return sample;
  const TriangleMesh& mesh = base_.mesh();
  const bool outside = (p - nearest.point).dot(pseudonormal(mesh, nearest.element, nearest.at)) >= 0.0;
  const CoatSample coat = coat_sample(nearest.element, nearest.at, moment);
  sample.gradient = outside ? nearest.normal : Vec3(-nearest.normal);
  if (nearest.distance == 0.0) sample.gradient = mesh.face_normal(nearest.element);
  sample.gradient -= coat.gradient;
  sample.height = coat.height;
  sample.value = (outside ? nearest.distance : -nearest.distance) - coat.height;
  sample.element = nearest.element;
  return sample;
}

}  // namespace asperity
