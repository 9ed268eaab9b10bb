#include "asperity/render/step.h"

#include <algorithm>

#include "asperity/render/stages/tick.h"

namespace asperity {

namespace {

/// Keeps the bricks that a tick reads in place while it lasts.
class VolumeReading {
 public:
  explicit VolumeReading(const Scene& scene) noexcept : scene_(scene) {
    for_each([](const ScalarField& field) { field.enter(); });
  }
  ~VolumeReading() {
    for_each([](const ScalarField& field) { field.leave(); });
  }
  VolumeReading(const VolumeReading&) = delete;
  VolumeReading& operator=(const VolumeReading&) = delete;

 private:
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    if (!scene_.reads_bricks()) return;
    for (const Instance& instance : scene_.felt()) {
      if (const IsoSurface* iso = iso_of(instance.surface)) visit(iso->field());
    }
    for (const FieldEffect& effect : scene_.felt_effects()) visit(*effect.field);
  }
  const Scene& scene_;
};

}  // namespace

ProxyCache::ProxyCache(const Scene& scene) {
  const auto& instances = scene.instances();
  if (!(scene.probe_radius() > 0.0)) return;
  const auto any = [&](const auto& is) { return std::any_of(instances.begin(), instances.end(), is); };
  const bool reliefs = any([](const Instance& instance) { return relief_of(instance) != nullptr; });
  // Of bricks, what is known changes as they are read.
  const bool isosurfaces = any([](const Instance& instance) {
    const IsoSurface* iso = iso_of(instance.surface);
    return iso != nullptr && iso->field().bricks() == nullptr;
  });
  // Any of them may come to be any instance's.
  for (std::size_t i = 0; i < std::min(instances.size(), entries_.size()); ++i) {
    if (reliefs) entries_[i].blocks = std::make_unique<ReliefBlocks>();
    if (isosurfaces) entries_[i].cells = std::make_unique<KeptCells>();
  }
}

ForceSample step(const Scene& scene, ProxyState& state, ProxyCache& cache, const ProbeSample& probe,
                 Seconds dt) noexcept {
  ForceSample out;
  Tick tick(scene, state, cache, probe, dt, out);
  if (!sample(tick)) return out;
  const VolumeReading reading(scene);
  cache.work().begin(scene.budget());
  reach(tick);
  carry(tick);
  constrain(tick);
  add(tick);
  answer(tick);
  return out;
}

ForceSample step(const Scene& scene, ProxyState& state, const ProbeSample& probe, Seconds dt) noexcept {
  ProxyCache cache;
  return step(scene, state, cache, probe, dt);
}

}  // namespace asperity
