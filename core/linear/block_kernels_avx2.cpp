// CMakeLists.txt compiles this file with -mavx2 -mfma if the compiler has them. Otherwise avx2_block_kernels() is null.
#include "core/linear/block_kernels.hpp"
#include "core/linear/block_loops.hpp"
#include "core/linear/lu_loops.hpp"

namespace mbsopt {

#if defined(__AVX2__) && defined(__FMA__)
namespace {

// The attributes belong to the alias, not to the type: Clang would drop a smaller alignment there.
using Four __attribute__((aligned(8), may_alias)) = double __attribute__((vector_size(32)));
static_assert(alignof(Four) == 8);

struct __attribute__((may_alias)) Row {
  Four x;

  Row& operator+=(const Row& y) { return x += y.x, *this; }
  Row& operator-=(const Row& y) { return x -= y.x, *this; }
  Row& operator*=(double s) { return x *= s, *this; }
  friend Row operator+(const Row& a, const Row& b) { return {a.x + b.x}; }
  friend Row operator-(const Row& a, const Row& b) { return {a.x - b.x}; }
  friend Row operator*(double s, const Row& a) { return {s * a.x}; }

  static Row zero() { return {Four{}}; }
  // Sets each entry to the larger of itself and |y|.
  void grow_to(const Row& y) {
    const Four size = y.x < 0 ? -y.x : y.x;
    x = x > size ? x : size;
  }
  double largest() const {
    const double a = x[0] > x[1] ? x[0] : x[1], b = x[2] > x[3] ? x[2] : x[3];
    return a > b ? a : b;
  }
};

using Two __attribute__((aligned(8), may_alias)) = double __attribute__((vector_size(16)));
static_assert(alignof(Two) == 8);

// M numbers: fours, and a pair where they leave one.
template <int M>
class ColumnOfFours {
 public:
  static constexpr int kRegisters = (M + 3) / 4;

  explicit ColumnOfFours(const double* from) {
#pragma GCC unroll 8
    for (int i = 0; i < kFours; ++i) x_[i] = four(from, i);
    if constexpr (kPair) rest_ = pair(from);
  }
  static ColumnOfFours zero() { return ColumnOfFours(); }
  void add(double s, const double* y) { subtract(-s, y); }
  void subtract(double s, const double* y) {
#pragma GCC unroll 8
    for (int i = 0; i < kFours; ++i) x_[i] -= s * four(y, i);
    if constexpr (kPair) rest_ -= s * pair(y);
  }
  void scale(double s) {
#pragma GCC unroll 8
    for (int i = 0; i < kFours; ++i) x_[i] *= s;
    if constexpr (kPair) rest_ *= s;
  }
  void store(double* to) const {
#pragma GCC unroll 8
    for (int i = 0; i < kFours; ++i) reinterpret_cast<Four*>(to)[i] = x_[i];
    if constexpr (kPair) *reinterpret_cast<Two*>(to + M - 2) = rest_;
  }
  double dot(const double* y) const {
    Four sum = x_[0] * four(y, 0);
#pragma GCC unroll 8
    for (int i = 1; i < kFours; ++i) sum += x_[i] * four(y, i);
    Two half = __builtin_shufflevector(sum, sum, 0, 1) + __builtin_shufflevector(sum, sum, 2, 3);
    if constexpr (kPair) half += rest_ * pair(y);
    return half[0] + half[1];
  }
  // y -= s x of the entries from `first` on; those of x before it are zero.
  static void subtract_from(int first, double s, const double* x, double* y) {
    for (int i = first / 4; i < kFours; ++i) reinterpret_cast<Four*>(y)[i] -= s * four(x, i);
    if constexpr (kPair) *reinterpret_cast<Two*>(y + M - 2) -= s * pair(x);
  }

 private:
  ColumnOfFours() = default;
  static constexpr int kFours = M / 4;
  static constexpr bool kPair = M % 4 != 0;
  static Four four(const double* y, int i) { return reinterpret_cast<const Four*>(y)[i]; }
  static Two pair(const double* y) { return *reinterpret_cast<const Two*>(y + M - 2); }

  Four x_[kFours] = {};
  Two rest_ = {};
};

}  // namespace

const LuKernelTable* avx2_lu_kernels() {
  static constexpr LuKernelTable kKernels = lu_kernel_table<ColumnOfFours>();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &kKernels : nullptr;
}

const BlockKernels* avx2_block_kernels() {
  static constexpr BlockKernels kKernels = BlockLoops<Row, ColumnOfFours>::kernels();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &kKernels : nullptr;
}
#else
const LuKernelTable* avx2_lu_kernels() { return nullptr; }
const BlockKernels* avx2_block_kernels() { return nullptr; }
#endif

}  // namespace mbsopt
