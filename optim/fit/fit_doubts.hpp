// Doubts about a fit, in sentences. They judge the samples that the loss keeps, record by record: the windows of an
// experiment are one record.
//
//   for (std::string& words : doubts_of_fit(fit, stack, solution, unknowns)) ...
//   for (const AngleDoubt& doubt : angle_doubts(fit, stack, z_start)) ...   // to be tested by another fit
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_context.hpp"

namespace mbsopt {

// Names samples that a loss takes out, channels of which the fit explains nothing, records that disagree with the
// others, estimated sigmas far above the given ones, and channels that repeat another one.
std::vector<std::string> doubts_of_fit(const FitContext& fit, const ExperimentStack& stack,
                                       const LeastSquaresResult& solution,
                                       const std::vector<UnknownParameter>& unknowns);

// The column of a record that may be in degrees, since no unit is stated. It is likely if its measured values span
// about 180/pi times as much as the model at the start or at the end of the fit, angles more than half a turn, and if
// the fit does not explain it.
struct AngleDoubt {
  std::string record, column, path, unit, words;
  bool is_likely = false;
};

// None if none is likely. z_start: residuals by the sigmas of the stack.
std::vector<AngleDoubt> angle_doubts(const FitContext& fit, const ExperimentStack& stack,
                                     const Eigen::VectorXd& z_start);
// rms of the residuals of a record's column over that of the measured values about their mean.
double unexplained(const IdentificationResult& result, const std::string& record, const std::string& column);

}  // namespace mbsopt
