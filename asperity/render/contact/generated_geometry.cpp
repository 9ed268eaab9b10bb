#include "asperity/render/contact/generated_geometry.h"

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/mesh.h"

namespace asperity {

namespace {

// The derived influence radius, in mean facet edges: a proxy that slides by less than one facet stays in its patch.
constexpr double influence_in_facets = 1.5;
// Parts of a base triangle's grid are generated in blocks of at most so many cells a side.
constexpr int block_cells = 8;
// A motion is followed through so many patches; where nothing is near they grow.
constexpr int most_patches = 64;
// Parts of grids whose bounds are asked for before a ball counts as too large.
constexpr int most_looks = 512;
// As TriangleMesh::build has it: thinner triangles have no normal.
constexpr double least_relative_area = 1e-12;

bool flat(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()});
  return !(0.5 * ab.cross(ac).norm() >= least_relative_area * longest) || longest == 0.0;
}

/// A range of the grid's corners over one base triangle.
struct Cells {
  int columns[2] = {0, 0};
  int rows[2] = {0, 0};
  [[nodiscard]] bool empty() const noexcept { return columns[0] >= columns[1] || rows[0] >= rows[1]; }
  [[nodiscard]] int width() const noexcept { return columns[1] - columns[0]; }
  [[nodiscard]] int height() const noexcept { return rows[1] - rows[0]; }
};

}  // namespace

/// Finds the parts of one base triangle's grid whose facets may come within a ball.
class GeneratedPatch::BlockSearch {
 public:
  BlockSearch(const ReliefSurface& surface, const ReliefFrame& frame, int subdivisions, const Vec3& centre,
              double radius, int& looks) noexcept
      : surface_(surface), frame_(frame), subdivisions_(subdivisions), radius_(radius), looks_(looks) {
    const ShellPrism& prism = frame.prism;
    const Vec3 cross = prism.edge_u.cross(prism.edge_v);
    const double area = cross.squaredNorm();
    gradient_[1] = prism.edge_v.cross(cross) / area;
    gradient_[2] = cross.cross(prism.edge_u) / area;
    gradient_[0] = -gradient_[1] - gradient_[2];
    gradient_[3] = cross / std::sqrt(area);
    const Vec3 offset = centre - prism.corner;
    centre_ = {1.0 + gradient_[0].dot(offset), gradient_[1].dot(offset), gradient_[2].dot(offset)};
    level_ = gradient_[3].dot(offset);
  }

  /// Calls visit(cells) for blocks that hold them all. False when visit answers false, or there are too many to look
  /// at.
  template <class Visit>
  bool run(const Visit& visit) const noexcept {
    Cells all;
    all.columns[1] = all.rows[1] = subdivisions_;
    // The whole relief's bounds cost nothing and are enough for a small ball.
    const Vec3 corners[3] = {frame_.prism.direction_at(0.0, 0.0), frame_.prism.direction_at(1.0, 0.0),
                             frame_.prism.direction_at(0.0, 1.0)};
    const double highest = surface_.reach() / std::max({corners[0].norm(), corners[1].norm(), corners[2].norm()});
    all = narrowed(all, -highest, highest);
    if (all.empty()) return true;
    if (small(all)) return visit(all);
    Cells stack[48];
    int top = 0;
    stack[top++] = all;
    while (top > 0) {
      if (looks_-- == 0) return false;
      Cells cells = stack[--top];
      const HeightRange heights = range_over(cells);
      cells = narrowed(cells, heights.lowest, heights.highest);
      if (cells.empty()) continue;
      if (small(cells)) {
        if (!visit(cells)) return false;
        continue;
      }
      Cells half = cells;
      if (cells.width() >= cells.height()) {
        half.columns[1] = cells.columns[0] = cells.columns[0] + cells.width() / 2;
      } else {
        half.rows[1] = cells.rows[0] = cells.rows[0] + cells.height() / 2;
      }
      stack[top++] = cells;
      stack[top++] = half;
    }
    return true;
  }

 private:
  [[nodiscard]] static bool small(const Cells& cells) noexcept {
    return cells.width() <= block_cells && cells.height() <= block_cells;
  }

  [[nodiscard]] HeightRange range_over(const Cells& cells) const noexcept {
    const Vec2 low = grid_place(cells.columns[0], cells.rows[0], subdivisions_);
    const Vec2 high = grid_place(cells.columns[1], cells.rows[1], subdivisions_);
    const Vec2 right(high.x(), low.y());
    const Vec2 left(low.x(), high.y());
    const Vec2 lower[3] = {low, right, left};
    HeightRange heights = surface_.range(frame_, lower);
    // The other half of the rectangle, unless it lies beyond the triangle's long edge.
    if (std::min(right.sum(), left.sum()) < 1.0) {
      const Vec2 upper[3] = {high, left, right};
      const HeightRange other = surface_.range(frame_, upper);
      heights.lowest = std::min(heights.lowest, other.lowest);
      heights.highest = std::max(heights.highest, other.highest);
    }
    return heights;
  }

  /// The cells whose facets may come within the ball, heights being within bounds (m).
  [[nodiscard]] Cells narrowed(const Cells& cells, double lowest, double highest) const noexcept {
    double low[4] = {infinity, infinity, infinity, infinity};
    double high[4] = {-infinity, -infinity, -infinity, -infinity};
    // Drift of the displaced surface across the plane, in barycentric coordinates, and its height over the plane (m):
    // bilinear in place and height, so that the corners of a block bound it.
    for (int corner = 0; corner < 4; ++corner) {
      const Vec2 at = grid_place(cells.columns[corner & 1], cells.rows[corner >> 1], subdivisions_);
      const Vec3 direction = frame_.prism.direction_at(at.x(), at.y());
      for (const double height : {lowest, highest}) {
        for (int k = 0; k < 4; ++k) {
          const double value = height * gradient_[k].dot(direction);
          low[k] = std::min(low[k], value);
          high[k] = std::max(high[k], value);
        }
      }
    }
    const double apart = std::max({0.0, low[3] - level_, level_ - high[3]});
    Cells none;
    if (apart > radius_) return none;
    const double across = std::sqrt(radius_ * radius_ - apart * apart);
    constexpr double rounding = 1e-9;
    double from[3];
    double to[3];
    for (int k = 0; k < 3; ++k) {
      const double reach = across * gradient_[k].norm() + rounding;
      from[k] = centre_[k] - reach - high[k];
      to[k] = centre_[k] + reach - low[k];
      if (from[k] > 1.0 || to[k] < 0.0) return none;
    }
    Cells answer = cells;
    for (int axis = 0; axis < 2; ++axis) {
      int* bounds = axis == 0 ? answer.columns : answer.rows;
      const double first = std::floor(from[axis + 1] * subdivisions_);
      const double last = std::ceil(to[axis + 1] * subdivisions_);
      if (first > bounds[0]) bounds[0] = static_cast<int>(std::min<double>(first, bounds[1]));
      if (last < bounds[1]) bounds[1] = static_cast<int>(std::max<double>(last, bounds[0]));
    }
    // Cells beyond the third edge's own bound.
    const double least_sum = 1.0 - to[0];
    if (static_cast<double>(answer.columns[1] + answer.rows[1]) < least_sum * subdivisions_) return none;
    if (answer.columns[0] + answer.rows[0] >= subdivisions_) return none;
    return answer;
  }

  const ReliefSurface& surface_;
  const ReliefFrame& frame_;
  int subdivisions_;
  double radius_;
  int& looks_;        ///< that may still be spent on narrowing
  Vec3 gradient_[4];  ///< of the barycentric coordinates (1/m), and of the height over the plane: its unit normal
  Vec3 centre_;       ///< barycentric coordinates of the ball's centre
  double level_ = 0.0;
};

void GeneratedPatch::start(const ReliefSurface& surface, const LawFacets& facets) noexcept {
  surface_ = &surface;
  subdivisions_ = facets.subdivisions;
  facet_ = surface.base().mesh().mean_edge() / subdivisions_;
  influence_ = facets.influence_radius > 0.0 ? facets.influence_radius : influence_in_facets * facet_;
  fitted_ = infinity;
  tolerance_ = ContactTolerance::of(facet_, surface.bounds());
  complete_ = true;
  certified_ = -1.0;
}

bool GeneratedPatch::generate(const Vec3& centre, double radius) noexcept {
  blocks_.clear();
  vertices_.clear();
  facets_.clear();
  certified_ = -1.0;
  std::size_t vertices = 0;
  int looks = most_looks;
  bool fits = true;
  Box around;
  around.include(centre);
  surface_->base().index().for_each_in_box(around.grown(radius + surface_->reach()), [&](std::uint32_t face) {
    if (!fits) return;
    for (const Block& block : blocks_) {
      if (block.face == face) return;
    }
    const ReliefFrame frame = surface_->frame(face);
    fits = BlockSearch(*surface_, frame, subdivisions_, centre, radius, looks).run([&](const Cells& cells) {
      vertices += static_cast<std::size_t>((cells.width() + 1) * (cells.height() + 1));
      Block block;
      block.face = face;
      for (int end = 0; end < 2; ++end) {
        block.columns[end] = static_cast<std::uint16_t>(cells.columns[end]);
        block.rows[end] = static_cast<std::uint16_t>(cells.rows[end]);
      }
      return vertices <= most_vertices && blocks_.push_back(block);
    });
  });
  if (!fits) return false;
  ReliefFrame frame;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (blocks_[i].face != frame.face) frame = surface_->frame(blocks_[i].face);
    displace(frame, static_cast<std::uint16_t>(i), centre, radius);
  }
  centre_ = centre;
  certified_ = radius;
  return true;
}

void GeneratedPatch::displace(const ReliefFrame& frame, std::uint16_t block, const Vec3& centre,
                              double radius) noexcept {
  const Block& cells = blocks_[block];
  const int first = cells.columns[0];
  // Each row of corners ends at the triangle's long edge; row j starts at this vertex.
  std::size_t below = 0;
  int below_count = 0;
  for (int j = cells.rows[0]; j <= cells.rows[1]; ++j) {
    const std::size_t row = vertices_.size();
    const int count = std::min<int>(cells.columns[1], subdivisions_ - j) - first + 1;
    for (int i = 0; i < count; ++i) {
      const Vec2 at = grid_place(first + i, j, subdivisions_);
      vertices_.push_back(surface_->point(frame, at.x(), at.y()).point);
    }
    for (int i = 0; j > cells.rows[0] && i + 1 < below_count; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (i < count) add_facet(block, below + at, below + at + 1, row + at, centre, radius);
      if (i + 1 < count) add_facet(block, below + at + 1, row + at + 1, row + at, centre, radius);
    }
    below = row;
    below_count = count;
  }
}

void GeneratedPatch::add_facet(std::uint16_t block, std::size_t a, std::size_t b, std::size_t c, const Vec3& centre,
                               double radius) noexcept {
  if (flat(vertices_[a], vertices_[b], vertices_[c])) return;
  if (closest_point_on_triangle(centre, vertices_[a], vertices_[b], vertices_[c]).squared_distance > radius * radius)
    return;
  Facet facet;
  facet.corner[0] = static_cast<std::uint16_t>(a);
  facet.corner[1] = static_cast<std::uint16_t>(b);
  facet.corner[2] = static_cast<std::uint16_t>(c);
  facet.block = block;
  // Two facets a vertex at most: there is always room.
  facets_.push_back(facet);
}

std::array<Vec3, 3> GeneratedPatch::corners(std::uint32_t facet) const noexcept {
  const Facet& f = facets_[facet];
  return {vertices_[f.corner[0]], vertices_[f.corner[1]], vertices_[f.corner[2]]};
}

double GeneratedPatch::room_around(const Vec3& position, double reach, double wanted) noexcept {
  const double room = certified_ - (position - centre_).norm() - reach;
  if (certified_ >= 0.0 && room >= wanted) return room;
  // Once something did not fit the proxy waits for the next tick.
  if (!complete_) return -1.0;
  // What does not fit is tried smaller, down to what must be there.
  constexpr double least = 0.05;
  constexpr double smaller = 0.35;
  for (double more = std::min(std::max(influence_, wanted), 4.0 * fitted_); more > least * std::min(facet_, influence_);
       more *= smaller) {
    if (generate(position, reach + more)) {
      fitted_ = more;
      return more;
    }
  }
  if (generate(position, reach)) return 0.0;
  complete_ = false;
  return -1.0;
}

bool GeneratedPatch::comes_near(const Segment& motion, double reach) const noexcept {
  bool near = false;
  surface_->base().index().for_each_along(motion, surface_->reach() + reach, [&](std::uint32_t) {
    near = true;
    return 0.0;
  });
  return near;
}

bool GeneratedPatch::glides(const Segment& motion, double radius) const noexcept {
  const double blocked = radius + blocked_in_skins * tolerance_.skin;
  for (std::uint32_t facet = 0; facet < facets_.size(); ++facet) {
    const auto [a, b, c] = corners(facet);
    if (!stays_off(a, b, c, motion, closest_point_on_triangle(motion.to, a, b, c), blocked)) return false;
  }
  return true;
}

SweptHit GeneratedPatch::segment(const Segment& motion, double radius, Sides sides) noexcept {
  SweptHit best;
  const Vec3 way = motion.to - motion.from;
  const double length = way.norm();
  const double touch = radius + touch_in_skins * tolerance_.skin;
  if (length == 0.0) return best;
  double wanted = influence_;
  double done = 0.0;
  for (int patch = 0; complete_ && patch < most_patches; ++patch) {
    const Vec3 from = motion.from + done * way;
    const double left = (1.0 - done) * length;
    const double room = room_around(from, touch, std::min(left, wanted));
    if (!(room > 0.0)) break;
    if (patch == 0 && length <= room && length < glide_of_radius * radius && glides(motion, radius)) return best;
    const double part = room < left ? room / length : 1.0 - done;
    const Segment piece{from, part < 1.0 - done ? Vec3(from + part * way) : motion.to};
    for (std::uint32_t facet = 0; facet < facets_.size(); ++facet) {
      const auto [a, b, c] = corners(facet);
      sweep_triangle(facet, a, b, c, piece, radius, sides, tolerance_, best);
    }
    if (best.hit) {
      best.t = done + best.t * part;
      best.contact.element = base_face(best.contact.element);
      return best;
    }
    if (room >= left) return best;
    done += part;
    if (patch == 0 && !comes_near(motion, touch)) return best;
    // Far from everything larger balls are as cheap.
    wanted = facets_.empty() ? 2.0 * std::max(wanted, room) : influence_;
  }
  // Not looked at any further: the proxy waits here.
  complete_ = false;
  best.hit = true;
  best.t = done;
  return best;
}

void GeneratedPatch::contacts(const Vec3& position, double radius, Sides sides, ContactSet& out) noexcept {
  const double reach = radius + touch_in_skins * tolerance_.skin;
  if (room_around(position, reach, 0.0) < 0.0) return;
  NearTriangles near;
  for (std::uint32_t facet = 0; facet < facets_.size(); ++facet) {
    const auto [a, b, c] = corners(facet);
    near.offer({facet, closest_point_on_triangle(position, a, b, c)}, reach);
  }
  ContactSet found;
  for (const ClosestHit& at : near) {
    const auto [a, b, c] = corners(at.face);
    add_triangle_contact(at, a, b, c, position, sides, tolerance_, found);
  }
  settle_edge_contacts(
      position, tolerance_, [&](std::uint32_t facet) { return corners(facet); }, found);
  for (Foot& contact : found) {
    contact.element = base_face(contact.element);
    out.push_back(contact);
  }
}

Foot GeneratedPatch::nearest(const Vec3& p, SurfaceCache& cache) noexcept {
  const Foot smooth = surface_->view(cache).nearest(p, infinity);
  if (!smooth.found() || room_around(smooth.point, 0.0, 0.0) < 0.0) return {};
  Foot best;
  Vec3 normals = Vec3::Zero();
  for (std::uint32_t facet = 0; facet < facets_.size(); ++facet) {
    const auto [a, b, c] = corners(facet);
    const TrianglePoint at = closest_point_on_triangle(p, a, b, c);
    const double distance = std::sqrt(at.squared_distance);
    if (distance > best.distance + tolerance_.rounding) continue;
    // On an edge or corner every facet there is as near: together their normals tell front from back.
    if (distance < best.distance - tolerance_.rounding) normals.setZero();
    normals += (b - a).cross(c - a).normalized();
    if (distance < best.distance) best = {at.point, Vec3::Zero(), distance, base_face(facet), at.barycentric};
  }
  best.normal = normals.squaredNorm() > 0.0 ? Vec3(normals.normalized()) : smooth.normal;
  return best;
}

}  // namespace asperity
