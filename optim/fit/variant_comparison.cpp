#include "optim/fit/variant_comparison.hpp"

#include <cmath>

#include "optim/fit/distributions.hpp"

namespace mbsopt::inline optim {
namespace {

// The squares of the residuals of fitted samples over the sigmas of `scale`.
double sum_of_squares(const IdentificationResult& fit, const IdentificationResult& scale) {
  double sum = 0;
  for (const ResidualRow& row : fit.residuals)
    if (!fit.experiments[row.experiment].validate)
      sum += std::pow((row.measured - row.model) / scale.experiments[row.experiment].channels[row.channel].sigma, 2);
  return sum;
}

bool of_the_same_samples(const IdentificationResult& a, const IdentificationResult& b) {
  if (a.residuals.size() != b.residuals.size() || a.samples != b.samples) return false;
  for (std::size_t i = 0; i < a.residuals.size(); ++i) {
    const ResidualRow &x = a.residuals[i], &y = b.residuals[i];
    if (x.experiment != y.experiment || x.channel != y.channel || x.t != y.t || x.measured != y.measured) return false;
  }
  return true;
}

}  // namespace

VariantComparison compare_variants(const IdentificationResult& first, const IdentificationResult& second) {
  VariantComparison test;
  const long n_first = first.statistics.degrees_of_freedom, n_second = second.statistics.degrees_of_freedom;
  test.second = n_second < n_first;
  const IdentificationResult &large = test.second ? second : first, &small = test.second ? first : second;
  test.more = small.statistics.degrees_of_freedom - large.statistics.degrees_of_freedom;
  test.freedom = large.statistics.degrees_of_freedom;
  const bool same = of_the_same_samples(first, second);
  for (const IdentificationResult* fit : {&first, &second})
    test.rms_scaled[fit == &second] =
        std::sqrt(sum_of_squares(*fit, same ? large : *fit) / static_cast<double>(fit->samples));
  for (const ExperimentFit& e : large.experiments)
    for (const ChannelFit& channel : e.channels) test.white = test.white && (e.validate || channel.analysis.white());
  if (!first.ok() || !second.ok())
    test.none = "a fit did not converge";
  else if (!std::isfinite(first.aic) || !std::isfinite(second.aic))
    test.none = "it is for the squared loss, and for residuals that are not zero";
  else if (!same)
    test.none = "the fits are of different samples";
  else if (test.more == 0)
    test.none = "both have as many parameters";
  else if (test.freedom < 1)
    test.none = "no degree of freedom is left";
  if (!test.none.empty()) return test;
  const double S_1 = sum_of_squares(small, large), S_2 = sum_of_squares(large, large);
  const double more = static_cast<double>(test.more), freedom = static_cast<double>(test.freedom);
  test.F = (S_1 - S_2) / more / (S_2 / freedom);
  if (!(test.F >= 0) || !std::isfinite(test.F)) {
    test.none =
        "the variant with more parameters explains the data worse: it does not contain the other one, or its "
        "fit ended in another minimum";
    return test;
  }
  test.p = f_tail(more, freedom, test.F);
  return test;
}

}  // namespace mbsopt::inline optim
