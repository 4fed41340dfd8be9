// The parameters of a scene as a vector rho, in the scene's order.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt::inline optim {

Eigen::VectorXd parameter_values(const Scene& scene);  // the scene's values

// Indices by name, or all if names is empty. Throws std::invalid_argument with the unknown name and the existing ones.
std::vector<int> parameter_indices(const Scene& scene, const std::vector<std::string>& names);

// The size of a parameter for differences and Taylor steps: |value|, or the range of its bounds, or 1.
double typical_size(const Parameter& parameter, double value);

}  // namespace mbsopt::inline optim
