#include "asperity/surface/shell.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "asperity/core/parallel_for.h"
#include "asperity/core/processor.h"
#include "asperity/surface/detail/four.h"

namespace asperity {

namespace {

// Directions longer than this would magnify a relief sideways at spikes more than its height is worth.
constexpr double longest_direction = 3.0;
// Least cosine-like product N . n that a direction must keep with every face around it.
constexpr double least_product = 0.1;

struct WeightedNormal {
  Vec3 normal;
  double weight;
};

using NormalsAround = std::span<const WeightedNormal>;

/// `corners`: of all faces. `around` is filled anew.
void find_normals_around(const TriangleMesh& mesh, std::uint32_t vertex, std::span<const FaceCorners> corners,
                         std::vector<WeightedNormal>& around) {
  around.clear();
  for (const std::uint32_t face : mesh.faces_of_vertex(vertex))
    around.push_back({corners[face].normal, corners[face].angle[mesh.corner_of(face, vertex)]});
}

double least_normal_product(NormalsAround around, const Vec3& direction) {
  double least = infinity;
  for (const WeightedNormal& face : around) least = std::min(least, face.normal.dot(direction));
  return least;
}

/// Length that brings N . n to 1 in the mean of squares, for a given direction.
Vec3 scaled(NormalsAround around, const Vec3& direction) {
  double once = 0.0;
  double twice = 0.0;
  for (const WeightedNormal& face : around) {
    const double product = face.normal.dot(direction);
    once += face.weight * product;
    twice += face.weight * product * product;
  }
  const double length = twice > 0.0 ? once / twice : 1.0;
  return std::clamp(length, 0.5, longest_direction) * direction;
}

/// The faces around four vertices, one of each at a time. A vertex with fewer of them than another has some of no
/// weight.
class FourFans {
 public:
  using Wide = four::Wide;
  using Vectors = four::Vectors;

  ASPERITY_FOUR FourFans(const TriangleMesh& mesh, const FaceCorners* corners, const std::uint32_t (&vertices)[4])
      : mesh_(mesh), corners_(corners), vertices_(vertices) {
    for (std::size_t i = 0; i < 4; ++i) {
      faces_[i] = mesh.faces_of_vertex(vertices[i]);
      most_ = std::max(most_, faces_[i].size());
    }
  }
  ASPERITY_FOUR void vertex_normals(Vectors& normal) const {
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 own = mesh_.vertex_normal(vertices_[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) normal[axis][i] = own[static_cast<Eigen::Index>(axis)];
    }
  }
  [[nodiscard]] ASPERITY_FOUR std::size_t size() const { return most_; }
  ASPERITY_FOUR void at(std::size_t j, Vectors& normal, Wide& weight) const {
    static const FaceCorners nothing{Vec3::Zero(), {0.0, 0.0, 0.0}};
    const FaceCorners* of[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const bool is = j < faces_[i].size();
      of[i] = is ? corners_ + faces_[i][j] : &nothing;
      weight[i] = is ? of[i]->angle[mesh_.corner_of(faces_[i][j], vertices_[i])] : 0.0;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto x = static_cast<Eigen::Index>(axis);
      normal[axis] = Wide{of[0]->normal[x], of[1]->normal[x], of[2]->normal[x], of[3]->normal[x]};
    }
  }
  ASPERITY_FOUR void least_product(const Vectors& direction, Wide& least) const {
    least = Wide{} + infinity;
    for (std::size_t j = 0; j < most_; ++j) {
      Vectors normal;
      Wide weight;
      at(j, normal, weight);
      Wide product;
      four::dot(normal, direction, product);
      for (std::size_t i = 0; i < 4; ++i) product[i] = j < faces_[i].size() ? product[i] : infinity;
      four::keep_smaller(least, product);
    }
  }

 private:
  const TriangleMesh& mesh_;
  const FaceCorners* corners_;
  const std::uint32_t (&vertices_)[4];
  std::span<const std::uint32_t> faces_[4];
  std::size_t most_ = 0;
};

/// Least squares of N . n = 1, held to the vertex normal where the faces leave N free (flat surroundings), for four
/// vertices.
ASPERITY_FOUR void solve_least_squares(const FourFans& fans, four::Vectors& direction) {
  using four::Vectors;
  using four::Wide;
  constexpr double hold = 1e-3;
  Vectors normal;
  fans.vertex_normals(normal);
  // The matrix is symmetric: its upper half.
  Wide xx{}, xy{}, xz{}, yy{}, yz{}, zz{}, total{}, once{}, twice{};
  Vectors right{};
  for (std::size_t j = 0; j < fans.size(); ++j) {
    Vectors n;
    Wide weight;
    fans.at(j, n, weight);
    const Vectors weighted = {weight * n[0], weight * n[1], weight * n[2]};
    xx += weighted[0] * n[0];
    xy += weighted[0] * n[1];
    xz += weighted[0] * n[2];
    yy += weighted[1] * n[1];
    yz += weighted[1] * n[2];
    zz += weighted[2] * n[2];
    for (std::size_t axis = 0; axis < 3; ++axis) right[axis] += weighted[axis];
    total += weight;
    Wide product;
    four::dot(n, normal, product);
    once += weight * product;
    twice += weight * product * product;
  }
  // As `scaled` does it.
  const Wide zero{};
  Wide length = twice > 0.0 ? once / twice : zero + 1.0;
  length = length < 0.5 ? zero + 0.5 : (length > longest_direction ? zero + longest_direction : length);
  xx += hold * total;
  yy += hold * total;
  zz += hold * total;
  for (std::size_t axis = 0; axis < 3; ++axis) right[axis] += hold * total * (length * normal[axis]);
  const Vectors first = {yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy};
  const Vectors second = {first[1], xx * zz - xz * xz, xy * xz - xx * yz};
  const Vectors third = {first[2], second[2], xx * yy - xy * xy};
  const Wide det = xx * first[0] + xy * first[1] + xz * first[2];
  four::dot(first, right, direction[0]);
  four::dot(second, right, direction[1]);
  four::dot(third, right, direction[2]);
  for (std::size_t axis = 0; axis < 3; ++axis) direction[axis] = total == 0.0 ? normal[axis] : direction[axis] / det;
}

/// The four directions by least squares, and whether each is safe, a bit each.
ASPERITY_FOUR unsigned least_squares_of_four(const TriangleMesh& mesh, const FaceCorners* corners,
                                             const std::uint32_t (&vertices)[4], Vec3 (&directions)[4]) {
  const FourFans fans(mesh, corners, vertices);
  four::Vectors direction;
  solve_least_squares(fans, direction);
  four::Wide least;
  fans.least_product(direction, least);
  four::Wide size;
  four::dot(direction, direction, size);
  four::square_root(size, size);
  unsigned safe = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    directions[i] = {direction[0][i], direction[1][i], direction[2][i]};
    safe |= least[i] >= least_product && size[i] <= longest_direction ? 1U << i : 0U;
  }
  return safe;
}

using LeastSquaresOfFour = unsigned (*)(const TriangleMesh& mesh, const FaceCorners* corners,
                                        const std::uint32_t (&vertices)[4], Vec3 (&directions)[4]);
unsigned least_squares_plain(const TriangleMesh& mesh, const FaceCorners* corners, const std::uint32_t (&vertices)[4],
                             Vec3 (&directions)[4]) {
  return least_squares_of_four(mesh, corners, vertices, directions);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) unsigned least_squares_avx2(const TriangleMesh& mesh, const FaceCorners* corners,
                                                            const std::uint32_t (&vertices)[4], Vec3 (&directions)[4]) {
  return least_squares_of_four(mesh, corners, vertices, directions);
}
#endif
LeastSquaresOfFour best_least_squares() noexcept {
#if defined(__x86_64__)
  if (has_avx2()) return least_squares_avx2;
#endif
  return least_squares_plain;
}

/// The direction whose least product with the normals around is largest, by pulling towards the worst one.
Vec3 most_seen(NormalsAround around, const Vec3& start) {
  Vec3 best = start;
  double best_product = least_normal_product(around, start);
  Vec3 direction = start;
  for (int i = 1; i <= 400; ++i) {
    const auto worst = std::min_element(around.begin(), around.end(), [&](const auto& a, const auto& b) {
      return a.normal.dot(direction) < b.normal.dot(direction);
    });
    direction = (direction + worst->normal / (1.0 + 0.25 * i)).normalized();
    const double product = least_normal_product(around, direction);
    if (product > best_product) {
      best_product = product;
      best = direction;
    }
  }
  return best;
}

/// Real roots of a h^2 + b h + c other than infinite ones, by the form that does not cancel; answers how many.
int quadratic_roots(double a, double b, double c, double roots[2]) noexcept {
  const double discriminant = b * b - 4.0 * a * c;
  if (discriminant < 0.0) return 0;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  int count = 0;
  if (a != 0.0) roots[count++] = q / a;
  if (q != 0.0) roots[count++] = c / q;
  return count;
}

/// Interval around 0 on which c0 + c1 h + c2 h^2 stays above `share` of c0 (> 0), cut into `interval`.
void cut_by_quadratic(double c0, double c1, double c2, ShellInterval& interval) {
  // What is left of the volume where the shell is squeezed most; the rest is margin against its folding over.
  constexpr double share = 0.05;
  const double c = (1.0 - share) * c0;
  double roots[2] = {infinity, infinity};
  if (std::abs(c2) * interval.upper * interval.upper <= 1e-14 * c0 &&
      std::abs(c2) * interval.lower * interval.lower <= 1e-14 * c0) {
    if (c1 != 0.0) roots[0] = -c / c1;
  } else {
    quadratic_roots(c2, c1, c, roots);
  }
  for (const double root : roots) {
    if (root > 0.0) interval.upper = std::min(interval.upper, root);
    if (root < 0.0) interval.lower = std::max(interval.lower, root);
  }
}

/// Real roots of a h^3 + b h^2 + c h + d.
int cubic_roots(double a, double b, double c, double d, double roots[3]) noexcept {
  const double size = std::abs(a) + std::abs(b) + std::abs(c) + std::abs(d);
  if (std::abs(a) <= 1e-14 * size) {
    if (std::abs(b) <= 1e-14 * size) {
      if (c == 0.0) return 0;
      roots[0] = -d / c;
      return 1;
    }
    return quadratic_roots(b, c, d, roots);
  }
  const double p = b / (3.0 * a);
  const double q = (c / a - 3.0 * p * p) / 3.0;
  const double r = 0.5 * (d / a - p * (c / a) + 2.0 * p * p * p);
  const double discriminant = q * q * q + r * r;
  if (discriminant > 0.0) {
    const double s = std::sqrt(discriminant);
    roots[0] = std::cbrt(-r + s) + std::cbrt(-r - s) - p;
    return 1;
  }
  const double radius = 2.0 * std::sqrt(std::max(0.0, -q));
  const double third =
      radius > 0.0 ? std::acos(std::clamp(-8.0 * r / (radius * radius * radius), -1.0, 1.0)) / 3.0 : 0.0;
  for (int k = 0; k < 3; ++k) roots[k] = radius * std::cos(third + 2.0 * std::numbers::pi * k / 3.0) - p;
  return 3;
}

/// Moves each direction towards the mean of its neighbours' as far as every face around still sees it. `corners`: of
/// all faces.
void relax(const TriangleMesh& mesh, std::span<const FaceCorners> corners, std::vector<Vec3>& directions) {
  constexpr int rounds = 30;
  const ParallelSettings shares{.grain = 1024};
  struct alignas(64) Scratch {
    std::vector<WeightedNormal> around;
  };
  std::vector<Scratch> scratch(parallel_workers(directions.size(), shares));
  std::vector<Vec3> next(directions.size());
  for (int round = 0; round < rounds; ++round) {
    parallel_for(directions.size(), shares, [&](std::size_t i, unsigned worker) {
      const auto vertex = static_cast<std::uint32_t>(i);
      std::vector<WeightedNormal>& around = scratch[worker].around;
      find_normals_around(mesh, vertex, corners, around);
      next[i] = directions[i];
      if (around.empty()) return;
      Vec3 sum = Vec3::Zero();
      double count = 0.0;
      for (const std::uint32_t face : mesh.faces_of_vertex(vertex)) {
        const TriangleMesh::Triangle& t = mesh.triangles()[face];
        const std::size_t k = mesh.corner_of(face, vertex);
        sum += directions[t[(k + 1) % 3]] + directions[t[(k + 2) % 3]];
        count += 2.0;
      }
      const Vec3 moved = scaled(around, (directions[i] + sum / count).normalized());
      // A height over each face may then differ from the metric one by a third at most.
      if (least_normal_product(around, moved) > std::min(0.67, 0.9 * least_normal_product(around, directions[i])))
        next[i] = moved;
    });
    std::swap(directions, next);
  }
}

}  // namespace

bool ShellPrism::invert(const Vec3& p, ShellPlace& place) const noexcept {
  constexpr int most_steps = 16;
  for (int i = 0; i < most_steps; ++i) {
    const Vec3 du = edge_u + place.height * turn_u;
    const Vec3 dv = edge_v + place.height * turn_v;
    const Vec3 dh = direction_at(place.u, place.v);
    const Vec3 rest = p - base_at(place.u, place.v) - place.height * dh;
    const Vec3 across = du.cross(dv);
    const double det = across.dot(dh);
    if (!(std::abs(det) > 0.0)) return false;
    const double per = 1.0 / det;
    const Vec3 turned = rest.cross(dh);
    const double step_u = -dv.dot(turned) * per;
    const double step_v = du.dot(turned) * per;
    const double step_h = across.dot(rest) * per;
    place.u += step_u;
    place.v += step_v;
    place.height += step_h;
    // In u and v an edge is 1; heights are measured by the triangle's size, the root of its area.
    const double plane = std::abs(step_u) + std::abs(step_v);
    const double area = across.squaredNorm();
    const double square = step_h * step_h;
    const auto within = [&](double size) {
      return plane <= size && square * square <= area * (size * size) * (size * size);
    };
    if (within(enough_of_step)) return determinant(place) > 0.0;
    if (!within(far_of_step)) return false;
  }
  return false;
}

bool ShellPrism::invert_anew(const Vec3& p, ShellPlace& place) const noexcept {
  const Vec3 offset = p - corner;
  // (offset - h direction) . ((edge_u + h turn_u) x (edge_v + h turn_v)) = 0
  const Vec3 c0 = edge_u.cross(edge_v);
  const Vec3 c1 = edge_u.cross(turn_v) + turn_u.cross(edge_v);
  const Vec3 c2 = turn_u.cross(turn_v);
  double roots[3];
  const int count = cubic_roots(-direction.dot(c2), offset.dot(c2) - direction.dot(c1),
                                offset.dot(c1) - direction.dot(c0), offset.dot(c0), roots);
  double best = -infinity;
  for (int i = 0; i < count; ++i) {
    const Vec3 along_u = edge_u + roots[i] * turn_u;
    const Vec3 along_v = edge_v + roots[i] * turn_v;
    const Vec3 normal = along_u.cross(along_v);
    const Vec3 inside = offset - roots[i] * direction;
    const double area = normal.squaredNorm();
    if (!(area > 0.0)) continue;
    ShellPlace at{inside.cross(along_v).dot(normal) / area, along_u.cross(inside).dot(normal) / area, roots[i]};
    if (!invert(p, at)) continue;
    const double insideness = at.barycentric().minCoeff();
    if (insideness <= best) continue;
    best = insideness;
    place = at;
  }
  return best > -infinity;
}

ShellGradients shell_gradients(const ShellPrism& prism, const ShellPlace& at) noexcept {
  const Vec3 du = prism.edge_u + at.height * prism.turn_u;
  const Vec3 dv = prism.edge_v + at.height * prism.turn_v;
  const Vec3 dh = prism.direction_at(at.u, at.v);
  const Vec3 across = du.cross(dv);
  const double per = 1.0 / across.dot(dh);
  return {per * dv.cross(dh), per * dh.cross(du), per * across};
}

ShellInterval ShellPrism::injective(double margin, double limit) const noexcept {
  ShellInterval interval{-limit, limit};
  const Vec3 c0 = edge_u.cross(edge_v);
  const Vec3 c1 = edge_u.cross(turn_v) + turn_u.cross(edge_v);
  const Vec3 c2 = turn_u.cross(turn_v);
  for (int k = 0; k < 3; ++k) {
    const double u = k == 1 ? 1.0 + 2.0 * margin : -margin;
    const double v = k == 2 ? 1.0 + 2.0 * margin : -margin;
    const Vec3 n = direction_at(u, v);
    if (!(n.dot(c0) > 0.0)) return {0.0, 0.0};
    cut_by_quadratic(n.dot(c0), n.dot(c1), n.dot(c2), interval);
  }
  return interval;
}

bool ShellPrism::holds(double margin, double limit) const noexcept {
  const Vec3 c0 = edge_u.cross(edge_v);
  const Vec3 c1 = edge_u.cross(turn_v) + turn_u.cross(edge_v);
  const Vec3 c2 = turn_u.cross(turn_v);
  // With room to spare against what `injective` leaves of the volume.
  constexpr double share = 0.9;
  for (int k = 0; k < 3; ++k) {
    const Vec3 n = direction_at(k == 1 ? 1.0 + 2.0 * margin : -margin, k == 2 ? 1.0 + 2.0 * margin : -margin);
    if (!(std::abs(n.dot(c1)) * limit + std::abs(n.dot(c2)) * limit * limit < share * n.dot(c0))) return false;
  }
  return true;
}

Shell Shell::build(const TriangleMesh& mesh, ShellDirections how) {
  Shell shell;
  const std::size_t count = mesh.positions().size();
  const bool relaxed = how == ShellDirections::relaxed;
  shell.directions.resize(count);
  std::vector<Vec3> directions(relaxed ? count : 0);
  const UnsetVector<FaceCorners> corners = mesh.face_corners();
  const ParallelSettings shares{.grain = 256};
  // Each thread's on cache lines of its own.
  struct alignas(64) Found {
    std::vector<WeightedNormal> around;  ///< scratch
    std::vector<std::uint32_t> blind;
    std::uint32_t turned = 0;
  };
  std::vector<Found> found(parallel_workers((count + 3) / 4, shares));
  const LeastSquaresOfFour least_squares = best_least_squares();
  parallel_for((count + 3) / 4, shares, [&](std::size_t group, unsigned worker) {
    auto& [here, blind, turned] = found[worker];
    std::uint32_t vertices[4];
    for (std::size_t i = 0; i < 4; ++i) vertices[i] = static_cast<std::uint32_t>(std::min(4 * group + i, count - 1));
    Vec3 around[4];
    const unsigned safe = least_squares(mesh, corners.data(), vertices, around);
    for (std::size_t i = 0; i < std::min<std::size_t>(4, count - 4 * group); ++i) {
      if ((safe >> i & 1U) == 0) {
        find_normals_around(mesh, vertices[i], corners, here);
        const Vec3 seen = most_seen(here, mesh.vertex_normal(vertices[i]));
        around[i] = scaled(here, seen);
        ++turned;
        if (least_normal_product(here, seen) <= 1e-3) blind.push_back(vertices[i]);
      }
      shell.directions[vertices[i]] = around[i].cast<float>();
      if (relaxed) directions[vertices[i]] = around[i];
    }
  });
  for (const Found& one : found) {
    shell.turned_vertices += one.turned;
    shell.blind_vertices.insert(shell.blind_vertices.end(), one.blind.begin(), one.blind.end());
  }
  std::sort(shell.blind_vertices.begin(), shell.blind_vertices.end());
  if (!relaxed) return shell;
  relax(mesh, corners, directions);
  for (std::size_t i = 0; i < count; ++i) shell.directions[i] = directions[i].cast<float>();
  return shell;
}

}  // namespace asperity
