#pragma once

namespace asperity {

/// Whether this processor has AVX2. [any]
inline bool has_avx2() noexcept {
#if defined(__x86_64__)
  static const bool wide = __builtin_cpu_supports("avx2");
  return wide;
#else
  return false;
#endif
}

}  // namespace asperity
