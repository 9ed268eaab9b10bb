// A surface of one's own, in the whole asperity program: a ball cut from a gyroid, the minimal surface of bones and
// butterfly wings. Value and gradient are enough; touching, drawing and measuring it come with CustomSurface.
//   custom_surface touch gyroid.json      with  "surfaces": [{"custom": {"type": "gyroid", "radius": "30 mm"}}]

#include <cmath>

#include "apps/asperity/program.h"
#include "asperity/surface/custom/surface.h"

using namespace asperity;

struct Gyroid {
  explicit Gyroid(NamedNumbers& n)
      : radius(n.get("radius", 0.03)), wave(6.283185307179586 / n.get("cell", 0.02)), wall(n.get("wall", 0.8)) {}
  FieldSample eval(const Vec3& p) const noexcept {
    const Vec3 s = (wave * p).array().sin(), c = (wave * p).array().cos();
    const double sheet = s.x() * c.y() + s.y() * c.z() + s.z() * c.x();  // 0 on the gyroid, wall on its faces
    const double inside = (std::abs(sheet) - wall) / (steepest * wave), out = p.norm() - radius;
    if (out > inside) return {out, p.normalized()};
    const Vec3 slope(c.x() * c.y() - s.z() * s.x(), c.y() * c.z() - s.x() * s.y(), c.z() * c.x() - s.y() * s.z());
    return {inside, std::copysign(1.0 / steepest, sheet) * slope};
  }
  Box bounds() const { return {Vec3::Constant(-radius), Vec3::Constant(radius)}; }
  double grain() const { return 0.5 / wave; }  // smallest length over which it changes (m)
  static constexpr double steepest = 1.75;     // of sheet, by phase: the value changes by at most 1 a metre
  double radius, wave, wall;
};

int main(int argc, char** argv) {
  return run_program(argc, argv, {register_custom_surface<Gyroid>("gyroid")});
}
