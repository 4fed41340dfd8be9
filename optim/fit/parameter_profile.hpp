// Profile likelihoods of the fitted parameters that the options name (profile_likelihood.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_context.hpp"

namespace mbsopt {

// Indices of the profiled parameters among all fitted names. Throws std::invalid_argument for one that is not fitted.
std::vector<Eigen::Index> profiled_unknowns(const std::vector<std::string>& profiles,
                                            const std::vector<std::string>& names);

// The profile of unknown k at the solution x.
ParameterProfile profile_of(FitContext& fit, ExperimentStack& stack, Eigen::Index k, const Eigen::VectorXd& x);

}  // namespace mbsopt
