// The bodies whose coordinates occur in each body's equations of motion: the pattern of their derivatives.
#pragma once

#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

struct Coupling {
  // bodies[i - 1] lists the moving bodies (1-based, ascending) whose q and v occur in the six equations of body i, with
  // i itself.
  std::vector<std::vector<int>> bodies;
  // The moving bodies that each row of Phi ties.
  std::vector<std::vector<int>> rows;
};

Coupling coupling(const MechanismData& data);

}  // namespace mbsopt
