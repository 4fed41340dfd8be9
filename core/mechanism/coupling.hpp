// The bodies whose coordinates occur in each body's equations of motion: the pattern of their derivatives.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

struct Coupling {
  // [i - 1]: the moving bodies (1-based, ascending) whose q and v occur in the six equations of body i, itself
  // included.
  std::vector<std::vector<int>> bodies;
  // Per row of Phi: the moving bodies that it ties.
  std::vector<std::vector<int>> rows;
};

Coupling coupling(const MechanismData& data);

}  // namespace mbsopt
