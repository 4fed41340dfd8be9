// The statistics of a least-squares fit.
//
//   residuals z(rho) in units of their sigma, Jacobian J = dz/drho, N rows, P columns, at the solution
//   s^2         = z'z / (N + R - P)                        residual variance, R: number of priors
//   covariance  = (J'J/v + J_prior'J_prior)^-1             v = s^2; 1 where sigma is known
//   std_error_k = sqrt(covariance_kk)                      95 % interval: rho_k -+ quantile std_error_k
//   quantile    = t(0.975, N + R - P)                      that of the normal distribution where sigma is known
// Seber and Wild, "Nonlinear Regression" (1989), sections 2.1 and 5.1. Priors are taken at their word.
//
// With a loss other than the square the estimate is Huber's M-estimate, and with psi(z) = rho'(z^2) z
//   v = K^2 [sum psi^2/(N + R - P)] / mean(psi_z)^2,   K = 1 + (P/N) var(psi_z)/mean(psi_z)^2
// Huber, "Robust Statistics" (1981), section 7.6, equation 6.5: errors independent, of one symmetric distribution.
//
// If the residuals are not white, the covariance is the sandwich
//   covariance  = G^-1 (B/v^2 + J_prior'J_prior) G^-1,   G = J'J/v + J_prior'J_prior,   B = variance of J'z
// with B from the residuals themselves (score_variance.hpp). With another loss z is psi/mean(psi_z) in B.
//
// A column of J counts as zero if a change of the parameter by its own size moves the record by less than 1e-10 of its
// norm. With equations C between the parameters, such a column stays if C has one: data on other parameters may
// determine it. Combinations that the data do not determine come from the singular values of J with columns scaled to
// unit length, whose ratio is the condition number (Belsley, Kuh and Welsch, "Regression Diagnostics" (1980), section
// 3.2).
//
//   FitData data;
//   data.J = J, data.z = z, data.rho = rho, data.names = {"m1", "m2"};
//   const FitStatistics s = fit_statistics(data);
//   s.std_error(0), s.quantile, s.correlation(0, 1);
//   for (const std::string& words : s.unidentifiable) std::cout << words;   // "m1, m2: only m1 + m2 is determined"
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "optim/fit/score_variance.hpp"
#include "optim/problem/problem.hpp"
#include "optim/solver/robust_loss.hpp"

namespace mbsopt::inline optim {

struct FitData {
  Eigen::MatrixXd J;        // N x P
  Eigen::VectorXd z;        // N
  Eigen::MatrixXd J_prior;  // R x P, or empty
  Eigen::MatrixXd C;        // M x P, or empty: C d rho = 0 by equations between the parameters, which are independent
  Eigen::VectorXd rho;      // P
  std::vector<std::string> names;
  std::vector<std::string> units;  // "" where not known; or none at all
  Loss loss;
  bool sigma_is_known = false;  // v = 1, and quantiles are normal; not with a loss other than the square
  double accuracy = 0;          // of J, relative: what differs by less is the same
  Eigen::VectorXd change;       // of each parameter, about its size; empty: |rho|, or 1 where that is 0
  double record = 0;            // norm of what was measured, in sigma; 0: not known
  CovarianceType covariance = CovarianceType::white;  // any but automatic
  std::vector<SampledRecord> records;                 // the rows of J, where it is not white
  std::vector<SampledRecord> motions;                 // the same in longer parts that are one in time, or empty
  std::vector<bool> of_one_record;                    // parameters that act in one record only
  std::vector<bool> at_bound;                         // parameters that a bound holds; empty: none
};

struct FitStatistics {
  std::string none;                     // why there are no standard errors, in words; they are NaN then
  Eigen::VectorXd std_error;            // infinite where the data do not determine the parameter
  Eigen::MatrixXd covariance;           // of the determined combinations
  Eigen::MatrixXd correlation;          // ones on the diagonal
  double residual_variance = kUnknown;  // s^2, also where it is not used; NaN without degrees of freedom
  double variance = kUnknown;           // v
  Eigen::VectorXd inflation;            // variance of each parameter over that for white residuals
  CovarianceType covariance_type = CovarianceType::white;
  double quantile = kUnknown;               // of the intervals
  long degrees_of_freedom = 0;              // N + R - P
  double condition_number = kUnknown;       // infinite where a column of J is zero
  std::vector<std::string> unidentifiable;  // in words

  std::string covariance_in_words() const;  // what the standard errors take the residuals for

  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
};

FitStatistics fit_statistics(const FitData& data);
// Takes away what holds at a minimum only: standard errors and correlations.
void withhold_errors(FitStatistics& statistics, std::string why);

}  // namespace mbsopt::inline optim
