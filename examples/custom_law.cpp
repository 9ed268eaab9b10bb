// A force law of one's own, in the whole asperity program: contact as Hunt and Crossley (1975) have it. The push rises
// with a power of the depth, and damping grows with the depth too, so that nothing jumps where the probe arrives.
//   custom_law compare M_a-H_1 --laws proxy,hunt-crossley
//   in a scene: "law": {"type": "hunt-crossley", "exponent": 1.3, "damping": "200 mm/s"}

#include <cmath>

#include "apps/asperity/program.h"
#include "asperity/render/law_registry.h"

using namespace asperity;

struct HuntCrossley {
  explicit HuntCrossley(NamedNumbers& n) : exponent(n.get("exponent", 1.5)), damping(n.get("damping", 0.5)) {}
  Status validate() const {
    if (exponent >= 1.0 && damping > 0.0) return success();
    return Error{ErrorCode::bad_value, "cannot be felt", {}, {}, "exponent 1 or more, damping above 0 (m/s)"};
  }
  CustomForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                    Seconds) const noexcept {
    const FieldSample field = surface.eval(probe);
    if (!(field.value < 0.0) || field.element == no_index) return {};
    const double depth = -field.value, millimetre = 1e-3;  // at 1 mm it is as stiff as the material
    const double push = material.stiffness * millimetre * std::pow(depth / millimetre, exponent);
    const Vec3 normal = field.gradient.normalized();
    const double faster = std::fmax(0.0, 1.0 - velocity.dot(normal) / damping);  // damping: the speed that doubles it
    return {true, faster * push * normal, probe + depth * normal, normal, depth, field.height, field.element, true};
  }
  double exponent, damping;
};

int main(int argc, char** argv) {
  return run_program(argc, argv, {register_custom_law<HuntCrossley>("hunt-crossley")});
}
