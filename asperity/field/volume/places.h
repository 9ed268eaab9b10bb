#pragma once
// Loops over the places of a grid.

#include <cstdint>

namespace asperity {

/// Calls visit(i, j, k) for every place from `first` to before `last` along each axis, x fastest. [any]
template <class Index, class Visit>
void for_each_place(const Index& first, const Index& last, const Visit& visit) {
  for (std::uint32_t k = first[2]; k < last[2]; ++k) {
    for (std::uint32_t j = first[1]; j < last[1]; ++j) {
      for (std::uint32_t i = first[0]; i < last[0]; ++i) visit(i, j, k);
    }
  }
}
/// The same where the ends are alike along all axes. [any]
template <class Visit>
void for_each_in_cube(int first, int last, const Visit& visit) {
  for (int k = first; k < last; ++k) {
    for (int j = first; j < last; ++j) {
      for (int i = first; i < last; ++i) visit(i, j, k);
    }
  }
}

}  // namespace asperity
