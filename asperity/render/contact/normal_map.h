#pragma once
// The normal map that a coat is given beside its heights, as the laws of heights feel it. Private to render.

#include "asperity/render/felt.h"
#include "asperity/render/laws/normal_map_use.h"

namespace asperity {

/// The lateral force of the coat's normal map where it is felt, into `answer.turn`, which is added as far as the energy
/// account pays for it. The answer's force and normal are those of the heights at `place` of `face`; `world`: in that
/// frame, not the object's. [servo]
void turn_by_normal_map(NormalMapUse use, const Touched& touch, std::uint32_t face, const Vec3& place, bool world,
                        LawForce& answer) noexcept;

}  // namespace asperity
