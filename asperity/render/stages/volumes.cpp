#include "asperity/render/stages/volumes.h"

#include <algorithm>

#include "asperity/render/stages/tick.h"
#include "asperity/render/step.h"

namespace asperity {

Box tick_reach(const ScalarField& field, const Pose& pose, const ProxyState& state, const Vec3& probe,
               double probe_radius) noexcept {
  constexpr double cells_around = 4.0;
  double widest = 0.0;
  const Vec3 local = pose.apply_inverse(probe);
  for (int a = 0; a < 3; ++a) {
    const GridAxis& axis = field.axes()[static_cast<std::size_t>(a)];
    widest = std::max(widest, axis.width(axis.locate(local[a]).cell));
  }
  const double apart = std::max((state.proxy - probe).norm(), (state.previous_probe - probe).norm());
  Box box;
  box.include(local);
  return box.grown(apart + 2.0 * probe_radius + cells_around * widest);
}

Status fetch_volumes(const Scene& scene, const ProxyState& state, const ProbeSample& probe) {
  if (!is_place(probe)) return success();
  ProxyState now = state;
  if (now.epoch == 0) now.proxy = now.previous_probe = probe.pose.position;
  Status fetched = success();
  for_each_volume(scene, [&](const ScalarField& field, const Pose& pose) {
    if (field.bricks() == nullptr || !fetched) return;
    const int level = std::clamp(now.wanted_level, 0, field.levels() - 1);
    fetched = field.bricks()->fetch(tick_reach(field, pose, now, probe.pose.position, scene.probe_radius()), level);
  });
  return fetched;
}

}  // namespace asperity
