#pragma once

#include <cassert>
#include <cstddef>
#include <new>
#include <type_traits>

namespace asperity {

/// At most `Capacity` values in place, without allocation. `push_back` on a full vector is refused (returns false):
/// the servo path has no other way to fail. Unused places are not initialised and not copied. [servo]
template <class T, std::size_t Capacity>
class FixedVector {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  FixedVector() noexcept {}  // NOLINT: the storage stays uninitialised on purpose
  FixedVector(const FixedVector& other) noexcept { *this = other; }
  FixedVector& operator=(const FixedVector& other) noexcept {
    if (this == &other) return *this;
    size_ = other.size_;
    for (std::size_t i = 0; i < size_; ++i) new (&values_[i]) T(other.values_[i]);
    return *this;
  }

  bool push_back(const T& value) noexcept {
    if (size_ == Capacity) return false;
    new (&values_[size_++]) T(value);
    return true;
  }
  /// Appends a default-constructed value and answers it, or nullptr when full.
  T* emplace_back() noexcept {
    if (size_ == Capacity) return nullptr;
    // T() would fill a struct with zeros before its members get their own values.
    if constexpr (std::is_class_v<T>) {
      return new (&values_[size_++]) T;
    } else {
      return new (&values_[size_++]) T();
    }
  }
  void clear() noexcept { size_ = 0; }
  /// Removes element `index`; the last one takes its place.
  void swap_remove(std::size_t index) noexcept {
    assert(index < size_);
    if (index != --size_) values_[index] = values_[size_];
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return Capacity; }
  T& operator[](std::size_t index) noexcept { return values_[index]; }
  const T& operator[](std::size_t index) const noexcept { return values_[index]; }
  T* begin() noexcept { return values_; }
  T* end() noexcept { return values_ + size_; }
  const T* begin() const noexcept { return values_; }
  const T* end() const noexcept { return values_ + size_; }

 private:
  union {
    T values_[Capacity];
  };
  std::size_t size_ = 0;
};

}  // namespace asperity
