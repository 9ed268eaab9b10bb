#pragma once
// A height over one triangle with its derivatives, and what is made of several.

namespace asperity {

/// Height over one triangle, or the weight of one, as a function of its barycentric coordinates (u, v) of the second
/// and third corner.
struct HeightJet {
  double height;  ///< m
  double u;       ///< dH/du (m)
  double v;
  double uu;  ///< second derivatives (m)
  double uv;
  double vv;

  /// [servo]
  void add(const HeightJet& more) noexcept {
    height += more.height;
    u += more.u;
    v += more.v;
    uu += more.uu;
    uv += more.uv;
    vv += more.vv;
  }
};

/// [servo]
inline HeightJet product(const HeightJet& a, const HeightJet& b) noexcept {
  return {a.height * b.height,
          a.u * b.height + a.height * b.u,
          a.v * b.height + a.height * b.v,
          a.uu * b.height + 2.0 * a.u * b.u + a.height * b.uu,
          a.uv * b.height + a.u * b.v + a.v * b.u + a.height * b.uv,
          a.vv * b.height + 2.0 * a.v * b.v + a.height * b.vv};
}

/// Of a weighted sum by the sum of the weights, where `per` is 1 over that. [servo]
inline HeightJet quotient(const HeightJet& sum, const HeightJet& weight, double per) noexcept {
  HeightJet mean;
  mean.height = sum.height * per;
  mean.u = (sum.u - mean.height * weight.u) * per;
  mean.v = (sum.v - mean.height * weight.v) * per;
  mean.uu = (sum.uu - 2.0 * mean.u * weight.u - mean.height * weight.uu) * per;
  mean.uv = (sum.uv - mean.u * weight.v - mean.v * weight.u - mean.height * weight.uv) * per;
  mean.vv = (sum.vv - 2.0 * mean.v * weight.v - mean.height * weight.vv) * per;
  return mean;
}

}  // namespace asperity
