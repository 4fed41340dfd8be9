// What a least-squares fit says about its parameters.
//
//   residuals z(rho) in units of their sigma, Jacobian J = dz/drho, N rows, P columns, at the solution
//   s^2         = z'z / (N - P)                            residual variance; 1 where sigma is known
//   covariance  = s^2 (J'J)^-1
//   std_error_k = sqrt(covariance_kk)                      ci95 = rho_k -+ t(0.975, N - P) std_error_k
// Seber and Wild, "Nonlinear Regression" (1989), sections 2.1 and 5.1.
//
// Combinations that the data do not determine come from the singular values of J with columns scaled to unit length,
// whose ratio is the condition number (Belsley, Kuh and Welsch, "Regression Diagnostics" (1980), section 3.2).
//
//   const FitStatistics s = fit_statistics(J, z, rho, {"m1", "m2"});
//   s.std_error(0), s.ci95(0, 1), s.correlation(0, 1);
//   for (const std::string& words : s.unidentifiable) std::cout << words;   // "m1, m2: only m1 + m2 is determined"
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace mbsopt {

struct FitStatistics {
  Eigen::VectorXd std_error;                // infinite where the data do not determine the parameter
  Eigen::MatrixXd ci95;                     // P x 2
  Eigen::MatrixXd covariance;               // of the determined combinations
  Eigen::MatrixXd correlation;              // ones on the diagonal
  double residual_variance = 0;             // z'z / (N - P), also where sigma is known; NaN where N <= P
  long degrees_of_freedom = 0;              // N - P
  double condition_number = 0;              // infinite where a column of J is zero
  std::vector<std::string> unidentifiable;  // in words
};

// sigma_is_known: the covariance is not scaled by the residual variance, and quantiles are normal.
FitStatistics fit_statistics(const Eigen::MatrixXd& J, const Eigen::VectorXd& z, const Eigen::VectorXd& rho,
                             const std::vector<std::string>& names, bool sigma_is_known = false);

}  // namespace mbsopt
