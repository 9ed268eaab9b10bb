#pragma once
// Geometry generated per triangle at run time inside the probe's influence area (haptic-textures-2005, 3.1). Private to
// render.

#include "asperity/core/fixed_vector.h"
#include "asperity/geometry/triangle_contact.h"
#include "asperity/render/law_facts.h"
#include "asperity/surface/relief/view.h"

namespace asperity {

/// The small triangles of a relief around a place, made anew every tick and wherever the proxy goes within it: each
/// base triangle near the place is cut into a grid, the part of the grid within the influence radius is displaced. A
/// patch holds every small triangle that comes nearer to its centre than a certified distance; a query that needs more
/// makes another one. Lives on the stack of a tick.
class GeneratedPatch {
 public:
  GeneratedPatch() noexcept {}  // NOLINT: the buffers stay uninitialised on purpose
  void start(const ReliefSurface& surface, const LawFacets& facets) noexcept;

  /// First touch of a ball moving among the facets. Where the buffer cannot hold what is around it, the motion is
  /// stopped there. [servo]
  [[nodiscard]] SweptHit segment(const Segment& motion, double radius, Sides sides) noexcept;
  /// The planes of the facets that a resting ball touches; `element` is the base's triangle. [servo]
  void contacts(const Vec3& position, double radius, Sides sides, ContactSet& out) noexcept;
  /// The facet nearest to p of those around the point of the relief that is nearest to p. `normal` is the facets' own,
  /// outward, not turned towards p. [servo]
  [[nodiscard]] Foot nearest(const Vec3& p, SurfaceCache& cache) noexcept;
  [[nodiscard]] double skin() const noexcept { return tolerance_.skin; }
  /// False when some query was not answered from everything around it: what it said then holds the proxy back. [servo]
  [[nodiscard]] bool complete() const noexcept { return complete_; }
  /// Distance around a query within which more is generated than it needs (m). [servo]
  [[nodiscard]] double influence() const noexcept { return influence_; }

  static constexpr std::size_t most_vertices = 512;

 private:
  struct Block {
    std::uint32_t face = 0;
    std::uint16_t columns[2] = {0, 0};  ///< first and last, of the grid's corners
    std::uint16_t rows[2] = {0, 0};
  };
  struct Facet {
    std::uint16_t corner[3] = {0, 0, 0};
    std::uint16_t block = 0;
  };
  class BlockSearch;

  /// How far the ball (position, reach) may move within what is generated; makes a new patch around it where that is
  /// less than `wanted`. Below 0: not even the ball itself fits.
  double room_around(const Vec3& position, double reach, double wanted) noexcept;
  bool generate(const Vec3& centre, double radius) noexcept;
  void displace(const ReliefFrame& frame, std::uint16_t block, const Vec3& centre, double radius) noexcept;
  void add_facet(std::uint16_t block, std::size_t a, std::size_t b, std::size_t c, const Vec3& centre,
                 double radius) noexcept;
  [[nodiscard]] std::array<Vec3, 3> corners(std::uint32_t facet) const noexcept;
  [[nodiscard]] std::uint32_t base_face(std::uint32_t facet) const noexcept {
    return blocks_[facets_[facet].block].face;
  }
  /// Whether nothing reaches into a ball on a short motion.
  [[nodiscard]] bool glides(const Segment& motion, double radius) const noexcept;
  [[nodiscard]] bool comes_near(const Segment& motion, double reach) const noexcept;

  const ReliefSurface* surface_ = nullptr;
  int subdivisions_ = 1;
  double facet_ = 0.0;  ///< mean edge of the small triangles (m)
  double influence_ = 0.0;
  double fitted_ = infinity;  ///< influence radius that last fitted the buffer (m)
  ContactTolerance tolerance_;
  bool complete_ = true;
  Vec3 centre_ = Vec3::Zero();
  double certified_ = -1.0;  ///< m; below 0: nothing
  FixedVector<Block, 96> blocks_;
  FixedVector<Vec3, most_vertices> vertices_;
  FixedVector<Facet, 2 * most_vertices> facets_;
};

}  // namespace asperity
