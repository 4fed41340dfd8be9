// Doubts about gradients of runs, in sentences, as every command gives them. The derivatives of the steps need not be
// those of the motion: steps that cross a kink follow the branches of their stages and not its instant.
//
// Figures of the run itself ask for a test: kinks that it crossed (jump_watch.hpp), and may_be_unresolved(). Kinks ask
// for the slope along one direction d of all variables, by extrapolated differences of free runs with a tenth of the
// integration errors:
//
//   |psi_rho d - (psi(h) - psi(-h))/(2h)| <= a sum_k |psi_rho_k d_k|      a: four digits fewer than rtol, 1e-6 to 1e-4
//
// If these are too uncertain, and for the other figures, gradients with other tolerances decide
// (integration_error.hpp).
//
//   for (const std::string& doubt : gradient_doubts(evaluator, evaluator.gradients(rho))) run.warn(doubt);
#pragma once

#include <string>
#include <vector>

#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {

std::vector<std::string> gradient_doubts(const Evaluator& evaluator, const Evaluation& gradients);

}  // namespace mbsopt::inline optim
