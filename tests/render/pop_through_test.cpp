// T5: nothing is passed through, however thin and however fast (formulation D6, D8).

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <map>
#include <string>

#include "tests/render/fixtures.h"
#include "tests/surface/folded.h"
#include "tests/surface/reliefs.h"

namespace asperity::pop_through_test {
namespace {

using namespace test;

/// A closed sheet of `thickness` with relief all over, less than half as high.
std::shared_ptr<const ReliefSurface> sheet(double thickness) {
  return relief_on(mesh_of(box_mesh(Vec3(0.02, 0.02, thickness))), {tiled(wavy_map(0.4 * thickness), 0.01)},
                   CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
}

/// A displaced icosphere with H_1 laid per face, stitched.
std::shared_ptr<const ReliefSurface> ridged_sphere(double radius, double amplitude, const Stitching& stitching) {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::serrated;
  spec.size = 32;
  spec.amplitude = amplitude;
  spec.count = 4;
  spec.wall = 0.25;
  auto maps = tiled(must(generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline)));
  return relief_on(mesh_of(icosphere(1, radius)), {std::move(maps)},
                   CoatSettings{Mapping::per_face, Vec2::Ones(), stitching});
}

struct Closed {
  std::string name;
  std::shared_ptr<const ReliefSurface> surface;
  int cells;  // of the tessellation, along the edges of a face
};

const std::vector<Closed>& closed_reliefs() {
  static const std::vector<Closed> reliefs = {
      {"sheet of 0.05 mm", sheet(0.05e-3), 60},
      {"sheet of 0.5 mm", sheet(0.5e-3), 60},
      {"ridged sphere, folds kept", ridged_sphere(0.01, 0.3e-3, {FoldMode::keep, Blend::quintic, 0.1, {}}), 80},
      {"ridged sphere, folds rounded", ridged_sphere(0.01, 0.3e-3, {FoldMode::round, Blend::quintic, 0.1, {}}), 80},
      {"blob",
       relief_on(mesh_of(random_closed_mesh(3, 2, 0.01, 0.2)), {tiled(wavy_map(2e-4), 0.005)},
                 CoatSettings{Mapping::triplanar, Vec2::Ones(), {}}),
       40}};
  return reliefs;
}

const Tessellation& dense(std::size_t which) {
  static std::map<std::size_t, Tessellation> made;
  const auto known = made.find(which);
  if (known != made.end()) return known->second;
  const Closed& one = closed_reliefs()[which];
  return made.emplace(which, dense_net(*one.surface, one.cells)).first->second;
}

/// From a speed of 0.01 to 20 m/s, evenly over the decades: how far a probe moves in 1 ms.
double random_stride(Rng& rng) {
  return 1e-3 * 0.01 * std::pow(2000.0, rng.uniform());
}

/// A point near the surface of the tessellation, at most `off` (m) from it.
Vec3 random_near(Rng& rng, const TriangleIndex& index, double off) {
  const TriangleMesh& mesh = index.mesh();
  return point_on(mesh, random_face(rng, mesh), random_barycentric(rng)) + random_point(rng, off);
}

TEST(T5_pop_through, the_tessellations_are_far_finer_than_what_they_judge) {
  EXPECT_LT(dense(0).error, 0.02 * 0.05e-3);
  EXPECT_LT(dense(1).error, 0.02 * 0.5e-3);
  for (std::size_t i = 2; i < closed_reliefs().size(); ++i) {
    EXPECT_LT(dense(i).error, 0.1 * closed_reliefs()[i].surface->coat().amplitude_bound()) << closed_reliefs()[i].name;
  }
}

/// A place on the relief to aim at: anywhere, or within 1 nm to 0.1 mm of where two faces are joined. Where motions are
/// led to, and nothing else, hangs on it.
Vec3 random_target(Rng& rng, const ReliefSurface& surface, const TriangleIndex& tessellated) {
  if (rng.uniform() < 0.5) return random_near(rng, tessellated, 0.0);
  const TriangleMesh& base = surface.base().mesh();
  const std::uint32_t face = random_face(rng, base);
  const double along = rng.uniform();
  const ReliefFrame frame = surface.frame(face);
  const Vec3 on_edge = (std::array{surface.point(frame, along, 0.0), surface.point(frame, 0.0, along),
                                   surface.point(frame, along, 1.0 - along)}[face % 3])
                           .point;
  return on_edge + random_point(rng, 1e-9 * std::pow(1e5, rng.uniform()));
}

/// A motion, and whether a dense mesh shows that it gets clearly inside.
struct Crossing {
  Vec3 from;
  Vec3 to;
  bool starts_outside = false;
  bool clear = false;
};

Crossing random_crossing(Rng& rng, const ReliefSurface& surface, const Tessellation& mesh, bool aimed) {
  const double stride = random_stride(rng);
  Crossing made;
  if (aimed) {
    const Vec3 target = random_target(rng, surface, mesh.index);
    made.from = target + random_point(rng, 0.9 * stride);
    made.to = made.from + stride * (target - made.from).normalized();
  } else {
    made.from = random_near(rng, mesh.index, 0.5 * stride);
    made.to = made.from + stride * random_direction(rng);
  }
  if (depth_inside(mesh.index, made.from) > -2.0 * mesh.error) return made;
  made.starts_outside = true;
  const FirstHit entry = mesh.index.first_hit({made.from, made.to});
  if (entry.face == no_index) return made;
  // Where it is deepest: between where it comes in and where it next goes out, or its end.
  const Vec3 entered = made.from + (entry.t + 1e-9) * (made.to - made.from);
  const FirstHit exit = mesh.index.first_hit({entered, made.to});
  const Vec3 out = exit.face == no_index ? made.to : Vec3(entered + exit.t * (made.to - entered));
  for (const double t : {0.25, 0.5, 0.75, 1.0})
    made.clear = made.clear || depth_inside(mesh.index, entered + t * (out - entered)) > 2.0 * mesh.error;
  return made;
}

// A hundred and five thousand on the five, fewer where the search is slow.
class T5_crossings : public testing::TestWithParam<std::size_t> {};

TEST_P(T5_crossings, are_met_where_a_dense_mesh_shows_them) {
  Rng rng(50 + GetParam());
  const auto& [name, surface, cells] = closed_reliefs()[GetParam()];
  const Tessellation& mesh = dense(GetParam());
  SurfaceCache hint;
  const int enough = GetParam() == 3 ? 5000 : 25000;
  int crossings = 0;
  for (int i = 0; crossings < enough; ++i) {
    const Crossing moved = random_crossing(rng, *surface, mesh, i % 4 != 0);
    if (!moved.starts_outside) continue;
    const Vec3& from = moved.from;
    const Vec3& to = moved.to;
    const SweptHit hit = surface->view(hint).first_touch({from, to}, i % 2 == 0 ? Sides::both : Sides::front);
    if (moved.clear) {
      ++crossings;
      ASSERT_TRUE(hit.hit) << name << ", segment " << i << " from " << from.transpose() << " to " << to.transpose();
    }
    if (!hit.hit) continue;
    const Vec3 touched = from + hit.t * (to - from);
    ASSERT_LT((touched - hit.contact.point).norm(), surface->skin()) << name << ", segment " << i;
    ASSERT_LT(std::abs(depth_inside(mesh.index, touched)), 2.0 * mesh.error + surface->skin())
        << name << ", segment " << i;
    // Not the second crossing: nothing on the way there lies clearly inside.
    const double share = std::array{0.2, 0.5, 0.8, 0.95}[static_cast<std::size_t>(i) / 4 % 4];
    ASSERT_LT(depth_inside(mesh.index, from + share * hit.t * (to - from)), 2.0 * mesh.error + surface->skin())
        << name << ", segment " << i << " from " << from.transpose() << " to " << to.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(ClosedReliefs, T5_crossings, testing::Values(0U, 1U, 2U, 3U, 4U));

TEST(T5_pop_through, a_motion_that_leaves_its_face_on_the_way_in_is_met) {
  // It enters a rim's relief 0.1 um from the edge, passes the edge below the surface, and what the rim's relief would
  // be beyond its edge rises over the motion again.
  const auto& surface = closed_reliefs().front().surface;
  const Vec3 from(0.015585913818826019, -0.014203074468611861, -0.00013407108457484807);
  const Vec3 to(0.0050942127910009443, -0.00020009648819175989, 7.131818228069516e-05);
  for (const double around : {1.0, 1e-2, 1e-3, 1e-4, 1e-5}) {
    const double entry = 0.53233;
    SurfaceCache hint;
    const Vec3 way = to - from;
    const Segment motion{from + std::max(0.0, entry - around) * way, from + std::min(1.0, entry + around) * way};
    EXPECT_TRUE(surface->view(hint).first_touch(motion, Sides::both).hit) << around;
  }
}

/// Moves a probe along straight pieces of random speed; `inside` says what place it is led to next.
template <class Next, class Check>
void lead(const Scene& scene, Rng& rng, const Vec3& start, int ticks, const Next& next, const Check& check) {
  ProxyState state;
  Vec3 probe = start;
  touch(scene, state, probe);
  Vec3 goal = start;
  double stride = 0.0;
  for (int i = 0; i < ticks; ++i) {
    if ((goal - probe).norm() <= stride || i % 200 == 0) {
      probe = i % 200 == 0 ? probe : goal;
      goal = next();
      stride = random_stride(rng);
    } else {
      probe += stride * (goal - probe).normalized();
    }
    check(i, probe, touch(scene, state, probe));
    if (testing::Test::HasFatalFailure()) return;
  }
}

Scene proxied(const std::shared_ptr<const ReliefSurface>& surface, Sides sides, double friction) {
  Instance instance;
  instance.name = "test";
  instance.surface = surface;
  instance.sides = sides;
  instance.material.stiffness = stiffness;
  instance.material.static_friction = friction;
  instance.material.dynamic_friction = 0.7 * friction;
  return must(Scene::build({instance}, 0.0));
}

TEST(T5_pop_through, a_proxy_on_a_sheet_stays_on_the_side_it_came_from) {
  // Well away from the rim nothing leads around: the proxy of a probe that starts above stays above.
  Rng rng(51);
  for (std::size_t which = 0; which < 2; ++which) {
    const auto& [name, surface, cells] = closed_reliefs()[which];
    for (const double friction : {0.0, 0.4}) {
      for (const Sides sides : {Sides::both, Sides::front}) {
        const Scene scene = proxied(surface, sides, friction);
        int pressed = 0;
        const auto next = [&] {
          return Vec3(rng.uniform(-3e-3, 3e-3), rng.uniform(-3e-3, 3e-3), rng.uniform(-4e-3, 4e-3));
        };
        const auto check = [&, &label = name](int i, const Vec3& probe, const ForceSample& felt) {
          ASSERT_GT(felt.proxy.z(), 0.0) << label << ", tick " << i << ", probe " << probe.transpose();
          ASSERT_GE(felt.wrench.force.z(), 0.0) << label << ", tick " << i;
          pressed += felt.flags.has(TickFlag::contact) ? 1 : 0;
        };
        lead(scene, rng, Vec3(0.0, 0.0, 1e-3), 2000, next, check);
        EXPECT_GT(pressed, 200) << name;
      }
    }
  }
}

TEST(T5_pop_through, a_proxy_is_never_inside) {
  Rng rng(52);
  for (std::size_t which = 0; which < closed_reliefs().size(); ++which) {
    const auto& [name, surface, cells] = closed_reliefs()[which];
    const Tessellation& mesh = dense(which);
    const Box box = surface->bounds().grown(2e-3);
    for (const double friction : {0.0, 0.4}) {
      const Scene scene = proxied(surface, Sides::front, friction);
      int pressed = 0;
      const auto next = [&] {
        return Vec3(box.lower + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(box.extent()));
      };
      const auto check = [&, &label = name](int i, const Vec3& probe, const ForceSample& felt) {
        const double depth = depth_inside(mesh.index, felt.proxy);
        ASSERT_LT(depth, 2.0 * mesh.error + surface->skin())
            << label << ", friction " << friction << ", tick " << i << ", probe " << probe.transpose();
        if (felt.flags.has(TickFlag::contact)) {
          ++pressed;
          // Out of its budget it may still be on its way.
          if (unfinished(felt.flags)) return;
          ASSERT_GT(depth, -2.0 * mesh.error - surface->skin())
              << label << ", friction " << friction << ", tick " << i << ", probe " << probe.transpose()
              << ": it rests on the relief";
        } else {
          ASSERT_EQ(felt.proxy, probe) << label << ", tick " << i;
        }
      };
      lead(scene, rng, box.upper, 2000, next, check);
      EXPECT_GT(pressed, 100) << name;
    }
  }
}

TEST(T5_pop_through, a_proxy_on_an_open_sheet_passes_only_around_its_rim) {
  const auto surface = relief_on(mesh_of(trial_mesh_a({4, 4, 0.01})), {tiled(wavy_map(5e-4))},
                                 CoatSettings{Mapping::triplanar, Vec2::Ones(), {}});
  Rng rng(53);
  for (const double side : {1.0, -1.0}) {
    const Scene scene = proxied(surface, Sides::both, 0.0);
    const auto next = [&] {
      return Vec3(rng.uniform(-6e-3, 6e-3), rng.uniform(-6e-3, 6e-3), rng.uniform(-4e-3, 4e-3));
    };
    SurfaceCache hint;
    const auto check = [&](int i, const Vec3& probe, const ForceSample& felt) {
      const FieldSample at = surface->eval(felt.proxy, hint);
      ASSERT_GT(side * at.value, -surface->skin()) << "tick " << i << ", probe " << probe.transpose();
    };
    lead(scene, rng, Vec3(0.0, 0.0, side * 2e-3), 10000, next, check);
  }
}

/// What planes leave free, each `height` over a face of a concave mesh: a convex room, in which the proxy of a probe
/// is the point of it nearest to the probe.
class ConvexRoom {
 public:
  ConvexRoom(const TriangleMesh& mesh, double height) {
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
      const Vec3 normal = mesh.face_normal(face);
      planes_.push_back({normal, normal.dot(mesh.corners(face)[0]) + height});
    }
  }

  /// Brute force over all faces, edges and corners that any planes could have in common.
  [[nodiscard]] Vec3 nearest(const Vec3& p) const {
    Vec3 best = p;
    double distance = infinity;
    const auto offer = [&](const Vec3& point) {
      for (const Plane& plane : planes_) {
        if (plane.normal.dot(point) < plane.level - 1e-12) return;
      }
      if (const double now = (point - p).norm(); now < distance) {
        distance = now;
        best = point;
      }
    };
    offer(p);
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      offer(p - (planes_[i].normal.dot(p) - planes_[i].level) * planes_[i].normal);
      for (std::size_t j = 0; j < i; ++j) {
        const Vec3 along = planes_[i].normal.cross(planes_[j].normal);
        if (along.norm() < 1e-6) continue;
        offer(meeting(planes_[i], planes_[j], {along, along.dot(p)}));
        for (std::size_t k = 0; k < j; ++k) {
          if (std::abs(along.dot(planes_[k].normal)) > 1e-6) offer(meeting(planes_[i], planes_[j], planes_[k]));
        }
      }
    }
    return best;
  }

 private:
  struct Plane {
    Vec3 normal;
    double level;  // m
  };
  static Vec3 meeting(const Plane& a, const Plane& b, const Plane& c) {
    Mat3 normals;
    normals << a.normal.transpose(), b.normal.transpose(), c.normal.transpose();
    return normals.inverse() * Vec3(a.level, b.level, c.level);
  }
  std::vector<Plane> planes_;
};

TEST(T5_pop_through, valleys_sharper_than_a_right_angle_hold_the_proxy_at_the_nearest_point_of_their_room) {
  // Down to the angle below which directions would be so long that the relief is made lower instead.
  constexpr double height = 0.2e-3;
  const auto expect_held = [](const std::string& name, MeshSource source, double bottom) {
    const auto surface = coated(std::move(source), flat_map(height), Mapping::triplanar);
    const ConvexRoom room(surface->base().mesh(), height);
    const Scene scene = proxied(surface, Sides::both, 0.0);
    Rng rng(54);
    const Vec3 centre(0.0, 0.3e-3, bottom);
    const auto next = [&] { return Vec3(centre + random_point(rng, 1.5e-3)); };
    int pressed = 0;
    lead(scene, rng, centre + Vec3(0.0, 0.0, 2e-3), 5000, next, [&](int i, const Vec3& probe, const ForceSample& felt) {
      const Vec3 right = stiffness * (room.nearest(probe) - probe);
      pressed += right.norm() > 0.0 ? 1 : 0;
      // What the proxy's descent leaves undone.
      ASSERT_LT((felt.wrench.force - right).norm(), 5e-4) << name << ", tick " << i << ", probe " << probe.transpose();
    });
    EXPECT_GT(pressed, 3000) << name;
  };
  for (const double opening : {120.0, 91.0, 89.0, 75.0, 60.0, 45.0}) {
    const double half = 0.5 * opening * std::numbers::pi / 180.0;
    expect_held(std::to_string(opening) + " degrees", valley(2.0 * half, 0.02), height / std::sin(half));
  }
  // Six faces around one vertex: those that face each other turn by more than a right angle.
  MeshSource cup = trial_mesh_e(1, std::numbers::pi / 2.0, 0.01);
  const Vec3 vertex = cup.positions[0];
  expect_held("cup of six faces", std::move(cup), vertex.z() + height);
}

}  // namespace
}  // namespace asperity::pop_through_test
