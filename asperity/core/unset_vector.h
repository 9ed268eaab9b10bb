#pragma once

#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace asperity {

/// Leaves the elements of a vector as they are until they are written: clearing a large array that many threads then
/// fill takes one of them as long as the filling. [build]
template <class T>
struct UnsetAllocator : std::allocator<T> {
  static_assert(std::is_trivially_destructible_v<T>);
  template <class U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };
  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }
};

/// A vector that resize and the constructor by size do not fill: whoever makes it writes every element before it is
/// read.
template <class T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

}  // namespace asperity
