// T3 (formulation D8): what is scanned at a constant 1 N is the relief, within 1 % of its amplitude, and the probe lies
// F / k under it along its normal. The relief is known apart from the library: as a formula, or as the spline of its
// texels solved by the test, laid on the base and joined by the definitions of mappings, directions and weights.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <functional>
#include <iostream>

#include "tests/render/analytic_relief.h"
#include "tests/render/spline_oracle.h"
#include "tests/surface/reliefs.h"

namespace asperity::reconstruction_test {
namespace {

using namespace test;

/// The relief near a point: how far the point is off it (m), and its unit normal there.
struct Truth {
  double off = 0.0;
  Vec3 normal = Vec3::UnitZ();
};
using TruthAt = std::function<Truth(const Vec3&)>;

struct Scan {
  double rms = 0.0;          ///< of the proxy off the true relief (m)
  double probe_error = 0.0;  ///< m, largest distance between the probe and where proxy, true normal and F / k put it
  int places = 0;

  void include(const Scan& other) {
    const int all = places + other.places;
    rms = std::sqrt((rms * rms * places + other.rms * other.rms * other.places) / all);
    probe_error = std::max(probe_error, other.probe_error);
    places = all;
  }
};

constexpr double press = 1.0;  // N

/// Leads a probe over `bases`, pressed against `axis` of each with 1 N, as slowly as can be.
class Scanner {
 public:
  explicit Scanner(Scene scene, const Vec3& outside) : scene_(std::move(scene)) { touch(scene_, state_, outside); }

  struct Held {
    Vec3 probe;
    Vec3 proxy;
    double force = 0.0;  // N
  };
  Held hold(const Vec3& base, const Vec3& axis, double& height) {
    Held held;
    for (int tick = 0; tick < 400; ++tick) {
      held.probe = base + height * axis;
      const Vec3 force = touch(scene_, state_, held.probe).wrench.force;
      held.proxy = state_.proxy;
      held.force = force.norm();
      const double missing = press - force.dot(axis);
      if (std::abs(missing) < 1e-7) return held;
      // At most down by as much as a spring of this stiffness needs: the height settles from above.
      height -= missing / stiffness;
    }
    ADD_FAILURE() << "no height over " << base.transpose() << " is pushed with 1 N";
    return held;
  }

 private:
  Scene scene_;
  ProxyState state_;
};

/// Over lines of a plane, whose frame `turn` is (z up).
template <class See>
void scan_lines(const std::shared_ptr<const ReliefSurface>& surface, const Mat3& turn, double reach, const See& see) {
  for (int line = 0; line < 4; ++line) {
    const double across = (-0.75 + 0.49 * line) * reach;
    double height = 3e-3;
    Scanner scanner(scene_of(surface, ProxyLaw{}), turn * Vec3(-reach, across, height));
    constexpr int places = 120;
    for (int i = 0; i <= places; ++i) {
      const double along = (-1.0 + 2.0 * i / places) * reach;
      see(scanner.hold(turn * Vec3(along, across + 0.1 * along, 0.0), turn.col(2), height));
    }
  }
}

Scan measured(const Scanner::Held& held, const Truth& truth) {
  return {std::abs(truth.off), (held.proxy - held.force / stiffness * truth.normal - held.probe).norm(), 1};
}

/// A relief that is a height over a plane.
struct PlaneTruth {
  Mat3 turn = Mat3::Identity();
  std::function<double(const Vec2&)> height;

  [[nodiscard]] Vec2 slope(const Vec2& at) const {
    constexpr double h = 1e-6;
    return Vec2(height(at + Vec2(h, 0.0)) - height(at - Vec2(h, 0.0)),
                height(at + Vec2(0.0, h)) - height(at - Vec2(0.0, h))) /
           (2.0 * h);
  }
  [[nodiscard]] Truth at(const Vec3& p) const {
    const Vec3 own = turn.transpose() * p;
    const Vec2 by = slope(own.head<2>());
    const Vec3 up(-by.x(), -by.y(), 1.0);
    return {(own.z() - height(own.head<2>())) / up.norm(), turn * up.normalized()};
  }
  /// The height over a base at which a spring of this stiffness pushes upwards with 1 N: the place x of the relief that
  /// holds it is where x + (F / k) slope(x) is the base. `from`: a place in the same basin.
  [[nodiscard]] double probe_height(const Vec2& base, Vec2 from) const {
    constexpr double depth = press / stiffness;
    constexpr double h = 1e-6;
    for (int i = 0; i < 50; ++i) {
      Eigen::Matrix2d change;
      for (int k = 0; k < 2; ++k) {
        const Vec2 step = h * Vec2::Unit(k);
        change.col(k) = Vec2::Unit(k) + depth * (slope(from + step) - slope(from - step)) / (2.0 * h);
      }
      const Vec2 missing = base - from - depth * slope(from);
      from += change.inverse() * missing;
      if (missing.norm() < 1e-12) break;
    }
    return height(from) - depth;
  }
};

void tell(const std::string& name, const Scan& scan, double amplitude) {
  std::cout << fmt::format("{}: RMS {:.4f} % of the amplitude, probe {:.3f} um off, {} places\n", name,
                           100.0 * scan.rms / amplitude, 1e6 * scan.probe_error, scan.places);
}

/// RMS of the proxy, and where the probe is: under it by F / k along the true normal, and, where `smooth`, at the
/// height that the truth alone predicts.
void expect_scanned(const std::string& name, const std::shared_ptr<const ReliefSurface>& surface,
                    const PlaneTruth& truth, double amplitude, double reach, double share, bool smooth,
                    double probe_error = 1e-6) {
  Scan scan;
  double height_error = 0.0;
  scan_lines(surface, truth.turn, reach, [&](const Scanner::Held& held) {
    scan.include(measured(held, truth.at(held.proxy)));
    const Vec3 probe = truth.turn.transpose() * held.probe;
    const Vec3 proxy = truth.turn.transpose() * held.proxy;
    if (smooth) {
      height_error = std::max(height_error, std::abs(probe.z() - truth.probe_height(probe.head<2>(), proxy.head<2>())));
    }
  });
  tell(name, scan, amplitude);
  EXPECT_LE(scan.rms, share * amplitude) << name;
  EXPECT_LE(scan.probe_error, probe_error) << name;
  EXPECT_LE(height_error, probe_error) << name;
}

const std::pair<Reconstruction, int> splines[] = {{Reconstruction::quadratic_bspline, 2}, {Reconstruction::bicubic, 3}};
// Of what the texels define nothing but rounding is lost (owed: 1 %).
constexpr double exact = 1e-4;

/// Texels, the map that the library makes of them and the spline that they define.
struct Sampled {
  std::shared_ptr<const Mesostructure> map;
  SplineOracle spline;

  Sampled(const std::vector<float>& texels, int size, Reconstruction how, int degree, double tile)
      : map(tiled(must(HeightMap::build(texels, size, size, Wrap::repeat, how)), tile)), spline(texels, size, degree) {}
  [[nodiscard]] double height(const Vec2& st) const { return spline.height(st.x(), st.y()); }
};

constexpr double amplitude = 0.5e-3;
constexpr double tile = 0.01;

/// Three unlike reliefs, smooth but for what 16 texels leave of them.
std::vector<Sampled> unlike(Reconstruction how, int degree) {
  constexpr int size = 16;
  constexpr double turn = 2.0 * std::numbers::pi;
  const std::function<double(const Vec2&)> formulas[] = {
      [](const Vec2& at) { return 0.5 * std::sin(turn * at.x()) + 0.5 * std::cos(turn * (at.x() + 2.0 * at.y())); },
      [](const Vec2& at) { return 0.6 * std::cos(turn * at.y() + 0.4); },
      [](const Vec2& at) { return std::sin(turn * (at.x() - at.y()) + 0.7); }};
  std::vector<Sampled> all;
  for (const auto& formula : formulas) {
    all.emplace_back(tabulated(size, size, [&](const Vec2& at) { return amplitude * formula(at); }), size, how, degree,
                     tile);
  }
  return all;
}

Mat3 leaning() {
  return Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vec3(0.5, 0.55, 0.67)).toRotationMatrix();
}

MeshSource turned(MeshSource source, const Mat3& turn) {
  for (Vec3& position : source.positions) position = turn * position;
  return source;
}

/// Shares of the three projections in a triplanar coat where the normal is n.
Vec3 triplanar_shares(const Vec3& n) {
  const Vec3 shares = (n.array().square() - 0.2 * n.squaredNorm()).max(0.0).square();
  return shares / shares.sum();
}
double triplanar_height(const Sampled& map, const Vec3& place, const Vec3& n) {
  const Vec3 shares = triplanar_shares(n);
  double height = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    height += shares[axis] * map.height(Vec2(place[(axis + 1) % 3], place[(axis + 2) % 3]) / tile);
  return height;
}

TEST(T3_reconstruction, a_cosine_on_a_plane_is_scanned_as_its_formula_says) {
  // The papers' relief: 0.5 mm, 5 mm from crest to crest, which bends with a radius of 1.27 mm: 1 N is held all over.
  constexpr double side = 0.02;
  constexpr double rate = 2.0 * std::numbers::pi / 5e-3;
  PlaneTruth truth;
  truth.height = [](const Vec2& at) { return amplitude * std::cos(rate * at.x()); };
  // By as much as the spline is off the formula's slope: 0.1 degrees.
  for (const auto& [how, degree] : splines) {
    const HeightMap map = map_of(
        128, [&](double s, double t) { return truth.height(side * Vec2(s - 0.5, t - 0.5)); }, Wrap::repeat, how);
    expect_scanned("cosine, degree " + std::to_string(degree), coated(plane_grid(side, side, 3, 4), map, Mapping::uv),
                   truth, amplitude, 0.45 * side, 0.01, true, 2e-6);
  }
}

TEST(T3_reconstruction, the_paper_s_reliefs_by_UVs_are_scanned_as_the_spline_of_their_texels) {
  constexpr double side = 0.04;
  for (const auto& [how, degree] : splines) {
    for (const MesostructureKind kind :
         {MesostructureKind::beams, MesostructureKind::rings, MesostructureKind::warts, MesostructureKind::groove}) {
      MesostructureSpec spec;
      spec.kind = kind;
      spec.size = 128;
      spec.amplitude = amplitude;
      spec.count = 4;
      const Sampled map(must(generate_heights(spec)), spec.size, how, degree, side);
      PlaneTruth truth;
      truth.height = [&](const Vec2& at) { return map.height(at / side + Vec2(0.5, 0.5)); };
      expect_scanned(std::string(paper_name(kind)) + ", degree " + std::to_string(degree),
                     relief_on(mesh_of(plane_grid(side, side, 6, 6)), {map.map}, {Mapping::uv, Vec2::Ones(), {}}),
                     truth, amplitude, 0.45 * side, exact, false);
    }
  }
}

TEST(T3_reconstruction, a_triplanar_coat_on_a_leaning_plane) {
  for (const auto& [how, degree] : splines) {
    const Sampled map = std::move(unlike(how, degree)[0]);
    PlaneTruth truth{leaning(), {}};
    const Vec3 normal = truth.turn.col(2);
    ASSERT_GT(triplanar_shares(normal).minCoeff(), 0.01) << "all three axes have a say";
    truth.height = [&](const Vec2& at) {
      return triplanar_height(map, truth.turn * Vec3(at.x(), at.y(), 0.0), normal);
    };
    expect_scanned("triplanar, degree " + std::to_string(degree),
                   relief_on(mesh_of(turned(trial_mesh_a({4, 4, 0.01}), truth.turn)), {map.map},
                             {Mapping::triplanar, Vec2::Ones(), {}}),
                   truth, amplitude, 0.012, exact, true);
  }
}

/// Heights of all faces of a flat mesh laid per face and blended by weights that sum to one (D3), on every place: the
/// products over the corners of S((b + rho) / (2 rho)), S the quintic, b the place's barycentric coordinates on the
/// face.
double stitched_height(const TriangleMesh& mesh, const std::vector<Sampled>& maps, double rho, const Vec3& place) {
  double weights = 0.0;
  double sum = 0.0;
  for (std::size_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(static_cast<std::uint32_t>(face));
    const Vec3 normal = (b - a).cross(c - a);
    const Vec3 at(normal.dot((c - b).cross(place - b)), normal.dot((a - c).cross(place - c)),
                  normal.dot((b - a).cross(place - a)));
    const Vec3 barycentric = at / normal.squaredNorm();
    double weight = 1.0;
    for (int k = 0; k < 3; ++k) {
      const double t = std::clamp((barycentric[k] + rho) / (2.0 * rho), 0.0, 1.0);
      weight *= t * t * t * (10.0 + t * (6.0 * t - 15.0));
    }
    if (weight == 0.0) continue;
    weights += weight;
    sum += weight * maps[face % maps.size()].height(
                        Vec2(barycentric[1] + 0.5 * barycentric[2], 0.5 * std::numbers::sqrt3 * barycentric[2]));
  }
  return sum / weights;
}

TEST(T3_reconstruction, unlike_maps_laid_per_face_and_stitched) {
  // As wide as equilateral triangles have room for: the bands of two edges reach a vertex together.
  constexpr double rho = 0.14;
  for (const auto& [how, degree] : splines) {
    const std::vector<Sampled> maps = unlike(how, degree);
    PlaneTruth truth{leaning(), {}};
    TriangleMesh mesh = mesh_of(turned(trial_mesh_a({4, 4, 0.01}), truth.turn));
    truth.height = [&](const Vec2& at) {
      return stitched_height(mesh, maps, rho, truth.turn * Vec3(at.x(), at.y(), 0.0));
    };
    expect_scanned("per face, degree " + std::to_string(degree),
                   relief_on(mesh, {maps[0].map, maps[1].map, maps[2].map},
                             {Mapping::per_face, Vec2::Ones(), {FoldMode::keep, Blend::quintic, rho, {}}}),
                   truth, amplitude, 0.012, exact, true);
  }
}

/// M_d,0 with a triplanar coat. By symmetry the direction of a vertex is its own, as long as makes heights metric over
/// the faces around it, and its smooth normal is its own too.
class IcosahedronTruth {
 public:
  IcosahedronTruth(const TriangleMesh& mesh, const Sampled& map) : mesh_(mesh), map_(map) {}

  [[nodiscard]] Truth at(const Vec3& p) const {
    Truth truth;
    double least = infinity;
    for (std::uint32_t face = 0; face < mesh_.triangles().size(); ++face) {
      const Vec3 place = inverted(face, p);
      if (std::min({place[0], place[1], 1.0 - place[0] - place[1]}) < -1e-9 || std::abs(place[2]) > least) continue;
      least = std::abs(place[2]);
      constexpr double h = 1e-5;
      const Vec3 along_u = point(face, place[0] + h, place[1]) - point(face, place[0] - h, place[1]);
      const Vec3 along_v = point(face, place[0], place[1] + h) - point(face, place[0], place[1] - h);
      truth.normal = along_u.cross(along_v).normalized();
      truth.off = (p - point(face, place[0], place[1])).dot(truth.normal);
    }
    EXPECT_LT(least, infinity) << p.transpose();
    return truth;
  }

 private:
  [[nodiscard]] Vec3 direction(std::uint32_t face, double u, double v) const {
    const auto [a, b, c] = mesh_.corners(face);
    const Vec3 normal = (b - a).cross(c - a).normalized();
    return ((1.0 - u - v) * a + u * b + v * c) / normal.dot(a);
  }
  [[nodiscard]] Vec3 base(std::uint32_t face, double u, double v) const {
    const auto [a, b, c] = mesh_.corners(face);
    return (1.0 - u - v) * a + u * b + v * c;
  }
  [[nodiscard]] Vec3 point(std::uint32_t face, double u, double v) const {
    const Vec3 place = base(face, u, v);
    return place + triplanar_height(map_, place, place) * direction(face, u, v);
  }
  /// (u, v, height) of a point over a face: directions are parallel to places, so the ray from the centre tells.
  [[nodiscard]] Vec3 inverted(std::uint32_t face, const Vec3& p) const {
    const auto [a, b, c] = mesh_.corners(face);
    Mat3 corners;
    corners << a, b, c;
    const Vec3 shares = corners.inverse() * p;
    const double sum = shares.sum();
    const Vec3 normal = (b - a).cross(c - a).normalized();
    return {shares[1] / sum, shares[2] / sum, (sum - 1.0) * normal.dot(a)};
  }

  const TriangleMesh& mesh_;
  const Sampled& map_;
};

/// Over two circles around the origin, of directions `first` and `second` at right angles in each.
template <class See>
void scan_circles(const std::shared_ptr<const ReliefSurface>& surface, double radius, const See& see) {
  for (const auto& [first, second] :
       {std::pair(Vec3(1.0, 0.3, 0.2), Vec3(-0.3, 1.0, 0.1)), std::pair(Vec3(0.2, -0.4, 1.0), Vec3(1.0, 0.7, 0.08))}) {
    const Vec3 one = first.normalized();
    const Vec3 other = (second - second.dot(one) * one).normalized();
    double height = radius + 3e-3;
    Scanner scanner(scene_of(surface, ProxyLaw{}), height * one);
    constexpr int places = 400;
    for (int i = 0; i <= places; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / places;
      const Vec3 out = std::cos(angle) * one + std::sin(angle) * other;
      see(scanner.hold(Vec3::Zero(), out, height));
    }
  }
}

void expect_scanned_around(const std::string& name, const std::shared_ptr<const ReliefSurface>& surface,
                           const TruthAt& truth, double radius, double height, double share, double probe_error) {
  Scan scan;
  scan_circles(surface, radius, [&](const Scanner::Held& held) { scan.include(measured(held, truth(held.proxy))); });
  tell(name, scan, height);
  EXPECT_LE(scan.rms, share * height) << name;
  EXPECT_LE(scan.probe_error, probe_error) << name;
}

TEST(T3_reconstruction, a_triplanar_coat_round_the_icosahedron) {
  constexpr double radius = 0.02;
  for (const auto& [how, degree] : splines) {
    const Sampled map = std::move(unlike(how, degree)[0]);
    const TriangleMesh mesh = mesh_of(icosphere(0, radius));
    const IcosahedronTruth truth(mesh, map);
    expect_scanned_around(
        "icosahedron, degree " + std::to_string(degree),
        relief_on(mesh, {map.map}, {Mapping::triplanar, Vec2::Ones(), {}}), [&](const Vec3& p) { return truth.at(p); },
        radius, amplitude, exact, 1e-6);
  }
}

TEST(T3_reconstruction, a_displaced_sphere_baked_onto_a_coarse_base_is_scanned_as_its_formula_says) {
  const WavySphere sphere;
  for (const auto& [how, degree] : splines) {
    const auto truth = [&](const Vec3& p) {
      const Vec3 normal = sphere.normal(p);
      return Truth{sphere.level(p) * normal.dot(p.normalized()), normal};
    };
    // By as much as the spline of the bake is off the formula's slope: 0.1 degrees.
    expect_scanned_around("displaced sphere, degree " + std::to_string(degree), baked(sphere, 3, 40, how), truth,
                          sphere.radius, sphere.amplitude, 0.01, 2e-6);
  }
}

}  // namespace
}  // namespace asperity::reconstruction_test
