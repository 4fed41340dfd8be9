// A load on all bodies that no symmetry of a mechanism leaves a direction out of: what Projector::response() answers.
#pragma once

#include <cstdint>

#include "core/body/fixed_size.hpp"

namespace mbsopt {

// Accelerations of body i (1-based), between -1 and 1: multiples of the golden ratio, modulo 2.
template <int N>
Vec<N> test_load(int i) {
  Vec<N> x;
  for (int k = 0; k < N; ++k) {
    const std::uint32_t turned = static_cast<std::uint32_t>(N * i + k) * 2654435769U;
    x(k) = 0x1p-31 * static_cast<std::int32_t>(turned);
  }
  return x;
}

}  // namespace mbsopt
