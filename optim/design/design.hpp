// Optimal design: parameters within their bounds that minimise one objective, others held within bounds.
//
//   minimise psi_0(rho)   subject to   rho_lower <= rho <= rho_upper,   lower_i <= psi_i(rho) <= upper_i
//
// Limits on an extreme psi_i hold for its true value.
//
//   DesignOptions options;
//   options.progress = [](const DesignRow& row) { std::cerr << row.objective << '\n'; return true; };
//   const DesignResult result = run_design(problem, options);
//   if (result.ok()) std::cout << result.variables[0].name << " = " << result.variables[0].value;
#pragma once

#include <optional>

#include "optim/design/design_result.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// problem.design must be there. Throws std::invalid_argument where it makes no sense (unknown names, no bounds to
// hold).
DesignResult run_design(const Problem& problem, const DesignOptions& options = {});

// If the linkage does not close at its own values, returns the problem with values at which it does (closing.hpp), if
// there are some. run_design does the same.
std::optional<Problem> problem_that_closes(const Problem& problem, const DesignOptions& options = {});

// The sharpness of the maximum over load cases that a run from the problem's own values would take; none where it takes
// none. Runs from several starts share one.
std::optional<double> design_sharpness(const Problem& problem, const DesignOptions& options = {});

// Counts the assembly modes at the start, from the problem's own values. Returns 0 if something is free or nothing
// closes, and those found so far if it is abandoned.
int design_modes(const Problem& problem, const DesignOptions& options = {});

// The values of a problem before any search, in a result of a design.
DesignResult given_design(const Problem& problem);

// The scale that a run from the problem's own values would take.
NlpScale design_scale(const Problem& problem, const DesignOptions& options = {});

}  // namespace mbsopt::inline optim
