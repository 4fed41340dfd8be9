// Tests whether residuals are independent noise about zero, as the statistics of a fit assume.
//
//   r_k         = sum e_i e_{i+k} / sum e_i^2,  e_i = z_i - mean                  autocorrelation
//   Q           = n (n + 2) sum_{k=1..h} r_k^2/(n - k)  ~  chi^2(h)              Ljung and Box, Biometrika 65 (1978)
//   297 runs        of equal sign among n+ positive and n- negative residuals        Wald and Wolfowitz, Annals of
//               mean m = 2 n+ n-/(n+ + n-) + 1,                                  Mathematical Statistics 11 (1940) 147
//               variance (m - 1)(m - 2)/(n+ + n- - 1)
// A small p says that noise would hardly do that: the model misses something, and the standard errors are too small.
//
//   const ResidualAnalysis a = analyse_residuals(z);     // in the order of time
//   if (!a.white()) std::cout << a.in_words();
#pragma once

#include <Eigen/Core>
#include <string>

namespace mbsopt::inline optim {

struct ResidualAnalysis {
  std::size_t samples = 0;
  double mean = 0;
  double autocorrelation = 0;  // r_1
  int lags = 0;                // h = min(10, n/5)
  double ljung_box = 0, ljung_box_p = 1;
  std::size_t runs = 0;
  double runs_z = 0, runs_p = 1;  // how many standard deviations too many; two-sided

  static constexpr double kSignificant = 0.01;  // p below it
  bool white() const { return ljung_box_p >= kSignificant && runs_p >= kSignificant; }
  std::string in_words() const;  // "white", or what speaks against it
};

// Fewer than 10 residuals, or all of them equal, say nothing: p = 1.
ResidualAnalysis analyse_residuals(const Eigen::VectorXd& z);

}  // namespace mbsopt::inline optim
