#include "optim/problem/parameter_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"

namespace mbsopt::inline optim {

Eigen::VectorXd parameter_values(const Scene& scene) {
  Eigen::VectorXd rho(static_cast<Eigen::Index>(scene.parameters.size()));
  for (Eigen::Index k = 0; k < rho.size(); ++k) rho(k) = scene.parameters[static_cast<std::size_t>(k)].value;
  return rho;
}

std::vector<int> parameter_indices(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const Parameter& p : scene.parameters) known.push_back(p.name);
  std::vector<int> indices;
  for (const std::string& name : names.empty() ? known : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end())
      throw std::invalid_argument(
          fmt::format("there is no parameter '{}'{}; known: {}", name, did_you_mean(name, known), joined(known)));
    const int index = static_cast<int>(found - known.begin());
    if (std::find(indices.begin(), indices.end(), index) != indices.end())
      throw std::invalid_argument(fmt::format("the parameter '{}' is listed twice", name));
    indices.push_back(index);
  }
  return indices;
}

double typical_size(const Parameter& parameter, double value) {
  if (value != 0) return std::abs(value);
  if (parameter.lower && parameter.upper && *parameter.upper > *parameter.lower)
    return *parameter.upper - *parameter.lower;
  return 1;
}

}  // namespace mbsopt::inline optim
