// T2 on steep and stitched reliefs (formulation D8 with amendments 1 and 5): the modulus of the force, its second
// differences where it is promised to be C1, and the proxy over folds of every angle.
//
// What is promised. The potential laws' force is -k Phi grad Phi: of the class of the heights less one. The proxy's is
// k (x - p), x the nearest point: below the radius of the crests of the class of the relief less one too. Heights are
// C1 by the quadratic spline and C2 by the cubic one; the quintic blend is C2, the s-shaped one C1.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <array>
#include <iostream>
#include <string>

#include "tests/render/fixtures.h"
#include "tests/surface/reliefs.h"

namespace asperity::steep_continuity_test {
namespace {

using namespace test;

/// A way of class C2 through space: the uniform cubic B-spline of its control points.
class Way {
 public:
  explicit Way(std::vector<Vec3> controls) : controls_(std::move(controls)) {
    for (std::size_t i = 2; i + 1 < controls_.size(); ++i) length_ += (controls_[i] - controls_[i - 1]).norm();
  }
  static Way straight(const Vec3& from, const Vec3& to) {
    std::vector<Vec3> controls;
    for (int i = -1; i <= 3; ++i) controls.emplace_back(from + 0.5 * i * (to - from));
    return Way(std::move(controls));
  }
  /// Along the relief over the line between two places, about `depth` under it.
  static Way under(const ReliefSurface& surface, const Vec3& from, const Vec3& to, const Vec3& up, double depth,
                   double spacing) {
    const int pieces = static_cast<int>(std::lround((to - from).norm() / spacing));
    SurfaceCache cache;
    std::vector<Vec3> controls;
    for (int i = -1; i <= pieces + 1; ++i) {
      const Vec3 base = from + static_cast<double>(i) / pieces * (to - from);
      const SweptHit hit = surface.view(cache).first_touch({base + 0.02 * up, base - 0.02 * up}, Sides::both);
      EXPECT_TRUE(hit.hit);
      controls.emplace_back(hit.contact.point - depth * hit.contact.normal);
    }
    return Way(std::move(controls));
  }

  [[nodiscard]] Vec3 at(double share) const {
    const auto pieces = static_cast<int>(controls_.size()) - 3;
    const double along = share * pieces;
    const int piece = std::clamp(static_cast<int>(along), 0, pieces - 1);
    const double t = along - piece;
    const double s = 1.0 - t;
    const Vec3* c = controls_.data() + piece;
    return (s * s * s * c[0] + (3.0 * t * t * (t - 2.0) + 4.0) * c[1] + (3.0 * s * s * (s - 2.0) + 4.0) * c[2] +
            t * t * t * c[3]) /
           6.0;
  }
  [[nodiscard]] double length() const { return length_; }

 private:
  std::vector<Vec3> controls_;
  double length_ = 0.0;
};

/// How the force changes along a way cut into equal steps.
struct Change {
  double jump = 0.0;      ///< N, the largest in one step
  double modulus = 0.0;   ///< N/m, that by the step
  double bend = 0.0;      ///< N/m^2, the largest second difference by the square of the step
  double steepest = 0.0;  ///< degrees between the force and `up`
  int free = 0;           ///< places without a force
};

/// What one tick leaves undone of the proxy's descent (1e-4 of a grain) would drown the differences of small steps:
/// `at_rest` the probe waits at each place until its force stays.
Change change_along(const Scene& scene, const Way& way, const Vec3& up, double step, bool at_rest) {
  const int count = static_cast<int>(std::lround(way.length() / step));
  const double size = way.length() / count;
  ProxyState state;
  touch(scene, state, way.at(0.0) + 0.02 * up);
  Change change;
  Vec3 last = Vec3::Zero();
  Vec3 before = Vec3::Zero();
  for (int i = 0; i <= count; ++i) {
    const Vec3 probe = way.at(static_cast<double>(i) / count);
    Vec3 force = touch(scene, state, probe).wrench.force;
    constexpr int most_ticks = 60;
    for (int waited = 0; at_rest && waited < most_ticks; ++waited) {
      const Vec3 now = touch(scene, state, probe).wrench.force;
      const bool stays = (now - force).norm() <= 1e-12;
      force = now;
      if (stays) break;
    }
    if (force.isZero()) {
      ++change.free;
    } else {
      change.steepest = std::max(change.steepest, std::acos(force.normalized().dot(up)) * 180.0 / std::numbers::pi);
    }
    if (i > 0) change.jump = std::max(change.jump, (force - last).norm());
    if (i > 1) change.bend = std::max(change.bend, (force - 2.0 * last + before).norm() / (size * size));
    before = last;
    last = force;
  }
  change.modulus = change.jump / size;
  return change;
}

/// By what share the ratios that a test expects were missed at most.
class Miss {
 public:
  explicit Miss(std::string what) : what_(std::move(what)) {}
  ~Miss() { std::cout << fmt::format("{}: within {:.1f} % in {} ratios\n", what_, 100.0 * most_, count_); }
  Miss(const Miss&) = delete;
  Miss& operator=(const Miss&) = delete;
  void expect_one(double ratio, const std::string& name) {
    EXPECT_NEAR(ratio, 1.0, 0.2) << name;
    most_ = std::max(most_, std::abs(ratio - 1.0));
    ++count_;
  }

 private:
  std::string what_;
  double most_ = 0.0;
  int count_ = 0;
};

/// C0: the largest change falls tenfold with the step, within 20 %, from 20 um to `finest`.
void expect_modulus_stays(Miss& miss, const Scene& scene, const Way& way, const Vec3& up, const std::string& name,
                          double finest = 2e-7) {
  Change coarse = change_along(scene, way, up, 2e-5, true);
  EXPECT_GT(coarse.modulus, 0.0) << name;
  for (const double step : {2e-6, 2e-7}) {
    if (step < finest) break;
    const Change fine = change_along(scene, way, up, step, true);
    miss.expect_one(fine.modulus / coarse.modulus, fmt::format("{}, step {}, {} N/m", name, step, fine.modulus));
    EXPECT_EQ(fine.free, 0) << name;
    coarse = fine;
  }
}

/// C1: the largest second difference falls with the square of the step, to a twenty-fifth with a fifth, within 20 %.
void expect_bend_stays(Miss& miss, const Scene& scene, const Way& way, const Vec3& up, const std::string& name) {
  // Below, rounding of the distances that a descent compares (1e-11 m) is all that changes.
  const double coarse = change_along(scene, way, up, 5e-6, true).bend;
  const Change fine = change_along(scene, way, up, 1e-6, true);
  EXPECT_GT(coarse, 0.0) << name;
  miss.expect_one(fine.bend / coarse, fmt::format("{}, {} N/m^2", name, coarse));
  EXPECT_EQ(fine.free, 0) << name;
}

/// C0 and no more: it falls tenfold, as the jumps of a derivative do (half or twice that, by where steps meet them).
void expect_bend_grows(const Scene& scene, const Way& way, const Vec3& up, const std::string& name) {
  const double coarse = change_along(scene, way, up, 1e-5, true).bend;
  const double fine = change_along(scene, way, up, 1e-7, true).bend;
  EXPECT_GT(fine, 10.0 * coarse) << name << ", " << coarse << " N/m^2";
}

/// M_a in a plane that leans to all three axes, so that three projections of a triplanar coat are mixed on it.
struct LeaningMesh {
  Mat3 turn = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vec3(0.5, 0.55, 0.67)).toRotationMatrix();
  TriangleMesh mesh = built(turn);

  static TriangleMesh built(const Mat3& turn) {
    MeshSource source = trial_mesh_a({4, 4, 0.01});
    for (Vec3& position : source.positions) position = turn * position;
    return mesh_of(std::move(source));
  }
  [[nodiscard]] Vec3 up() const { return turn.col(2); }
};

/// Lines through the base around its vertex nearest to the middle: through it, past it, and across edges of all three
/// directions.
struct Line {
  std::string name;
  Vec3 from;
  Vec3 to;
};
std::vector<Line> lines_over(const LeaningMesh& base) {
  Vec3 vertex = base.mesh.positions().front();
  for (const Vec3& position : base.mesh.positions()) vertex = position.norm() < vertex.norm() ? position : vertex;
  const auto at = [&](double x, double y) {
    return Vec3(vertex + base.mesh.mean_edge() * (base.turn * Vec3(x, y, 0.0)));
  };
  return {{"through a vertex", at(-0.27, -0.09), at(0.27, 0.09)},
          {"past a vertex", at(-0.3, 0.01), at(0.3, 0.02)},
          {"across edges", at(0.1, -0.35), at(0.65, 0.4)}};
}

// Waves of 10 and 5 mm as high as this slope by up to 65 degrees; their crests bend with a radius of 0.45 mm and more.
constexpr double steep = 2e-3;
constexpr double below_crests = 0.1e-3;

struct Dress {
  std::string name;
  Mapping mapping;
  double repeat;
};
/// How unlike maps are laid on the faces. One repeat is 10 mm in each: a face's side, a tile, a quarter of the sheet.
const std::array<Dress, 3> dresses = {
    {{"per face", Mapping::per_face, 1.0}, {"by UVs", Mapping::uv, 4.0}, {"triplanar", Mapping::triplanar, 1.0}}};

std::shared_ptr<const ReliefSurface> steep_relief(const LeaningMesh& base, const Dress& dress, Reconstruction how,
                                                  Blend blend = Blend::quintic) {
  return relief_on(base.mesh, unlike_maps(steep, 0.01, how),
                   CoatSettings{dress.mapping, Vec2::Constant(dress.repeat), {FoldMode::keep, blend, 0.2, {}}});
}

/// A potential law's way lies under all heights, straight; the proxy's follows the relief below its crests' radius.
Way way_for(const std::string& law, const ReliefSurface& surface, const Line& line, const Vec3& up) {
  if (law == "proxy") return Way::under(surface, line.from, line.to, up, below_crests, 0.25e-3);
  const Vec3 down = -1.1 * surface.coat().amplitude_bound() * up;
  return Way::straight(line.from + down, line.to + down);
}

template <class Expect>
void over_steep_stitched_reliefs(const char* law, Reconstruction how, Blend blend, const Expect& expect) {
  const LeaningMesh base;
  for (const Dress& dress : dresses) {
    const auto surface = steep_relief(base, dress, how, blend);
    ASSERT_TRUE(surface->coat().has_seams());
    const Scene scene = scene_of(surface, named(law));
    double steepest = 0.0;
    for (const Line& line : lines_over(base)) {
      const Way way = way_for(law, *surface, line, base.up());
      expect(scene, way, base.up(), std::string(law) + ", " + dress.name + ", " + line.name);
      steepest = std::max(steepest, change_along(scene, way, base.up(), 2e-5, false).steepest);
    }
    EXPECT_GT(steepest, 55.0) << dress.name;
    EXPECT_LT(steepest, 75.0) << dress.name;
  }
}

TEST(T2_continuity, on_steep_stitched_reliefs_of_every_mapping) {
  Miss miss("modulus over steep stitched reliefs");
  for (const char* law : {"mesostructure", "proxy"})
    over_steep_stitched_reliefs(law, Reconstruction::quadratic_bspline, Blend::quintic,
                                [&](const auto&... about) { expect_modulus_stays(miss, about...); });
}

TEST(T2_continuity, of_heights_and_blends_of_class_C2_the_force_is_C1) {
  Miss miss("second differences over steep stitched reliefs of class C2");
  for (const char* law : {"mesostructure", "proxy"})
    over_steep_stitched_reliefs(law, Reconstruction::bicubic, Blend::quintic,
                                [&](const auto&... about) { expect_bend_stays(miss, about...); });
}

TEST(T2_continuity, of_heights_or_blends_of_class_C1_the_force_is_C0_and_no_more) {
  const LeaningMesh base;
  const Line line = lines_over(base)[1];
  for (const char* law : {"mesostructure", "proxy"}) {
    for (const auto& [how, blend] : {std::pair(Reconstruction::quadratic_bspline, Blend::quintic),
                                     std::pair(Reconstruction::bicubic, Blend::s_shape)}) {
      const auto surface = steep_relief(base, dresses[0], how, blend);
      expect_bend_grows(scene_of(surface, named(law)), way_for(law, *surface, line, base.up()), base.up(), law);
    }
  }
}

/// Short lines over a round mesh near a direction: square over the middle of an edge, and past a vertex.
std::vector<Line> lines_near(const TriangleMesh& mesh, const Vec3& direction) {
  const auto nearest = [&](const auto& places) {
    Vec3 best = places.front();
    for (const Vec3& place : places) best = place.dot(direction) > best.dot(direction) ? place : best;
    return best;
  };
  std::vector<Vec3> middles;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k)
      middles.emplace_back(0.5 * (mesh.corners(face)[k] + mesh.corners(face)[(k + 1) % 3]));
  }
  const Vec3 middle = nearest(middles);
  const Vec3 vertex = nearest(mesh.positions());
  const Vec3 across = middle.cross(vertex - middle).normalized();
  const Vec3 past = vertex + 0.5e-3 * across;
  const Vec3 along = (vertex - middle).normalized();
  return {{"over an edge", middle - 3.2e-3 * across, middle + 3.2e-3 * across},
          {"past a vertex", past - 3.2e-3 * along, past + 3.2e-3 * along}};
}

/// Over M_d,1, whose faces fold by up to 22 degrees, where one axis alone lays a triplanar coat and where two do.
TEST(T2_continuity, on_steep_reliefs_round_a_sphere_whose_folds_are_rounded) {
  Miss miss("modulus round a sphere");
  const TriangleMesh mesh = mesh_of(icosphere(1, 0.04));
  for (const auto& [mapping, repeat] : {std::pair(Mapping::triplanar, 1.0), std::pair(Mapping::per_face, 2.5)}) {
    const auto surface =
        relief_on(mesh, unlike_maps(1.5e-3),
                  CoatSettings{mapping, Vec2::Constant(repeat), {FoldMode::round, Blend::quintic, 0.15, {}}});
    ASSERT_TRUE(surface->report().fits());
    for (const auto& [law, depth] : {std::pair("mesostructure", 0.4e-3), std::pair("proxy", 0.1e-3)}) {
      const Scene scene = scene_of(surface, named(law));
      double steepest = 0.0;
      for (const Vec3 up : {Vec3(0.1, 0.2, 1.0).normalized(), Vec3(0.8, 0.1, 0.8).normalized()}) {
        if (mapping == Mapping::per_face && up.x() > 0.5) continue;
        for (const Line& line : lines_near(mesh, up)) {
          const Way way = Way::under(*surface, line.from, line.to, up, depth, 0.2e-3);
          const std::string name = fmt::format("{}, {}, {}", law, to_string(mapping), line.name);
          // Rounded reliefs are dear, and a proxy at rest the more.
          expect_modulus_stays(miss, scene, way, up, name, std::string(law) == "proxy" ? 2e-6 : 2e-7);
          steepest = std::max(steepest, change_along(scene, way, up, 2e-5, false).steepest);
        }
      }
      EXPECT_GT(steepest, 45.0) << law;
    }
  }
}

constexpr double roof_side = 0.04;  // m
constexpr double roof_band = 0.08;  // of the height of a triangle over the ridge: 3.2 mm

/// Flat heights on the four faces of a roof that is bent down by `degrees`; below 0 it is a valley.
std::shared_ptr<const ReliefSurface> roof_relief(double degrees, const std::array<double, 4>& heights, FoldMode folds) {
  std::vector<std::shared_ptr<const Mesostructure>> maps;
  for (const double height : heights) maps.push_back(tiled(flat_map(height)));
  return relief_on(mesh_of(roof(degrees * std::numbers::pi / 180.0, roof_side)), std::move(maps),
                   CoatSettings{Mapping::per_face, Vec2::Ones(), {folds, Blend::quintic, roof_band, {}}});
}
constexpr std::array<double, 4> equal = {1e-4, 1e-4, 1e-4, 1e-4};
constexpr std::array<double, 4> unequal = {1e-4, 2e-4, 2.5e-4, 3e-4};

TEST(T2_continuity, in_valleys_of_every_angle_the_proxys_force_never_changes_faster_than_the_probe) {
  // What lies free above a valley is convex: the way to the nearest point of it changes by no more than the probe
  // moves, however deep that is (and, over the fold itself, by as much).
  for (int degrees = -150; degrees < 0; degrees += 30) {
    const auto surface = roof_relief(degrees, equal, FoldMode::keep);
    const Scene scene = scene_of(surface, ProxyLaw{});
    for (const double depth : {0.1e-3, 1e-3}) {
      const Vec3 under(0.0, 0.0, 1e-4 / std::cos(0.5 * degrees * std::numbers::pi / 180.0) - depth);
      const Way way = Way::straight(under + Vec3(-1.5e-3, 0.7e-3, 0.0), under + Vec3(1.5e-3, 0.7e-3, 0.0));
      for (const double step : {1e-5, 1e-6}) {
        EXPECT_NEAR(change_along(scene, way, Vec3::UnitZ(), step, true).modulus, stiffness, 1e-3 * stiffness)
            << degrees << " degrees, " << depth << " m deep, step " << step;
      }
    }
  }
}

TEST(T2_continuity, the_proxy_over_all_dihedrals_with_unequal_heights_where_folds_are_rounded) {
  Miss miss("modulus of the proxy over rounded folds");
  for (int degrees = -150; degrees <= 150; degrees += 30) {
    const double slope = std::tan(0.5 * degrees * std::numbers::pi / 180.0);
    // Of two planes blended over a band of half width w the crest bends with a radius of w / (3.75 slope).
    const double crest = degrees > 0 ? roof_band * roof_side / (3.75 * slope) : infinity;
    const double depth = std::min(0.1 * crest, 0.1e-3);
    const auto surface = roof_relief(degrees, unequal, FoldMode::round);
    const double reach = 4e-3 / std::hypot(1.0, slope);
    const Way way =
        Way::under(*surface, Vec3(-reach, 0.6e-3, 0.0), Vec3(reach, 0.8e-3, 0.0), Vec3::UnitZ(), depth, 0.01 * reach);
    const std::string name = std::to_string(degrees) + " degrees";
    const Scene scene = scene_of(surface, ProxyLaw{});
    // In a valley of 30 degrees directions are shorter than its angle asks for; descents end up to 0.3 um early there.
    expect_modulus_stays(miss, scene, way, Vec3::UnitZ(), name, degrees == -150 ? 2e-6 : 2e-7);
    EXPECT_LE(change_along(scene, way, Vec3::UnitZ(), 2e-6, true).modulus, stiffness) << name;
  }
}

TEST(T2_continuity, the_mesostructure_law_is_C1_over_all_dihedrals_with_unequal_heights_where_folds_are_rounded) {
  Miss miss("second differences of the mesostructure law over rounded folds");
  for (int degrees = -150; degrees <= 150; degrees += 30) {
    const auto surface = roof_relief(degrees, unequal, FoldMode::round);
    const double reach = 4e-3 * std::cos(0.5 * degrees * std::numbers::pi / 180.0);
    const Way way =
        Way::under(*surface, Vec3(-reach, 0.6e-3, 0.0), Vec3(reach, 0.8e-3, 0.0), Vec3::UnitZ(), 0.05e-3, 0.01 * reach);
    expect_bend_stays(miss, scene_of(surface, named("mesostructure")), way, Vec3::UnitZ(),
                      std::to_string(degrees) + " degrees");
  }
}

TEST(T2_continuity, over_a_ridge_that_stays_sharp_the_proxys_force_jumps_by_what_the_fold_says_however_short_the_step) {
  // Amendment 5: k d sin(fold), where from one flank the other holds the probe still; beyond a right angle it lets go.
  for (int degrees = 30; degrees <= 120; degrees += 30) {
    const double fold = degrees * std::numbers::pi / 180.0;
    const Scene scene = scene_of(roof_relief(degrees, equal, FoldMode::keep), ProxyLaw{});
    constexpr double below = 0.2e-3;
    const double depth = below / std::cos(0.5 * fold);
    const double right = stiffness * depth * (degrees < 90 ? std::sin(fold) : 1.0);
    const Vec3 under(0.0, 0.0, 1e-4 / std::cos(0.5 * fold) - below);
    // Up to where it has slipped and is held again.
    const double reach = 0.8 * depth * std::sin(0.5 * fold);
    const Way way = Way::straight(under + Vec3(-reach, 0.6e-3, 0.0), under + Vec3(1.3 * reach, 0.6e-3, 0.0));
    for (const double step : {2e-6, 2e-7}) {
      EXPECT_NEAR(change_along(scene, way, Vec3::UnitZ(), step, true).jump, right, 0.03 * right)
          << degrees << " degrees, step " << step;
    }
  }
}

}  // namespace
}  // namespace asperity::steep_continuity_test
