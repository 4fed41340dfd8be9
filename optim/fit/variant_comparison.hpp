// Compares two models fitted to the same data; the smaller one is the larger one with some parameters held. This is the
// F-test of the extra sum of squares (Seber and Wild, "Nonlinear Regression" (1989), section 5.3).
//
//   F = [(S_1 - S_2)/(n_1 - n_2)] / (S_2/n_2)         S: sums of (measured - model)^2/sigma^2, with the sigmas of the
//                                                     larger model 2;  n: degrees of freedom
//
// F has the distribution F(n_1 - n_2, n_2) if the smaller model 1 is true and residuals are independent.
//
//   const VariantComparison test = compare_variants(fit_1, fit_2);
//   std::cout << test.F << ' ' << test.p;
#pragma once

#include <string>

#include "optim/fit/fit_result.hpp"

namespace mbsopt::inline optim {

struct VariantComparison {
  std::string none;            // why there is no test, in words
  bool second = false;         // is the larger one
  long more = 0, freedom = 0;  // n_1 - n_2, n_2
  double F = FitStatistics::kUnknown, p = FitStatistics::kUnknown;
  bool white = true;  // residuals of the larger model
  // Root mean squares of (measured - model)/sigma of the first and of the second model. Both take the sigmas of the
  // larger model, or each its own if the fits are of different samples.
  double rms_scaled[2] = {FitStatistics::kUnknown, FitStatistics::kUnknown};
};

VariantComparison compare_variants(const IdentificationResult& first, const IdentificationResult& second);

}  // namespace mbsopt::inline optim
