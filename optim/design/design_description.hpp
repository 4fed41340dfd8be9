// Describes a design in its result: the start, the solution with what limits cost, and verdicts on the solution.
#pragma once

#include "optim/design/design_program.hpp"
#include "optim/design/design_result.hpp"
#include "optim/design/limit_rounds.hpp"
#include "optim/objective/case_evaluator.hpp"
#include "optim/problem/problem.hpp"
#include "optim/problem/variable_scaling.hpp"

namespace mbsopt::inline optim {

// Adds warnings of variables that move nothing, too.
void describe_start(const Problem& problem, const CaseEvaluator& evaluator, const DesignProgram& program,
                    const CaseEvaluation& start, DesignResult& result);

// Values of the variables and constraints at the end of the search; result.rho is set already.
void describe_end(const CaseEvaluator& evaluator, const DesignProgram& program, const NlpResult& solution,
                  DesignResult& result);

// Evaluates the solution once more: true extremes, optimality, prices of limits, limits in conflict.
// tolerance: the optimiser's; a limit whose multiplier balances less of the gradient does not bind.
void describe_solution(DesignProgram& program, const VariableScaling& scaling, const LimitedSolution& rounds,
                       double tolerance, DesignResult& result);

// Takes `converged` back if the optimality of a solved least-squares fit is not small, or true extremes break limits.
void judge_solution(const DesignSpec& spec, const DesignProgram& program, const CaseEvaluator& evaluator,
                    DesignResult& result);

}  // namespace mbsopt::inline optim
