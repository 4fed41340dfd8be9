#include "core/linear/block_kernels.hpp"

#include "core/linear/block_loops.hpp"
#include "core/linear/lu_loops.hpp"
#include "core/linear/pairs.hpp"

namespace mbsopt {
namespace {

static_assert(kLanes == 4);  // as in block_kernels_avx2.cpp

template <int M>
struct ColumnOfPairs : Column<M / 2> {
  static constexpr int kRegisters = M / 2;
  using Column<M / 2>::Column;
  static ColumnOfPairs zero() {
    static constexpr double kZeros[M] = {};
    return ColumnOfPairs(kZeros);
  }
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
  static constexpr BlockKernels kKernels = BlockLoops<LaneRow, ColumnOfPairs>::kernels();
  return kKernels;
}

const BlockKernels& block_kernels() {
  static const BlockKernels& kKernels = avx2_block_kernels() ? *avx2_block_kernels() : portable_block_kernels();
  return kKernels;
}

}  // namespace mbsopt
