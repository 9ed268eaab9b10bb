#pragma once
// The formulas of mesostructure_library.h. Private to field.

#include <cstdint>
#include <functional>

namespace asperity {

/// Height at texture coordinates (s to the right, t up, 0 to 1; beyond they repeat), in any unit, from any ground.
using Pattern = std::function<double(double s, double t)>;

// Cloth and basketry.
Pattern linen_pattern(std::uint64_t seed);
Pattern denim_pattern(std::uint64_t seed);
Pattern corduroy_pattern(std::uint64_t seed);
Pattern knit_pattern(std::uint64_t seed);
Pattern basket_pattern(std::uint64_t seed);
// Grown and weathered.
Pattern leather_pattern(std::uint64_t seed);
Pattern wood_pattern(std::uint64_t seed);
Pattern bark_pattern(std::uint64_t seed);
Pattern orange_pattern(std::uint64_t seed);
Pattern scales_pattern(std::uint64_t seed);
Pattern pebbles_pattern(std::uint64_t seed);
Pattern sand_pattern(std::uint64_t seed);
// Built.
Pattern cobbles_pattern(std::uint64_t seed);
Pattern bricks_pattern(std::uint64_t seed);
Pattern roughcast_pattern(std::uint64_t seed);
Pattern paving_pattern(std::uint64_t seed);
// Made.
Pattern sandpaper_pattern(std::uint64_t seed);
Pattern honeycomb_pattern(std::uint64_t seed);
Pattern knurl_pattern(std::uint64_t seed);
Pattern plate_pattern(std::uint64_t seed);
Pattern hammered_pattern(std::uint64_t seed);
Pattern milled_pattern(std::uint64_t seed);
Pattern brushed_pattern(std::uint64_t seed);
Pattern file_pattern(std::uint64_t seed);
Pattern ribs_pattern(std::uint64_t seed);
Pattern record_pattern(std::uint64_t seed);
Pattern braille_pattern(std::uint64_t seed);
Pattern studs_pattern(std::uint64_t seed);

}  // namespace asperity
