// A law that is added to the whole program by this file: facts, options, State and force.

#include <algorithm>

#include "apps/asperity/program.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/touched_surface.h"

namespace {

using namespace asperity;

/// A layer of felt over a mesh: as stiff as the material below `pile`, and by `share` of that above. Printed: of the
/// nap's own memory, which yields where it was pressed.
struct FeltLayer {
  static constexpr LawFacts facts{.name = "felt-layer",
                                  .title = "a nap that yields before the ground does",
                                  .source = "of these tests, eq. 1",
                                  .compared = on_mesh | literal_too};
  Formulation formulation = Formulation::consistent;
  double pile = 1e-3;
  double share = 0.2;
  double recovery = 0.05;

  struct State {
    double pressed = 0.0;  ///< m
  };

  static void options(std::vector<Option>& rows) {
    rows.push_back(option("pile", &FeltLayer::pile, OptionType::quantity(Dimension::length, Range::positive()),
                          "height of the nap."));
    rows.push_back(option("share", &FeltLayer::share, OptionType::number({0.0, 1.0}), "of the ground's stiffness."));
    rows.push_back(option("recovery", &FeltLayer::recovery, OptionType::quantity(Dimension::time, Range::positive()),
                          "time in which it stands up again.")
                       .of_printed_form("whose nap has no memory"));
  }
  [[nodiscard]] std::string lacks(const Instance& instance) const {
    return base_of(instance.surface) != nullptr ? "" : "a mesh";
  }
  LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3&, Seconds dt,
                 State& state) const noexcept {
    LawForce answer;
    const FieldSample field = surface.eval(probe);
    const double depth = pile - field.value;
    const bool printed = formulation == Formulation::literal;
    state.pressed = printed ? std::max(depth, state.pressed * (1.0 - std::min(1.0, dt / Seconds(recovery)))) : 0.0;
    if (!(depth > 0.0) || field.element == no_index) return answer;
    const double nap = share * std::clamp(printed ? 2.0 * depth - state.pressed : depth, 0.0, pile);
    const double ground = std::max(0.0, depth - pile);
    answer.contact = true;
    answer.normal = field.gradient.normalized();
    answer.penetration = depth;
    answer.force = material.stiffness * (nap + ground) * answer.normal;
    answer.point = probe + depth * answer.normal;
    answer.element = field.element;
    return answer;
  }
};

}  // namespace

int main(int argc, char** argv) {
  return run_program(argc, argv, {register_law<FeltLayer>()});
}
