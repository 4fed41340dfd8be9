#include "optim/fit/distributions.hpp"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace mbsopt::inline optim {

using boost::math::cdf;
using boost::math::complement;
using boost::math::quantile;

namespace {

// In double precision throughout: long double takes half of the compile time and adds nothing here.
using Double = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
using ChiSquared = boost::math::chi_squared_distribution<double, Double>;
using Normal = boost::math::normal_distribution<double, Double>;
using StudentsT = boost::math::students_t_distribution<double, Double>;

}  // namespace

double normal_quantile(double probability) { return quantile(Normal(), probability); }
double student_quantile(double degrees_of_freedom, double probability) {
  return quantile(StudentsT(degrees_of_freedom), probability);
}

double chi_squared_tail(double degrees_of_freedom, double x) {
  return cdf(complement(ChiSquared(degrees_of_freedom), x));
}
double normal_tail(double x) { return cdf(complement(Normal(), x)); }

}  // namespace mbsopt::inline optim
