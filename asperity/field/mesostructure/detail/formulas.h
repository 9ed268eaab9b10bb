#pragma once
// The formulas of mesostructure_generators.h. Private to field: each takes a completed spec that has passed the checks.

#include <vector>

#include "asperity/field/mesostructure/generators.h"

namespace asperity {

std::vector<float> flat_heights(const MesostructureSpec& spec);
std::vector<float> serrated_heights(const MesostructureSpec& spec);
std::vector<float> beam_heights(const MesostructureSpec& spec);
std::vector<float> ring_heights(const MesostructureSpec& spec);
std::vector<float> groove_heights(const MesostructureSpec& spec);
std::vector<float> fractal_heights(const MesostructureSpec& spec);
// These two do not find a place for every number; they answer fewer than asked then.
struct ScatteredHeights {
  std::vector<float> heights;
  int placed = 0;
};
ScatteredHeights wart_heights(const MesostructureSpec& spec);
ScatteredHeights coin_heights(const MesostructureSpec& spec);

}  // namespace asperity
