// Channels of angles that look as if the record were in degrees.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/fit/experiment_stack.hpp"

namespace mbsopt {

// Returns a sentence, behind the path of the column, for each channel that seems to be in degrees. Its measured values
// span about 180/pi times as much as the model at the start or at the end of the fit, angles more than half a turn, and
// the fit does not explain them. A column with a stated unit is not doubted. `data` has a table per experiment, z the
// residuals of all samples by the sigmas of the stack.
std::vector<std::string> angle_doubts(const Scene& scene, const IdentificationSpec& spec,
                                      const std::vector<CsvTable>& data, const ExperimentStack& stack,
                                      const Eigen::VectorXd& z_start, const Eigen::VectorXd& z_end);

}  // namespace mbsopt
