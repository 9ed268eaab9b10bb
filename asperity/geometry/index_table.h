#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "asperity/core/math.h"

namespace asperity {

/// Spreads the bits of a key over a hash. [build]
inline std::uint64_t mixed_bits(std::uint64_t value) {
  value = (value ^ (value >> 32U)) * 0x9e3779b97f4a7c15ULL;
  return value ^ (value >> 29U);
}

/// Open-addressing set of indices: hash and equality are the caller's, the table holds four bytes a slot. [build]
class IndexTable {
 public:
  /// Room for `count` indices; more must not be inserted.
  explicit IndexTable(std::size_t count) : slots_(std::bit_ceil(count + count / 2 + 2), no_index) {}

  /// The index already stored that `equal`s, or no_index after storing `index`.
  template <class Equal>
  std::uint32_t find_or_insert(std::uint64_t hash, std::uint32_t index, Equal&& equal) {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t slot = hash & mask;; slot = (slot + 1) & mask) {
      if (slots_[slot] == no_index) {
        slots_[slot] = index;
        return no_index;
      }
      if (equal(slots_[slot])) return slots_[slot];
    }
  }

 private:
  std::vector<std::uint32_t> slots_;
};

}  // namespace asperity
