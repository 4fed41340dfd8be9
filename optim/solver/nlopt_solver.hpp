// NLopt: a dozen local and global methods behind one call. S. G. Johnson, "The NLopt nonlinear-optimization package".
//
// nlopt_methods.hpp lists them and their abilities.
//
//   NloptOptions options;
//   options.method = "slsqp";
//   NlpResult result = solve_with_nlopt(problem, x_start, options);
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "optim/solver/nlopt_methods.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

struct NloptOptions {
  std::string method = "slsqp";
  // With gradients, this is for the scaled optimality conditions. Without, it is for the last steps, relative to |x| if
  // above 1.
  double tolerance = 1e-6;
  double constraint_tolerance = 1e-8;  // largest violation of a constraint that counts as feasible, unscaled
  std::optional<long> max_evaluations;
  std::optional<long> max_iterations;                // points that were better than all before
  unsigned history = 0;                              // pairs of lbfgs and mlsl; 0: NLopt chooses
  std::uint32_t seed = 0;                            // of methods that are random
  std::function<bool(const NlpProgress&)> progress;  // after every iteration; false stops
};

// Throws std::invalid_argument with nlopt_refusal(), or if a global method lacks bounds. Never throws because of an
// evaluation.
NlpResult solve_with_nlopt(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const NloptOptions& options = {});

}  // namespace mbsopt::inline optim
