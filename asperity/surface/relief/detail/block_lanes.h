#pragma once
// Distances to blocks of samples and to their nodes, many side by side. The same to the bit with and without AVX2.

#include <array>
#include <cstddef>

#include "asperity/core/math.h"

namespace asperity {

/// Samples a side of a block, which is looked at as a whole.
inline constexpr int block_side = 8;
inline constexpr std::size_t block_nodes = std::size_t{block_side} * block_side;
/// What is known of blocks, each number in a row of its own: centre (3), radius, a plane's normal (3), and its distance
/// from the centre, which no node is above.
inline constexpr std::size_t block_rows = 8;

/// The least squared distances to a place that a node of each of `count` blocks may have. [build]
using BoundBlocks = void (*)(const std::array<const float*, block_rows>& rows, std::size_t count, const Vec3f& place,
                             float* to);
extern const BoundBlocks bound_blocks;
/// Squared distances of a block's nodes (all x, all y, all z) to a place, and the least of them. [build]
using SquareNodes = float (*)(const float* nodes, const Vec3f& place, float* to);
extern const SquareNodes square_nodes;

}  // namespace asperity
