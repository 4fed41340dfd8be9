// The active parameters as blocks of kLanes tangent directions: lane k of block c is the unit vector of active
// parameter kLanes c + k; theta holds what each differentiated field does in these directions.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

using LaneRows = Eigen::Matrix<double, Eigen::Dynamic, kLanes, Eigen::RowMajor>;

struct ParameterBlock {
  LaneRows theta;         // slots x kLanes
  int parameter[kLanes];  // index of each lane's parameter, -1: lane not used

  template <int N>
  const Lanes<N>* field(int slot, Lanes<N>& storage) const {  // null where the field is constant
    if (slot < 0) return nullptr;
    storage = theta.middleRows<N>(slot);
    return &storage;
  }
  Lanes<1> direction(int index) const {  // of parameter `index` itself
    Lanes<1> d;
    for (int k = 0; k < kLanes; ++k) d(k) = parameter[k] == index ? 1.0 : 0.0;
    return d;
  }
};

inline std::vector<ParameterBlock> parameter_blocks(const MechanismData& data) {
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
