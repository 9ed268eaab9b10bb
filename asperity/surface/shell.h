#pragma once
// Shell coordinates: the space around a triangle mesh as (place on a triangle, height along interpolated directions).

#include <array>
#include <cstdint>
#include <vector>

#include "asperity/core/lanes.h"
#include "asperity/core/math.h"
#include "asperity/core/names.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// A place in the shell of one triangle: the two barycentric coordinates of its second and third corner, and the height
/// (m) along the interpolated direction.
struct ShellPlace {
  double u = 0.0;
  double v = 0.0;
  double height = 0.0;
  [[nodiscard]] Vec3 barycentric() const noexcept { return {1.0 - u - v, u, v}; }
};

/// A closed interval of heights (m) around 0.
struct ShellInterval {
  double lower = 0.0;
  double upper = 0.0;
};

/// Several places of a shell side by side.
struct ShellPlaces {
  Lanes u;
  Lanes v;
  Lanes height;
  std::array<bool, lanes> reached;  ///< by the shell
};

/// One prism of the shell (formulation D2): S(u, v, h) = V(u, v) + h N(u, v), both linear in u and v. Not normalised,
/// so S is a polynomial; neighbours share the directions of their corners, so it is continuous across edges.
struct ShellPrism {
  Vec3 corner;  ///< first corner (m)
  Vec3 edge_u;  ///< second corner - first
  Vec3 edge_v;
  Vec3 direction;  ///< of the first corner; its component along the triangle's normal is about 1
  Vec3 turn_u;     ///< direction of the second corner - that of the first
  Vec3 turn_v;

  // What a step of `invert` is measured by, an edge as 1: the next would be as small against one of this size as that
  // is, far below what faces overlap by; and what is so far off goes nowhere.
  static constexpr double enough_of_step = 3e-7;
  static constexpr double far_of_step = 1e6;

  [[nodiscard]] Vec3 base_at(double u, double v) const noexcept { return corner + u * edge_u + v * edge_v; }
  [[nodiscard]] Vec3 direction_at(double u, double v) const noexcept { return direction + u * turn_u + v * turn_v; }
  [[nodiscard]] Vec3 point(const ShellPlace& at) const noexcept {
    return base_at(at.u, at.v) + at.height * direction_at(at.u, at.v);
  }
  /// det(dS/du, dS/dv, dS/dh): above 0 where the shell does not fold over. [servo]
  [[nodiscard]] double determinant(const ShellPlace& at) const noexcept {
    return (edge_u + at.height * turn_u).cross(edge_v + at.height * turn_v).dot(direction_at(at.u, at.v));
  }

  /// Inverts S by Newton's method from `place` (a guess; the answer is put there). False when it does not converge to a
  /// place where the shell is regular; `place` is then meaningless. [servo]
  [[nodiscard]] bool invert(const Vec3& p, ShellPlace& place) const noexcept;
  /// The same of several points, given by their coordinates x, y and z (m), by AVX2 where the processor has it, which
  /// changes no bit. [servo]
  void invert(const std::array<Lanes, 3>& points, ShellPlaces& places) const noexcept;
  /// The same without a guess: all heights at which p lies in the plane of the triangle moved along the directions are
  /// roots of a cubic; the regular one nearest to the triangle is taken. [servo]
  [[nodiscard]] bool invert_anew(const Vec3& p, ShellPlace& place) const noexcept;
  /// The heights around 0 within which S is one to one on the triangle grown by `margin` (in barycentric coordinates).
  /// For fixed h the determinant is linear over the triangle, so that its three corner values, quadratics in h, decide:
  /// closed form (formulation D2). Empty (lower >= upper) when the shell is folded over at height 0. `limit` (m) bounds
  /// the answer. [build]
  [[nodiscard]] ShellInterval injective(double margin, double limit) const noexcept;
  /// Whether `injective` is known, without roots, to hold all heights within `limit` (m) of the triangle. Nearly every
  /// prism of a relief is: those that are not have to be asked. [build]
  [[nodiscard]] bool holds(double margin, double limit) const noexcept;
};

/// Gradients of the shell coordinates at a place (1/m, 1/m, m/m).
struct ShellGradients {
  Vec3 u;
  Vec3 v;
  Vec3 height;
};
/// Rows of the inverse of S's Jacobian. [servo]
ShellGradients shell_gradients(const ShellPrism& prism, const ShellPlace& at) noexcept;

/// How vertex directions are chosen.
enum class ShellDirections {
  least_squares,  ///< N . n about 1 over the faces around, so that a height is metric over each (amendment 2)
  relaxed,        ///< the same, then smoothed over the mesh where that lets a higher relief fit
};
/// As in scene files.
template <>
struct Names<ShellDirections> {
  static constexpr auto table = std::to_array<Named<ShellDirections>>(
      {{ShellDirections::least_squares, "least_squares"}, {ShellDirections::relaxed, "relaxed"}});
};

/// One direction a vertex, and which vertices have none that all their faces see from the front.
struct Shell {
  std::vector<Vec3f> directions;
  std::vector<std::uint32_t> blind_vertices;  ///< some face has N . n <= 0 whatever N is
  std::uint32_t turned_vertices = 0;          ///< whose least-squares direction had to be replaced by a safer one

  /// [build]
  static Shell build(const TriangleMesh& mesh, ShellDirections how = ShellDirections::least_squares);
  /// The prism over `face`. [servo]
  [[nodiscard]] ShellPrism prism(const TriangleMesh& mesh, std::uint32_t face) const noexcept {
    const TriangleMesh::Triangle& t = mesh.triangles()[face];
    const Vec3& a = mesh.positions()[t[0]];
    const Vec3 n = directions[t[0]].cast<double>();
    return {a, mesh.positions()[t[1]] - a,          mesh.positions()[t[2]] - a,
            n, directions[t[1]].cast<double>() - n, directions[t[2]].cast<double>() - n};
  }
};

}  // namespace asperity
