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
//   const Profile profile = profile_likelihood(problem, x_hat, options);
//   if (profile.lower) std::cout << *profile.lower;           // else the data do not bound it below
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt {

struct ProfilePoint {
  double x = 0;  // of the variable
  double cost = 0, tau = 0;
  Eigen::VectorXd variables;  // all, fitted
};

struct Profile {
  std::vector<ProfilePoint> points;    // by rising x; the estimate among them
  std::optional<double> lower, upper;  // of the 95 % interval, in x
  std::string below, above;            // why there is none
};

struct ProfileOptions {
  Eigen::Index variable = 0;
  double first_step = 0;        // about half a standard error, in x, > 0
  double likelihood_scale = 1;  // v > 0
  double quantile = 1.96;
  LeastSquaresOptions solver;
  std::function<bool(const ProfilePoint&)> progress;  // after every point; false stops
};

// x: the estimate. A point better than it (the fit was in a local minimum, or not at its end) is said so in below or
// above.
Profile profile_likelihood(LeastSquaresProblem& problem, const Eigen::VectorXd& x, const ProfileOptions& options);

}  // namespace mbsopt
