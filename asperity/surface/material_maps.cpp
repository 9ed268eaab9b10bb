#include "asperity/surface/material_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace asperity {

Result<MaterialMaps> MaterialMaps::build(Parts parts) {
  for (std::size_t c = 0; c < mapped_channels; ++c) {
    const HeightMap* map = parts.channels[c].get();
    if (map == nullptr) continue;
    const bool stiffness = c == static_cast<std::size_t>(MaterialChannel::stiffness);
    // Stored as floats relative to their middle, zero may come out a rounding below it; readers cut it off.
    const double rounding = 1e-6 * (map->highest() - map->lowest());
    if (map->lowest() >= (stiffness ? std::numeric_limits<double>::min() : -rounding)) continue;
    return bad_value(fmt::format("is as low as {:g} somewhere", map->lowest()),
                     to_string(static_cast<MaterialChannel>(c)), stiffness ? "values above 0" : "values of 0 or more");
  }
  if ((parts.lay_s == nullptr) != (parts.lay_t == nullptr))
    return refused(ErrorCode::mismatch, "has one component alone", "lay", "one along s and one along t, or none");
  for (const auto& component : {parts.lay_s, parts.lay_t}) {
    if (component == nullptr || std::max(std::abs(component->lowest()), std::abs(component->highest())) <= 1.0 + 1e-6)
      continue;
    return bad_value(fmt::format("lies between {:g} and {:g}", component->lowest(), component->highest()), "lay",
                     "components between -1 and 1");
  }
  MaterialMaps maps;
  maps.parts_ = std::move(parts);
  return maps;
}

LocalMaterial MaterialMaps::sample(const Vec2& st) const noexcept {
  LocalMaterial local;
  for (std::size_t c = 0; c < mapped_channels; ++c) {
    if (parts_.channels[c] == nullptr) continue;
    const HeightSample sample = parts_.channels[c]->sample(st);
    local.value[c] = sample.height;
    local.slope[c] = sample.gradient;
  }
  if (parts_.lay_s != nullptr) {
    local.lay = Vec2(parts_.lay_s->height_at(st), parts_.lay_t->height_at(st));
    local.lay_strength = std::min(1.0, local.lay.norm());
  }
  return local;
}

std::size_t MaterialMaps::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this);
  for (const auto& map : parts_.channels) bytes += map != nullptr ? map->memory_bytes() : 0;
  for (const auto& map : {parts_.lay_s, parts_.lay_t}) bytes += map != nullptr ? map->memory_bytes() : 0;
  return bytes;
}

}  // namespace asperity
