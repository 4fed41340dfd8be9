#include "optim/fit/distributions.hpp"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>

namespace mbsopt {

using boost::math::cdf;
using boost::math::complement;

double chi_squared_quantile(double degrees_of_freedom, double probability) {
  return quantile(boost::math::chi_squared(degrees_of_freedom), probability);
}

double chi_squared_tail(double degrees_of_freedom, double x) {
  return cdf(complement(boost::math::chi_squared(degrees_of_freedom), x));
}
double normal_tail(double x) { return cdf(complement(boost::math::normal(), x)); }
double f_tail(double degrees1, double degrees2, double x) {
  return cdf(complement(boost::math::fisher_f(degrees1, degrees2), x));
}

}  // namespace mbsopt
