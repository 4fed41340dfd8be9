#include "core/dynamics/lane_kernels.hpp"

#include "core/dynamics/lane_loops.hpp"
#include "core/dynamics/pairs.hpp"

namespace mbsopt {

const LaneKernels& portable_lane_kernels() {
  static constexpr LaneKernels kKernels = LaneLoops<LaneRow>::kernels();
  return kKernels;
}

const LaneKernels& lane_kernels() {
  static const LaneKernels& kKernels = avx2_lane_kernels() ? *avx2_lane_kernels() : portable_lane_kernels();
  return kKernels;
}

}  // namespace mbsopt
