#pragma once
// The formulas of mesostructure_library.h. Private to field.

#include <cstdint>
#include <functional>
#include <span>

namespace asperity {

/// Height at texture coordinates (s to the right, t up, 0 to 1; beyond they repeat), in any unit, from any ground.
using Pattern = std::function<double(double s, double t)>;

/// One relief of the library, as its formula's file lists it.
struct PatternItem {
  const char* name;
  double tile;       ///< m
  double amplitude;  ///< m
  Pattern (*make)(std::uint64_t seed);
  const char* summary;
};

/// Cloth, basketry, skin, wood, stone and sand. [build]
std::span<const PatternItem> grown_patterns();
/// Masonry, paving, machined and moulded surfaces. [build]
std::span<const PatternItem> made_patterns();

}  // namespace asperity
