// Row H-I: Test I of hrm-2010 on every trial mesh. What is to be felt is computed from the meshes' vertices alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/render/fixtures.h"

namespace asperity::trial_rows_test {
namespace {

using namespace test;
using std::numbers::pi;

/// Turns smaller than this are none (rad). The trial meshes have no fold between 0 and this.
constexpr double no_turn = 1e-4;
/// Where one of a point's barycentric coordinates is below this an edge is near: the papers' band is 0.05.
constexpr double near_edge = 0.06;

double angle(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// A place of a mesh that a hand comes by.
struct Step {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  ///< of its face, from the corners
  std::uint32_t face = no_index;
  int edges_near = 0;
};

/// The place of a mesh that is highest over a point of the x-y plane. Face no_index: there is none.
Step seen_from_above(const TriangleMesh& mesh, const Vec2& at) {
  Step top;
  double highest = -infinity;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    const Vec3 normal = (b - a).cross(c - a);
    if (normal.z() <= 0.0) continue;
    const auto area = [&](const Vec3& p, const Vec3& q) {
      return (p.x() - at.x()) * (q.y() - at.y()) - (p.y() - at.y()) * (q.x() - at.x());
    };
    const Vec3 share = Vec3(area(b, c), area(c, a), area(a, b)) / normal.z();
    const Vec3 point = share[0] * a + share[1] * b + share[2] * c;
    if (share.minCoeff() < -1e-12 || point.z() <= highest) continue;
    highest = point.z();
    top = {point, normal.normalized(), face, static_cast<int>((share.array() < near_edge).count())};
  }
  return top;
}

/// A straight way from corner to corner, as seen from above.
std::vector<Step> walk(const TriangleMesh& mesh, std::span<const Vec2> corners) {
  std::vector<Step> steps;
  for (std::size_t leg = 0; leg + 1 < corners.size(); ++leg) {
    const Vec2 way = corners[leg + 1] - corners[leg];
    const int count = 1 + static_cast<int>(500.0 * way.norm() / mesh.mean_edge());
    for (int i = 0; i <= count; ++i) {
      steps.push_back(seen_from_above(mesh, corners[leg] + (static_cast<double>(i) / count) * way));
      if (steps.back().face != no_index) continue;
      ADD_FAILURE() << "the way leaves the mesh";
      return {};
    }
  }
  return steps;
}

/// By chance from the inside of a face to a vertex, and from there to another face, within `reach` (m) of the z axis.
std::vector<Vec2> by_vertices(const TriangleMesh& mesh, double reach) {
  std::vector<Vec2> vertices;
  for (const Vec3& vertex : mesh.positions()) {
    const Vec2 at = vertex.head<2>();
    if (at.norm() < 0.95 * reach && (seen_from_above(mesh, at).point - vertex).norm() < 1e-9) vertices.push_back(at);
  }
  Rng rng(4);
  const auto anywhere = [&] {
    for (;;) {
      const Vec2 at(rng.uniform(-reach, reach), rng.uniform(-reach, reach));
      if (at.norm() < reach) return at;
    }
  };
  std::vector<Vec2> corners{anywhere()};
  for (int i = 0; i < 6; ++i) {
    if (!vertices.empty()) corners.push_back(vertices[rng.below(static_cast<std::uint32_t>(vertices.size()))]);
    corners.push_back(anywhere());
  }
  return corners;
}

/// From the middle of each face of a strip to that of the next.
std::vector<Vec2> along_strip(const TriangleMesh& mesh) {
  std::vector<Vec2> corners;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face)
    corners.emplace_back(point_on(mesh, face, Vec3::Constant(1.0 / 3.0)).head<2>());
  return corners;
}

/// A hand that presses along a walk, a ten-thousandth of an edge deep: where what it should feel turns does not depend
/// on the depth. So near a ridge that is sharper than a right angle it would come out on the other side: there it
/// lifts.
struct Press {
  double depth = 0.0;
  std::vector<Step> steps;
  std::vector<Vec3> path;
  std::vector<bool> lifted;

  Press(const TriangleMesh& mesh, std::span<const Vec2> corners)
      : depth(1e-4 * mesh.mean_edge()), steps(walk(mesh, corners)), lifted(steps.size(), false) {
    for (std::size_t i = 1; i < steps.size(); ++i) {
      const Step& a = steps[i - 1];
      const Step& b = steps[i];
      const bool ridge = (b.normal - a.normal).dot(b.point - a.point) > 0.0;
      if (!ridge || a.normal.dot(b.normal) > 0.1) continue;
      for (std::size_t k = i > 3 ? i - 3 : 0; k < std::min(i + 3, steps.size()); ++k) lifted[k] = true;
    }
    for (std::size_t i = 0; i < steps.size(); ++i)
      path.emplace_back(steps[i].point - (lifted[i] ? -depth : depth) * steps[i].normal);
  }

  [[nodiscard]] std::vector<Vec3> felt(const Scene& scene) const {
    return slide(scene, path, steps.front().point + depth * steps.front().normal);
  }
};

/// A stretch of a walk, its last step included.
struct Stretch {
  std::size_t first = 0;
  std::size_t last = 0;
};

/// The stretches of a walk that are away from all edges, each on one face. Between two of them an edge or a vertex is
/// passed, or an edge is grazed.
std::vector<Stretch> stretches(const std::vector<Step>& steps) {
  std::vector<Stretch> found;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].edges_near > 0) continue;
    const bool goes_on = !found.empty() && found.back().last + 1 == i && steps[i].face == steps[i - 1].face;
    if (goes_on) {
      found.back().last = i;
    } else {
      found.push_back({i, i});
    }
  }
  return found;
}

/// What is felt between two stretches, from the last step of one to the first of the next.
struct Passage {
  bool crosses = false;    ///< from one face to another
  bool at_vertex = false;  ///< near one
  bool lifts = false;
  double fold = 0.0;     ///< angle between the faces' normals (rad)
  double turn = 0.0;     ///< between the forces at both ends
  double largest = 0.0;  ///< turn within a tick
  int turns = 0;         ///< ticks that turn
  double least = infinity;
  double most = 0.0;  ///< force (N)

  Passage(const Press& press, std::span<const Vec3> forces, std::size_t from, std::size_t to)
      : crosses(press.steps[from].face != press.steps[to].face),
        fold(angle(press.steps[from].normal, press.steps[to].normal)),
        turn(angle(forces[from], forces[to])) {
    for (std::size_t i = from + 1; i <= to; ++i) {
      at_vertex = at_vertex || press.steps[i].edges_near > 1;
      lifts = lifts || press.lifted[i];
      if (press.lifted[i]) continue;
      least = std::min(least, forces[i].norm());
      most = std::max(most, forces[i].norm());
      if (press.lifted[i - 1]) continue;
      largest = std::max(largest, angle(forces[i - 1], forces[i]));
      turns += angle(forces[i - 1], forces[i]) > no_turn ? 1 : 0;
    }
  }
  /// Far from the edge's ends, where one other face at most has a say.
  [[nodiscard]] bool over_edge() const { return crosses && !at_vertex && !lifts; }
};

/// What there is to feel between the stretches of a walk.
struct Counted {
  int folds = 0;           ///< passages from one face to another of another direction
  int flat = 0;            ///< passages of edges, from one face to another, that are flat
  int vertices = 0;        ///< passages near a vertex
  double flat_turn = 0.0;  ///< largest turn of a force at a flat edge, in one tick (rad)
};

/// How a law answers between stretches.
struct Way {
  bool jumps = true;    ///< at an edge, in one tick; false: over a band
  double slant = 1e-6;  ///< by what share the depth that it measures may differ from that under the plane
  double lean = 1e-5;   ///< rad, on a face
};

/// On faces a force along the face's normal, as large as k times the depth; at every fold a turn by the fold's own
/// angle, and nowhere else any.
Counted expect_events_at_folds_alone(const Press& press, const Scene& scene, const Way& way, const std::string& who) {
  const std::vector<Vec3> forces = press.felt(scene);
  const std::vector<Stretch> faces = stretches(press.steps);
  const double push = stiffness * press.depth;
  double off = 0.0;
  double lean = 0.0;
  for (const Stretch& face : faces) {
    for (std::size_t i = face.first; i <= face.last; ++i) {
      lean = std::max(lean, angle(forces[i], press.steps[face.first].normal));
      off = std::max(off, std::abs(forces[i].norm() - push));
    }
  }
  EXPECT_LE(off, way.slant * push) << who;
  EXPECT_LE(lean, way.lean) << who;
  Counted geometry;
  int events = 0;
  int jumps_due = 0;
  int jumps = 0;
  for (std::size_t r = 1; r < faces.size(); ++r) {
    const Passage passed(press, forces, faces[r - 1].last, faces[r].first);
    EXPECT_NEAR(passed.turn, passed.fold, 2.0 * way.lean) << who;
    const bool folded = passed.fold > 1e-9;
    geometry.folds += folded ? 1 : 0;
    geometry.vertices += passed.at_vertex ? 1 : 0;
    geometry.flat += passed.over_edge() && !folded ? 1 : 0;
    if (passed.over_edge() && !folded) geometry.flat_turn = std::max(geometry.flat_turn, passed.largest);
    events += passed.turn > no_turn ? 1 : 0;
    if (!way.jumps) continue;
    jumps_due += passed.over_edge() && folded ? 1 : 0;
    jumps += passed.over_edge() && folded ? passed.turns : 0;
    // Under the middle of a ridge a probe is less deep than that, by the ridge's cosine: 1/3 between faces of an
    // icosahedron.
    EXPECT_GT(passed.least, 0.3 * push) << who;
    EXPECT_LT(passed.most, 1.05 * push) << who;
  }
  EXPECT_EQ(events, geometry.folds) << who;
  EXPECT_EQ(jumps, jumps_due) << who;
  return geometry;
}

/// The laws that feel H_0 at all: Algorithms 1 and 2 as printed push by H - |d|, which is nowhere above 0.
std::vector<std::pair<std::string, Law>> laws_that_feel_flat_coats() {
  std::vector<std::pair<std::string, Law>> laws;
  for (const std::string& name : relief_laws()) {
    if (name == "height-field-literal" || name == "mesostructure-literal") continue;
    // The prisms of a flat coat have no height of their own.
    const bool in_prisms = name == "mesostructure-intended";
    laws.emplace_back(name, in_prisms ? Law(MesostructureIntendedLaw{.prism_height = 1e-4}) : named(name));
  }
  return laws;
}

Way way_of(const std::string& law) {
  Way way;
  // Heights are metric over a face as far as its corners' directions are (amendment 2).
  if (law == "height-field" || law == "mesostructure") way.slant = 0.02;
  if (law == "mesostructure-intended") way.jumps = false;
  return way;
}

/// Every law on the mesh with H_0, and those of bare meshes without; answers what there was to feel. `acute`: some
/// ridges are sharper than a right angle, and the way passes flat edges beside them.
Counted expect_of_every_law(const MeshSource& source, std::span<const Vec2> corners, bool acute = false) {
  const Press press(mesh_of(source), corners);
  Counted geometry;
  for (const char* law : {"god-object", "proxy"})
    geometry = expect_events_at_folds_alone(press, scene_of(bare(source), named(law)), {}, std::string("bare ") + law);
  const auto surface = coated(source, flat_map(0.0), Mapping::uv);
  for (const auto& [name, law] : laws_that_feel_flat_coats()) {
    const Way way = way_of(name);
    const double flat_turn = expect_events_at_folds_alone(press, scene_of(surface, law), way, name).flat_turn;
    if (acute && !way.jumps) {
      // In every band Algorithm 2 projects the probe on all adjoining faces: on the one round the ridge it falls
      // within.
      EXPECT_GT(flat_turn, 0.1) << name;
    } else {
      EXPECT_LE(flat_turn, 1e-9) << name;
    }
  }
  return geometry;
}

Counted expect_by_vertices(const MeshSource& source, double reach, bool acute = false) {
  return expect_of_every_law(source, by_vertices(mesh_of(source), reach), acute);
}

TEST(H_I, no_event_on_M_a_over_faces_edges_and_vertices) {
  const Counted geometry = expect_by_vertices(trial_mesh_a(), 0.03);
  EXPECT_EQ(geometry.folds, 0);
  EXPECT_GE(geometry.flat, 20);
  EXPECT_GE(geometry.vertices, 6);
}

TEST(H_I, no_event_on_M_f_over_any_edge) {
  const MeshSource source = trial_mesh_f();
  const Counted geometry = expect_of_every_law(source, along_strip(mesh_of(source)));
  EXPECT_EQ(geometry.folds, 0);
  EXPECT_EQ(geometry.flat, 9);
}

TEST(H_I, as_many_events_on_M_b_as_folds) {
  EXPECT_GE(expect_by_vertices(trial_mesh_b(), 0.03).folds, 30);
  EXPECT_GE(expect_by_vertices(trial_mesh_b(pi / 4.0, {3, 3, 0.01}), 6e-3).folds, 3);
  const Counted arch = expect_by_vertices(trial_mesh_b(pi / 4.0, {}, TrialBend::arch), 0.015);
  EXPECT_GE(arch.folds, 8);
  EXPECT_GE(arch.flat, 5);
}

TEST(H_I, as_many_events_on_M_c_as_folds) {
  const Counted geometry = expect_by_vertices(trial_mesh_c(), 0.015, true);
  EXPECT_GE(geometry.folds, 8);
  EXPECT_GE(geometry.flat, 8);
}

TEST(H_I, as_many_events_on_M_d_as_folds) {
  EXPECT_GE(expect_by_vertices(icosphere(0, 0.02), 0.012).vertices, 5);
  EXPECT_GE(expect_by_vertices(icosphere(2, 0.02), 0.012).folds, 25);
}

TEST(H_I, as_many_events_on_M_e_as_folds) {
  EXPECT_GE(expect_by_vertices(trial_mesh_e(4, 1.2), 0.015).folds, 25);
}

MeshSource wavy_mesh_g() {
  const HeightOverFace waves = [](std::uint32_t, const Vec3& at) { return 1e-3 * at[1] * std::sin(3.0 * at[0]); };
  return trial_mesh_g(2, waves, pi / 12.0, {4, 4, 0.01});
}
TEST(H_I, as_many_events_on_M_G_as_folds) {
  EXPECT_GE(expect_by_vertices(wavy_mesh_g(), 0.012).folds, 50);
}

/// Presses along the inner edges of a mesh, close by them on either side: the face's own normal is felt, and no event.
/// Answers how many sides of folds there were.
int expect_none_along_folds(const MeshSource& source) {
  const TriangleMesh mesh = mesh_of(source);
  const double depth = 1e-4 * mesh.mean_edge();
  const auto surface = coated(source, flat_map(0.0), Mapping::uv);
  int folds = 0;
  for (const auto& [name, law] : laws_that_feel_flat_coats()) {
    if (!way_of(name).jumps) continue;
    const Scene scene = scene_of(surface, law);
    double lean = 0.0;
    double least = infinity;
    folds = 0;
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
      const auto corners = mesh.corners(face);
      const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
      for (std::size_t edge = 0; edge < 3; ++edge) {
        const std::uint32_t other = mesh.neighbour(face, static_cast<int>(edge));
        if (other == no_index) continue;
        const auto [a, b, c] = mesh.corners(other);
        folds += angle((b - a).cross(c - a), normal) > no_turn ? 1 : 0;
        const Vec3& from = corners[edge];
        const Vec3& to = corners[(edge + 1) % 3];
        const Vec3 in = 8.0 * depth * normal.cross(to - from).normalized() - depth * normal;
        const auto path = line(from + 0.2 * (to - from) + in, to + 0.2 * (from - to) + in, 40);
        const std::vector<Vec3> forces = slide(scene, path, path.front() + 2.0 * depth * normal);
        for (const Vec3& force : forces) {
          least = std::min(least, force.norm());
          lean = std::max(lean, angle(force, normal));
        }
      }
    }
    EXPECT_GT(least, 0.0) << name;
    EXPECT_LE(lean, way_of(name).lean) << name;
  }
  return folds;
}

TEST(H_I, no_event_along_folds) {
  EXPECT_EQ(expect_none_along_folds(trial_mesh_b(pi / 30.0, {3, 3, 0.01})), 2 * 21);
  EXPECT_EQ(expect_none_along_folds(trial_mesh_b(pi / 4.0, {3, 3, 0.01}, TrialBend::arch)), 2 * 6);
  EXPECT_EQ(expect_none_along_folds(trial_mesh_c({3, 4, 0.01})), 2 * 9);
  EXPECT_EQ(expect_none_along_folds(icosphere(0, 0.02)), 2 * 30);
  EXPECT_EQ(expect_none_along_folds(trial_mesh_e(2, 1.2)), 2 * 30);
}

/// Algorithms 1 and 2 as printed push by H - |d|: on H_0 nothing, on a coat twice as high as the probe is deep as much
/// as the bare mesh.
void expect_no_push_of_the_printed_forms(const MeshSource& source, std::span<const Vec2> corners) {
  const Press press(mesh_of(source), corners);
  const std::vector<Vec3> plain = press.felt(scene_of(bare(source), GodObjectLaw{}));
  const auto flat = coated(source, flat_map(0.0), Mapping::uv);
  const auto raised = coated(source, flat_map(2.0 * press.depth), Mapping::uv);
  for (const char* law : {"height-field-literal", "mesostructure-literal"}) {
    const std::vector<Vec3> none = press.felt(scene_of(flat, named(law)));
    const std::vector<Vec3> some = press.felt(scene_of(raised, named(law)));
    double push = 0.0;
    double off = 0.0;
    std::ptrdiff_t pressed = 0;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      push = std::max(push, none[i].norm());
      pressed += plain[i].norm() > 0.0 ? 1 : 0;
      if (press.steps[i].edges_near == 0 && !press.lifted[i]) off = std::max(off, (some[i] - plain[i]).norm());
    }
    EXPECT_EQ(push, 0.0) << law;
    EXPECT_LT(off, 1e-6 * stiffness * press.depth) << law;
    const auto lifted = std::count(press.lifted.begin(), press.lifted.end(), true);
    EXPECT_EQ(pressed + lifted, std::ssize(plain));
  }
}

TEST(H_I, the_printed_forms_push_nothing_on_H_0_where_the_bare_mesh_does) {
  const auto expect_none = [](const MeshSource& source, double reach) {
    expect_no_push_of_the_printed_forms(source, by_vertices(mesh_of(source), reach));
  };
  expect_none(trial_mesh_a(), 0.03);
  expect_none(trial_mesh_b(), 0.03);
  expect_none(trial_mesh_c(), 0.015);
  expect_none(icosphere(0, 0.02), 0.012);
  expect_none(icosphere(2, 0.02), 0.012);
  expect_none(trial_mesh_e(4, 1.2), 0.015);
  expect_none(wavy_mesh_g(), 0.012);
  const MeshSource strip = trial_mesh_f();
  expect_no_push_of_the_printed_forms(strip, along_strip(mesh_of(strip)));
}

}  // namespace
}  // namespace asperity::trial_rows_test
