#include "core/linear/block_kernels.hpp"

#include <algorithm>

#include "core/linear/block_loops.hpp"
#include "core/linear/lu_loops.hpp"
#include "core/linear/pairs.hpp"

namespace mbsopt {
namespace {

static_assert(kLanes == 4);  // as in block_kernels_avx2.cpp

struct SixInPairs : Column<3> {
  using Column<3>::Column;
  static SixInPairs zero() {
    static constexpr double kZeros[6] = {};
    return SixInPairs(kZeros);
  }
  friend SixInPairs operator*(SixInPairs x, const SixInPairs& y) {
    for (int i = 0; i < 3; ++i) x.x[i] *= y.x[i];
    return x;
  }
  SixInPairs& operator+=(const SixInPairs& y) {
    for (int i = 0; i < 3; ++i) x[i] += y.x[i];
    return *this;
  }
  SixInPairs& operator-=(const SixInPairs& y) {
    for (int i = 0; i < 3; ++i) x[i] -= y.x[i];
    return *this;
  }
  // Sets each entry to the larger of itself and |y|.
  void grow_to(const SixInPairs& y) {
    for (int i = 0; i < 3; ++i) {
      const Pair size = y.x[i] < 0 ? -y.x[i] : y.x[i];
      x[i] = x[i] > size ? x[i] : size;
    }
  }
  double largest() const {
    double size = 0;
    for (const Pair& pair : x) size = std::max({size, pair[0], pair[1]});
    return size;
  }
  // The products with one, two, six columns of six.
  double times(const double* y) const {
    const Pair sum = Column<3>::times(y);
    return sum[0] + sum[1];
  }
  Pair times_two(const double* M) const { return sums(Column<3>::times(M), Column<3>::times(M + 6)); }
  SixInPairs times_columns(const double* M) const {
    SixInPairs out = *this;
    for (int i = 0; i < 3; ++i) out.x[i] = times_two(M + 12 * i);
    return out;
  }
};

template <int M>
struct ColumnOfPairs : Column<M / 2> {
  static constexpr int kRegisters = M / 2;
  using Column<M / 2>::Column;
  double dot(const double* y) const {
    const Pair sum = this->times(y);
    return sum[0] + sum[1];
  }
  // y -= s x of the entries from `first` on; those of x before it are zero.
  static void subtract_from(int first, double s, const double* x, double* y) {
    const Pair ss = {s, s};
    for (int i = first / 2; i < kRegisters; ++i)
      reinterpret_cast<Pair*>(y)[i] -= ss * reinterpret_cast<const Pair*>(x)[i];
  }
};

}  // namespace

const LuKernelTable& portable_lu_kernels() {
  static constexpr LuKernelTable kKernels = lu_kernel_table<ColumnOfPairs>();
  return kKernels;
}

const LuKernelTable& lu_kernels() {
  static const LuKernelTable& kKernels = avx2_lu_kernels() ? *avx2_lu_kernels() : portable_lu_kernels();
  return kKernels;
}

const BlockKernels& portable_block_kernels() {
  static constexpr BlockKernels kKernels = BlockLoops<LaneRow, SixInPairs>::kernels();
  return kKernels;
}

const BlockKernels& block_kernels() {
  static const BlockKernels& kKernels = avx2_block_kernels() ? *avx2_block_kernels() : portable_block_kernels();
  return kKernels;
}

}  // namespace mbsopt
