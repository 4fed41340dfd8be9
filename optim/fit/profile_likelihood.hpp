// Profile likelihood of one variable: it is held at a value, all others are fitted again, and the least cost C(x) is
// noted. Unlike the linear intervals it follows the curvature of the model, and shows where data bound a parameter on
// one side only.
//
//   tau(x) = sign(x - x^) sqrt(2 (C(x) - C(x^))/v)         95 % interval: |tau| <= quantile
// Bates and Watts, "Nonlinear Regression Analysis and Its Applications" (1988), section 6.1. For a linear model tau is
// (x - x^)/std_error. Steps go outward from the estimate. Each starts from the fit of the one before, and tau so far
// gives the next x. Secants find the ends of the interval to 1e-3 of the quantile.
//
//   ProfileOptions options{.variable = 0, .first_step = std_error, .likelihood_scale = s2, .quantile = 1.96};
//   const ParameterProfile profile = profile_likelihood(problem, x_hat, options);
//   if (profile.lower) std::cout << *profile.lower;           // else the data do not bound it below
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_context.hpp"

namespace mbsopt::inline optim {

struct ProfileOptions {
  Eigen::Index variable = 0;
  double first_step = 0;        // about half a standard error, in x, > 0
  double likelihood_scale = 1;  // v > 0
  double quantile = 1.96;
  LeastSquaresOptions solver;
  std::function<bool(const ParameterProfile::Point&)> progress;  // after every point; false stops
};

// x: the estimate; values and ends of the profile are those of the variable. A point better than the estimate (the fit
// was in a local minimum, or not at its end) is said so in below or above.
ParameterProfile profile_likelihood(LeastSquaresProblem& problem, const Eigen::VectorXd& x,
                                    const ProfileOptions& options);

// Indices of the profiled parameters among all fitted names. Throws std::invalid_argument for one that is not fitted.
std::vector<Eigen::Index> profiled_unknowns(const std::vector<std::string>& profiles,
                                            const std::vector<std::string>& names);

// The profile of fitted parameter k at the solution x.
ParameterProfile profile_of(FitContext& fit, ExperimentStack& stack, Eigen::Index k, const Eigen::VectorXd& x);

}  // namespace mbsopt::inline optim
