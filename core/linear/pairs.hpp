// Rows of lanes in pairs of registers (columns.hpp), for the innermost loops on any processor.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

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

}  // namespace mbsopt
