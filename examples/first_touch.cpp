// A sheet of 10 x 10 cm wears rings of 1 mm relief (H_3). A probe comes down on it: what does the hand feel?
// value() hands out what a Result holds; where input comes from outside, ask ok() first and show error().message().

#include <cstdio>

#include "asperity/asperity.h"

using namespace asperity;

int main() {
  const auto sheet = make_mesh_surface(plane_grid(0.1, 0.1, 8, 8)).value();
  const auto rings = generate_height_map({.kind = MesostructureKind::rings}).value();
  const auto relief = make_relief(*sheet, Mesostructure::build(rings, Vec2(0.1, 0.1)).value()).value();
  const Scene scene = Scene::build({{.name = "sheet", .surface = relief}}).value();
  ProxyState state;
  ProxyCache cache;
  for (double z = 1.1e-3; z > -1e-3; z -= 2e-4) {
    const ForceSample felt = step(scene, state, cache, {.pose = {.position = {0.0, 0.0, z}}}, Seconds(1e-3));
    std::printf("%5.1f mm %8.3f N\n", 1e3 * z, felt.wrench.force.z());
  }
}
