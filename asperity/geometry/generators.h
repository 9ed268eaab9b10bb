#pragma once
// Meshes made from a formula: the trial meshes of hrm-2010 (Table 1), and the shapes that tests and first runs need.
//
// Lengths are metres, angles radians; every answer has corner UVs and is built with TriangleMesh::build at scale 1.
// A parameter outside its stated range is moved to the nearer end of it (not-a-number: the lower end), so that a
// generator always answers a mesh. Open meshes turn their touched side (the normals) towards +z.

#include <cstdint>
#include <functional>
#include <numbers>
#include <span>

#include "asperity/core/names.h"
#include "asperity/geometry/mesh.h"

namespace asperity {

/// M_d,j (hrm-2010, Table 1): a sphere of 20 * 4^subdivisions triangles around the origin, every vertex on the sphere.
/// Closed, outward. UVs per face, so that each face carries the map: corners (0, 0), (1, 0), (1/2, sqrt(3)/2), the
/// undistorted part of the map in an equilateral triangle. `subdivisions` 0 to 9; `radius` 1e-9 to 1e9 m. [build]
MeshSource icosphere(int subdivisions, double radius);

/// The radius (m) at which `icosphere(subdivisions, radius)` has the mean edge length `mean_edge` (m). [build]
double icosphere_radius_for_edge(int subdivisions, double mean_edge);

/// A rectangle in z = 0 centred on the origin, `width` along x and `depth` along y (1e-9 to 1e9 m), cut into
/// 2 * columns * rows right triangles. UVs run once over the whole rectangle, (0, 0) at its lower left, so that a map
/// lies the same however the rectangle is cut. The shorter side is at least 1e-7 of the longer. `columns`, `rows` 1 to
/// 2048. [build]
MeshSource plane_grid(double width, double depth, int columns, int rows);

/// The same cut into exactly `triangles` right triangles (2 to 4,194,304; an odd count loses one), with cells as square
/// as the divisors of the count allow. [build]
MeshSource plane_grid(double width, double depth, std::uint32_t triangles);

/// Size of the regular trial meshes.
struct TrialMeshSettings {
  int columns = 8;          ///< pairs of triangles in a strip along x; 1 to 1000
  int rows = 8;             ///< strips along y; 1 to 1000
  double mean_edge = 0.01;  ///< mean edge length of the whole mesh (m); 1e-9 to 1e9
};

/// M_a (hrm-2010, Table 1): open, flat, in z = 0, `rows` strips of 2 * columns equilateral triangles, centred on the
/// origin. Every other vertex row is shifted by half an edge. UVs run once over the bounding rectangle. [build]
MeshSource trial_mesh_a(const TrialMeshSettings& settings = {});

/// How M_b is bent.
///   dome  along every edge: laid on a sphere. Folds of 45 degrees are an icosahedron's: beyond a few triangles they
///   close
///         around it
///   arch  along the rows: the triangles stay M_a's own, edges within a strip stay flat, and the largest fold still
///   leaves
///         an open sheet of any size
enum class TrialBend { dome, arch };
/// As in scene files.
template <>
struct Names<TrialBend> {
  static constexpr auto table = std::to_array<Named<TrialBend>>({{TrialBend::dome, "dome"}, {TrialBend::arch, "arch"}});
};

/// M_b (hrm-2010, Table 1): M_a as a softly convex surface. Folds are exterior angles, measured through the solid: 180
/// degrees is flat, 225 a bend of 45. Every inner edge folds by 180 to 180 degrees + `largest_fold`, largest in the
/// middle. A dome's lattice is laid on a sphere by inverse stereographic projection, which keeps circles and so keeps
/// the triangles near equilateral and the (Delaunay) mesh convex; all its folds are more than 180 degrees. An arch's
/// folds halve from one row to the next on both sides of the middle one.
/// `largest_fold` 1e-3 to pi/4. UVs those of M_a. [build]
MeshSource trial_mesh_b(double largest_fold = std::numbers::pi / 30.0, const TrialMeshSettings& settings = {},
                        TrialBend bend = TrialBend::dome);

/// M_c (hrm-2010, Table 1): M_a folded along its rows into a corrugated sheet that never overhangs. `ridge_angles` are
/// the angles between the two faces at the ridges, in turn, pi/18 to pi each; none: 60, 90, 120 degrees (acute, square,
/// obtuse). Both sides of a ridge slope alike, so that the angle in a valley is the mean of its two ridges' (75, 105,
/// 90); edges within a strip stay flat. Faces stay equilateral. UVs those of M_a. [build]
MeshSource trial_mesh_c(const TrialMeshSettings& settings = {}, std::span<const double> ridge_angles = {});

/// M_e (hrm-2010, Table 1): an open cup without wall thickness, part of a sphere around the origin below a plane rim,
/// opening towards +z. Normals point to the sphere's centre: the inside of the cup is the touched side, and every inner
/// edge is concave. 6 * rings^2 triangles in rings around the bottom.
/// `opening`: angle from the bottom to the rim seen from the centre, 0.1 to 3.0; pi/2 is a hemisphere. `rings` 1 to
/// 512; `mean_edge` 1e-9 to 1e9 m. UVs: the rings laid flat in a disc of diameter 1. [build]
MeshSource trial_mesh_e(int rings = 8, double opening = std::numbers::pi / 2.0, double mean_edge = 0.01);

/// M_f (hrm-2010, Table 1): an open, flat strip of `triangles` similar right triangles in z = 0, from big on the left
/// to small on the right; each has `grading` times the area and sqrt(grading) times the height of the one before. At
/// the paper's grading, one half, they are isosceles. UVs per face: right angle at (0, 0), the others at (1, 0) and
/// (0, 1), so that a map's features shrink with the face. `grading` 0.1 to 0.9; `triangles` 1 to
/// most_graded_triangles(grading); `mean_edge` (of the whole mesh) 1e-9 to 1e9 m. [build]
MeshSource trial_mesh_f(int triangles = 10, double mean_edge = 0.01, double grading = 0.5);

/// How many triangles a strip of this grading may have: at most 40, the last with at least 2^-40 of the first's area.
/// [any]
int most_graded_triangles(double grading);

/// Height (m, outward) over the point of a mesh's triangle `face` with these barycentric coordinates.
using HeightOverFace = std::function<double(std::uint32_t face, const Vec3& barycentric)>;

/// Geometry in place of a coat: every triangle of `base` cut into 4^subdivisions similar ones, every vertex moved by
/// `height` along the interpolated vertex normal (of length 1). Where faces share a point it is one vertex, at the mean
/// of their heights, so that the answer is as closed as the base. UVs are the base's, interpolated; none where it has
/// none. `subdivisions` 0 to 10, and so that there are at most most_displaced_triangles. [build]
MeshSource displaced_mesh(const TriangleMesh& base, int subdivisions, const HeightOverFace& height);

/// Bound on the triangles of displaced_mesh.
inline constexpr std::size_t most_displaced_triangles = 4'194'304;

/// M_G (hrm-2010, Table 1): M_b with small triangles that follow a height field in place of its coat; `height` is over
/// the faces of trial_mesh_b(largest_fold, settings), a dome; displaced_mesh makes one of an arch. [build]
MeshSource trial_mesh_g(int subdivisions, const HeightOverFace& height, double largest_fold = std::numbers::pi / 30.0,
                        const TrialMeshSettings& settings = {});

/// A closed box around the origin, outward, 12 triangles; `size` along x, y, z, each 1e-9 to 1e9 m and at least
/// 1e-7 of the longest.
/// UVs: the unit square on each side. [build]
MeshSource box_mesh(const Vec3& size);

/// A random closed blob: the vertices of an icosphere moved along their rays by smooth random bumps and a little noise
/// a vertex. Closed and outward. Every vertex lies within `radius` * (1 -+ `roughness`) of the origin; as all motion is
/// along rays, the mesh is star-shaped around the origin and cannot intersect itself. The same seed answers the same
/// mesh. `subdivisions` 0 to 8; `radius` 1e-9 to 1e9 m; `roughness` 0 to 0.9. UVs those of the icosphere. [build]
MeshSource random_closed_mesh(std::uint64_t seed, int subdivisions, double radius, double roughness);

}  // namespace asperity
