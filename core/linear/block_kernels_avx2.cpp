// CMakeLists.txt compiles this file with -mavx2 -mfma if the compiler has them. Otherwise avx2_block_kernels() is null.
#include "core/linear/block_loops.hpp"
#include "core/linear/columns.hpp"
#include "core/linear/kernel_table.hpp"
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

struct Fours {
  using Register = Four;
  static constexpr int kWidth = 4;
  static Pair half(const Four& x) { return __builtin_shufflevector(x, x, 0, 1) + __builtin_shufflevector(x, x, 2, 3); }
};
template <int M>
using ColumnOfFours = Column<Fours, M>;

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
