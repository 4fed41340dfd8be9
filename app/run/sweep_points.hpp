// The parameter values that `sweep` computes: a grid, a Latin hypercube, or the rows of a CSV file.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt::inline app {

struct SweepOptions {
  std::vector<std::string> vary;    // "k1=10:20:5" of a grid, "k1=10:20" of samples
  std::optional<int> samples = {};  // of a Latin hypercube within these ranges
  std::optional<long> seed = {};    // of the samples
  std::string points = {};          // or a CSV file with a column per parameter
  bool gradients = false;
};

struct SweepPoints {
  std::vector<int> parameters;          // indices of the varied ones
  std::vector<Eigen::VectorXd> values;  // one vector of those per point
};

// Grids and samples of a parameter with a logarithmic scale are even in its logarithm. seed is that of the samples.
// Throws std::invalid_argument or CsvError in words.
SweepPoints sweep_points(const Scene& scene, const SweepOptions& options, long seed);

}  // namespace mbsopt::inline app
