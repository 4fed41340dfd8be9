// Solves a design by its optimiser, in rounds. After each round the bounds of smooth extremes move (true_limits.hpp),
// until the true extremes keep their limits.
//
//   const LimitedSolution rounds = solve_in_rounds(program, hooks, result);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "optim/design/design_program.hpp"
#include "optim/solver/nlp_search.hpp"

namespace mbsopt::inline optim {

// The solution of the last round.
struct LimitedSolution {
  NlpResult solution;  // counts those of all rounds
  std::vector<std::optional<double>> true_values;
  Eigen::VectorXd slopes;  // of true values in smooth ones
};

struct SearchHooks {
  std::function<bool(const NlpProgress&)> progress;  // after every iteration; false stops
  std::function<bool()> abandoned;
};

// Adds the seed, the rounds and the simulations to the result.
LimitedSolution solve_in_rounds(DesignProgram& program, const SearchHooks& hooks, DesignResult& result);

}  // namespace mbsopt::inline optim
