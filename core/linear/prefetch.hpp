// Asking for memory before it is needed. A body has some 3 kB in a dozen arrays, those of thousands of bodies do not
// fit the near caches, and the processor's own guesses end with each page of memory.
#pragma once

#include <cstddef>
#include <cstdint>

namespace mbsopt {

inline constexpr int kAhead = 4;  // bodies or groups of rows, in the order in which a loop comes to them

// So many objects from x + shift on, which need not be there. Always inlined: a function of its own would be left out
// of programs, having no effect that compilers know of, and must not be shared with files for other processors.
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
