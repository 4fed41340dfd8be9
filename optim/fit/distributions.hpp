// Quantiles and tails of distributions, from Boost, whose functions take seconds to compile.
#pragma once

namespace mbsopt::inline optim {

double normal_quantile(double probability);
double student_quantile(double degrees_of_freedom, double probability);

// The probability of a value above x.
double chi_squared_tail(double degrees_of_freedom, double x);
double normal_tail(double x);

}  // namespace mbsopt::inline optim
