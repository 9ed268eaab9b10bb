#pragma once
// The formulas of mesostructure_generators.h. Private to field: each takes a completed spec that has passed the checks.

#include <vector>

#include "asperity/field/mesostructure/generators.h"

namespace asperity {

using MadeHeights = Result<std::vector<float>>;

MadeHeights flat_heights(const MesostructureSpec& spec);
MadeHeights serrated_heights(const MesostructureSpec& spec);
MadeHeights beam_heights(const MesostructureSpec& spec);
MadeHeights ring_heights(const MesostructureSpec& spec);
/// These two do not find a place for every number. Errors: bad_value ("number").
MadeHeights wart_heights(const MesostructureSpec& spec);
MadeHeights coin_heights(const MesostructureSpec& spec);
MadeHeights groove_heights(const MesostructureSpec& spec);
MadeHeights fractal_heights(const MesostructureSpec& spec);

}  // namespace asperity
