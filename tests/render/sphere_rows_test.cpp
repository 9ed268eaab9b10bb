// Row H-II on M_d,j (hrm-2010, Test II), against dense reliefs that are made here.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/render/relief_scans.h"

namespace asperity::sphere_rows_test {
namespace {

using namespace test;

/// M_d,j with a coat, and the relief on it as its definition says (formulation D2): over each place of a face its
/// height, along directions that are interpolated between the vertices; those lie on the sphere's rays, as long as
/// brings N . n to 1 over the faces around.
struct Sphere {
  static constexpr double tile = 0.02;  // m, of a triplanar coat

  Texels texels;
  Mapping mapping;
  std::shared_ptr<const ReliefSurface> surface;
  std::vector<Vec3> directions;  ///< one a vertex
  std::vector<Vec3> normals;     ///< one a vertex: the mean over the faces around, by their angles

  Sphere(MesostructureKind kind, int subdivisions, Mapping how)
      : texels({.kind = kind, .size = 256, .amplitude = amplitude, .count = 3}),
        mapping(how),
        surface(
            coated(icosphere(subdivisions, icosphere_radius_for_edge(subdivisions, 0.01)), texels.map(), how, tile)) {
    const TriangleMesh& base = mesh();
    for (std::uint32_t vertex = 0; vertex < base.positions().size(); ++vertex) {
      const Vec3 ray = base.positions()[vertex].normalized();
      Vec3 normal = Vec3::Zero();
      double once = 0.0;
      double twice = 0.0;
      for (std::uint32_t face = 0; face < base.triangles().size(); ++face) {
        const auto& corners = base.triangles()[face];
        const auto k = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), vertex) - corners.begin());
        if (k == 3) continue;
        const Vec3 one = base.positions()[corners[(k + 1) % 3]] - base.positions()[vertex];
        const Vec3 other = base.positions()[corners[(k + 2) % 3]] - base.positions()[vertex];
        const Vec3 n = one.cross(other).normalized();
        const double angle = std::acos(one.normalized().dot(other.normalized()));
        normal += angle * n;
        once += angle * n.dot(ray);
        twice += angle * std::pow(n.dot(ray), 2);
      }
      normals.push_back(normal.normalized());
      directions.emplace_back(once / twice * ray);
    }
  }

  [[nodiscard]] const TriangleMesh& mesh() const { return surface->base().mesh(); }

  [[nodiscard]] double height(std::uint32_t face, const Vec3& at) const {
    if (mapping == Mapping::per_face) return texels.height({at[1] + 0.5 * at[2], 0.5 * std::numbers::sqrt3 * at[2]});
    const auto& corners = mesh().triangles()[face];
    const Vec3 point = point_on(mesh(), face, at) / tile;
    const Vec3 normal = at[0] * normals[corners[0]] + at[1] * normals[corners[1]] + at[2] * normals[corners[2]];
    double sum = 0.0;
    double total = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double weight = std::pow(std::max(0.0, std::pow(normal[axis], 2) - 0.2 * normal.squaredNorm()), 2);
      total += weight;
      sum += weight * texels.height({point[(axis + 1) % 3], point[(axis + 2) % 3]});
    }
    return sum / total;
  }
};

/// Where a law without heights, which touches the base, meets a step of the coat within a texel.
bool near_step(const Sphere& sphere, std::uint32_t face, const Vec3& at) {
  double low = infinity;
  double high = -infinity;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      const double h = sphere.height(face, at + Vec3(-0.5 * (i + j), 0.5 * i, 0.5 * j) / sphere.texels.size());
      low = std::min(low, h);
      high = std::max(high, h);
    }
  }
  return high - low > 0.25 * amplitude;
}

/// The relief over one face in small triangles.
class DenseFace {
 public:
  DenseFace(const Sphere& sphere, std::uint32_t face) {
    const auto corners = sphere.mesh().corners(face);
    const auto& vertices = sphere.mesh().triangles()[face];
    const Vec3 way = corners[1] - corners[0];
    normal_ = way.cross(corners[2] - corners[0]).normalized();
    along_ = way.normalized();
    across_ = normal_.cross(along_);
    for (int row = 0; row <= cuts; ++row) {
      for (int column = 0; column + row <= cuts; ++column) {
        const Vec3 at(1.0 - (column + row) / static_cast<double>(cuts), column / static_cast<double>(cuts),
                      row / static_cast<double>(cuts));
        Vec3 point = Vec3::Zero();
        Vec3 direction = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
          point += at[static_cast<int>(k)] * corners[k];
          direction += at[static_cast<int>(k)] * sphere.directions[vertices[k]];
        }
        points_.push_back(as_seen(point + sphere.height(face, at) * direction));
      }
    }
  }

  [[nodiscard]] const Vec3& normal() const { return normal_; }

  /// Where a probe that comes straight down on the face first meets the relief.
  struct Met {
    double height = -infinity;  ///< m, over the point that is asked about
    double upright = 0.0;       ///< cosine between the relief's normal there and the face's
    bool inside = false;        ///< away from the face's edges, where other faces have a say
  };
  [[nodiscard]] Met over(const Vec3& base) const {
    const Vec3 foot = as_seen(base);
    Met met;
    for (int row = 0; row < cuts; ++row) {
      for (int column = 0; column + row < cuts; ++column) {
        const Vec3& a = points_[index(column, row)];
        // Far from here: rays lean by less than a small part of the face.
        if ((a - foot).head<2>().squaredNorm() > std::pow(2e-3, 2)) continue;
        const bool inside = std::min({row, column, cuts - row - column}) > cuts / 10;
        add(a, points_[index(column + 1, row)], points_[index(column, row + 1)], foot, inside, met);
        if (column + row + 1 == cuts) continue;
        add(points_[index(column + 1, row)], points_[index(column + 1, row + 1)], points_[index(column, row + 1)], foot,
            inside, met);
      }
    }
    return met;
  }

 private:
  static constexpr int cuts = 200;

  static std::size_t index(int column, int row) {
    return static_cast<std::size_t>(row * (cuts + 1) - row * (row - 1) / 2 + column);
  }
  /// Along the face, and over it.
  [[nodiscard]] Vec3 as_seen(const Vec3& p) const { return {p.dot(along_), p.dot(across_), p.dot(normal_)}; }
  static void add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& foot, bool inside, Met& met) {
    const Vec3 cross = (b - a).cross(c - a);
    if (cross.z() <= 0.0) return;
    const auto area = [&](const Vec3& p, const Vec3& q) {
      return (p.x() - foot.x()) * (q.y() - foot.y()) - (p.y() - foot.y()) * (q.x() - foot.x());
    };
    const Vec3 share = Vec3(area(b, c), area(c, a), area(a, b)) / cross.z();
    if (share.minCoeff() < 0.0) return;
    const double height = share[0] * a.z() + share[1] * b.z() + share[2] * c.z() - foot.z();
    if (height > met.height) met = {height, cross.z() / cross.norm(), inside};
  }

  Vec3 normal_;
  Vec3 along_;
  Vec3 across_;
  std::vector<Vec3> points_;
};

/// Over the insides of faces of M_d,j.
void expect_heights_on_sphere(MesostructureKind kind, int subdivisions, Mapping mapping) {
  // N; small, for of a slope force shading's depth has the secant.
  constexpr double force = 0.01;
  constexpr int count = 60;
  const Sphere sphere(kind, subdivisions, mapping);
  const std::vector<std::string> laws{"force-shading-literal", "force-shading", "proxy", "height-field",
                                      "mesostructure"};
  std::vector<Score> scores(laws.size());
  Rng rng(5);
  for (int way = 0; way < 6; ++way) {
    const std::uint32_t face = random_face(rng, sphere.mesh());
    const DenseFace relief(sphere, face);
    // Per face along t = 0.28: over a peak of H_3, its ring and the hole in that. Over the bumps several ways.
    const bool bumps = kind == MesostructureKind::warts;
    const Vec3 from = bumps ? Vec3(0.70 - 0.03 * way, 0.15 + 0.03 * way, 0.15) : Vec3(0.48, 0.20, 0.32);
    const Vec3 to = bumps ? Vec3(0.15, 0.25 + 0.04 * way, 0.60 - 0.04 * way) : Vec3(0.13, 0.55, 0.32);
    std::vector<DenseFace::Met> met;
    std::vector<bool> step;
    for (const Vec3& at : line(from, to, count)) {
      met.push_back(relief.over(point_on(sphere.mesh(), face, at)));
      step.push_back(near_step(sphere, face, at));
    }
    for (std::size_t k = 0; k < laws.size(); ++k) {
      const bool shades = laws[k].starts_with("force-shading");
      const Scan felt = scan(scene_of(sphere.surface, named(laws[k])), point_on(sphere.mesh(), face, from),
                             point_on(sphere.mesh(), face, to), count, force, relief.normal());
      for (std::size_t i = 1; i + 1 < met.size(); ++i) {
        // Next to a wall the height under the probe depends on where exactly it stands (amendment 16).
        const double upright = std::min({met[i - 1].upright, met[i].upright, met[i + 1].upright});
        if (shades ? step[i] : upright < 0.8 || !met[i].inside) continue;
        EXPECT_NEAR(felt.pushes[i], force, 0.01 * force) << laws[k];
        scores[k].add(felt.heights[i], shades ? 0.0 : met[i].height);
      }
    }
  }
  for (std::size_t k = 0; k < laws.size(); ++k) {
    EXPECT_GT(scores[k].samples(), 100) << laws[k];
    EXPECT_LT(scores[k].rms(), 0.02 * amplitude) << laws[k] << " over " << paper_name(kind);
    if (laws[k].starts_with("force-shading")) {
      EXPECT_LT(scores[k].excursion(), 0.05 * amplitude) << laws[k] << " over " << paper_name(kind);
    } else {
      EXPECT_GT(scores[k].excursion(), 0.4 * amplitude) << laws[k] << " over " << paper_name(kind);
    }
  }
}
TEST(H_II, reliefs_are_followed_on_M_d_0_per_face) {
  expect_heights_on_sphere(MesostructureKind::beams, 0, Mapping::per_face);
  expect_heights_on_sphere(MesostructureKind::rings, 0, Mapping::per_face);
  expect_heights_on_sphere(MesostructureKind::warts, 0, Mapping::per_face);
}
TEST(H_II, reliefs_are_followed_on_M_d_2_per_face_and_triplanar) {
  for (const Mapping mapping : {Mapping::per_face, Mapping::triplanar}) {
    expect_heights_on_sphere(MesostructureKind::beams, 2, mapping);
    expect_heights_on_sphere(MesostructureKind::rings, 2, mapping);
    expect_heights_on_sphere(MesostructureKind::warts, 2, mapping);
  }
}

}  // namespace
}  // namespace asperity::sphere_rows_test
