// How far the shared parameters would move without one group of experiments, and how well they would then explain the
// others, to first order, by the linear model at the solution. Parameters that are free in one experiment leave by QR
// factors of its rows:
//
//   [ J_own  J_shared | z ] = Q [ R S | q ]
//                               [ 0 T | p ]        d = argmin sum_{i != e} |T_i d + p_i|^2 + |J_prior d + z_prior|^2
//
// within the bounds of the shared parameters. Own parameters at a bound stay there.
// Cook and Weisberg, "Residuals and Influence in Regression" (1982), section 3.4.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {

// The others, without one group.
struct OthersWithout {
  // One per variable x: it is 0 for those that are not shared, and infinite if the others and priors do not determine
  // it.
  Eigen::VectorXd change;
  // Weighted squares of their samples: at the solution, and least ones, to first order and whatever the bounds.
  Eigen::Index samples = 0;
  double before = 0, after = 0;
};

// Per group of members; the groups are 0, 1, ... Stacks must have no equalities, and shared variables.
std::vector<OthersWithout> others_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                          const std::vector<std::size_t>& group_of_member);

}  // namespace mbsopt::inline optim
