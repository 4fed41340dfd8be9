// How far the shared parameters would move without one of the experiments, to first order, by the linear model at the
// solution. Parameters that are free in one experiment leave by QR factors of its rows:
//
//   [ J_own  J_shared | z ] = Q [ R S | q ]        S = sum_e T_e'T_e + J_prior'J_prior
//                               [ 0 T | p ]        d = (S - T_e'T_e)^-1 T_e'p_e
//
// Cook and Weisberg, "Residuals and Influence in Regression" (1982), section 3.4.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/fit/experiment_stack.hpp"

namespace mbsopt {

// Per member of the stack, for each variable x the change without it; 0 for those that are not shared. Infinite where
// the others do not determine the shared ones. Of stacks without equalities.
std::vector<Eigen::VectorXd> changes_without(const ExperimentStack& stack, const LeastSquaresPoint& solution,
                                             const std::vector<UnknownParameter>& unknowns);

}  // namespace mbsopt
