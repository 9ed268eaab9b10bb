#pragma once
// Fields whose zeros are touched in tests: each as one would write it.

#include <cmath>

#include "asperity/surface/custom/surface.h"

namespace asperity::test {

/// A distance to a sphere.
struct Ball {
  double radius = 0.03;
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample;
    const double length = p.norm();
    sample.value = length - radius;
    if (length > 0.0) sample.gradient = p / length;
    return sample;
  }
  [[nodiscard]] Box bounds() const { return {Vec3::Constant(-radius), Vec3::Constant(radius)}; }
};

/// A ball that says how much it bends outside.
struct SmoothBall : Ball {
  [[nodiscard]] double bend() const { return 1.0 / radius; }
  [[nodiscard]] double grain() const { return radius; }
};

/// A distance to a torus around z.
struct Torus {
  double radius = 0.03;
  double tube = 0.01;
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample;
    const double around = std::hypot(p.x(), p.y());
    const Vec3 ring = around > 0.0 ? Vec3(radius / around * p.x(), radius / around * p.y(), 0.0) : Vec3(radius, 0, 0);
    const double length = (p - ring).norm();
    sample.value = length - tube;
    if (length > 0.0) sample.gradient = (p - ring) / length;
    return sample;
  }
  [[nodiscard]] Box bounds() const {
    const double wide = radius + tube;
    return {Vec3(-wide, -wide, -tube), Vec3(wide, wide, tube)};
  }
};

/// |x/a|^4 + |y/b|^4 + |z/c|^4 = 1, by the fourth root: no distance.
struct Superquadric {
  Vec3 size = Vec3(0.03, 0.02, 0.04);
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample;
    const Vec3 q = p.cwiseQuotient(size);
    const double sum = q.array().pow(4).sum();
    const double norm = std::sqrt(std::sqrt(sum));
    sample.value = size.minCoeff() * (norm - 1.0);
    if (norm > 0.0)
      sample.gradient = size.minCoeff() * (q.array().cube() / (norm * norm * norm)).matrix().cwiseQuotient(size);
    return sample;
  }
  [[nodiscard]] Box bounds() const { return {-size, size}; }
  // The fourth root's gradient is at most as long as the smallest half axis makes it, times 3^(1/4) at corners.
  [[nodiscard]] double lipschitz() const { return 1.3160740129524926; }
  [[nodiscard]] double grain() const { return 0.005; }
};

/// |x/a|^2 + |y/b|^2 + |z/c|^2 = 1, by the square root: no distance.
struct Ellipsoid {
  Vec3 size = Vec3(0.03, 0.02, 0.01);
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample;
    const Vec3 q = p.cwiseQuotient(size);
    const double norm = q.norm();
    sample.value = size.minCoeff() * (norm - 1.0);
    if (norm > 0.0) sample.gradient = size.minCoeff() / norm * q.cwiseQuotient(size);
    return sample;
  }
  [[nodiscard]] Box bounds() const { return {-size, size}; }
};

/// The gyroid itself, a sheet that goes on beyond its box.
struct GyroidSheet {
  double wave = 6.283185307179586 / 0.02;
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    const Vec3 s = (wave * p).array().sin();
    const Vec3 c = (wave * p).array().cos();
    FieldSample sample;
    sample.value = (s.x() * c.y() + s.y() * c.z() + s.z() * c.x()) / wave;
    sample.gradient = Vec3(c.x() * c.y() - s.z() * s.x(), c.y() * c.z() - s.x() * s.y(), c.z() * c.x() - s.y() * s.z());
    return sample;
  }
  [[nodiscard]] Box bounds() const { return {Vec3::Constant(-0.03), Vec3::Constant(0.03)}; }
  [[nodiscard]] double lipschitz() const { return 1.75; }
  [[nodiscard]] double bend() const { return 2.0 * wave; }
  [[nodiscard]] double grain() const { return 0.5 / wave; }
  [[nodiscard]] Sides sides() const { return Sides::both; }
};

/// Free space between two walls, x = 0 and z = 0.
struct Corner {
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample;
    const bool floor = p.z() < p.x();
    sample.value = floor ? p.z() : p.x();
    sample.gradient = floor ? Vec3::UnitZ() : Vec3::UnitX();
    return sample;
  }
  [[nodiscard]] Box bounds() const { return {Vec3(-0.01, -0.05, -0.01), Vec3(0.05, 0.05, 0.05)}; }
};

}  // namespace asperity::test
