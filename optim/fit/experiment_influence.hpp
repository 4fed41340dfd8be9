// How far the shared parameters would move without one of the experiments, to first order, by the linear model at the
// solution. Parameters that are free in one experiment leave by QR factors of its rows:
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

namespace mbsopt {

// Per member of the stack, for each variable x the change without it; 0 for those that are not shared. Infinite where
// the others and priors do not determine one. Stacks must have no equalities.
std::vector<Eigen::VectorXd> changes_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                             const std::vector<UnknownParameter>& unknowns);

// Weighted squares of the samples of all records but one: at the solution, and where they are least without that one,
// to first order and whatever the bounds.
struct OthersWithout {
  Eigen::Index samples = 0;
  double before = 0, after = 0;
};
// Per record; record_of_member: its number, from 0. Stacks must have no equalities, and shared variables.
std::vector<OthersWithout> others_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                          const std::vector<UnknownParameter>& unknowns,
                                          const std::vector<std::size_t>& record_of_member);

}  // namespace mbsopt
