#include "core/mechanism/parameter_lanes.hpp"

#include <algorithm>

namespace mbsopt {

ParameterBlock block_without_parameters(const MechanismData& data) {
  ParameterBlock block;
  block.theta.setZero(data.slots(), kLanes);
  block.moved_before.assign(static_cast<std::size_t>(data.slots()) + 1, 0);
  std::fill(std::begin(block.parameter), std::end(block.parameter), -1);
  return block;
}

std::vector<ParameterBlock> parameter_blocks(const MechanismData& data) {
  const int active = static_cast<int>(data.active.size());
  std::vector<ParameterBlock> blocks(static_cast<std::size_t>((active + kLanes - 1) / kLanes),
                                     block_without_parameters(data));
  for (int c = 0; c < static_cast<int>(blocks.size()); ++c) {
    ParameterBlock& block = blocks[static_cast<std::size_t>(c)];
    for (int k = 0; k < kLanes; ++k) {
      const int i = kLanes * c + k;
      if (i >= active) break;
      block.parameter[k] = data.active[static_cast<std::size_t>(i)];
      block.theta.col(k) = data.theta_rho.col(i);
    }
    for (Eigen::Index row = 0; row < block.theta.rows(); ++row) {
      const std::size_t k = static_cast<std::size_t>(row);
      block.moved_before[k + 1] = block.moved_before[k] + ((block.theta.row(row).array() != 0).any() ? 1 : 0);
    }
  }
  return blocks;
}

}  // namespace mbsopt
