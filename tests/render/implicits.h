#pragma once
// Scenes with one implicit surface whose distance is known in closed form.

#include <memory>
#include <utility>

#include "asperity/render/step.h"
#include "tests/field/sparse_grids.h"

namespace asperity::test {

inline Instance implicit_instance(std::shared_ptr<const SparseGrid> grid, const Law& law = ProxyLaw{},
                                  CellReconstruction reconstruction = CellReconstruction::smooth, double offset = 0.0) {
  Instance instance;
  instance.name = "implicit";
  instance.surface = std::make_shared<const ImplicitSurface>(
      ImplicitSurface::build({std::move(grid), nullptr, nullptr, reconstruction, offset}).value());
  instance.law = law;
  instance.sides = Sides::front;
  return instance;
}

inline ForceSample touch_at(const Scene& scene, ProxyState& state, const Vec3& position, double dt = 1e-3) {
  ProbeSample probe;
  probe.pose.position = position;
  return step(scene, state, probe, Seconds(dt));
}

}  // namespace asperity::test
