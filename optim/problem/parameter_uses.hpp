// The fields of a problem that each parameter enters, directly or through definitions.
#pragma once

#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

struct ParameterUse {
  std::string parameter;
  std::vector<std::string> fields;  // paths in the file: "bodies[2].mass", "drives[0].law"
};

std::vector<ParameterUse> parameter_uses(const Problem& problem);

}  // namespace mbsopt::inline optim
