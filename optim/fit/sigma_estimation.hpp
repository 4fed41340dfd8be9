// Sigmas that a fit estimates from its own residuals, one per channel and experiment.
//
// With normal noise the likelihood is largest where, for every channel, sigma^2 is the mean square of its residuals r:
//   -log L = sum_c [ n_c log sigma_c + 1/2 sum_i (r_ci/sigma_c)^2 ]    =>    sigma_c^2 = sum_i r_ci^2/n_c
// The fit and the sigmas are found in turn, until no sigma changes any more: each turn lowers -log L. N/(N - P), the
// number of samples over that without the parameters, makes up for what the fit takes off the residuals. With a loss
// other than the square, which has outliers in mind, it is 1.4826 times the median of |r| (normal noise has that).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/fit/experiment_stack.hpp"

namespace mbsopt {

inline constexpr int kSigmaRounds = 40;
inline constexpr double kSigmaChange = 1e-6;  // relative

bool estimates_sigma(const IdentificationSpec& spec);  // in a fitted experiment

struct SigmaEstimates {
  struct One {
    std::size_t member, channel;  // of the stack, of its experiment
    double sigma;
  };
  std::vector<One> all;
  double change = 0;  // the largest, relative
};

// z: the residuals with the sigmas so far.
SigmaEstimates estimated_sigmas(ExperimentStack& stack, const IdentificationSpec& spec, const Eigen::VectorXd& z);
void use_sigmas(ExperimentStack& stack, const SigmaEstimates& sigmas);

}  // namespace mbsopt
