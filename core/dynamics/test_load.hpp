// A load on all bodies that no symmetry of a mechanism leaves a direction out of: what Projector::response() answers.
#pragma once

#include <cmath>

#include "core/body/fixed_size.hpp"

namespace mbsopt {

// Accelerations of body i (1-based), of size 1.
template <int N>
Vec<N> test_load(int i) {
  Vec<N> x;
  for (int k = 0; k < N; ++k) x(k) = std::cos(1.0 + 2.7 * (N * i + k) + 0.31 * i * i);
  return x;
}

}  // namespace mbsopt
