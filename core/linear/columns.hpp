// Columns of numbers in registers, for vector types of GCC and Clang. Eigen's fixed-size expressions would go through
// memory.
//
// Registers describes a type of register: Register itself, its numbers kWidth, and half(x), the pair of sums of its
// numbers. A column of M numbers, M even, takes a pair of two beside them where they leave one.
#pragma once

namespace mbsopt {

// The attributes belong to the alias, not to the type: Clang would drop a smaller alignment there.
using Pair __attribute__((aligned(8), may_alias)) = double __attribute__((vector_size(16)));
static_assert(alignof(Pair) == 8);

struct Pairs {  // of any processor
  using Register = Pair;
  static constexpr int kWidth = 2;
  static Pair half(const Pair& x) { return x; }
};

template <class Registers, int M>
class Column {
  using Register = typename Registers::Register;
  static constexpr int kWidth = Registers::kWidth, kFull = M / kWidth;
  static constexpr bool kPair = M % kWidth != 0;

 public:
  static constexpr int kRegisters = kFull + kPair;

  explicit Column(const double* from) {
#pragma GCC unroll 16
    for (int i = 0; i < kFull; ++i) x_[i] = full(from, i);
    if constexpr (kPair) rest_ = pair(from);
  }
  static Column zero() { return Column(); }
  void add(double s, const double* y) { subtract(-s, y); }
  void subtract(double s, const double* y) {
#pragma GCC unroll 16
    for (int i = 0; i < kFull; ++i) x_[i] -= s * full(y, i);
    if constexpr (kPair) rest_ -= s * pair(y);
  }
  void scale(double s) {
#pragma GCC unroll 16
    for (int i = 0; i < kFull; ++i) x_[i] *= s;
    if constexpr (kPair) rest_ *= s;
  }
  void store(double* to) const {
#pragma GCC unroll 16
    for (int i = 0; i < kFull; ++i) reinterpret_cast<Register*>(to)[i] = x_[i];
    if constexpr (kPair) *reinterpret_cast<Pair*>(to + M - 2) = rest_;
  }
  double dot(const double* y) const {
    Register sum = x_[0] * full(y, 0);
#pragma GCC unroll 16
    for (int i = 1; i < kFull; ++i) sum += x_[i] * full(y, i);
    Pair half = Registers::half(sum);
    if constexpr (kPair) half += rest_ * pair(y);
    return half[0] + half[1];
  }
  // y -= s x of the entries from `first` on; those of x before it are zero.
  static void subtract_from(int first, double s, const double* x, double* y) {
    for (int i = first / kWidth; i < kFull; ++i) reinterpret_cast<Register*>(y)[i] -= s * full(x, i);
    if constexpr (kPair) *reinterpret_cast<Pair*>(y + M - 2) -= s * pair(x);
  }

 private:
  Column() = default;
  static Register full(const double* y, int i) { return reinterpret_cast<const Register*>(y)[i]; }
  static Pair pair(const double* y) { return *reinterpret_cast<const Pair*>(y + M - 2); }

  Register x_[kFull] = {};
  Pair rest_ = {};
};

}  // namespace mbsopt
