// How the design command minimises: one run, or the best of a multistart; journalled, and gone on with.
#pragma once

#include "app/long_run.hpp"
#include "optim/design.hpp"

namespace mbsopt {

struct DesignOutcome {
  DesignResult design;
  bool interrupted = false;  // before all starts had finished
};

// before: the objectives at the given values, in the problem's order.
DesignOutcome minimised(Run& run, const Eigen::VectorXd& before);

}  // namespace mbsopt
