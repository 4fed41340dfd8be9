// One search of a design, from the problem's own values and poses.
#pragma once

#include "optim/design/design_options.hpp"
#include "optim/design/design_result.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

DesignResult single_design(const Problem& problem, const DesignOptions& options);

}  // namespace mbsopt::inline optim
