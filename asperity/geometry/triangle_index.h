#pragma once

#include <memory>
#include <variant>

#include "asperity/core/names.h"
#include "asperity/geometry/bvh_search.h"
#include "asperity/geometry/contact.h"
#include "asperity/geometry/octree.h"
#include "asperity/geometry/triangle_contact.h"
#include "asperity/geometry/triangle_patch.h"

namespace asperity {

/// Which structure answers the elementary queries.
enum class SearchStructure { bvh, octree };
/// As in scene files.
template <>
struct Names<SearchStructure> {
  static constexpr auto table =
      std::to_array<Named<SearchStructure>>({{SearchStructure::bvh, "bvh"}, {SearchStructure::octree, "octree"}});
};

/// One query interface over a mesh and either search structure. Owns both mesh and structure; copies share them, so
/// that copying costs nothing.
///
/// Elementary queries are exact. The swept queries treat the probe as a ball of radius r plus a thin `skin` (1e-6 of
/// the mean edge): resting on the surface means resting one skin above it, which keeps rounding from
/// ever carrying a probe through; the laws subtract the skin again, so forces do not contain it.
///
/// Distance to a triangle is a convex function along a straight motion, so Newton's method from
/// the start approaches the first contact from outside and never passes it: no tunnelling, at any speed.
class TriangleIndex {
 public:
  /// [build]
  static TriangleIndex build(TriangleMesh mesh, SearchStructure structure = SearchStructure::bvh,
                             const BvhSettings& settings = {});

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return inside_->mesh; }
  /// Identity that tells patches of different indices apart; never 0.
  [[nodiscard]] std::uint64_t identity() const noexcept { return identity_; }
  /// Identity that an index has in common with all that were made of it by moving vertices (MeshRefitter): the same
  /// triangles and vertices by the same numbers, in other places. [any]
  [[nodiscard]] std::uint64_t lineage() const noexcept { return lineage_; }
  /// What a search costs (boxes met by a random line) compared with the tree as it was built: 1 for a built one, more
  /// for one refitted to a mesh that has been bent far. Above about 2 building anew pays. [any]
  [[nodiscard]] double cost_ratio() const noexcept;
  /// Thickness that separates a resting probe from the surface (m).
  [[nodiscard]] double skin() const noexcept { return tolerance_.skin; }
  /// Bytes of mesh and structure, however many copies share them. [any]
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

  /// Nearest point of the surface within `bound` (m); found() is false when there is none. [servo]
  [[nodiscard]] Foot closest(const Vec3& p, double bound) const noexcept;
  /// The same, from the patch when its certificate allows, else from the structure; exact either way. [servo]
  [[nodiscard]] Foot closest(const Vec3& p, double bound, TrianglePatch& patch) const noexcept;
  /// First triangle met by the segment, from either side. [servo]
  [[nodiscard]] FirstHit first_hit(const Segment& segment) const noexcept;
  /// Calls visit(face) for every triangle whose bounding box meets `box`; may repeat a face with the octree. [servo]
  template <class Visit>
  void for_each_in_box(const Box& box, Visit&& visit) const {
    std::visit([&](const auto& structure) { structure.for_each_in_box(box, visit); }, inside_->structure);
  }
  /// Calls visit(face) for every triangle that may come within `margin` (m) of a face, itself included: with a
  /// hierarchy all but most of those that lie wholly above it, below it or beyond one of its edges by more. [servo]
  template <class Visit>
  void for_each_beside(std::uint32_t face, double margin, Visit&& visit) const {
    const std::array<Vec3, 3> corners = mesh().corners(face);
    if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) {
      bvh->for_each_beside(corners, mesh().face_normal(face), margin, visit);
      return;
    }
    Box box;
    for (const Vec3& corner : corners) box.include(corner);
    for_each_in_box(box.grown(margin), visit);
  }
  /// Calls visit(one, others) so that every pair of triangles without a common vertex whose boxes meet comes up once,
  /// and perhaps some that miss each other by a rounding; in no order, and from several threads at a time. [build]
  void for_each_meeting(const FaceBoxes& boxes, const MeetingVisit& visit) const;
  /// Calls visit(face), roughly from near to far, for every triangle whose bounding box grown by `radius` (m) the
  /// segment meets; visit answers the fraction of the segment beyond which nothing is wanted any more. [servo]
  template <class Visit>
  void for_each_along(const Segment& segment, double radius, Visit&& visit) const {
    if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) {
      bvh->for_each_along(segment, radius, visit);
      return;
    }
    Box box;
    box.include(segment.from);
    box.include(segment.to);
    std::get_if<TriangleOctree>(&inside_->structure)->for_each_in_box(box.grown(radius), [&](std::uint32_t face) {
      visit(face);
    });
  }

  /// Boxes, one a triangle and around it, to be searched instead of the triangles; never too small. Each thread takes
  /// about `grain` triangles at a time. [build]
  [[nodiscard]] FaceBoxes enclosed(const BoxesOver& over, std::size_t grain = 2048) const;
  /// for_each_along for the triangles whose boxes the segment meets, and perhaps some more. [servo]
  template <class Visit>
  void for_each_along(const Segment& segment, const FaceBoxes& boxes, Visit&& visit) const {
    if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) {
      bvh->for_each_along(segment, boxes, visit);
    } else {
      for_each_along(segment, boxes.farther, visit);
    }
  }
  /// Calls visit(face), roughly from near to far, for every triangle whose box comes within a bound (m) of `p`, and
  /// perhaps some more; visit answers the bound from then on. [servo]
  template <class Visit>
  void for_each_near(const Vec3& p, double bound, const FaceBoxes& boxes, Visit&& visit) const {
    if (const auto* bvh = std::get_if<Bvh>(&inside_->structure)) {
      bvh->for_each_near(p, bound, boxes, visit);
      return;
    }
    Box around;
    around.include(p);
    for_each_in_box(around.grown(bound + boxes.farther), [&](std::uint32_t face) { visit(face); });
  }

  /// First touch of a ball of `radius` (m, plus skin) moving along `motion`. Triangles seen from behind at the start
  /// are passed through when `sides` is front. [servo]
  [[nodiscard]] SweptHit sweep(const Segment& motion, double radius, Sides sides, TrianglePatch& patch) const noexcept;
  /// Every distinct plane that a ball of `radius` (m) resting at `position` touches within two skins. [servo]
  void contacts(const Vec3& position, double radius, Sides sides, TrianglePatch& patch, ContactSet& out) const noexcept;
  /// The face that a ball was left resting on at `position`, where that is all that it touches and the foot is inside
  /// it; nullptr: not known to be so. In `patch`, until the next query. [servo]
  [[nodiscard]] const Foot* rests_on_face(const Vec3& position, double radius, Sides sides,
                                          const TrianglePatch& patch) const noexcept;
  /// Whether such a ball slides along its face past nothing else, and rests on it alone again at its end, which is
  /// remembered then. Where not, sweep tells what it meets. [servo]
  bool slides(const Segment& motion, double radius, Sides sides, TrianglePatch& patch) const noexcept;

 private:
  friend class MeshRefitter;
  /// Mesh and structure stay in place, as the structure refers to the mesh.
  struct Inside {
    explicit Inside(TriangleMesh of) : mesh(std::move(of)) {}
    TriangleMesh mesh;
    std::variant<Bvh, TriangleOctree> structure;
    double built_cost = 1.0;  ///< of a hierarchy when it was built
  };

  TriangleIndex() = default;
  TriangleIndex(std::shared_ptr<const Inside> inside, std::uint64_t lineage);
  /// Whether the patch covers the ball (position, reach), refilling it where that can help.
  bool ensure(const Vec3& position, double reach, TrianglePatch& patch) const noexcept;
  void gather(const Vec3& centre, double reach, TrianglePatch& patch) const noexcept;
  /// Calls visit(face, distance, offset) for every triangle within `reach` of `position`, from the patch where it
  /// suffices.
  template <class Visit>
  void scan_ball(const Vec3& position, double reach, TrianglePatch& patch, Visit&& visit) const noexcept;
  /// Bound on the error of the distances that scan_ball gives (m).
  [[nodiscard]] double error(const Vec3& position) const noexcept;
  [[nodiscard]] SweptHit sweep_part(const Segment& motion, double radius, Sides sides,
                                    TrianglePatch& patch) const noexcept;
  /// Whether a triangle lies below the plane that a ball rests on.
  [[nodiscard]] bool below(std::uint32_t face, const Foot& rest) const noexcept;
  /// Whether a ball that rests on a face keeps off all that is not below that on a short motion.
  [[nodiscard]] bool passes_others(const Segment& motion, const Foot& rest, double radius,
                                   TrianglePatch& patch) const noexcept;
  /// Lists what a ball that rests on a face may come to within `reach` of where it is.
  void look_beside(const Vec3& position, const Foot& rest, double reach, TrianglePatch& patch) const noexcept;
  /// Whether nothing reaches into the ball on a short motion; if so, remembers what it touches at its end.
  bool glides(const Segment& motion, double length, double radius, Sides sides, double touch,
              TrianglePatch& patch) const noexcept;
  void remember(const Vec3& position, double radius, Sides sides, const ContactSet& contacts,
                TrianglePatch& patch) const noexcept;
  [[nodiscard]] ClosestHit near_at(std::uint32_t face, const Vec3& position) const noexcept;
  /// Adds the planes of what is near, and makes of edges and corners what they mean beside a touched face.
  void touch_all(const NearTriangles& near, const Vec3& position, Sides sides, ContactSet& out) const noexcept;

  std::shared_ptr<const Inside> inside_;
  std::uint64_t identity_ = 0;
  std::uint64_t lineage_ = 0;
  ContactTolerance tolerance_;
};

}  // namespace asperity
