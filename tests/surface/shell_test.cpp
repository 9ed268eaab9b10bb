// Shell coordinates (formulation D2, amendments 2 and 3): T6, injectivity.

#include "asperity/surface/shell.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>

#include "tests/geometry/random_meshes.h"
#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::shell_test {
namespace {

using namespace test;

const Vec2 whole_triangle[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};

/// Any of the meshes, those that no modeller would be proud of included.
TriangleMesh any_mesh(Rng& rng, std::uint64_t seed) {
  const auto kind = static_cast<int>(rng.below(kinds_of_base + kinds_of_mesh));
  return mesh_of(kind < kinds_of_base ? base_of_kind(kind, seed) : mesh_of_kind(kind - kinds_of_base, seed));
}

/// A place inside the triangle, at a height within `share` of the interval.
ShellPlace random_place(Rng& rng, const ShellInterval& room, double share = 1.0) {
  const Vec3 barycentric = random_barycentric(rng);
  return {barycentric[1], barycentric[2], share * rng.uniform(room.lower, room.upper)};
}

/// How far apart two places are, in mean edges: along the triangle or in height.
double difference(const ShellPrism& prism, const ShellPlace& a, const ShellPlace& b, double edge) {
  return std::max((prism.base_at(a.u, a.v) - prism.base_at(b.u, b.v)).norm(), std::abs(a.height - b.height)) / edge;
}

/// For the log of a failing case: the triangle's size and shape beside the mesh's.
void describe(const TriangleMesh& mesh, std::uint32_t face, const ShellPlace& place) {
  const auto [a, b, c] = mesh.corners(face);
  const double longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
  RC_LOG() << "face " << face << " of " << mesh.triangles().size() << ": longest edge " << longest / mesh.mean_edge()
           << " mean edges, aspect " << longest * longest / (b - a).cross(c - a).norm() << ", height "
           << place.height / longest << " longest edges\n";
}

RC_GTEST_PROP(T6_injectivity, round_trip_from_a_guess_is_exact_within_the_injective_interval, (std::uint64_t seed)) {
  Rng rng(seed);
  const TriangleMesh mesh = any_mesh(rng, seed);
  const Shell shell = Shell::build(mesh);
  const double edge = mesh.mean_edge();
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const ShellPrism prism = shell.prism(mesh, face);
    const ShellInterval room = prism.injective(0.0, edge);
    if (!(room.upper > room.lower)) continue;
    const ShellPlace place = random_place(rng, room);
    // As the servo loop guesses: from a place a little way off.
    ShellPlace found = place;
    found.u += rng.uniform(-0.01, 0.01);
    found.v += rng.uniform(-0.01, 0.01);
    found.height += 0.01 * rng.uniform(room.lower, room.upper);
    const bool inverted = prism.invert(prism.point(place), found);
    if (!inverted) describe(mesh, face, place);
    RC_ASSERT(inverted);
    RC_ASSERT(difference(prism, place, found, edge) < 1e-9);
  }
}

RC_GTEST_PROP(T6_injectivity, several_at_once_are_inverted_as_each_alone, (std::uint64_t seed)) {
  Rng rng(seed);
  const TriangleMesh mesh = any_mesh(rng, seed);
  const Shell shell = Shell::build(mesh);
  const double edge = mesh.mean_edge();
  for (int i = 0; i < 100; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const ShellPrism prism = shell.prism(mesh, face);
    const ShellInterval room = prism.injective(0.0, edge);
    if (!(room.upper > room.lower)) continue;
    std::array<Lanes, 3> points;
    ShellPlaces found;
    ShellPlace alone[lanes];
    bool reached[lanes];
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const ShellPlace place = random_place(rng, room);
      // One of them so far off that it may be reached from nowhere.
      const Vec3 p = prism.point(place) + (rng.below(5) == 0 ? random_point(rng, 10.0 * edge) : Vec3(Vec3::Zero()));
      for (std::size_t axis = 0; axis < 3; ++axis) points[axis][lane] = p[static_cast<int>(axis)];
      alone[lane] = {place.u + rng.uniform(-0.01, 0.01), place.v + rng.uniform(-0.01, 0.01),
                     place.height + 0.01 * rng.uniform(room.lower, room.upper)};
      found.u[lane] = alone[lane].u;
      found.v[lane] = alone[lane].v;
      found.height[lane] = alone[lane].height;
      reached[lane] = prism.invert(p, alone[lane]);
    }
    prism.invert(points, found);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const ShellPlace place{found.u[lane], found.v[lane], found.height[lane]};
      // A place that one form only just reaches, and the other one not, is far from every relief.
      const bool far = std::abs(place.height) > edge;
      RC_ASSERT(found.reached[lane] == reached[lane] || far);
      if (found.reached[lane] && reached[lane]) RC_ASSERT(difference(prism, place, alone[lane], edge) < 1e-9 || far);
    }
  }
}

RC_GTEST_PROP(T6_injectivity, round_trip_without_a_guess_is_exact_within_the_injective_interval, (std::uint64_t seed)) {
  Rng rng(seed);
  const TriangleMesh mesh = any_mesh(rng, seed);
  const Shell shell = Shell::build(mesh);
  const double edge = mesh.mean_edge();
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const ShellPrism prism = shell.prism(mesh, face);
    const ShellInterval room = prism.injective(0.0, edge);
    if (!(room.upper > room.lower)) continue;
    const ShellPlace place = random_place(rng, room);
    ShellPlace found;
    const bool inverted = prism.invert_anew(prism.point(place), found);
    if (!inverted) describe(mesh, face, place);
    RC_ASSERT(inverted);
    RC_ASSERT(difference(prism, place, found, edge) < 1e-9);
  }
}

/// The height, going from 0 towards `limit`, up to which the determinant keeps a twentieth of what it is at height 0
/// all over the triangle, by looking at a grid of places and closing in by halves.
double brute_force_end(const ShellPrism& prism, double margin, double limit) {
  const auto holds = [&](double height) {
    constexpr int cells = 12;
    for (int i = 0; i <= cells; ++i) {
      for (int j = 0; i + j <= cells; ++j) {
        const double grown = (1.0 + 3.0 * margin) / cells;
        const double u = grown * i - margin;
        const double v = grown * j - margin;
        if (prism.determinant({u, v, height}) < 0.05 * prism.determinant({u, v, 0.0})) return false;
      }
    }
    return true;
  };
  constexpr int steps = 400;
  double inside = 0.0;
  for (int i = 1; i <= steps; ++i) {
    double outside = limit * i / steps;
    if (holds(outside)) {
      inside = outside;
      continue;
    }
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (inside + outside);
      (holds(middle) ? inside : outside) = middle;
    }
    return inside;
  }
  return limit;
}

RC_GTEST_PROP(T6_injectivity, closed_form_agrees_with_the_least_determinant_on_a_grid, (std::uint64_t seed)) {
  Rng rng(seed);
  const TriangleMesh mesh = any_mesh(rng, seed);
  const Shell shell = Shell::build(mesh);
  for (int i = 0; i < 4; ++i) {
    const ShellPrism prism = shell.prism(mesh, random_face(rng, mesh));
    const double limit = mesh.mean_edge() * rng.uniform(0.1, 3.0);
    const double margin = i % 2 == 0 ? 0.0 : rng.uniform(0.0, 0.3);
    const ShellInterval room = prism.injective(margin, limit);
    if (!(room.upper > room.lower)) {
      bool regular = true;
      for (int k = 0; k < 3; ++k) {
        const double u = k == 1 ? 1.0 + 2.0 * margin : -margin;
        const double v = k == 2 ? 1.0 + 2.0 * margin : -margin;
        regular = regular && prism.determinant({u, v, 0.0}) > 0.0;
      }
      RC_ASSERT(!regular);
      continue;
    }
    RC_ASSERT(std::abs(room.upper - brute_force_end(prism, margin, limit)) <= 1e-6 * limit);
    RC_ASSERT(std::abs(room.lower - brute_force_end(prism, margin, -limit)) <= 1e-6 * limit);
  }
}

/// Faces whose prism holds p at a height that the face's relief has, with where.
struct Owner {
  std::uint32_t face;
  ShellPlace place;
};
std::vector<Owner> owners_by_brute_force(const ReliefSurface& surface, const Vec3& p, double slack) {
  std::vector<Owner> owners;
  const auto faces = static_cast<std::uint32_t>(surface.base().mesh().triangles().size());
  for (std::uint32_t face = 0; face < faces; ++face) {
    const ReliefFrame frame = surface.frame(face);
    ShellPlace place;
    if (!frame.prism.invert_anew(p, place) || place.barycentric().minCoeff() < -slack) continue;
    const HeightRange range = surface.range(frame, whole_triangle);
    if (place.height < range.lowest || place.height > range.highest) continue;
    owners.push_back({face, place});
  }
  return owners;
}

bool share_vertex(const TriangleMesh& mesh, std::uint32_t one, std::uint32_t other) {
  for (const std::uint32_t a : mesh.triangles()[one]) {
    for (const std::uint32_t b : mesh.triangles()[other]) {
      if (a == b) return true;
    }
  }
  return false;
}

RC_GTEST_PROP(T6_injectivity, every_point_in_the_shell_is_owned_once_and_locate_finds_the_owner, (std::uint64_t seed)) {
  Rng rng(seed);
  const int kind = static_cast<int>(rng.below(kinds_of_base));
  TriangleMesh mesh = mesh_of(base_of_kind(kind, seed));
  const double amplitude = mesh.mean_edge() * rng.uniform(0.01, 0.15);
  const auto surface = relief_on(std::move(mesh), {tiled(wavy_map(amplitude), 0.01)},
                                 CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
  SurfaceCache cache;
  for (int i = 0; i < 40; ++i) {
    const std::uint32_t face = random_face(rng, surface->base().mesh());
    const ReliefFrame frame = surface->frame(face);
    const HeightRange range = surface->range(frame, whole_triangle);
    const Vec3 barycentric = random_barycentric(rng, 1e-3);
    const ShellPlace place{barycentric[1], barycentric[2], 0.99 * rng.uniform(range.lowest, range.highest)};
    const Vec3 p = frame.prism.point(place);
    const std::vector<Owner> owners = owners_by_brute_force(*surface, p, 0.0);
    bool distant = false;
    for (const Owner& owner : owners) {
      if (owner.face == face) continue;
      // Only reliefs of distant faces, reported as such, may reach into one another.
      RC_ASSERT(!share_vertex(surface->base().mesh(), owner.face, face));
      RC_ASSERT(surface->overlapped(face));
      distant = true;
    }
    RC_ASSERT(!owners.empty());
    ShellPlace at;
    const ReliefFrame* found = surface->locate(p, cache, {}, at);
    RC_ASSERT(found != nullptr);
    if (distant) continue;
    RC_ASSERT(found->face == face);
    RC_ASSERT(difference(frame.prism, place, at, surface->base().mesh().mean_edge()) < 1e-9);
  }
}

RC_GTEST_PROP(T6_injectivity, what_locate_finds_is_an_owner_wherever_a_brute_force_search_has_one,
              (std::uint64_t seed)) {
  Rng rng(seed);
  TriangleMesh mesh = mesh_of(base_of_kind(static_cast<int>(rng.below(kinds_of_base)), seed));
  const double amplitude = mesh.mean_edge() * rng.uniform(0.01, 0.15);
  const auto surface = relief_on(std::move(mesh), {tiled(wavy_map(amplitude), 0.01)},
                                 CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
  const Box box = surface->bounds();
  SurfaceCache cache;
  for (int i = 0; i < 60; ++i) {
    const Vec3 p = box.lower + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(box.extent());
    const std::vector<Owner> owners = owners_by_brute_force(*surface, p, -1e-6);
    if (owners.empty()) continue;
    ShellPlace at;
    const ReliefFrame* found = surface->locate(p, cache, {}, at);
    RC_ASSERT(found != nullptr);
    bool owns = false;
    for (const Owner& owner : owners) owns = owns || owner.face == found->face;
    RC_ASSERT(owns);
  }
}

/// Faces whose prism folds over somewhere within the coat's heights, on a grid of places and heights.
std::vector<std::uint32_t> folded_faces(const ReliefSurface& surface, const Shell& shell) {
  std::vector<std::uint32_t> folded;
  const TriangleMesh& mesh = surface.base().mesh();
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const ShellPrism prism = shell.prism(mesh, face);
    const HeightRange heights = surface.coat().range(surface.frame(face).coat, whole_triangle);
    double least = infinity;
    for (int k = 0; k < 3; ++k) {
      const double u = k == 1 ? 1.0 : 0.0;
      const double v = k == 2 ? 1.0 : 0.0;
      for (int i = 0; i <= 200; ++i) {
        const double height = heights.lowest + (heights.highest - heights.lowest) * i / 200.0;
        least = std::min(least, prism.determinant({u, v, height}));
      }
    }
    if (least <= 0.0) folded.push_back(face);
  }
  return folded;
}

struct TooHigh {
  const char* name;
  MeshSource source;
  double lowest;
  double highest;
};
std::vector<TooHigh> coats_that_do_not_fit() {
  // Sunk deeper than a sphere is, higher than a valley or a cup is wide, both at once.
  return {{"sphere", icosphere(2, 0.01), -0.012, -0.001},
          {"corrugated", trial_mesh_c({4, 6, 0.01}), -0.015, 0.015},
          {"cup", trial_mesh_e(4, std::numbers::pi / 2.0, 0.005), 0.001, 0.03},
          {"blob", random_closed_mesh(7, 2, 0.02, 0.3), -0.012, 0.012}};
}

HeightMap between(double lowest, double highest) {
  return map_of(16, [=](double s, double) {
    return lowest + (highest - lowest) * (0.5 + 0.5 * std::sin(2.0 * std::numbers::pi * s));
  });
}

TEST(T6_injectivity, a_coat_that_folds_over_is_reported_with_its_faces) {
  for (const TooHigh& one : coats_that_do_not_fit()) {
    const auto surface = coated(one.source, between(one.lowest, one.highest), Mapping::triplanar);
    const ReliefReport& report = surface->report();
    EXPECT_FALSE(report.fits()) << one.name;
    const Shell shell = Shell::build(surface->base().mesh());
    const std::vector<std::uint32_t> folded = folded_faces(*surface, shell);
    EXPECT_FALSE(folded.empty()) << one.name;
    // The report keeps a margin, so it may name more faces, never fewer.
    EXPECT_TRUE(std::includes(report.faces_at_fault.begin(), report.faces_at_fault.end(), folded.begin(), folded.end()))
        << one.name;
    EXPECT_LT(report.fitting_share, 1.0) << one.name;
    EXPECT_NE(report.advice().find("face " + std::to_string(report.faces_at_fault.front())), std::string::npos);
  }
}

TEST(T6_injectivity, a_coat_that_fits_is_not_reported) {
  for (int kind = 0; kind < kinds_of_base - 1; ++kind) {
    const auto surface = coated(base_of_kind(kind, 3), wavy_map(1e-5), Mapping::triplanar);
    EXPECT_TRUE(surface->report().fits()) << kind << ": " << surface->report().advice();
    EXPECT_EQ(surface->report().lowered_vertices, 0U) << kind;
    EXPECT_EQ(surface->report().fitting_share, 1.0) << kind;
    EXPECT_TRUE(surface->report().advice().empty()) << kind;
  }
}

TEST(T6_injectivity, refusing_names_the_faces) {
  for (const TooHigh& one : coats_that_do_not_fit()) {
    TriangleMesh mesh = mesh_of(one.source);
    Coat coat = coat_on(mesh, between(one.lowest, one.highest), Mapping::triplanar);
    const Coat same = coat;
    MeshSurface base(TriangleIndex::build(std::move(mesh)));
    const ReliefReport report = coated(one.source, between(one.lowest, one.highest), Mapping::triplanar)->report();
    const auto refused = ReliefSurface::build(std::move(base), std::move(coat),
                                              ReliefSettings{ShellDirections::least_squares, OnOverlap::refuse});
    ASSERT_FALSE(refused.ok()) << one.name;
    EXPECT_EQ(refused.error().code, ErrorCode::bad_mesh);
    EXPECT_FALSE(refused.error().accepted.empty());
    EXPECT_NE(refused.error().what.find(std::to_string(report.faces_at_fault.size()) + " faces"), std::string::npos);
    EXPECT_NE(refused.error().what.find("face " + std::to_string(report.faces_at_fault.front())), std::string::npos)
        << refused.error().what;
    EXPECT_EQ(refused.error().what.find("rendered lower"), std::string::npos) << "nothing is rendered";
  }
}

TEST(T6_injectivity, a_cured_coat_is_injective_over_all_that_it_renders) {
  for (const FoldMode folds : {FoldMode::keep, FoldMode::round}) {
    for (const ShellDirections directions : {ShellDirections::least_squares, ShellDirections::relaxed}) {
      for (const TooHigh& one : coats_that_do_not_fit()) {
        TriangleMesh mesh = mesh_of(one.source);
        CoatSettings settings{folds == FoldMode::keep ? Mapping::triplanar : Mapping::per_face, Vec2::Ones(), {}};
        settings.stitching.folds = folds;
        Coat coat = must(Coat::build(mesh, tiled(between(one.lowest, one.highest)), settings));
        const ReliefSurface surface =
            must(ReliefSurface::build(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat),
                                      ReliefSettings{directions, OnOverlap::cure}));
        EXPECT_TRUE(surface.report().directions_relaxed || surface.report().lowered_vertices > 0) << one.name;
        EXPECT_EQ(surface.report().lowered_vertices > 0, surface.report().least_share < 1.0) << one.name;
        const auto faces = static_cast<std::uint32_t>(surface.base().mesh().triangles().size());
        for (std::uint32_t face = 0; face < faces; ++face) {
          const ReliefFrame frame = surface.frame(face);
          HeightRange range = surface.range(frame, whole_triangle);
          if (folds == FoldMode::round) {
            // The bounds of rounded folds are loose: what is rendered itself.
            range = {infinity, -infinity};
            for (int i = 0; i <= 12; ++i) {
              for (int j = 0; i + j <= 12; ++j) {
                const double height = surface.height(frame, i / 12.0, j / 12.0).height;
                range = {std::min(range.lowest, height), std::max(range.highest, height)};
              }
            }
          }
          for (int i = 0; i <= 20; ++i) {
            const double height = range.lowest + (range.highest - range.lowest) * i / 20.0;
            for (const Vec2& corner : whole_triangle) {
              ASSERT_GT(frame.prism.determinant({corner.x(), corner.y(), height}), 0.0)
                  << one.name << ", face " << face << ", height " << height
                  << (folds == FoldMode::round ? ", round" : ", keep")
                  << (directions == ShellDirections::relaxed ? ", relaxed" : "");
            }
          }
        }
      }
    }
  }
}

TEST(T6_injectivity, vertices_that_no_direction_suits_are_named_and_bear_no_relief) {
  // A flat pocket: whatever the direction at its rim, one of its sides sees it from behind.
  MeshSource pillow;
  pillow.positions = {{0.0, 0.0, 0.0}, {0.01, 0.0, 0.0}, {0.0, 0.01, 0.0}, {0.004, 0.004, 0.0}, {0.003, 0.003, 0.0}};
  pillow.triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}};
  const auto surface = coated(pillow, flat_map(1e-3), Mapping::triplanar);
  EXPECT_FALSE(surface->report().fits());
  EXPECT_EQ(surface->report().blind_vertices, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_NE(surface->report().advice().find("vertex 0"), std::string::npos);
  const TriangleMesh& mesh = surface->base().mesh();
  for (std::uint32_t face = 0; face < 6; ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (mesh.triangles()[face][k] > 2) continue;
      EXPECT_EQ(surface->height(surface->frame(face), whole_triangle[k].x(), whole_triangle[k].y()).height, 0.0)
          << face;
    }
  }
}

TEST(T6_injectivity, a_direction_that_sees_all_faces_is_found_where_there_is_one) {
  // A knife's edge: a broad face and a narrow one that is folded back behind it. What the broad one weighs hides the
  // narrow one from the vertex normal, but between the two lies a direction that sees both.
  for (const double opening : {20.0, 30.0, 45.0}) {
    const double angle = degrees(opening);
    MeshSource knife;
    knife.positions = {{0.0, 0.0, 0.0},
                       {0.01, 0.0, 0.0},
                       {0.005, 0.05, 0.0},
                       {0.005, 4e-4 * std::cos(angle), -4e-4 * std::sin(angle)}};
    knife.triangles = {{0, 1, 2}, {1, 0, 3}};
    const TriangleMesh mesh = mesh_of(knife);
    const auto seen = [&](const Vec3& direction) {
      return std::min(mesh.face_normal(0).dot(direction), mesh.face_normal(1).dot(direction)) / direction.norm();
    };
    const Shell shell = Shell::build(mesh);
    for (std::uint32_t vertex = 0; vertex < 2; ++vertex) {
      ASSERT_LT(seen(mesh.vertex_normal(vertex)), 0.0) << opening;
      const double best = seen(mesh.face_normal(0) + mesh.face_normal(1));
      EXPECT_GT(seen(shell.directions[vertex].cast<double>()), 0.9 * best) << opening;
    }
    EXPECT_TRUE(shell.blind_vertices.empty()) << opening;
  }
}

TEST(T6_injectivity, other_directions_are_taken_however_little_does_not_fit) {
  for (const int kind : {1, 3, 4}) {
    // Sunk into what is convex, raised in what has valleys.
    const double side = kind == 4 ? 1.0 : -1.0;
    const auto report_at = [&](double height) {
      TriangleMesh mesh = mesh_of(base_of_kind(kind, 5));
      Coat coat =
          coat_on(mesh, between(std::min(0.0, side * height), std::max(0.0, side * height)), Mapping::triplanar);
      return must(ReliefSurface::build(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat),
                                       ReliefSettings{ShellDirections::least_squares, OnOverlap::cure}))
          .report();
    };
    double fits = 1e-3;
    double folds = 0.05;
    while (folds > fits * 1.0001) {
      const double middle = 0.5 * (fits + folds);
      (report_at(middle).faces_at_fault.empty() ? fits : folds) = middle;
    }
    const ReliefReport report = report_at(1.002 * fits);
    EXPECT_GT(report.fitting_share, 0.99) << kind;
    EXPECT_LT(report.fitting_share, 1.0) << kind;
    EXPECT_TRUE(report.directions_relaxed) << kind;
    EXPECT_EQ(report.lowered_vertices, 0U) << kind;
  }
}

TEST(T6_injectivity, directions_are_metric_over_every_face_of_a_regular_mesh) {
  // Amendment 2: interpolated unit normals would lose a fifth of the height at the middle of an icosahedron's faces.
  const TriangleMesh mesh = mesh_of(icosphere(0, 0.01));
  const Shell shell = Shell::build(mesh);
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const ShellPrism prism = shell.prism(mesh, face);
    for (const Vec2& corner : whole_triangle)
      EXPECT_NEAR(prism.direction_at(corner.x(), corner.y()).dot(mesh.face_normal(face)), 1.0, 5e-3);
    EXPECT_NEAR(prism.direction_at(1.0 / 3.0, 1.0 / 3.0).norm(), 1.0, 5e-3);
  }
}

RC_GTEST_PROP(T6_injectivity, neighbours_see_one_shell_over_their_common_edge, (std::uint64_t seed)) {
  Rng rng(seed);
  const TriangleMesh mesh = any_mesh(rng, seed);
  const Shell shell = Shell::build(mesh);
  for (int i = 0; i < 100; ++i) {
    const std::uint32_t face = random_face(rng, mesh);
    const int edge = static_cast<int>(rng.below(3));
    const std::uint32_t other = mesh.neighbour(face, edge);
    if (other == no_index) continue;
    const double along = rng.uniform();
    const double height = rng.uniform(-0.1, 0.1) * mesh.mean_edge();
    const auto from = static_cast<std::size_t>(edge);
    const auto to = static_cast<std::size_t>((edge + 1) % 3);
    const auto at = [&](std::uint32_t one) {
      Vec3 barycentric = Vec3::Zero();
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t vertex = mesh.triangles()[one][static_cast<std::size_t>(k)];
        if (vertex == mesh.triangles()[face][from]) barycentric[k] = 1.0 - along;
        if (vertex == mesh.triangles()[face][to]) barycentric[k] = along;
      }
      return shell.prism(mesh, one).point({barycentric[1], barycentric[2], height});
    };
    RC_ASSERT((at(face) - at(other)).norm() <= 1e-14 * (mesh.bounds().diagonal() + std::abs(height)));
  }
}

}  // namespace
}  // namespace asperity::shell_test
