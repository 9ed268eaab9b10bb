#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "asperity/core/names.h"
#include "asperity/core/unset_vector.h"
#include "asperity/surface/coat.h"
#include "asperity/surface/mesh/surface.h"
#include "asperity/surface/relief/frame.h"
#include "asperity/surface/relief/prisms.h"

namespace asperity {

class ReliefView;
class ReliefPartners;

/// What to do with a coat whose relief folds over itself: whose heights are more than some prism of the shell holds.
enum class OnOverlap {
  cure,    ///< turn the directions where that helps, then lower the relief around the vertices at fault, and report it
  refuse,  ///< Error naming the faces and vertices
};
/// As in scene files.
template <>
struct Names<OnOverlap> {
  static constexpr auto table =
      std::to_array<Named<OnOverlap>>({{OnOverlap::cure, "cure"}, {OnOverlap::refuse, "refuse"}});
};

/// How a relief is made from a base and a coat.
struct ReliefSettings {
  ShellDirections directions = ShellDirections::least_squares;
  OnOverlap on_overlap = OnOverlap::cure;
};

/// What building a relief found out.
struct ReliefReport {
  std::vector<std::uint32_t> faces_at_fault;  ///< whose prism folds over within the coat's heights, before any cure
  std::vector<std::uint32_t> blind_vertices;  ///< without a direction that all their faces see from the front
  double fitting_share = 1.0;                 ///< of the coat's amplitude at which every prism is one to one; 0: none
  std::uint32_t lowered_vertices = 0;         ///< where the cure renders less than the coat's height
  double least_share = 1.0;                   ///< the least of what is rendered there
  bool directions_relaxed = false;            ///< the cure turned the directions
  std::uint32_t overlapping_pairs = 0;        ///< of faces without a common vertex whose reliefs' bounds meet in space
  [[nodiscard]] bool fits() const noexcept { return faces_at_fault.empty() && blind_vertices.empty(); }
  /// One sentence on what is wrong and what would cure it; empty when all fits. [any]
  [[nodiscard]] std::string advice() const;
};

/// Where a relief is over part of a face: no point of it is farther than `error` from a triangle.
struct ReliefBound {
  Vec3 corner[3];      ///< m
  double error = 0.0;  ///< m
};

/// A base mesh that wears a coat of relief: the displaced surface x = V + H N itself (formulation D2, D3).
///
/// Over each triangle x is a smooth function of the barycentric coordinates; neighbours share directions and, through
/// stitching, heights, so that the surface is closed wherever the base is. All queries are about that surface, at one
/// moment of its coat, which may have levels of detail and change with time (ReliefView). On an open base the relief
/// ends at the rim.
class ReliefSurface {
 public:
  /// Errors: mismatch (a coat that was laid on another mesh than the base's), bad_mesh (a relief that folds over, when
  /// `settings` refuse that), naming faces, vertices and the largest share of the amplitude that fits. [build]
  static Result<ReliefSurface> build(MeshSurface base, Coat coat, const ReliefSettings& settings = {});
  /// The same with the default settings, for a coat that is known to have been laid on this base: with another one the
  /// program ends with build's message. [build]
  ReliefSurface(MeshSurface base, Coat coat);
  /// The same coat, asked for in the same way, on the base after its vertices moved (DeformableMesh): shell, bands and
  /// room for the heights are found anew. Mappings go by places (triplanar, solid) of the mesh that the coat was laid
  /// on, so that nothing swims. Errors: mismatch (a base of another lineage), bad_mesh as build. [build]
  [[nodiscard]] Result<ReliefSurface> moved(MeshSurface base) const;
  /// The mesh that the coat was laid on: what Coat::frame is asked with. [servo]
  [[nodiscard]] const TriangleMesh& rest_mesh() const noexcept { return rest_.mesh(); }
  /// Coat::sample on this surface: mapped by the mesh that the coat was laid on, gradient and normal in the plane of
  /// the face as it lies now. [servo]
  [[nodiscard]] CoatSample coat_sample(std::uint32_t face, const Vec3& barycentric,
                                       const CoatMoment& moment = {}) const noexcept;

  /// What is touched of it at a moment of its coat. [servo]
  [[nodiscard]] ReliefView view(SurfaceCache& cache, const CoatMoment& moment = {}) const noexcept;
  /// Phi = h - H in shell coordinates, blended where faces are stitched, and its gradient. Not a distance: its gradient
  /// is as long as the relief is steep. Where the shell does not reach, the nearest base point's own. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p, SurfaceCache& cache, const CoatMoment& moment = {}) const noexcept;
  [[nodiscard]] double skin() const noexcept { return skin_; }
  [[nodiscard]] Box bounds() const noexcept { return base_.bounds().grown(reach_); }

  /// What evaluating the relief over `face` needs. [servo]
  [[nodiscard]] ReliefFrame frame(std::uint32_t face, const CoatMoment& moment = {}) const noexcept;
  /// Tells reliefs apart, never 0: whose frames a cache holds. [any]
  [[nodiscard]] std::uint64_t identity() const noexcept { return identity_; }
  /// Whether a frame is this surface's own, of the face and the moment. [servo]
  [[nodiscard]] bool holds(const ReliefFrame& frame, std::uint32_t face, const CoatMoment& moment) const noexcept {
    return frame.owner == identity_ && frame.face == face && frame.coat.moment == moment;
  }
  /// Height as rendered over a place of the frame's triangle. [servo]
  [[nodiscard]] HeightJet height(const ReliefFrame& frame, double u, double v) const noexcept {
    return height(frame, u, v, in_band(frame, u, v));
  }
  /// That height alone (m), to within rounding: where no neighbour has a say, in half the time. [servo]
  [[nodiscard]] double height_alone(const ReliefFrame& frame, double u, double v) const noexcept;
  /// The same at several places at once, equal to the bit. [servo]
  void heights_alone(const ReliefFrame& frame, const Lanes& u, const Lanes& v, Lanes& heights) const noexcept;
  /// And where other faces have a say, what is known of those is kept for the next places. [servo]
  void heights_alone(const ReliefFrame& frame, const Lanes& u, const Lanes& v, ReliefPartners& partners,
                     Lanes& heights) const noexcept;
  /// Heights that are asked for there, about: the face's own, and in a band those of the faces around. [servo]
  [[nodiscard]] std::uint32_t heights_at(const ReliefFrame& frame, double u, double v) const noexcept {
    return in_band(frame, u, v) ? heights_in_band : 1;
  }
  /// The displaced surface over it. [servo]
  [[nodiscard]] ReliefPoint point(const ReliefFrame& frame, double u, double v) const noexcept {
    std::uint32_t heights = 0;
    return point(frame, u, v, heights);
  }
  /// The same; adds heights_at to `heights`. [servo]
  [[nodiscard]] ReliefPoint point(const ReliefFrame& frame, double u, double v, std::uint32_t& heights) const noexcept {
    const bool blended = in_band(frame, u, v);
    heights += blended ? heights_in_band : 1;
    ReliefPoint spot;
    spot.jet = height(frame, u, v, blended);
    const ShellPrism& prism = frame.prism;
    spot.direction = prism.direction_at(u, v);
    spot.point = prism.base_at(u, v) + spot.jet.height * spot.direction;
    spot.along_u = prism.edge_u + spot.jet.u * spot.direction + spot.jet.height * prism.turn_u;
    spot.along_v = prism.edge_v + spot.jet.v * spot.direction + spot.jet.height * prism.turn_v;
    spot.front = spot.along_u.cross(spot.along_v);
    const double size = spot.front.norm();
    if (size > 0.0) spot.front /= size;
    return spot;
  }
  /// That point alone (m), likewise. [servo]
  [[nodiscard]] Vec3 place(const ReliefFrame& frame, double u, double v) const noexcept {
    return frame.prism.base_at(u, v) + height_alone(frame, u, v) * frame.prism.direction_at(u, v);
  }
  /// Squared distance (m^2) of that point from another one; and several at once. [servo]
  [[nodiscard]] double squared_distance(const ReliefFrame& frame, double u, double v, const Vec3& from) const noexcept {
    return (place(frame, u, v) - from).squaredNorm();
  }
  void squared_distances(const ReliefFrame& frame, const Lanes& u, const Lanes& v, const Vec3& from,
                         Lanes& squares) const noexcept;
  /// Bounds of the height as rendered, over the triangle with these corners. [servo]
  [[nodiscard]] HeightRange range(const ReliefFrame& frame, const Vec2 corners[3]) const noexcept;
  /// A plane that the height as rendered keeps to over part of the frame's triangle. Where the relief is smooth the
  /// error is of second order in the part; in folds that are rounded it is a range. [servo]
  [[nodiscard]] HeightForm form(const ReliefFrame& frame, const FacePart& part) const noexcept;
  /// Bounds that it is made of: one, or about two where other faces may have a say in the part. [servo]
  [[nodiscard]] std::uint32_t bounds_of(const ReliefFrame& frame, const FacePart& part) const noexcept {
    return reaches_band(frame, part) ? 2 : 1;
  }
  /// The same in space, over a triangle. [servo]
  [[nodiscard]] ReliefBound bound(const ReliefFrame& frame, const FacePart& part) const noexcept;
  /// Shell coordinates of p: finds the owning prism from the nearest base point by walking across edges. Its triangle,
  /// which stays in `cache` until another one is asked for; null where no prism holds p. [servo]
  [[nodiscard]] const ReliefFrame* locate(const Vec3& p, SurfaceCache& cache, const CoatMoment& moment,
                                          ShellPlace& place) const noexcept;
  /// Value and gradient of Phi at a located place. [servo]
  [[nodiscard]] FieldSample field(const ReliefFrame& frame, const ShellPlace& place) const noexcept;
  /// Value and gradient of h - H with the face's own height, not stitched (Algorithm 1). [servo]
  [[nodiscard]] FieldSample own_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept;

  [[nodiscard]] const MeshSurface& base() const noexcept { return base_; }
  [[nodiscard]] const Coat& coat() const noexcept { return coat_; }
  [[nodiscard]] const Shell& shell() const noexcept { return shell_; }
  [[nodiscard]] const ReliefReport& report() const noexcept { return report_; }
  [[nodiscard]] Prisms prisms() const noexcept { return {base_.mesh(), coat_.amplitude_bound()}; }
  /// Smallest length (m) over which the relief changes: steps along the surface are measured by it. [any]
  [[nodiscard]] double grain() const noexcept { return grain_; }
  /// Whether heights of neighbouring faces may differ at their edge (no blend was asked for). [any]
  [[nodiscard]] bool has_jumps() const noexcept { return coat_.has_seams() && bands_.empty(); }
  /// Whether reliefs of faces without a common vertex come into one another anywhere; and into that of `face`. [servo]
  [[nodiscard]] bool overlaps() const noexcept { return report_.overlapping_pairs > 0; }
  /// [servo]
  [[nodiscard]] bool overlapped(std::uint32_t face) const noexcept {
    return !overlapped_.empty() && overlapped_[face] != 0;
  }
  /// Folds `fillet`: the least radius that a fillet has anywhere (m): 0 where a convex fold ends; 0 in other modes.
  /// [any]
  [[nodiscard]] double least_fillet() const noexcept;
  /// How far the displaced surface is from its base at most (m). [any]
  [[nodiscard]] double reach() const noexcept { return reach_; }
  /// Boxes around the relief over each face, at every level and moment of its coat, for the base's index. [servo]
  [[nodiscard]] const FaceBoxes& boxes() const noexcept { return boxes_; }
  /// Bounds of the height as rendered over all of a face, at every level and moment (m). [servo]
  [[nodiscard]] HeightRange range(std::uint32_t face) const noexcept {
    return {static_cast<double>(ranges_[face].lowest), static_cast<double>(ranges_[face].highest)};
  }
  /// Bytes of coat, base, search structure and shell. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  static constexpr std::uint32_t heights_in_band = 4;
  struct CarriedHeights;
  struct Enclosed;
  class EnclosedByFour;
  class Overlaps;
  ReliefSurface(MeshSurface base, Coat coat, MeshSurface rest, std::shared_ptr<CarriedHeights> carried);
  /// Finds what the moved reliefs have in common with this one.
  void carry() const;
  /// Does what the settings ask beyond the default.
  Status settle(const ReliefSettings& settings);
  void fit(ShellDirections directions);
  void lay_bands();
  /// Per face: of the heights over it, the share that its prism has room for.
  [[nodiscard]] UnsetVector<double> fitting_shares() const;
  [[nodiscard]] double deepest_fold() const;
  void lay_fillets();
  /// Radius of the largest ball that fits over an edge (m): infinite where that is flat, 0 where it is convex.
  [[nodiscard]] float fillet_over(std::uint32_t face, int edge) const noexcept;
  [[nodiscard]] float band_to(std::uint32_t face, int edge) const noexcept;
  void lower(std::span<const double> share_of_face);
  /// Whether heights over a face may be anything that the coat holds, from level to level and moment to moment.
  [[nodiscard]] bool any_height() const noexcept;
  /// Whether neither other faces nor a cure have a say in a face's heights.
  [[nodiscard]] bool on_its_own(std::uint32_t face) const noexcept;
  /// Finds ranges_ and boxes_, and what they are made of.
  [[nodiscard]] Enclosed enclose();
  /// Heights over all of a face at all levels, and the box around what they make of it.
  [[nodiscard]] HeightRange enclose_face(std::uint32_t face, Box& box) const noexcept;
  void find_overlaps(const Enclosed& enclosed);
  [[nodiscard]] HeightJet stitched(const ReliefFrame& frame, double u, double v) const noexcept;
  template <class PartnerOf>
  [[nodiscard]] double stitched_height(const ReliefFrame& frame, double u, double v,
                                       const PartnerOf& partner_of) const noexcept;
  [[nodiscard]] HeightJet rounded(const ReliefFrame& frame, double u, double v) const noexcept;
  /// How far across its band a place is towards where another face has lost its say, which is at 1.
  [[nodiscard]] double share_across(const ReliefFrame& frame, const ShellPlace& place, const ShellGradients& gradients,
                                    std::uint32_t other, Vec3& gradient) const noexcept;
  [[nodiscard]] FieldSample fillet_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept;
  struct RoundPartner;
  class RoundSum;
  [[nodiscard]] FieldSample round_field(const ReliefFrame& frame, const ShellPlace& place) const noexcept;
  [[nodiscard]] HeightJet height(const ReliefFrame& frame, double u, double v, bool blended) const noexcept;
  /// Whether other faces have a say at a place.
  [[nodiscard]] static bool in_band(const ReliefFrame& frame, double u, double v) noexcept {
    return frame.stitched && within_bands(frame.band, u, v);
  }
  [[nodiscard]] static bool within_bands(const StitchBand& band, double u, double v) noexcept;
  [[nodiscard]] bool reaches_band(const ReliefFrame& frame, const FacePart& part) const noexcept;
  [[nodiscard]] HeightForm stitched_form(const ReliefFrame& frame, const FacePart& part) const noexcept;
  [[nodiscard]] HeightRange range_around(const ReliefFrame& frame, const FacePart& part) const noexcept;
  template <class Visit>
  void for_each_partner(const ReliefFrame& frame, double u, double v, Visit&& visit) const noexcept;

  std::uint64_t identity_ = 0;
  MeshSurface base_;
  MeshSurface rest_;  ///< that the coat was laid on
  Coat coat_;
  std::shared_ptr<CarriedHeights> carried_;  ///< shared with all reliefs that it is moved to
  ReliefSettings settings_;
  Shell shell_;
  std::vector<StitchBand> bands_;         ///< one a face, or empty: nothing to stitch
  std::vector<float> fillets_;            ///< one a vertex, or empty: radius of the ball in concave folds (m)
  std::vector<float> fillet_reach_;       ///< one a vertex: 1 - its coordinate, up to which all faces around have a say
  std::vector<float> shares_;             ///< one a vertex, or empty: the whole height everywhere
  std::vector<std::uint8_t> overlapped_;  ///< one a face, or empty: whether reliefs of distant faces meet there
  struct FaceRange {
    float lowest;
    float highest;
  };
  UnsetVector<FaceRange> ranges_;  ///< one a face, rounded outwards
  FaceBoxes boxes_;
  ReliefReport report_;
  double reach_ = 0.0;
  double skin_ = 0.0;
  double grain_ = 0.0;
  double fold_depth_ = 0.0;  ///< by how much rounding folds may move the surface (m)
};

/// Lays a coat of these parts on a mesh and makes the relief of both. The mesh is named once, so the coat can be on no
/// other than the one it is touched with. Errors: those of Coat::build, then those of ReliefSurface::build. [build]
Result<std::shared_ptr<const ReliefSurface>> make_relief(MeshSurface base, CoatParts parts,
                                                         const CoatSettings& coat = {},
                                                         const ReliefSettings& relief = {});
/// The same of one mesostructure all over the mesh. [build]
Result<std::shared_ptr<const ReliefSurface>> make_relief(MeshSurface base, Mesostructure maps,
                                                         const CoatSettings& coat = {},
                                                         const ReliefSettings& relief = {});

}  // namespace asperity
