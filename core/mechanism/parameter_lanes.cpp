#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

std::vector<ParameterBlock> parameter_blocks(const MechanismData& data) {
  const int active = static_cast<int>(data.active.size());
  std::vector<ParameterBlock> blocks(static_cast<std::size_t>((active + kLanes - 1) / kLanes));
  for (int c = 0; c < static_cast<int>(blocks.size()); ++c) {
    ParameterBlock& block = blocks[static_cast<std::size_t>(c)];
    block.theta.setZero(data.slots(), kLanes);
    for (int k = 0; k < kLanes; ++k) {
      const int i = kLanes * c + k;
      block.parameter[k] = i < active ? data.active[static_cast<std::size_t>(i)] : -1;
      if (i < active) block.theta.col(k) = data.theta_rho.col(i);
    }
  }
  return blocks;
}

}  // namespace mbsopt
