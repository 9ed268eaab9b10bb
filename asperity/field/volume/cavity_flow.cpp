#include <cmath>
#include <numbers>

#include "asperity/field/volume/generators.h"

namespace asperity {
namespace {

// Shares of the outer stream's speed.
constexpr double eddy_speed = 0.15;
constexpr double roll_speed = 0.05;

/// F(a, c) = ln(cosh a + c) and its derivatives, without overflow. c > -1.
struct LayerTerm {
  double s;  ///< F_a
  double p;  ///< F_c
  double aa, ac, cc;

  LayerTerm(double a, double c) {
    const double e = std::exp(-std::abs(a));
    const double cosh = 0.5 * (1.0 + e * e);  // times e
    const double sinh = std::copysign(0.5 * (1.0 - e * e), a);
    const double d = cosh + c * e;
    s = sinh / d;
    p = e / d;
    const double q = cosh / d;
    aa = p * p + c * p * q;
    ac = -s * p;
    cc = -p * p;
  }
};

/// c(x, y) and its derivatives: the undulation of the layer.
struct Undulation {
  double c, x, y, xx, xy;

  Undulation(const VolumeGenerator& g, const Vec3& p, double m) {
    const double k = 2.0 * std::numbers::pi / *g.wavelength;
    const double reach = 0.3 * g.extent->x();
    const double u = p.x() / reach;
    const double fade = std::exp(-u * u);
    const double w = 1.0 - fade;
    const double w_x = 2.0 * u / reach * fade;
    const double w_xx = 2.0 / (reach * reach) * (1.0 - 2.0 * u * u) * fade;
    const double phase = k * (p.x() - 0.5 * g.speed * g.time) + 0.5 * std::sin(m * p.y());
    const double phase_y = 0.5 * m * std::cos(m * p.y());
    const double cosine = g.strength * std::cos(phase);
    const double sine = g.strength * std::sin(phase);
    c = w * cosine;
    x = w_x * cosine - w * k * sine;
    y = -w * sine * phase_y;
    xx = w_xx * cosine - 2.0 * w_x * k * sine - w * k * k * cosine;
    xy = -phase_y * (w_x * sine + w * k * cosine);
  }
};

/// R(x, z) and its derivatives: the eddy that fills the cavity.
struct Eddy {
  double x, z, xx, xz, zz;

  Eddy(const VolumeGenerator& g, const Vec3& p) {
    const double l = std::numbers::pi / g.extent->x();
    const double size = g.extent->z() / 8.0;
    const double t = (p.z() - 0.25 * g.extent->z()) / size;
    // The Gaussian's slope is at most sqrt(2 / e) / size.
    const double height = eddy_speed * g.speed * size / std::sqrt(2.0 / std::numbers::e);
    const double gauss = height * std::exp(-t * t);
    const double gauss_z = -2.0 * t / size * gauss;
    const double gauss_zz = (4.0 * t * t - 2.0) / (size * size) * gauss;
    const double sine = std::sin(l * p.x());
    const double along = sine * sine;
    const double along_x = l * std::sin(2.0 * l * p.x());
    const double along_xx = 2.0 * l * l * std::cos(2.0 * l * p.x());
    x = along_x * gauss;
    z = along * gauss_z;
    xx = along_xx * gauss;
    xz = along_x * gauss_z;
    zz = along * gauss_zz;
  }
};

/// A(y, z) and its derivatives: the rolls along the stream.
struct Rolls {
  double y, z, yy, yz, zz;

  Rolls(const VolumeGenerator& g, const Vec3& p, double m) {
    const double size = 4.0 * *g.thickness;
    const double t = (p.z() - 0.5 * g.extent->z()) / size;
    const double height = roll_speed * g.speed * size / std::sqrt(2.0 / std::numbers::e);
    const double gauss = height * std::exp(-t * t);
    const double gauss_z = -2.0 * t / size * gauss;
    const double sine = std::sin(m * p.y());
    const double cosine = std::cos(m * p.y());
    y = m * cosine * gauss;
    z = sine * gauss_z;
    yy = -m * m * sine * gauss;
    yz = m * cosine * gauss_z;
    zz = sine * (4.0 * t * t - 2.0) / (size * size) * gauss;
  }
};

/// All that the flow at a place is made of.
struct CavityParts {
  Undulation wave;
  LayerTerm layer;
  Eddy eddy;
  Rolls rolls;

  CavityParts(const VolumeGenerator& g, const Vec3& p) : CavityParts(g, p, 2.0 * std::numbers::pi / g.extent->y()) {}

 private:
  CavityParts(const VolumeGenerator& g, const Vec3& p, double across_wavenumber)
      : wave(g, p, across_wavenumber),
        layer((p.z() - 0.5 * g.extent->z()) / *g.thickness, wave.c),
        eddy(g, p),
        rolls(g, p, across_wavenumber) {}
};

}  // namespace

Result<CavityFlow> CavityFlow::build(const VolumeGenerator& generator) {
  VolumeGenerator cavity = generator;
  cavity.kind = VolumeKind::cavity;
  ASPERITY_CHECK(validate(cavity));
  CavityFlow flow;
  flow.generator_ = completed(cavity);
  return flow;
}

Vec3 CavityFlow::velocity(const Vec3& p) const noexcept {
  const auto [wave, layer, eddy, rolls] = CavityParts(generator_, p);
  const double d = *generator_.thickness;
  const double half = 0.5 * generator_.speed;
  return {half * (1.0 + layer.s) - eddy.z, rolls.z, -half * d * layer.p * wave.x + eddy.x - rolls.y};
}

Mat3 CavityFlow::gradient(const Vec3& p) const noexcept {
  const auto [wave, layer, eddy, rolls] = CavityParts(generator_, p);
  const double d = *generator_.thickness;
  const double half = 0.5 * generator_.speed;
  Mat3 out;
  out << half * layer.ac * wave.x - eddy.xz, half * layer.ac * wave.y, half * layer.aa / d - eddy.zz,  //
      0.0, rolls.yz, rolls.zz,                                                                         //
      -half * d * (layer.cc * wave.x * wave.x + layer.p * wave.xx) + eddy.xx,
      -half * d * (layer.cc * wave.x * wave.y + layer.p * wave.xy) - rolls.yy,
      -half * layer.ac * wave.x + eddy.xz - rolls.yz;
  return out;
}

}  // namespace asperity
