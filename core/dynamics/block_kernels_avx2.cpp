// Compiled with -mavx2 -mfma where the compiler has them (CMakeLists.txt), else empty but for the answer no.
#include "core/dynamics/block_loops.hpp"

namespace mbsopt {

#if defined(__AVX2__) && defined(__FMA__)
namespace {

// The attributes of the alias, not of the type: Clang would drop a smaller alignment there.
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
  // To the absolute values of y, where they are larger.
  void grow_to(const Row& y) {
    const Four size = y.x < 0 ? -y.x : y.x;
    x = x > size ? x : size;
  }
  double largest() const {
    const double a = x[0] > x[1] ? x[0] : x[1], b = x[2] > x[3] ? x[2] : x[3];
    return a > b ? a : b;
  }
};

}  // namespace

const BlockKernels* avx2_block_kernels() {
  static constexpr BlockKernels kKernels = BlockLoops<Row>::kernels();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &kKernels : nullptr;
}
#else
const BlockKernels* avx2_block_kernels() { return nullptr; }
#endif

}  // namespace mbsopt
