// Rows H-II, H-V and H-neg (hrm-2010, Tests II and V, Fig. 12). What is to be felt is computed here, from the texels
// and the meshes' vertices alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/render/fixtures.h"

namespace asperity::relief_rows_test {
namespace {

using namespace test;
using std::numbers::pi;

constexpr double amplitude = 1e-3;  // m: 10 % of the trial meshes' edge

/// The texels of a mesostructure that repeats, and their bilinear interpolation.
class Texels {
 public:
  explicit Texels(const MesostructureSpec& spec) : size_(spec.size), heights_(must(generate_heights(spec))) {}

  [[nodiscard]] HeightMap map(Reconstruction how = Reconstruction::bilinear) const {
    return must(HeightMap::build(heights_, size_, size_, Wrap::repeat, how));
  }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] double height(const Vec2& st) const {
    const double x = st.x() * size_ - 0.5;
    const double y = st.y() * size_ - 0.5;
    const double column = std::floor(x);
    const double row = std::floor(y);
    const auto i = static_cast<int>(column);
    const auto j = static_cast<int>(row);
    return std::lerp(std::lerp(texel(i, j), texel(i + 1, j), x - column),
                     std::lerp(texel(i, j + 1), texel(i + 1, j + 1), x - column), y - row);
  }
  /// Whether it steps within a texel of here by more than a quarter of the amplitude.
  [[nodiscard]] bool near_step(const Vec2& st) const {
    double low = infinity;
    double high = -infinity;
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        const double h = height(st + Vec2(0.5 * i, 0.5 * j) / size_);
        low = std::min(low, h);
        high = std::max(high, h);
      }
    }
    return high - low > 0.25 * amplitude;
  }

 private:
  /// Row 0 is on top.
  [[nodiscard]] double texel(int column, int row) const {
    const auto wrapped = [&](int i) { return static_cast<std::size_t>((i % size_ + size_) % size_); };
    return static_cast<double>(heights_[wrapped(size_ - 1 - row) * static_cast<std::size_t>(size_) + wrapped(column)]);
  }

  int size_;
  std::vector<float> heights_;
};

/// A mesostructure laid once over M_a.
struct Sheet {
  Texels texels;
  Box box = mesh_of(trial_mesh_a()).bounds();
  std::shared_ptr<const ReliefSurface> surface;

  explicit Sheet(const MesostructureSpec& spec, Reconstruction how = Reconstruction::bilinear)
      : texels(spec), surface(coated(trial_mesh_a(), texels.map(how), Mapping::uv)) {}
  Sheet(MesostructureKind kind, Reconstruction how = Reconstruction::bilinear)
      : Sheet({.kind = kind, .size = 256, .amplitude = amplitude, .count = 3}, how) {}

  [[nodiscard]] Vec3 at(double s, double t) const {
    return {box.lower.x() + s * box.extent().x(), box.lower.y() + t * box.extent().y(), 0.0};
  }
  [[nodiscard]] Vec2 texture_at(const Vec3& p) const {
    return {(p.x() - box.lower.x()) / box.extent().x(), (p.y() - box.lower.y()) / box.extent().y()};
  }
};

// ---- H-II

/// What a quasi-static probe feels that is pressed with a constant force along an axis at evenly spaced places.
struct Scan {
  std::vector<Vec3> places;      ///< in the base's plane (m)
  std::vector<double> heights;   ///< of the probe with F / k removed (m)
  std::vector<double> sideways;  ///< force along the way (N)
  std::vector<double> pushes;    ///< force along the axis (N)
  double spacing = 0.0;          ///< m

  [[nodiscard]] double excursion() const {
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    return *high - *low;
  }
  /// Largest difference between the force along the axis and the one that is to be held (N): a law that does not push
  /// has no height.
  [[nodiscard]] double off(double force = 0.25) const {
    double off = 0.0;
    for (const double push : pushes) off = std::max(off, std::abs(push - force));
    return off;
  }
  /// Work of the force along the way between two places (J).
  [[nodiscard]] double work(std::size_t from, std::size_t to) const {
    double sum = 0.0;
    for (std::size_t i = from; i < to; ++i) sum += 0.5 * (sideways[i] + sideways[i + 1]) * spacing;
    return sum;
  }
};
Scan scan(const Scene& scene, const Vec3& from, const Vec3& to, int count, double force = 0.25,
          const Vec3& axis = Vec3::UnitZ()) {
  Scan scan;
  scan.places = line(from, to, count);
  scan.spacing = (to - from).norm() / count;
  const Vec3 way = (to - from).normalized();
  ProxyState state;
  for (const Vec3& place : scan.places) {
    const double z = height_at_force(scene, state, place, axis, force, 3e-3, -3e-3);
    const Vec3 felt = touch(scene, state, place + z * axis).wrench.force;
    scan.heights.push_back(z + force / stiffness);
    scan.sideways.push_back(felt.dot(way));
    scan.pushes.push_back(felt.dot(axis));
  }
  return scan;
}

/// How far a scan's heights are from those of the relief.
class Score {
 public:
  void add(double height, double expected) {
    squares_ += std::pow(height - expected, 2);
    low_ = std::min(low_, height);
    high_ = std::max(high_, height);
    ++samples_;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares_ / samples_); }
  [[nodiscard]] double lowest() const { return low_; }
  [[nodiscard]] double excursion() const { return high_ - low_; }
  [[nodiscard]] int samples() const { return samples_; }

 private:
  double squares_ = 0.0;
  double low_ = infinity;
  double high_ = -infinity;
  int samples_ = 0;
};

/// Along rows of texels, from centre to centre, where every reconstruction has the texels' own heights. Samples within
/// a texel of a step are left out (amendment 16).
Score follow_rows(const Sheet& sheet, const Law& law) {
  const Scene scene = scene_of(sheet.surface, law);
  const auto centre = [&](int i) { return (i + 0.5) / sheet.texels.size(); };
  Score score;
  for (const int row : {42, 92, 135, 174, 218}) {
    const Scan felt = scan(scene, sheet.at(centre(25), centre(row)), sheet.at(centre(230), centre(row)), 205);
    EXPECT_LT(felt.off(), 1e-6) << law.facts().name;
    for (std::size_t i = 0; i < felt.places.size(); ++i) {
      const Vec2 st = sheet.texture_at(felt.places[i]);
      if (!sheet.texels.near_step(st)) score.add(felt.heights[i], sheet.texels.height(st));
    }
  }
  EXPECT_GT(score.samples(), 600);
  return score;
}

/// The two methods that the paper compares, in the forms that they have here.
struct Method {
  const char* name;
  Law law;
  bool has_height;
};
const std::vector<Method>& methods() {
  static const std::vector<Method> all{
      {"force-shading-literal", ForceShadingLaw{Formulation::literal}, false},
      {"force-shading", ForceShadingLaw{}, false},
      {"height-field", HeightFieldLaw{}, true},
      {"mesostructure", MesostructureLaw{}, true},
      {"mesostructure-intended", MesostructureIntendedLaw{.prism_height = 5.0 * amplitude}, true}};
  return all;
}

void expect_heights(MesostructureKind kind) {
  for (const Reconstruction how : {Reconstruction::bilinear, Reconstruction::quadratic_bspline}) {
    const Sheet sheet(kind, how);
    for (const auto& [name, law, has_height] : methods()) {
      const Score score = follow_rows(sheet, law);
      if (has_height) {
        EXPECT_GT(score.excursion(), 0.6 * amplitude) << name;
        EXPECT_LT(score.rms(), 0.05 * amplitude) << name;
      } else {
        EXPECT_LT(score.excursion(), 0.05 * amplitude) << name;
      }
    }
  }
}
TEST(H_II, heights_of_H_2_are_followed_on_M_a_and_force_shading_pushes_without_any) {
  expect_heights(MesostructureKind::beams);
}
TEST(H_II, heights_of_H_3_are_followed_on_M_a_and_force_shading_pushes_without_any) {
  expect_heights(MesostructureKind::rings);
}
TEST(H_II, heights_of_H_4_are_followed_on_M_a_and_force_shading_pushes_without_any) {
  expect_heights(MesostructureKind::warts);
}

/// A stretch of a scan on which the force along the way has one sign.
struct Pulse {
  double from = 0.0;  ///< m from the scan's start
  double to = 0.0;
  double work = 0.0;  ///< J, below 0: against the hand
};
std::vector<Pulse> pulses(const Scan& felt) {
  constexpr double least = 1e-3;  // N
  std::vector<Pulse> found;
  int last = 0;
  for (std::size_t i = 0; i < felt.sideways.size(); ++i) {
    const double force = felt.sideways[i];
    const int sign = force > least ? 1 : force < -least ? -1 : 0;
    const double at = static_cast<double>(i) * felt.spacing;
    if (sign != 0 && sign != last) found.push_back({at, at, 0.0});
    if (sign != 0) {
      found.back().to = at;
      found.back().work += force * felt.spacing;
    }
    last = sign;
  }
  return found;
}

// "With the force shading method the user only perceives resistance on the going up and a jump going down, but no
// height differences": on either side of a beam a pulse, worth the held force times the beam's height each.
TEST(H_II, over_H_2_all_push_at_both_sides_of_each_beam_and_only_heights_rise_between) {
  const Sheet sheet(MesostructureKind::beams);
  // Between two of the three beams along the way; those across are a third of their pitch wide.
  constexpr double start = 0.08;
  const double wide = sheet.box.extent().x();
  const double texel = wide / sheet.texels.size();
  for (const auto& [name, law, has_height] : methods()) {
    const Scan felt = scan(scene_of(sheet.surface, law), sheet.at(start, 1.0 / 3.0), sheet.at(0.92, 1.0 / 3.0), 2000);
    EXPECT_LT(felt.off(), 1e-6) << name;
    const std::vector<Pulse> found = pulses(felt);
    ASSERT_EQ(found.size(), 6U) << name;
    for (std::size_t i = 0; i < 6; ++i) {
      const bool up = i % 2 == 0;
      const double edge = ((static_cast<double>(i / 2) + 0.5 + (up ? -1.0 : 1.0) / 6.0) / 3.0 - start) * wide;
      EXPECT_NEAR(0.5 * (found[i].from + found[i].to), edge, texel) << name;
      EXPECT_NEAR(found[i].work, (up ? -1.0 : 1.0) * 0.25 * amplitude, 0.05 * 0.25 * amplitude) << name;
      if (!up) {
        const double top = 0.5 * (found[i - 1].to + found[i].from);
        const double rise = felt.heights[static_cast<std::size_t>(top / felt.spacing)] - felt.heights.front();
        EXPECT_NEAR(rise, has_height ? amplitude : 0.0, 0.01 * amplitude) << name;
      }
    }
    EXPECT_NEAR(felt.heights.back(), felt.heights.front(), 0.01 * amplitude) << name;
    EXPECT_NEAR(felt.work(0, 2000), 0.0, 0.01 * 0.25 * amplitude) << name;
  }
}

// "In both cases there is some similar resistance to go out, with the force shading method the user only perceives the
// resistance for going up to the oval while with the heightfield method the perception is clearly going up to the oval
// and down from it." Out of the ring of H_3 from its inside: what the hand spends sideways on the way up, the held
// force times the rise, is the same; only under heights it has been lifted for it.
TEST(H_II, out_of_a_ring_of_H_3_all_resist_alike_and_only_heights_go_up_and_down) {
  const Sheet sheet(MesostructureKind::rings);
  constexpr double rise = 0.5 * amplitude;
  for (const auto& [name, law, has_height] : methods()) {
    // The ring around (0.28, 0.72): its crest is 0.17 from there, its feet are 0.06 from the crest.
    const Scan felt =
        scan(scene_of(sheet.surface, law), sheet.at(0.28 + 0.10, 0.72), sheet.at(0.28 + 0.24, 0.72), 1400);
    EXPECT_LT(felt.off(), 1e-6) << name;
    const double up = felt.work(0, 700);
    const double down = felt.work(700, 1400);
    EXPECT_NEAR(up, -0.25 * rise, 0.02 * 0.25 * rise) << name;
    EXPECT_NEAR(down, 0.25 * rise, 0.02 * 0.25 * rise) << name;
    const double lifted = felt.heights[700] - felt.heights[0];
    EXPECT_NEAR(lifted, has_height ? rise : 0.0, 0.05 * rise) << name;
    EXPECT_NEAR(felt.heights[1400] - felt.heights[0], 0.0, 0.05 * rise) << name;
    // All that the hand spends on the way up: nothing under heights, the pulse under force shading.
    EXPECT_NEAR(up + 0.25 * lifted, has_height ? 0.0 : -0.25 * rise, 0.05 * 0.25 * rise) << name;
  }
}

/// Amplitudes of the first lines of what a scan feels, under a Hann window.
std::vector<double> spectrum(const std::vector<double>& signal) {
  constexpr int lines = 100;
  const auto count = static_cast<double>(signal.size());
  double mean = 0.0;
  for (const double value : signal) mean += value / count;
  std::vector<double> amplitudes;
  for (int k = 1; k <= lines; ++k) {
    Vec2 sum = Vec2::Zero();
    for (std::size_t i = 0; i < signal.size(); ++i) {
      const double turn = 2.0 * pi * static_cast<double>(i) / count;
      sum += (0.5 - 0.5 * std::cos(turn)) * (signal[i] - mean) * Vec2(std::cos(k * turn), std::sin(k * turn)) / count;
    }
    amplitudes.push_back(sum.norm());
  }
  return amplitudes;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto count = static_cast<double>(a.size());
  double mean_a = 0.0;
  double mean_b = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean_a += a[i] / count;
    mean_b += b[i] / count;
  }
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += std::pow(a[i] - mean_a, 2);
    bb += std::pow(b[i] - mean_b, 2);
  }
  return ab / std::sqrt(aa * bb);
}

// "The resulting perception is somehow similar in both methods": the forces sideways have one spectrum, that of the
// held force times the texels' slope; it is not that of another line.
TEST(H_II, over_H_4_the_forces_of_both_methods_have_the_spectrum_of_the_slope) {
  const Sheet sheet(MesostructureKind::warts);
  constexpr double rows[] = {0.28, 0.41, 0.52, 0.66};
  std::vector<std::vector<double>> slopes;
  for (const double t : rows) {
    std::vector<double> slope;
    for (const Vec3& p : line(sheet.at(0.1, t), sheet.at(0.9, t), 1024)) {
      const Vec2 ahead(1e-4, 0.0);
      const Vec2 st = sheet.texture_at(p);
      slope.push_back(-0.25 * (sheet.texels.height(st + ahead) - sheet.texels.height(st - ahead)) /
                      (2e-4 * sheet.box.extent().x()));
    }
    slopes.push_back(spectrum(slope));
  }
  double other = 0.0;
  for (std::size_t i = 0; i < 3; ++i) other = std::max(other, correlation(slopes[i], slopes[i + 1]));
  EXPECT_LT(other, 0.9);
  for (std::size_t row = 0; row < std::size(rows); ++row) {
    for (const auto& [name, law, has_height] : methods()) {
      const Scan felt = scan(scene_of(sheet.surface, law), sheet.at(0.1, rows[row]), sheet.at(0.9, rows[row]), 1024);
      EXPECT_LT(felt.off(), 1e-6) << name;
      EXPECT_GT(correlation(spectrum(felt.sideways), slopes[row]), 0.98) << name << " at " << rows[row];
      EXPECT_EQ(felt.excursion() > 0.2 * amplitude, has_height) << name;
    }
  }
}

// H_1 is steep on its left side: of its heights one texel in 32 rises from left to right, and one falls on the way
// back. Force shading feels the same asymmetry in the force sideways, in heights none.
TEST(H_II, over_H_1_heights_are_asymmetric_by_the_way_and_force_shading_has_none) {
  const Sheet sheet({.kind = MesostructureKind::serrated, .size = 256, .amplitude = amplitude, .count = 8});
  constexpr double texels_a_ridge = 32.0;
  const auto centre = [](double column) { return (column + 0.5) / 256.0; };
  for (const auto& [name, law, has_height] : methods()) {
    const Scene scene = scene_of(sheet.surface, law);
    for (const bool back : {false, true}) {
      // Six ridges, from centre to centre of texels.
      const Vec3 left = sheet.at(centre(30.0), 0.43);
      const Vec3 right = sheet.at(centre(222.0), 0.43);
      const Scan felt = scan(scene, back ? right : left, back ? left : right, 960);
      EXPECT_LT(felt.off(), 1e-6) << name;
      double least = 0.0;
      double most = 0.0;
      for (const double force : felt.sideways) {
        least = std::min(least, force);
        most = std::max(most, force);
      }
      const double steep = back ? most : -least;
      const double gentle = back ? -least : most;
      EXPECT_NEAR(steep / gentle, texels_a_ridge - 1.0, 0.05 * texels_a_ridge) << name;
      int up = 0;
      int down = 0;
      for (std::size_t i = 1; i < felt.heights.size(); ++i) {
        const bool wall = sheet.texels.near_step(sheet.texture_at(0.5 * (felt.places[i] + felt.places[i - 1])));
        const double change = felt.heights[i] - felt.heights[i - 1];
        if (!has_height) {
          // Along a wall the held force is a small part of force shading's.
          EXPECT_NEAR(wall ? 0.0 : change, 0.0, 0.01 * amplitude) << name;
          continue;
        }
        up += change > 1e-8 ? 1 : 0;
        down += change < -1e-8 ? 1 : 0;
      }
      if (!has_height) continue;
      const double asymmetry = static_cast<double>(down - up) / (down + up);
      EXPECT_NEAR(asymmetry, (back ? -1.0 : 1.0) * (texels_a_ridge - 2.0) / texels_a_ridge, 0.01) << name;
    }
  }
}

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

// ---- H-V

/// M_f with a mesostructure five times along each face: the first corner of a face has the texture coordinates (0, 0),
/// the second (5, 0), the third (5/2, 5 sqrt(3)/2).
struct Strip {
  static constexpr double repeat = 5.0;
  static constexpr double tile = 0.01;  // m

  TriangleMesh mesh = mesh_of(trial_mesh_f());
  Texels texels;
  std::shared_ptr<const ReliefSurface> surface;

  explicit Strip(MesostructureKind kind, bool levels = false)
      : texels({.kind = kind, .size = 128, .amplitude = amplitude, .count = 2}) {
    Mesostructure maps = must(Mesostructure::build(texels.map(), Vec2(tile, tile)));
    if (levels) {
      const DetailSettings settings{.kind = DetailKind::low_pass};
      maps = maps.with_detail(
          std::make_shared<const DetailPyramid>(must(DetailPyramid::build(maps.heights(), maps.tile(), settings))));
    }
    surface = must(make_relief(MeshSurface(TriangleIndex::build(mesh)), std::move(maps),
                               CoatSettings{Mapping::per_face, Vec2(repeat, repeat), {}}));
  }

  [[nodiscard]] double height(const Vec3& at) const {
    return texels.height(repeat * Vec2(at[1] + 0.5 * at[2], 0.5 * std::numbers::sqrt3 * at[2]));
  }
};

/// Two ways over the inside of every face, in barycentric coordinates: along the edge from its first corner to its
/// second and along that to its third. Beams of H_2 are crossed between those across, H_3 through its peaks.
struct Way {
  Vec3 from;
  Vec3 to;
};
Way way_along(MesostructureKind kind, int edge) {
  constexpr double margin = 0.12;
  const double off = (kind == MesostructureKind::rings ? 1.28 : 0.5) / Strip::repeat / (0.5 * std::numbers::sqrt3);
  Way way{{1.0 - margin - off, margin, off}, {margin, 1.0 - margin - off, off}};
  if (edge == 1) {
    std::swap(way.from[1], way.from[2]);
    std::swap(way.to[1], way.to[2]);
  }
  return way;
}

/// Where heights rise through three quarters of the amplitude, as shares of the way.
std::vector<double> rises(const std::vector<double>& heights) {
  std::vector<double> found;
  for (std::size_t i = 1; i < heights.size(); ++i) {
    const double before = heights[i - 1] - 0.75 * amplitude;
    const double after = heights[i] - 0.75 * amplitude;
    if (before < 0.0 && after >= 0.0)
      found.push_back((static_cast<double>(i) - after / (after - before)) / static_cast<double>(heights.size() - 1));
  }
  return found;
}

// "Neighboring triangles progressively reduce their area in half; since mesostructure remains at the same resolution,
// the resulting mapped areas actually double their density": by sqrt(2) per length.
TEST(H_V, features_are_felt_where_M_f_lays_them_denser_by_sqrt_2_from_triangle_to_triangle) {
  constexpr int samples = 2000;
  for (const MesostructureKind kind :
       {MesostructureKind::serrated, MesostructureKind::beams, MesostructureKind::rings}) {
    const Strip strip(kind);
    for (const Law& law : {Law(HeightFieldLaw{}), Law(MesostructureLaw{})}) {
      const std::string name(law.facts().name);
      const Scene scene = scene_of(strip.surface, law);
      std::vector<double> density;
      for (std::uint32_t face = 0; face < strip.mesh.triangles().size(); ++face) {
        double product = 1.0;
        for (const int edge : {0, 1}) {
          const auto [from, to] = way_along(kind, edge);
          std::vector<double> expected;
          std::vector<double> felt;
          for (const Vec3& at : line(from, to, samples)) {
            expected.push_back(strip.height(at));
            // Pressed to the depth of the ground; with F / k removed.
            const Vec3 p = point_on(strip.mesh, face, at);
            felt.push_back(poke(scene, p + Vec3(0.0, 0.0, 2.0 * amplitude), p).wrench.force.z() / stiffness);
          }
          const std::vector<double> due = rises(expected);
          const std::vector<double> found = rises(felt);
          ASSERT_EQ(found.size(), due.size()) << name << " on face " << face;
          ASSERT_GE(found.size(), 3U);
          const double texel = 1.0 / (strip.texels.size() * Strip::repeat);
          for (std::size_t i = 0; i < due.size(); ++i) EXPECT_NEAR(found[i], due[i], 2.0 * texel) << name;
          const double length = (point_on(strip.mesh, face, to) - point_on(strip.mesh, face, from)).norm();
          product *= static_cast<double>(found.size() - 1) / ((found.back() - found.front()) * length);
        }
        density.push_back(std::sqrt(product));
        if (face == 0) continue;
        EXPECT_NEAR(density[face] / density[face - 1], std::numbers::sqrt2, 0.02) << name;
      }
    }
  }
}

constexpr double eye = 0.3;            // m, over the face
constexpr double field_of_view = 0.7;  // rad
constexpr int pixels = 1000;

/// Which share of the features' height is left on a face that is looked at under a zoom.
double share_left(const Strip& strip, const Law& law, MesostructureKind kind, std::uint32_t face, double zoom) {
  constexpr double force = 0.1;  // N
  SceneSettings settings;
  settings.level_rate = 1e9;
  settings.view.zoom = zoom;
  settings.view.focus = settings.view.home = point_on(strip.mesh, face, Vec3::Constant(1.0 / 3.0));
  settings.view.camera = {settings.view.focus + eye * Vec3::UnitZ(), settings.view.focus, field_of_view, pixels};
  Instance instance;
  instance.name = "strip";
  instance.surface = strip.surface;
  instance.law = law;
  instance.material.stiffness = stiffness;
  const Scene scene = must(Scene::build({instance}, settings));
  const auto [from, to] = way_along(kind, 0);
  const double most = 3.0 * amplitude * std::max(1.0, zoom);
  double low = infinity;
  double high = -infinity;
  ProxyState state;
  for (const Vec3& at : line(from, to, 150)) {
    const Vec3 p = settings.view.to_workspace(point_on(strip.mesh, face, at));
    const double z = height_at_force(scene, state, p, Vec3::UnitZ(), force, most, -most) + force / stiffness;
    low = std::min(low, z / zoom);
    high = std::max(high, z / zoom);
  }
  return (high - low) / amplitude;
}

// "Sharp features perceptible at big triangles become smoothed at smaller triangles. If the scene is zoomed in they
// become sharper again. A feature becomes undetectable when the height difference becomes less than a corresponding
// visual pixel." Halving the triangles twice is as halving the zoom.
TEST(H_V, what_is_lower_than_a_pixel_or_closer_than_two_is_gone_and_zooming_brings_it_back) {
  constexpr double zooms[] = {0.2, 0.5, 1.0, 2.0, 4.0, 32.0};
  constexpr std::uint32_t faces = 8;
  for (const MesostructureKind kind :
       {MesostructureKind::serrated, MesostructureKind::beams, MesostructureKind::rings}) {
    const Strip strip(kind, true);
    for (const Law& law : {Law(HeightFieldLaw{}), Law(MesostructureLaw{})}) {
      double left[std::size(zooms)][faces];
      int gone = 0;
      int felt = 0;
      for (std::size_t z = 0; z < std::size(zooms); ++z) {
        const double pixel = 2.0 * std::tan(0.5 * field_of_view) * eye / zooms[z] / pixels;
        for (std::uint32_t face = 0; face < faces; ++face) {
          const double share = left[z][face] = share_left(strip, law, kind, face, zooms[z]);
          const auto [a, b, c] = strip.mesh.corners(face);
          const double area = 0.5 * (b - a).cross(c - a).norm();
          // A face holds sqrt(3)/4 of a square of repeat x repeat tiles; two ridges or beams are in each.
          const double pitch = 0.5 * std::sqrt(area / (0.25 * std::numbers::sqrt3)) / Strip::repeat;
          if (pixel > amplitude || pitch < 2.0 * pixel) {
            EXPECT_LT(share, 0.02) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
            ++gone;
          }
          const bool large = pixel < amplitude / 8.0 && pitch > 40.0 * pixel;
          EXPECT_GT(large ? share : 1.0, 0.75) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
          felt += large ? 1 : 0;
          const double beside = face > 0 ? left[z][face - 1] : 1.0;
          const double before = z > 0 ? left[z - 1][face] : 0.0;
          EXPECT_LT(share, beside + 0.01) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
          EXPECT_GT(share, before - 0.01) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
          // Of H_3 a pixel's height leaves out as much as its width does, and that is another share of the amplitude.
          const bool doubled = z > 1 && z < 5 && face > 1 && kind != MesostructureKind::rings;
          const double twice = doubled ? left[z - 1][face - 2] : share;
          EXPECT_NEAR(share, twice, 0.03) << law.facts().name << " on face " << face << " at zoom " << zooms[z];
        }
      }
      EXPECT_GE(felt, 8);
      EXPECT_GT(gone, 12);
    }
  }
}

// ---- H-neg

TEST(H_neg, a_groove_is_followed_down_by_the_consistent_laws) {
  const Sheet sheet(MesostructureKind::groove);
  for (const Law& law : {Law(HeightFieldLaw{}), Law(MesostructureLaw{})}) {
    const Score score = follow_rows(sheet, law);
    EXPECT_LT(score.lowest(), -0.95 * amplitude) << law.facts().name;
    EXPECT_LT(score.rms(), 0.05 * amplitude) << law.facts().name;
  }
}

TEST(H_neg, a_groove_is_never_felt_by_the_literal_laws_that_feel_the_same_letter_raised) {
  const Sheet sheet(MesostructureKind::groove);
  std::vector<float> heights = must(generate_heights({MesostructureKind::groove, 256, amplitude}));
  for (float& height : heights) height = -height;
  const auto raised = coated(
      trial_mesh_a(), must(HeightMap::build(heights, 256, 256, Wrap::repeat, Reconstruction::bilinear)), Mapping::uv);
  for (const char* law : {"height-field-literal", "mesostructure-literal"}) {
    const Scene cut = scene_of(sheet.surface, named(law));
    const Scene proud = scene_of(raised, named(law));
    Rng rng(8);
    int pushed = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3 base(rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), 0.0);
      const auto down = line(base + Vec3(0.0, 0.0, 2e-3), base - Vec3(0.0, 0.0, 2e-3), 40);
      for (const Vec3& force : slide(cut, down)) ASSERT_EQ(force, Vec3::Zero().eval()) << law;
      pushed += largest_jump(slide(proud, down)) > 0.0 ? 1 : 0;
    }
    EXPECT_GT(pushed, 20) << law;
  }
}

/// The letter's middle line on M_a (m), from its upper end to its lower one: two bows of 250 degrees that meet in the
/// middle of the tile, of radius 0.16.
class MiddleLine {
 public:
  explicit MiddleLine(const Sheet& sheet) {
    constexpr int count = 1000;
    constexpr double radius = 0.16;
    constexpr double sweep = 250.0 / 180.0 * pi;
    for (int i = 0; i <= 2 * count; ++i) {
      const bool upper = i <= count;
      const double turned = sweep * (i - count) / count;
      const double angle = upper ? 1.5 * pi + turned : 0.5 * pi - turned;
      const double centre = upper ? 0.5 + radius : 0.5 - radius;
      points_.emplace_back(sheet.at(0.5 + radius * std::cos(angle), centre + radius * std::sin(angle)).head<2>());
    }
  }

  /// A share of the way along it (of its angle).
  [[nodiscard]] Vec2 at(double share) const {
    return points_[static_cast<std::size_t>(share * static_cast<double>(points_.size() - 1))];
  }
  struct Nearest {
    double distance = infinity;  ///< m
    double share = 0.0;
  };
  [[nodiscard]] Nearest nearest(const Vec2& p) const {
    Nearest found;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double distance = (points_[i] - p).norm();
      if (distance < found.distance)
        found = {distance, static_cast<double>(i) / static_cast<double>(points_.size() - 1)};
    }
    return found;
  }

 private:
  std::vector<Vec2> points_;
};

/// A hand that does not know the letter. It presses with a constant force, goes on at a constant speed, and turns the
/// way that it is pushed sideways; of how it had to turn it learns how to go on.
struct Hand {
  double mass = 0.25;       // kg
  double damping = 6.5;     // N s/m
  double press = 0.5;       // N
  double speed = 0.015;     // m/s
  double turning = 40.0;    // rad/(s N)
  double learning = 100.0;  // rad/(s^2 N)
};

struct Followed {
  double reached = 0.0;  ///< share of the letter that was gone along, step by step
  double rms = 0.0;      ///< distance from its middle line until then or until it was left (m)
  double height = 0.0;   ///< mean of the hand's with F / k removed (m)
  bool touched = false;
};
Followed follow(const Scene& scene, const MiddleLine& letter, const Hand& hand) {
  constexpr int substeps = 5;
  constexpr double step = 1e-3 / substeps;
  constexpr double lost = 0.01;  // m, from the middle line
  constexpr double start = 0.02;
  Followed followed{start};
  const Vec2 first = letter.at(start);
  const Vec2 way = letter.at(start + 0.01) - first;
  double heading = std::atan2(way.y(), way.x());
  double turn = 0.0;
  double sideways = 0.0;
  Vec3 position(first.x(), first.y(), amplitude);
  Vec3 velocity = Vec3::Zero();
  ProxyState state;
  Score score;
  double heights = 0.0;
  for (int tick = 0; tick < 15000 && followed.reached < 0.97; ++tick) {
    const ForceSample felt = touch(scene, state, position);
    const Vec3& force = felt.wrench.force;
    followed.touched = followed.touched || felt.flags.has(TickFlag::contact);
    // What the hand feels sideways, over some 20 ms.
    sideways += 0.05 * (std::cos(heading) * force.y() - std::sin(heading) * force.x() - sideways);
    turn += 1e-3 * hand.learning * sideways;
    heading += 1e-3 * (hand.turning * sideways + turn);
    const Vec3 drive = hand.damping * hand.speed * Vec3(std::cos(heading), std::sin(heading), 0.0);
    for (int i = 0; i < substeps; ++i) {
      velocity += step / hand.mass * (force + drive - hand.press * Vec3::UnitZ());
      velocity /= 1.0 + step * hand.damping / hand.mass;
      position += step * velocity;
    }
    const MiddleLine::Nearest nearest = letter.nearest(position.head<2>());
    if (nearest.distance > lost || position.z() < -lost) break;
    score.add(nearest.distance, 0.0);
    heights += position.z() + hand.press / stiffness;
    // No further than the hand can have come within a tick: it may not jump from bow to bow.
    if (nearest.share < followed.reached + 0.01) followed.reached = std::max(followed.reached, nearest.share);
  }
  followed.rms = score.rms();
  followed.height = heights / score.samples();
  return followed;
}

// "Our HRM-rendering algorithm allows a correct perception of this sort of characteristics as well, even cruising along
// the grooves of the scratches." Force shading has the same force sideways and leads the hand as well, but on the base;
// the printed forms never touch, and without a groove the hand goes straight on.
TEST(H_neg, a_hand_that_turns_as_it_is_pushed_follows_the_engraved_S) {
  const Scene plain = scene_of(coated(trial_mesh_a(), flat_map(0.0), Mapping::uv), MesostructureLaw{});
  for (const double flank : {0.02, 0.04}) {
    MesostructureSpec spec{.kind = MesostructureKind::groove, .size = 512, .amplitude = amplitude};
    spec.width = 0.08;
    // Of each wall: as H_6 has it, with a flat bottom, and round.
    spec.flank = flank;
    const Sheet sheet(spec);
    const MiddleLine letter(sheet);
    // The tile is wider than long.
    const double width = *spec.width * std::min(sheet.box.extent().x(), sheet.box.extent().y());
    for (const double press : {0.5, 1.0}) {
      const Hand hand{.press = press};
      for (const auto& [name, law, has_height] : methods()) {
        const Followed followed = follow(scene_of(sheet.surface, law), letter, hand);
        EXPECT_GE(followed.reached, 0.97) << name << " at " << press << " N";
        EXPECT_LT(followed.rms, (flank < 0.04 ? 0.25 : 0.02) * width) << name << " at " << press << " N";
        EXPECT_NEAR(followed.height, has_height ? -amplitude : 0.0, 0.05 * amplitude) << name;
      }
      for (const char* name : {"height-field-literal", "mesostructure-literal"}) {
        const Followed fallen = follow(scene_of(sheet.surface, named(name)), letter, hand);
        EXPECT_FALSE(fallen.touched) << name;
        EXPECT_LT(fallen.reached, 0.1) << name;
      }
      const Followed straight_on = follow(plain, letter, hand);
      EXPECT_TRUE(straight_on.touched);
      EXPECT_LT(straight_on.reached, 0.3);
    }
  }
}

}  // namespace
}  // namespace asperity::relief_rows_test
