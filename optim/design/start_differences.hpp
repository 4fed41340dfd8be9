// Compares the gradients at the start of a design with differences, in each load case.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "optim/objective/case_evaluator.hpp"

namespace mbsopt::inline optim {

// Warnings of derivatives that disagree. go_on: asked before every difference, in any thread.
std::vector<std::string> difference_warnings(const CaseEvaluation& start, CaseEvaluator& evaluator,
                                             const std::function<bool()>& go_on);

}  // namespace mbsopt::inline optim
