#include "asperity/surface/stitching.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/parallel_for.h"
#include "asperity/core/unset_vector.h"

namespace asperity {

namespace {

struct FaceShape {
  double height[3];  ///< over the edge opposite corner k (m)
  double angle[3];   ///< at corner k
};

FaceShape shape_of(const TriangleMesh& mesh, std::uint32_t face) {
  const auto corners = mesh.corners(face);
  FaceShape shape{};
  const double twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 one = corners[(k + 1) % 3] - corners[k];
    const Vec3 other = corners[(k + 2) % 3] - corners[k];
    shape.height[k] = twice_area / (corners[(k + 2) % 3] - corners[(k + 1) % 3]).norm();
    shape.angle[k] = std::atan2(one.cross(other).norm(), one.dot(other));
  }
  return shape;
}

/// Edge opposite corner k, in the mesh's own numbering of edges.
constexpr int edge_opposite(int corner) {
  return (corner + 1) % 3;
}

// As many as make starting a thread pay.
constexpr std::size_t stitched_a_share = 1024;

/// Calls set(face) for each, or set(vertex), on all cores.
template <class Set>
void for_all(std::size_t count, const Set& set) {
  parallel_for(count, {.grain = stitched_a_share}, [&](std::size_t i) { set(static_cast<std::uint32_t>(i)); });
}

using Widths = UnsetVector<std::array<double, 3>>;
using Shapes = UnsetVector<FaceShape>;

/// How far from each vertex (m) a face around it may still have a say. Around a vertex a band of width w meets the far
/// side of a corner of angle a within w / sin(a / 2); folds turn angles a little, which the factor leaves room for.
UnsetVector<double> reaches(const TriangleMesh& mesh, const Widths& widths, const Shapes& shapes) {
  constexpr double room = 1.5;
  UnsetVector<double> reach(mesh.positions().size());
  for_all(reach.size(), [&](std::uint32_t vertex) {
    double widest = 0.0;
    double sharpest = 1.0;
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
      const std::size_t k = mesh.corner_of(face, vertex);
      widest = std::max({widest, widths[face][(k + 1) % 3], widths[face][(k + 2) % 3]});
      sharpest = std::min(sharpest, std::sin(0.5 * std::min(shapes[face].angle[k], 1.57)));
    }
    reach[vertex] = room * widest / std::max(sharpest, 1e-6);
  });
  return reach;
}

/// How far into `face`, against how far into `other`, a place of `face` lies beyond their common edge when it is seen
/// along the directions there: 1 where those are symmetric, the least within `most` (coordinate of the corner opposite
/// the edge) of it.
double mirror_ratio(const TriangleMesh& mesh, const Shell& shell, std::uint32_t face, int corner, std::uint32_t other,
                    double most) {
  const TriangleMesh::Triangle& t = mesh.triangles()[face];
  const std::uint32_t ends[2] = {t[static_cast<std::size_t>((corner + 1) % 3)],
                                 t[static_cast<std::size_t>((corner + 2) % 3)]};
  const Vec3 opposite = shell.directions[t[static_cast<std::size_t>(corner)]].cast<double>();
  const Vec3 along = (mesh.positions()[ends[1]] - mesh.positions()[ends[0]]).normalized();
  const Vec3 normal = mesh.face_normal(other);
  const Vec3 into = mesh.face_normal(face).cross(along);
  const Vec3 into_other = -normal.cross(along);
  double least = 1.0;
  // A quotient of what is linear in the place: least at a corner of the strip.
  for (const std::uint32_t end : ends) {
    const Vec3 at_edge = shell.directions[end].cast<double>();
    for (const double off : {0.0, most}) {
      const Vec3 direction = at_edge + off * (opposite - at_edge);
      const double seen = normal.dot(direction);
      if (seen <= 0.0) return 0.0;
      least = std::min(least, -into_other.dot(into) + normal.dot(into) * into_other.dot(direction) / seen);
    }
  }
  return least;
}

/// Where the coordinate of a corner is below this the face across the opposite edge may have a say.
float look_across(const TriangleMesh& mesh, const Shell& shell, std::uint32_t face, int corner, double rho) {
  constexpr double least_ratio = 0.25;
  constexpr double room = 1.01;
  const std::uint32_t other = mesh.neighbour(face, edge_opposite(corner));
  double look = room * rho;
  // The farther one looks the more the directions have turned.
  for (int round = 0; other != no_index && round < 2; ++round)
    look = room * rho / std::max(least_ratio, mirror_ratio(mesh, shell, face, corner, other, look));
  return static_cast<float>(look);
}

/// The faces around a vertex, seen along its direction.
struct Fan {
  struct Wedge {
    std::uint32_t face;
    std::size_t corner;  ///< of the vertex
    Vec2 first;          ///< where the edge from it to the next corner leads (m)
    Vec2 second;
    double area;  ///< twice (m^2): below 0 seen from behind
  };
  FixedVector<Wedge, 24> wedges;
};

double cross_of(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// False where there are more faces than a fan holds.
bool look_at_fan(const TriangleMesh& mesh, std::uint32_t vertex, const Vec3& direction, Fan& fan) {
  fan.wedges.clear();
  const Vec3 right = direction.unitOrthogonal();
  const Vec3 up = direction.normalized().cross(right);
  const auto faces = mesh.faces_of_vertex(vertex);
  if (faces.size() > fan.wedges.capacity()) return false;
  for (const std::uint32_t face : faces) {
    const std::size_t k = mesh.corner_of(face, vertex);
    const auto corners = mesh.corners(face);
    const auto seen = [&](const Vec3& edge) { return Vec2(edge.dot(right), edge.dot(up)); };
    const Vec2 first = seen(corners[(k + 1) % 3] - corners[k]);
    const Vec2 second = seen(corners[(k + 2) % 3] - corners[k]);
    fan.wedges.push_back({face, k, first, second, cross_of(first, second)});
  }
  return true;
}

/// Up to which 1 - coordinate of the vertex another face of the fan may have a say in one of them; infinite where no
/// end is seen.
double say_of(const Fan::Wedge& other, const Fan::Wedge& own, const float* rho) {
  if (!(other.area > 0.0) || !(own.area > 0.0)) return std::numeric_limits<double>::infinity();
  // How fast the two coordinates of the other face that are 0 at the vertex fall, against what its bands let them,
  // along both edges of the own one: it has a say up to where the faster one is there.
  const auto fall = [&](const Vec2& way) {
    return Vec2(-cross_of(way, other.second) / (other.area * static_cast<double>(rho[(other.corner + 1) % 3])),
                -cross_of(other.first, way) / (other.area * static_cast<double>(rho[(other.corner + 2) % 3])));
  };
  const Vec2 along_first = fall(own.first);
  const Vec2 along_second = fall(own.second);
  double slowest = std::min(along_first.maxCoeff(), along_second.maxCoeff());
  // Between the edges where both are as fast.
  const Vec2 change = along_second - along_first;
  const double apart = change.x() - change.y();
  const double share = (along_first.y() - along_first.x()) / apart;
  if (apart != 0.0 && share > 0.0 && share < 1.0) slowest = std::min(slowest, along_first.x() + share * change.x());
  return slowest > 0.0 ? 1.0 / slowest : std::numeric_limits<double>::infinity();
}

void narrow_reaches_around(std::uint32_t vertex, const TriangleMesh& mesh, const Shell& shell,
                           std::vector<StitchBand>& bands) {
  // A corner that is no larger is a hundredth of its face.
  constexpr float worth_it = 0.1F;
  // For directions that turn within the corner.
  constexpr double room = 1.25;
  const auto faces = mesh.faces_of_vertex(vertex);
  const bool wide = std::any_of(faces.begin(), faces.end(), [&](std::uint32_t face) {
    return bands[face].reach[mesh.corner_of(face, vertex)] > worth_it;
  });
  Fan fan;
  if (!wide || !look_at_fan(mesh, vertex, shell.directions[vertex].cast<double>(), fan)) return;
  for (const Fan::Wedge& own : fan.wedges) {
    float& reach = bands[own.face].reach[own.corner];
    if (reach <= worth_it) continue;
    double farthest = 0.0;
    for (const Fan::Wedge& other : fan.wedges) {
      if (other.face == own.face || mesh.neighbour(own.face, static_cast<int>(own.corner)) == other.face ||
          mesh.neighbour(own.face, static_cast<int>((own.corner + 2) % 3)) == other.face)
        continue;
      farthest = std::max(farthest, say_of(other, own, bands[other.face].rho));
    }
    reach = static_cast<float>(std::min(static_cast<double>(reach), room * farthest));
  }
}

}  // namespace

Status validate(const Stitching& stitching) {
  if (!(stitching.rho > 0.0 && stitching.rho <= 1.0 / 3.0)) {
    return bad_value(fmt::format("is {:g}", stitching.rho), "rho",
                     "a width above 0, at most 1/3 of a triangle's height");
  }
  if (stitching.folds == FoldMode::fillet &&
      !(stitching.fillet_radius > 0.0 && std::isfinite(stitching.fillet_radius))) {
    return bad_value(fmt::format("is {:g} m", stitching.fillet_radius), "fillet_radius", "a radius above 0 m");
  }
  if (!(stitching.most_rounding >= 0.0)) {
    return bad_value(fmt::format("is {:g} m", stitching.most_rounding), "most_rounding", "a length of 0 m or more");
  }
  if (stitching.blend != Blend::image) return success();
  if (stitching.blend_map.size() < 2) {
    return bad_value(fmt::format("has {} weights", stitching.blend_map.size()), "blend_map",
                     "at least two weights, from outside to inside");
  }
  for (const double weight : stitching.blend_map) {
    if (!(weight >= 0.0 && weight <= 1.0)) {
      return bad_value(fmt::format("holds the weight {:g}", weight), "blend_map", "weights from 0 to 1");
    }
  }
  if (stitching.blend_map.back() <= 0.0) {
    return bad_value("ends in 0", "blend_map", "a last weight (inside the face) above 0");
  }
  return success();
}

BlendValue blend_value(const Stitching& stitching, double rho, double barycentric) noexcept {
  if (stitching.blend == Blend::none || rho <= 0.0) return {barycentric >= 0.0 ? 1.0 : 0.0, 0.0, 0.0};
  const double per = 1.0 / (2.0 * rho);
  const double t = std::clamp((barycentric + rho) * per, 0.0, 1.0);
  const bool within = t > 0.0 && t < 1.0;
  switch (stitching.blend) {
    case Blend::linear: return {t, within ? per : 0.0, 0.0};
    case Blend::s_shape:
      return {t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) * per, within ? (6.0 - 12.0 * t) * per * per : 0.0};
    case Blend::quintic:
      return {t * t * t * (10.0 + t * (6.0 * t - 15.0)), 30.0 * t * t * (1.0 - t) * (1.0 - t) * per,
              60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) * per * per};
    default: break;
  }
  const auto last = static_cast<double>(stitching.blend_map.size() - 1);
  const auto cell = static_cast<std::size_t>(std::min(t * last, last - 1.0));
  const double rise = stitching.blend_map[cell + 1] - stitching.blend_map[cell];
  return {stitching.blend_map[cell] + (t * last - static_cast<double>(cell)) * rise, within ? rise * last * per : 0.0,
          0.0};
}

std::vector<StitchBand> stitch_bands(const TriangleMesh& mesh, const Shell& shell, double rho) {
  const std::size_t faces = mesh.triangles().size();
  Shapes shapes(faces);
  for_all(faces, [&](std::uint32_t face) { shapes[face] = shape_of(mesh, face); });
  Widths widths(faces);
  for_all(faces, [&](std::uint32_t face) {
    for (int k = 0; k < 3; ++k) {
      double least = shapes[face].height[k];
      const std::uint32_t other = mesh.neighbour(face, edge_opposite(k));
      for (int j = 0; other != no_index && j < 3; ++j) {
        if (mesh.neighbour(other, edge_opposite(j)) == face) least = std::min(least, shapes[other].height[j]);
      }
      widths[face][static_cast<std::size_t>(k)] = rho * least;
    }
  });
  // The say of the faces around a vertex must end well before the opposite edges.
  constexpr double most_of_height = 0.45;
  UnsetVector<double> reach = reaches(mesh, widths, shapes);
  UnsetVector<double> share(reach.size());
  for_all(share.size(), [&](std::uint32_t vertex) {
    double least = 1.0;
    for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
      const double height = shapes[face].height[mesh.corner_of(face, vertex)];
      if (reach[vertex] > 0.0) least = std::min(least, most_of_height * height / reach[vertex]);
    }
    share[vertex] = least;
  });
  for_all(faces, [&](std::uint32_t face) {
    const TriangleMesh::Triangle& t = mesh.triangles()[face];
    for (std::size_t k = 0; k < 3; ++k) widths[face][k] *= std::min(share[t[(k + 1) % 3]], share[t[(k + 2) % 3]]);
  });
  reach = reaches(mesh, widths, shapes);
  std::vector<StitchBand> bands(faces);
  for_all(faces, [&](std::uint32_t face) {
    for (std::size_t k = 0; k < 3; ++k) {
      bands[face].rho[k] = static_cast<float>(widths[face][k] / shapes[face].height[k]);
      bands[face].look[k] =
          look_across(mesh, shell, face, static_cast<int>(k), static_cast<double>(bands[face].rho[k]));
      bands[face].reach[k] =
          static_cast<float>(std::min(1.0, reach[mesh.triangles()[face][k]] / shapes[face].height[k]));
    }
  });
  return bands;
}

void narrow_reaches(const TriangleMesh& mesh, const Shell& shell, std::vector<StitchBand>& bands) {
  for_all(mesh.positions().size(), [&](std::uint32_t vertex) { narrow_reaches_around(vertex, mesh, shell, bands); });
}

}  // namespace asperity
