// A sheet of 10 x 10 cm wears rings of 1 mm relief (H_3). A probe comes down on it: what does the hand feel?
// value() hands out what a Result holds; where input comes from outside, ask ok() first and show error().message().

#include <cstdio>

#include "asperity/field/mesostructure_generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/render/step.h"

using namespace asperity;

int main() {
  const auto rings = generate_height_map({.kind = MesostructureKind::rings}, Wrap::repeat, Reconstruction::bilinear);
  const auto maps = std::make_shared<Mesostructure>(Mesostructure::build(rings.value(), Vec2(0.1, 0.1)).value());
  const TriangleMesh sheet = TriangleMesh::build(plane_grid(0.1, 0.1, 8, 8)).value();
  const Coat coat = Coat::build(sheet, maps, {}).value();
  const auto relief = std::make_shared<ReliefSurface>(MeshSurface(TriangleIndex::build(sheet)), coat);
  const Scene scene = Scene::build({{.name = "sheet", .surface = relief, .law = HeightFieldLaw{}}}, 0.0).value();
  ProxyState state;
  for (double z = 1.1e-3; z > -1e-3; z -= 2e-4) {
    const ForceSample felt = step(scene, state, {.pose = {.position = {0.0, 0.0, z}}}, Seconds(1e-3));
    std::printf("%5.1f mm %8.3f N\n", 1e3 * z, felt.wrench.force.z());
  }
}
