#include "asperity/render/state.h"

#include <algorithm>

#include "asperity/render/scene.h"

namespace asperity {

ProxyCache::ProxyCache(const Scene& scene) {
  const auto& instances = scene.instances();
  const auto is_relief = [](const Instance& instance) { return relief_of(instance) != nullptr; };
  if (!(scene.probe_radius() > 0.0) || std::none_of(instances.begin(), instances.end(), is_relief)) return;
  // Any of them may come to be any instance's.
  for (std::size_t i = 0; i < std::min(instances.size(), entries_.size()); ++i)
    entries_[i].blocks = std::make_unique<ReliefBlocks>();
}

}  // namespace asperity
