// The times at which functions of time in laws and costs, or their derivatives, jump. Steps can end there.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/expression/program.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

// Adds the times of a program whose first inputs are all parameters, and whose input `time` is t. The samples x_i of a
// curve of a t + b lie at (x_i - b)/a, where a and b depend on parameters. Curves of other arguments are left out.
void add_kinks_in_time(const Program& program, int time, const Eigen::VectorXd& rho, std::vector<KinkedSignal>& kinks);

}  // namespace mbsopt
