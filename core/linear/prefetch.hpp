// Requests memory before a loop needs it. A body has some 3 kB in a dozen arrays. Those of thousands of bodies do not
// fit the near caches, and the processor's own prefetching stops at each page of memory.
#pragma once

#include <cstddef>
#include <cstdint>

namespace mbsopt {

inline constexpr int kAhead = 4;  // bodies or groups of rows, in the order in which a loop comes to them

// Prefetches Count objects from x + shift on, which need not exist. It is always inlined: compilers omit calls of a
// function without effects, and files for other processors must not share it.
template <int Count = 1, class T>
[[gnu::always_inline]] inline void prefetch(const T* x, std::ptrdiff_t shift = 0) {
  constexpr std::ptrdiff_t kSize = static_cast<std::ptrdiff_t>(sizeof(T)), kBytes = Count * kSize, kLine = 64;
  const std::uintptr_t from = reinterpret_cast<std::uintptr_t>(x) + static_cast<std::uintptr_t>(kSize * shift);
#pragma GCC unroll 16
  for (std::ptrdiff_t i = 0; i < kBytes; i += kLine) {
    __builtin_prefetch(reinterpret_cast<const char*>(from + static_cast<std::uintptr_t>(i)));
  }
  __builtin_prefetch(reinterpret_cast<const char*>(from + static_cast<std::uintptr_t>(kBytes - 1)));
}

}  // namespace mbsopt
