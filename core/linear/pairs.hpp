// Pairs of doubles, columns of them held in registers, and rows of lanes: vector types of GCC and Clang, for any
// processor. The innermost loops of the block solvers use them. Eigen's fixed-size expressions would go through memory.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// The attributes belong to the alias, not to the type: Clang would drop a smaller alignment there.
using Pair __attribute__((aligned(8), may_alias)) = double __attribute__((vector_size(16)));
static_assert(alignof(Pair) == 8);

// One row of lanes (fixed_size.hpp) in registers. A single vector of four would stay in memory if the processor's
// registers hold two.
struct __attribute__((may_alias)) LaneRow {
  using AlignedPair = double __attribute__((vector_size(16), may_alias));
  AlignedPair low, high;

  LaneRow& operator+=(const LaneRow& x) { return low += x.low, high += x.high, *this; }
  LaneRow& operator-=(const LaneRow& x) { return low -= x.low, high -= x.high, *this; }
  LaneRow& operator*=(double s) { return low *= s, high *= s, *this; }
  friend LaneRow operator+(const LaneRow& x, const LaneRow& y) { return {x.low + y.low, x.high + y.high}; }
  friend LaneRow operator-(const LaneRow& x, const LaneRow& y) { return {x.low - y.low, x.high - y.high}; }
  friend LaneRow operator*(double s, const LaneRow& x) { return {s * x.low, s * x.high}; }

  static LaneRow zero() { return {AlignedPair{}, AlignedPair{}}; }
  // Sets each entry to the larger of itself and |y|.
  void grow_to(const LaneRow& y) {
    const AlignedPair a = y.low < 0 ? -y.low : y.low, b = y.high < 0 ? -y.high : y.high;
    low = low > a ? low : a;
    high = high > b ? high : b;
  }
  double largest() const {
    const double a = low[0] > low[1] ? low[0] : low[1], b = high[0] > high[1] ? high[0] : high[1];
    return a > b ? a : b;
  }
};
static_assert(sizeof(LaneRow) == kLanes * sizeof(double));

// The numbers of a vector, or the rows of an array of lanes, so that formulas for entries serve both.
template <int N>
double* entries(Vec<N>& x) {
  return x.data();
}
template <int N>
const double* entries(const Vec<N>& x) {
  return x.data();
}
template <int N>
LaneRow* entries(Lanes<N>& x) {
  return reinterpret_cast<LaneRow*>(x.data());
}
template <int N>
const LaneRow* entries(const Lanes<N>& x) {
  return reinterpret_cast<const LaneRow*>(x.data());
}

// A column of 2 Pairs numbers.
template <int Pairs>
struct Column {
  Pair x[Pairs];

  explicit Column(const double* from) {
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) x[i] = reinterpret_cast<const Pair*>(from)[i];
  }
  void add(double s, const double* y) {
    const Pair ss = {s, s};
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) x[i] += ss * reinterpret_cast<const Pair*>(y)[i];
  }
  void subtract(double s, const double* y) {
    const Pair ss = {s, s};
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) x[i] -= ss * reinterpret_cast<const Pair*>(y)[i];
  }
  void scale(double s) {
    const Pair ss = {s, s};
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) x[i] *= ss;
  }
  // x'y as two halves that are not yet added.
  Pair times(const double* y) const {
    Pair sum = x[0] * reinterpret_cast<const Pair*>(y)[0];
#pragma GCC unroll 16
    for (int i = 1; i < Pairs; ++i) sum += x[i] * reinterpret_cast<const Pair*>(y)[i];
    return sum;
  }
  void store(double* to) const {
#pragma GCC unroll 16
    for (int i = 0; i < Pairs; ++i) reinterpret_cast<Pair*>(to)[i] = x[i];
  }
};

}  // namespace mbsopt
