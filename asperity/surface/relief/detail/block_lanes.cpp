#include "asperity/surface/relief/detail/block_lanes.h"

#include <cmath>
#include <limits>

#include "asperity/core/processor.h"

namespace asperity {

namespace {

#define ASPERITY_INLINE [[gnu::always_inline]] inline

/// The least squared distance to a place that a node of each of some blocks may have.
ASPERITY_INLINE void bound_all(const std::array<const float*, block_rows>& block, std::size_t count, const Vec3f& c,
                               float* to) {
  const float cx = c.x();
  const float cy = c.y();
  const float cz = c.z();
  for (std::size_t k = 0; k < count; ++k) {
    const float x = cx - block[0][k];
    const float y = cy - block[1][k];
    const float z = cz - block[2][k];
    const float square = x * x + y * y + z * z;
    const float up = x * block[4][k] + y * block[5][k] + z * block[6][k];
    const float over = up - block[7][k] > 0.0F ? up - block[7][k] : 0.0F;
    const float aside = square - up * up > 0.0F ? square - up * up : 0.0F;
    const float lateral = std::sqrt(aside) - block[3][k];
    const float beside = lateral > 0.0F ? lateral : 0.0F;
    const float around = std::sqrt(square) - block[3][k];
    const float sphere = around > 0.0F ? around * around : 0.0F;
    const float slab = over * over + beside * beside;
    to[k] = slab > sphere ? slab : sphere;
  }
}

/// Squared distances of a block's nodes to a place, and the least of them.
ASPERITY_INLINE float square_all(const float* __restrict places, const Vec3f& c, float* __restrict to) {
  constexpr std::size_t abreast = 8;
  const float cx = c.x();
  const float cy = c.y();
  const float cz = c.z();
  for (std::size_t k = 0; k < block_nodes; ++k) {
    const float x = places[k] - cx;
    const float y = places[block_nodes + k] - cy;
    const float z = places[2 * block_nodes + k] - cz;
    to[k] = x * x + y * y + z * z;
  }
  float least[abreast];
  for (std::size_t l = 0; l < abreast; ++l) least[l] = to[l];
  for (std::size_t k = abreast; k < block_nodes; k += abreast) {
    for (std::size_t l = 0; l < abreast; ++l) least[l] = to[k + l] < least[l] ? to[k + l] : least[l];
  }
  float all = least[0];
  for (std::size_t l = 1; l < abreast; ++l) all = least[l] < all ? least[l] : all;
  return all;
}

void bound_plain(const std::array<const float*, block_rows>& block, std::size_t count, const Vec3f& c, float* to) {
  bound_all(block, count, c, to);
}
float square_plain(const float* places, const Vec3f& c, float* to) {
  return square_all(places, c, to);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void bound_avx2(const std::array<const float*, block_rows>& block, std::size_t count,
                                                const Vec3f& c, float* to) {
  bound_all(block, count, c, to);
}
__attribute__((target("avx2"))) float square_avx2(const float* places, const Vec3f& c, float* to) {
  return square_all(places, c, to);
}
#endif
#undef ASPERITY_INLINE

}  // namespace

#if defined(__x86_64__)
const BoundBlocks bound_blocks = has_avx2() ? bound_avx2 : bound_plain;
const SquareNodes square_nodes = has_avx2() ? square_avx2 : square_plain;
#else
const BoundBlocks bound_blocks = bound_plain;
const SquareNodes square_nodes = square_plain;
#endif

}  // namespace asperity
