// A limit on a mean of an expression that no objective of the file has:
//
//   "subject_to": [{"maximum_of": "F", "upper": 33}]
//
// The bound gets an objective of its own, "maximum_of F", so that all that is done with objectives is done with it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "optim/problem/problem.hpp"

namespace mbsopt {

// Which of kMeanKinds a bound gives in place of an objective; the first where it gives several.
std::optional<std::size_t> bounded_mean(const ObjectiveBound& bound);

std::string name_of_mean(std::size_t kind, const Expression& of);  // "maximum_of F"

// Adds the objectives, and makes the bounds refer to them. The sharpness of an extreme is by default
// ObjectiveBound::kSharpness/max(|lower|, |upper|), over 1 where that is 0: the expression has the size of its limit.
void name_bounded_means(Problem& problem);

}  // namespace mbsopt
