// A contact law of one's own, in the whole asperity program: contact as Hunt and Crossley (1975) have it. The push
// rises with a power of the depth, and damping grows with the depth too, so that nothing jumps where the probe arrives.
//   custom_law compare M_a-H_1 --laws proxy,hunt-crossley
//   in a scene: "law": {"type": "hunt-crossley", "exponent": 1.3, "damping": "200 mm/s"}

#include <cmath>

#include "apps/asperity/program.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/touched_surface.h"

using namespace asperity;

struct HuntCrossley {
  static constexpr LawFacts facts{.name = "hunt-crossley",
                                  .title = "a push that rises with a power of the depth, as does its damping",
                                  .source = "Hunt and Crossley 1975"};
  double exponent = 1.5;
  double damping = 0.5;  // m/s: the speed that doubles the push

  static void options(std::vector<Option>& rows) {
    rows.push_back(option("exponent", &HuntCrossley::exponent, OptionType::number({1.0, 3.0}), "of the depth."));
    rows.push_back(option("damping", &HuntCrossley::damping, OptionType::quantity(Dimension::speed, Range::positive()),
                          "speed of pressing in that doubles the push."));
  }
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3& velocity,
                 Seconds) const noexcept {
    LawForce answer;
    const FieldSample field = surface.eval(probe);
    if (!(field.value < 0.0) || field.element == no_index) return answer;
    const double depth = -field.value, millimetre = 1e-3;  // at 1 mm it is as stiff as the material
    const double push = material.stiffness * millimetre * std::pow(depth / millimetre, exponent);
    answer.contact = answer.damped = true;
    answer.normal = field.gradient.normalized();
    answer.spring = push * answer.normal;
    answer.force = std::fmax(0.0, 1.0 - velocity.dot(answer.normal) / damping) * answer.spring;
    answer.stored = push * depth / (exponent + 1.0);
    answer.stiffness = exponent * push / depth;
    answer.point = probe + depth * answer.normal;
    answer.penetration = depth;
    answer.height = field.height;
    answer.element = field.element;
    return answer;
  }
};

int main(int argc, char** argv) {
  return run_program(argc, argv, {register_law<HuntCrossley>()});
}
