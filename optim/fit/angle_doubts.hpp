// Channels of angles that look as if the record were in degrees.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/fit/experiment_stack.hpp"

namespace mbsopt {

// Sentences with the path of the column before them: channels whose measured values span about 180/pi times as much as
// the model at the start or at the end of the fit, angles more than half a turn, and are not explained by it. Columns
// whose unit is stated are not doubted. data: of each experiment; z: residuals per sample, by the sigmas of the stack.
std::vector<std::string> angle_doubts(const Scene& scene, const IdentificationSpec& spec,
                                      const std::vector<CsvTable>& data, const ExperimentStack& stack,
                                      const Eigen::VectorXd& z_start, const Eigen::VectorXd& z_end);

}  // namespace mbsopt
