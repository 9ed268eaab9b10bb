#pragma once
// What the rows of hrm-2010 on reliefs have in common: heights that are computed from the texels alone, slow scans
// under a constant force, and the two methods that the paper compares.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/render/fixtures.h"

namespace asperity::test {

inline constexpr double amplitude = 1e-3;  // m: 10 % of the trial meshes' edge

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
inline Scan scan(const Scene& scene, const Vec3& from, const Vec3& to, int count, double force = 0.25,
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
inline Score follow_rows(const Sheet& sheet, const Law& law) {
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
inline const std::vector<Method>& methods() {
  static const std::vector<Method> all{
      {"force-shading-literal", ForceShadingLaw{Formulation::literal}, false},
      {"force-shading", ForceShadingLaw{}, false},
      {"height-field", HeightFieldLaw{}, true},
      {"mesostructure", MesostructureLaw{}, true},
      {"mesostructure-intended", MesostructureIntendedLaw{.prism_height = 5.0 * amplitude}, true}};
  return all;
}

}  // namespace asperity::test
