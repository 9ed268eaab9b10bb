#include "asperity/study/detail/ray_cast.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <variant>

#include "asperity/core/parallel_for.h"
#include "asperity/render/fine/texture.h"

namespace asperity {
namespace {

// A hit beyond an open rim is passed; after so many the ray counts as lost.
constexpr int most_rim_hits = 4;
// Corners of a smooth cell bend by less than about 14 degrees; between pixels, a bend of more than about 11 is an edge.
constexpr double smooth_cosine = 0.97;
constexpr double least_bend = 0.018;

/// The part of a ray, by parameter, that lies within a box; empty when `from > to`.
struct Interval {
  double from = 0.0;
  double to = infinity;
};

Interval clip(const Vec3& origin, const Vec3& direction, const Box& box) {
  Interval inside;
  for (int k = 0; k < 3; ++k) {
    double near = (box.lower[k] - origin[k]) / direction[k];
    double far = (box.upper[k] - origin[k]) / direction[k];
    if (direction[k] == 0.0) {
      const bool within = origin[k] >= box.lower[k] && origin[k] <= box.upper[k];
      near = within ? -infinity : infinity;
      far = infinity;
    }
    if (near > far) std::swap(near, far);
    inside.from = std::max(inside.from, near);
    inside.to = std::min(inside.to, far);
  }
  return inside;
}

/// First touch of a surface by the ray's parameter, from the sides that can be touched.
template <class View>
Pixel first_touch(const View& view, const Vec3& origin, const Vec3& direction, Interval part, Sides sides) {
  const Segment motion{origin + part.from * direction, origin + part.to * direction};
  const SweptHit hit = view.first_touch(motion, sides);
  if (!hit.hit) return {};
  Pixel pixel{part.from + hit.t * (part.to - part.from), hit.contact.normal};
  pixel.place = {hit.contact.element, hit.side < 0.0, hit.contact.at};
  return pixel;
}

/// The mesh that an implicit surface was made from is there to be seen; where what is felt differs, that is shown.
Pixel first_hit(const ImplicitSurface& surface, const Vec3& origin, const Vec3& direction, Interval part, Sides sides,
                SurfaceCache& cache) {
  if (surface.is_mesh())
    return first_touch(surface.mesh()->view(cache), origin, direction, part, surface.mesh()->natural_sides());
  return first_touch(surface.view(cache), origin, direction, part, sides);
}

/// First hit of a relief. Beside the rim of an open mesh the implicit relief goes on; what is felt does not.
Pixel first_hit(const ReliefSurface& surface, const Vec3& origin, const Vec3& direction, Interval part, Sides sides,
                SurfaceCache& cache) {
  const ReliefView view = surface.view(cache);
  const TriangleMesh& base = surface.base().mesh();
  const double after = surface.skin() / direction.norm();
  for (int i = 0; i < most_rim_hits && part.from < part.to; ++i) {
    const Pixel pixel = first_touch(view, origin, direction, part, sides);
    if (!pixel.hit() || base.report().closed()) return pixel;
    const Vec3 point = origin + pixel.depth * direction;
    const Foot foot = view.nearest_base(point);
    if (foot.found() && !beyond_rim(base, foot, point, surface.skin())) return pixel;
    part.from = pixel.depth + 10.0 * after;
  }
  return {};
}

template <class S>
Pixel first_hit(const S& surface, const Vec3& origin, const Vec3& direction, Interval part, Sides sides,
                SurfaceCache& cache) {
  if constexpr (requires { surface.view(); }) {
    return first_touch(surface.view(), origin, direction, part, sides);
  } else {
    return first_touch(surface.view(cache), origin, direction, part, sides);
  }
}

/// Calls work(row, caster) for every row, shared out over threads, each with a caster of its own.
template <class Work>
void for_each_row(const Scene& scene, const Camera& camera, std::size_t rows, const ParallelSettings& settings,
                  const Work& work) {
  std::vector<RayCaster> casters;
  for (unsigned i = 0; i < parallel_workers(rows, settings); ++i) casters.emplace_back(scene, camera);
  parallel_for(rows, settings, [&](std::size_t row, unsigned worker) { work(static_cast<int>(row), casters[worker]); });
}

/// Rows one by one, `from` to `to` of the whole picture.
ParallelSettings picture_rows(unsigned threads, const Progress& progress, double from, double to) {
  return {.threads = threads, .progress = &progress, .what = "drawing the picture", .from = from, .to = to};
}

/// Pixel positions 0, block, 2 block ..., and the last one.
std::vector<int> places(int size, int block) {
  std::vector<int> out;
  for (int i = 0; i < size - 1; i += block) out.push_back(i);
  out.push_back(size - 1);
  return out;
}

/// Pixels x0 ... x1 by y0 ... y1, with what the rays at its corners saw: upper left, upper right, lower left, lower
/// right.
struct Cell {
  int x0, x1, y0, y1;
  const Pixel* corners[4];
};

/// Whether all corners see nothing, or one patch without a bend.
bool smooth(const Cell& cell, const Camera& camera) {
  const Pixel& first = *cell.corners[0];
  for (const Pixel* corner : cell.corners) {
    if (corner->hit() != first.hit()) return false;
    if (first.hit() && corner->normal.dot(first.normal) < smooth_cosine) return false;
  }
  if (!first.hit()) return true;
  const double twist =
      cell.corners[0]->depth + cell.corners[3]->depth - cell.corners[1]->depth - cell.corners[2]->depth;
  for (const Pixel* corner : cell.corners) {
    if (corner->filled != first.filled) return false;
  }
  return std::abs(twist) < camera.pixel * first.depth;
}

/// Rays a block apart: places along both sides of the image, and what was seen at each.
struct Lattice {
  std::vector<int> xs;
  std::vector<int> ys;
  PixelGrid knots;
  [[nodiscard]] Cell cell(int column, int row) const {
    const auto c = static_cast<std::size_t>(column);
    const auto r = static_cast<std::size_t>(row);
    return {xs[c],
            xs[c + 1],
            ys[r],
            ys[r + 1],
            {&knots.at(column, row), &knots.at(column + 1, row), &knots.at(column, row + 1),
             &knots.at(column + 1, row + 1)}};
  }
};

Lattice cast_lattice(const Scene& scene, const Camera& camera, int block, const ParallelSettings& settings) {
  Lattice lattice{places(static_cast<int>(camera.width), block), places(static_cast<int>(camera.height), block), {}};
  PixelGrid& knots = lattice.knots;
  knots.columns = static_cast<int>(lattice.xs.size());
  knots.rows = static_cast<int>(lattice.ys.size());
  knots.pixels.resize(lattice.xs.size() * lattice.ys.size());
  for_each_row(scene, camera, lattice.ys.size(), settings, [&](int row, RayCaster& caster) {
    const double y = lattice.ys[static_cast<std::size_t>(row)] + 0.5;
    for (int column = 0; column < knots.columns; ++column)
      knots.pixels[knots.index(column, row)] = caster.cast(lattice.xs[static_cast<std::size_t>(column)] + 0.5, y);
  });
  return lattice;
}

void fill_cell(const Cell& cell, const Camera& camera, RayCaster& caster, PixelGrid& grid) {
  const bool interpolate = smooth(cell, camera);
  const int right = cell.x1 == grid.columns - 1 ? cell.x1 + 1 : cell.x1;
  const int bottom = cell.y1 == grid.rows - 1 ? cell.y1 + 1 : cell.y1;
  for (int y = cell.y0; y < bottom; ++y) {
    for (int x = cell.x0; x < right; ++x) {
      Pixel& out = grid.pixels[grid.index(x, y)];
      if (!interpolate) {
        out = caster.cast(x + 0.5, y + 0.5);
      } else if (cell.corners[0]->hit()) {
        const double u = static_cast<double>(x - cell.x0) / (cell.x1 - cell.x0);
        const double v = static_cast<double>(y - cell.y0) / (cell.y1 - cell.y0);
        const double weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
        out = {0.0, Vec3::Zero()};
        out.filled = cell.corners[0]->filled;
        for (int k = 0; k < 4; ++k) {
          out.depth += weights[k] * cell.corners[k]->depth;
          out.normal += weights[k] * cell.corners[k]->normal;
        }
        out.normal.normalize();
      }
    }
  }
}

/// How much a pixel differs from its neighbours: 3 at an outline, 2 at a jump of depth, else 1 - cosine of the bend.
double edge_strength(const PixelGrid& grid, const Camera& camera, int x, int y) {
  const Pixel& here = grid.at(x, y);
  double strength = 0.0;
  constexpr int neighbours[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  for (const auto& step : neighbours) {
    const int nx = x + step[0];
    const int ny = y + step[1];
    if (nx < 0 || ny < 0 || nx >= grid.columns || ny >= grid.rows) continue;
    const Pixel& other = grid.at(nx, ny);
    if (here.hit() != other.hit()) return 3.0;
    if (!here.hit()) continue;
    // On a patch that is not seen from its edge, neighbours are not farther apart in depth than this.
    const bool jump = std::abs(here.depth - other.depth) > 8.0 * camera.pixel * here.depth;
    strength = std::max(strength, jump ? 2.0 : 1.0 - here.normal.dot(other.normal));
  }
  return strength;
}

}  // namespace

Pixel RayCaster::cast(double x, double y) {
  const Vec3 direction = camera_->ray(x, y);
  Pixel nearest;
  for (std::size_t i = 0; i < scene_->instances().size(); ++i) {
    const Instance& instance = scene_->instances()[i];
    const Vec3 from = instance.world_from_object.apply_inverse(camera_->eye);
    const Vec3 along = instance.world_from_object.rotate_inverse(direction);
    const IsoSurface* iso = iso_of(instance.surface);
    const Box bounds = iso != nullptr ? iso->surface_bounds() : surface_bounds(instance.surface);
    Interval part = clip(from, along, bounds.grown(1e-3 * bounds.diagonal()));
    part.to = std::min(part.to, nearest.depth);
    if (part.from >= part.to) continue;
    const Pixel seen =
        std::visit([&](const auto& s) { return first_hit(*s, from, along, part, sides_of(instance), caches_[i]); },
                   instance.surface);
    if (!seen.hit() || seen.depth >= nearest.depth) continue;
    nearest = seen;
    Vec3 normal = seen.normal.dot(along) > 0.0 ? Vec3(-seen.normal) : seen.normal;
    if (instance.fine != nullptr) {
      // What is felt as a texture is seen as one.
      const double footprint = camera_->pixel * seen.depth;
      normal -= texture_at(instance, seen.place, from + seen.depth * along, normal, footprint).gradient;
      normal.normalize();
    }
    nearest.normal = instance.world_from_object.rotate(normal);
    nearest.filled = 0.0;
    if (instance.closed_from != nullptr) {
      const ClosedRelief& closed = instance.closed_from->closed;
      nearest.filled = closed.rise_at(seen.place.element, seen.place.at) > closed.report.tolerance ? 1.0 : 0.0;
    }
  }
  return nearest;
}

PixelGrid cast_image(const Scene& scene, const Camera& camera, int block, unsigned threads, const Progress& progress) {
  const double share = block == 1 ? 1.0 : 0.4;
  const Lattice lattice = cast_lattice(scene, camera, block, picture_rows(threads, progress, 0.0, share));
  if (block == 1) return lattice.knots;
  PixelGrid grid{static_cast<int>(camera.width), static_cast<int>(camera.height), {}};
  grid.pixels.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows));
  for_each_row(scene, camera, lattice.ys.size() - 1, picture_rows(threads, progress, share, 1.0),
               [&](int row, RayCaster& caster) {
                 for (int column = 0; column + 1 < lattice.knots.columns; ++column)
                   fill_cell(lattice.cell(column, row), camera, caster, grid);
               });
  return grid;
}

CastCost measure_cost(const Scene& scene, const Camera& camera, int block, unsigned threads) {
  const auto begin = std::chrono::steady_clock::now();
  const Lattice lattice = cast_lattice(scene, camera, block, {.threads = threads});
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  double uneven = 0.0;
  double cells = 0.0;
  for (int row = 0; row + 1 < lattice.knots.rows; ++row) {
    for (int column = 0; column + 1 < lattice.knots.columns; ++column, ++cells) {
      uneven += smooth(lattice.cell(column, row), camera) ? 0.0 : 1.0;
    }
  }
  return {seconds / static_cast<double>(lattice.knots.pixels.size()), uneven / std::max(1.0, cells)};
}

std::vector<EdgePixel> cast_edges(const Scene& scene, const Camera& camera, const PixelGrid& grid, std::size_t most,
                                  unsigned threads) {
  std::vector<std::pair<double, std::size_t>> candidates;
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.columns; ++x) {
      const double strength = edge_strength(grid, camera, x, y);
      if (strength > least_bend) candidates.emplace_back(-strength, grid.index(x, y));
    }
  }
  if (candidates.size() > most) {
    std::nth_element(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(most), candidates.end());
    candidates.resize(most);
  }
  // In the order of the image, so that a ray's hints serve the next one.
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<EdgePixel> edges(candidates.size());
  const ParallelSettings settings{.grain = 64, .threads = threads};
  for_each_row(scene, camera, edges.size(), settings, [&](int i, RayCaster& caster) {
    EdgePixel& edge = edges[static_cast<std::size_t>(i)];
    edge.index = candidates[static_cast<std::size_t>(i)].second;
    const auto columns = static_cast<std::size_t>(grid.columns);
    const auto x = static_cast<double>(edge.index % columns);
    const auto y = static_cast<double>(edge.index / columns);
    for (int k = 0; k < 4; ++k) edge.quarters[k] = caster.cast(x + (k % 2 ? 0.75 : 0.25), y + (k / 2 ? 0.75 : 0.25));
  });
  return edges;
}

}  // namespace asperity
