// Profile likelihoods of the fitted parameters that the options name (profile_likelihood.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_context.hpp"

namespace mbsopt {

// Indices among the unknowns. Throws std::invalid_argument for a name that is not fitted.
std::vector<Eigen::Index> profiled_unknowns(const FitContext& fit, const std::vector<UnknownParameter>& unknowns);

// The profile of unknown k at the solution x.
ParameterProfile profile_of(FitContext& fit, ExperimentStack& stack, Eigen::Index k, const Eigen::VectorXd& x);

}  // namespace mbsopt
