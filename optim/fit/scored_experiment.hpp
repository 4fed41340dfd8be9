// The residuals of an experiment, and what they say channel by channel.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/fit/experiment.hpp"
#include "optim/fit/fit_result.hpp"

namespace mbsopt {

// Fills the fit of one experiment from its residuals z, and appends them to the rows of residuals.csv. estimated:
// whether the fit has estimated sigmas.
void score_experiment(const ExperimentSpec& spec, const Experiment& model, const Loss& loss, const Eigen::VectorXd& z,
                      bool estimated, std::size_t experiment, ExperimentFit& fit, std::vector<ResidualRow>& residuals);

}  // namespace mbsopt
