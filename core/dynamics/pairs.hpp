// Pairs of doubles, and columns of them held in registers: vector types of GCC and Clang, which need no particular
// processor. For the innermost loops of the block solvers, where Eigen's fixed-size expressions go through memory.
#pragma once

namespace mbsopt {

using Pair = double __attribute__((vector_size(16), aligned(8), may_alias));

// (a0 + a1, b0 + b1)
inline Pair sums(Pair a, Pair b) { return __builtin_shufflevector(a, b, 0, 2) + __builtin_shufflevector(a, b, 1, 3); }

// 2 Pairs numbers. First: the pairs before it are left alone.
template <int Pairs>
struct Column {
  Pair x[Pairs];

  explicit Column(const double* from) {
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) x[i] = reinterpret_cast<const Pair*>(from)[i];
  }
  template <int First = 0>
  void add(double s, const double* y) {
    const Pair ss = {s, s};
#pragma GCC unroll 16
    for (int i = First; i < Pairs; ++i) x[i] += ss * reinterpret_cast<const Pair*>(y)[i];
  }
  template <int First = 0>
  void subtract(double s, const double* y) {
    const Pair ss = {s, s};
#pragma GCC unroll 16
    for (int i = First; i < Pairs; ++i) x[i] -= ss * reinterpret_cast<const Pair*>(y)[i];
  }
  void scale(double s) {
    const Pair ss = {s, s};
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) x[i] *= ss;
  }
  // x'y, its two halves not yet added.
  template <int First = 0>
  Pair times(const double* y) const {
    Pair sum = x[First] * reinterpret_cast<const Pair*>(y)[First];
#pragma GCC unroll 16
    for (int i = First + 1; i < Pairs; ++i) sum += x[i] * reinterpret_cast<const Pair*>(y)[i];
    return sum;
  }
  void store(double* to) const {
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) reinterpret_cast<Pair*>(to)[i] = x[i];
  }
};

}  // namespace mbsopt
