// Limits on a mean of an expression, or on its values at instants, and parts of a sum that is minimised, without an
// objective in the file:
//
//   "subject_to": [{"maximum_of": "F", "upper": 33}, {"sampled": "sin(mu)", "every": 0.5, "lower": 0.1}]
//
// A mean gets an objective of its own, "maximum_of F". Each instant gets a limit and an objective, "sin(mu) at 0.5 s".
// So all functions for objectives serve them, too.
#pragma once

#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// Instants of a sampled limit: start_time + k every, up to end_time.
std::vector<double> instants(const ObjectiveBound& bound, const SimulationSettings& simulation);

// "maximum_of F", the objective of a mean that a bound gives.
std::string name_of_mean(const Means& means);

// Adds the objectives, and makes the bounds refer to them. The default sharpness of an extreme is
// ObjectiveBound::kSharpness/max(|lower|, |upper|), over 1 if that is 0: the expression has the size of its limit.
void name_bounded_means(Problem& problem);

}  // namespace mbsopt::inline optim
