// Describes a design in its result: the start, the solution with what limits cost, and verdicts on the solution.
#pragma once

#include "optim/design/design_program.hpp"
#include "optim/design/design_result.hpp"

namespace mbsopt::inline optim {

// Adds warnings of variables that move nothing, too.
void describe_start(const DesignProgram& program, const Evaluation& start, DesignResult& result);

// Values of the variables and constraints at the end of the search; result.rho is set already.
void describe_end(const DesignProgram& program, const NlpResult& solution, DesignResult& result);

// Evaluates the solution at x once more: true extremes, optimality, prices of limits, limits in conflict. A limit whose
// multiplier balances less of the gradient than the optimiser's tolerance does not bind.
void describe_solution(DesignProgram& program, const Eigen::VectorXd& x, DesignResult& result);

// Takes `converged` back if the optimality of a solved least-squares fit is not small, or true extremes break limits.
void judge_solution(const DesignProgram& program, DesignResult& result);

}  // namespace mbsopt::inline optim
