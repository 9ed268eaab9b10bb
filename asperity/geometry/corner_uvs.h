#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "asperity/core/math.h"

namespace asperity {

/// Texture coordinates of the corners of triangles: once a vertex where all triangles around it agree to the bit; apart
/// for each triangle that differs at some corner, and those once where there are few that differ, as where every
/// triangle wears the whole map.
class CornerUvs {
 public:
  using Triangle = std::array<std::uint32_t, 3>;
  using Corners = std::array<Vec2f, 3>;

  CornerUvs() = default;
  /// Of all triangles, none without corners; `vertices`: more than any index. [build]
  CornerUvs(std::span<const Corners> all, std::span<const Triangle> triangles, std::size_t vertices);

  [[nodiscard]] bool empty() const noexcept { return apart_.empty(); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return of_vertex_.capacity() * sizeof(Vec2f) + apart_.capacity() * sizeof(Apart) + which_.capacity() +
           own_.capacity() * sizeof(Corners);
  }
  /// Of triangle `face`, whose corners are at the vertices of `triangle`. [servo]
  [[nodiscard]] Corners at(std::uint32_t face, const Triangle& triangle) const noexcept {
    const Apart& group = apart_[face / group_size];
    const std::uint32_t bit = 1U << (face % group_size);
    if ((group.faces & bit) != 0) {
      const std::uint32_t own = group.before + static_cast<std::uint32_t>(std::popcount(group.faces & (bit - 1U)));
      return own_[which_.empty() ? own : which_[own]];
    }
    return {of_vertex_[triangle[0]], of_vertex_[triangle[1]], of_vertex_[triangle[2]]};
  }

 private:
  static constexpr std::uint32_t group_size = 32;
  /// Which of a group of triangles have coordinates of their own, and how many have before it.
  struct Apart {
    std::uint32_t faces = 0;
    std::uint32_t before = 0;
  };
  void keep_apart(std::span<const Corners> all, std::size_t count);

  std::vector<Vec2f> of_vertex_;
  std::vector<Apart> apart_;
  std::vector<std::uint8_t> which_;  ///< of own_, one a triangle that is apart; empty: each has one of its own
  std::vector<Corners> own_;
};

}  // namespace asperity
