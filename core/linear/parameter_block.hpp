// Tangent directions of a block of parameters.
#pragma once

#include <vector>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

using LaneRows = Eigen::Matrix<double, Eigen::Dynamic, kLanes, Eigen::RowMajor>;

struct ParameterBlock {
  LaneRows theta;                 // slots x kLanes
  std::vector<int> moved_before;  // per row of theta, and after the last: how many rows before it are not zero
  int parameter[kLanes];          // index of each lane's parameter, -1: lane not used

  // Returns whether a field of `rows` rows changes in any of the lanes.
  bool moves(int slot, int rows) const {
    if (slot < 0) return false;
    const std::size_t first = static_cast<std::size_t>(slot);
    return moved_before[first] != moved_before[first + static_cast<std::size_t>(rows)];
  }
  template <int N>
  const Lanes<N>* field(int slot, Lanes<N>& storage) const {  // null where the field does not change
    if (!moves(slot, N)) return nullptr;
    storage = theta.middleRows<N>(slot);
    return &storage;
  }
  Lanes<1> direction(int index) const {  // of parameter `index` itself
    Lanes<1> d;
    for (int k = 0; k < kLanes; ++k) d(k) = parameter[k] == index ? 1.0 : 0.0;
    return d;
  }
};

}  // namespace mbsopt
