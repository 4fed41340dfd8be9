#include "core/dynamics/block_kernels.hpp"

#include "core/dynamics/block_loops.hpp"
#include "core/dynamics/pairs.hpp"

namespace mbsopt {
static_assert(kLanes == 4);  // as in block_kernels_avx2.cpp

const BlockKernels& portable_block_kernels() {
  static constexpr BlockKernels kKernels = BlockLoops<LaneRow>::kernels();
  return kKernels;
}

const BlockKernels& block_kernels() {
  static const BlockKernels& kKernels = avx2_block_kernels() ? *avx2_block_kernels() : portable_block_kernels();
  return kKernels;
}

}  // namespace mbsopt
