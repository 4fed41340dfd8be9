#include "core/linear/kernel_table.hpp"

#include "core/linear/block_loops.hpp"
#include "core/linear/columns.hpp"
#include "core/linear/lu_loops.hpp"
#include "core/linear/pairs.hpp"

namespace mbsopt {
namespace {

static_assert(kLanes == 4);  // as in block_kernels_avx2.cpp

template <int M>
using ColumnOfPairs = Column<Pairs, M>;

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
