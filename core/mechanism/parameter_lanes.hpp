// The active parameters as blocks of kLanes tangent directions: lane k of block c is the unit vector of active
// parameter kLanes c + k. `theta` holds the derivatives of each differentiated field in these directions.
#pragma once

#include <vector>

#include "core/linear/parameter_block.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

ParameterBlock block_without_parameters(const MechanismData& data);
std::vector<ParameterBlock> parameter_blocks(const MechanismData& data);

}  // namespace mbsopt
