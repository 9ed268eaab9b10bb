#include "asperity/geometry/corner_uvs.h"

#include <algorithm>

#include "asperity/core/parallel_for.h"
#include "asperity/geometry/index_table.h"

namespace asperity {

namespace {

std::uint64_t bits_of(const Vec2f& uv) noexcept {
  return std::bit_cast<std::uint32_t>(uv.x()) | std::uint64_t{std::bit_cast<std::uint32_t>(uv.y())} << 32U;
}

bool same(const CornerUvs::Corners& a, const CornerUvs::Corners& b) noexcept {
  return bits_of(a[0]) == bits_of(b[0]) && bits_of(a[1]) == bits_of(b[1]) && bits_of(a[2]) == bits_of(b[2]);
}

std::uint64_t hash_of(const CornerUvs::Corners& uvs) noexcept {
  return mixed_bits(mixed_bits(mixed_bits(bits_of(uvs[0])) + bits_of(uvs[1])) + bits_of(uvs[2]));
}

}  // namespace

CornerUvs::CornerUvs(std::span<const Corners> all, std::span<const Triangle> triangles, std::size_t vertices)
    : of_vertex_(vertices, Vec2f::Zero()) {
  // The last triangle at a vertex says what it has.
  for (std::size_t face = 0; face < all.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) of_vertex_[triangles[face][k]] = all[face][k];
  }
  apart_.resize((all.size() + group_size - 1) / group_size);
  constexpr std::size_t groups_a_share = 512;
  parallel_for(apart_.size(), {.grain = groups_a_share}, [&](std::size_t group) {
    const std::size_t first = group * group_size;
    for (std::size_t face = first; face < std::min(first + group_size, all.size()); ++face) {
      const Triangle& t = triangles[face];
      if (!same({of_vertex_[t[0]], of_vertex_[t[1]], of_vertex_[t[2]]}, all[face]))
        apart_[group].faces |= 1U << (face - first);
    }
  });
  std::size_t differ = 0;
  for (const Apart& group : apart_) differ += static_cast<std::size_t>(std::popcount(group.faces));
  // Where nearly all differ what the others share is the larger part.
  const bool all_apart = 6 * differ > 5 * all.size();
  if (all_apart) of_vertex_ = std::vector<Vec2f>();
  std::uint32_t count = 0;
  for (std::size_t group = 0; group < apart_.size(); ++group) {
    const std::size_t faces = std::min<std::size_t>(group_size, all.size() - group * group_size);
    if (all_apart) apart_[group].faces = faces == group_size ? ~0U : (1U << faces) - 1U;
    apart_[group].before = count;
    count += static_cast<std::uint32_t>(std::popcount(apart_[group].faces));
  }
  keep_apart(all, count);
}

void CornerUvs::keep_apart(std::span<const Corners> all, std::size_t count) {
  constexpr std::size_t few = 256;
  const auto each_apart = [&](const auto& visit) {
    for (std::size_t face = 0; face < all.size(); ++face) {
      if ((apart_[face / group_size].faces >> (face % group_size) & 1U) != 0 && !visit(all[face])) return;
    }
  };
  // Of fewer an index would be no smaller than what it stands for.
  if (count > few) {
    IndexTable table(few + 1);
    which_.reserve(count);
    each_apart([&](const Corners& uvs) {
      const auto next = static_cast<std::uint32_t>(own_.size());
      const std::uint32_t known =
          table.find_or_insert(hash_of(uvs), next, [&](std::uint32_t other) { return same(own_[other], uvs); });
      if (known == no_index && next == few) return false;
      if (known == no_index) own_.push_back(uvs);
      which_.push_back(static_cast<std::uint8_t>(known == no_index ? next : known));
      return true;
    });
    if (which_.size() == count) return own_.shrink_to_fit();
  }
  which_ = std::vector<std::uint8_t>();
  own_.clear();
  own_.reserve(count);
  each_apart([&](const Corners& uvs) {
    own_.push_back(uvs);
    return true;
  });
}

}  // namespace asperity
