// The options of a design, and its result: variables, limits and load cases at the solution, and the history.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "optim/objective/evaluator.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

struct DesignVariable {
  std::string name, unit;
  double initial = 0, value = 0;
  std::optional<double> lower, upper;
  bool at_lower = false, at_upper = false;  // the solution touches this bound
};

struct DesignConstraint {
  std::string objective;
  std::optional<double> lower, upper;
  double initial = 0, value = 0;
  std::optional<double> true_value = {};    // at the solution, where the objective is a smooth extreme
  double violation = 0;                     // amount by which the nearer bound is missed, 0 where it holds
  double true_violation = 0;                // the same of true_value
  bool at_lower = false, at_upper = false;  // the solution touches this bound
  // By how much the minimised objective falls per unit by which the bound is eased, >= 0. For an equality, the fall per
  // unit by which its value is raised, of any sign.
  double price = 0;
  std::string load_case = {};    // in which the limit holds; empty where the problem has no cases
  std::string in_words() const;  // "peak", "peak (cold)"
};

// The objective in one load case, or a term of what is minimised, at both ends of the search.
struct DesignCase {
  std::string name;
  double weight = 1, initial = 0, value = 0;
  std::optional<double> true_value = {};  // where the objective is a smooth extreme
};

// If no point satisfies the limits: one of those that exclude each other.
struct DesignConflict {
  std::string limit;  // "maximum_of F <= 33", "k1 >= 1"
  double missed = 0;  // 0: it holds, but keeps others from doing so
  double price = 0;   // fall of the sum of relative violations per unit by which it is eased
};

// In which assembly mode a mechanism is designed (core/start/assembly_modes.hpp).
struct DesignMode {
  int mode = 0, of = 1;        // 0: that of the scene's poses at the start; and how many there are, 0: not counted
  std::vector<Body> bodies{};  // of the scene, their poses those of the mode; empty: the scene's own
};

// One iteration of the optimiser.
struct DesignRow {
  int iteration = 0;
  double objective = 0;
  double violation = 0;        // largest of the constraints, each relative to its bounds
  double optimality = 0;       // largest entry of the scaled Lagrangian gradient; 0 at the optimum; NaN: not known
  Eigen::VectorXd parameters;  // the variables, SI
  long simulations = 0;        // so far; those of least_squares are counted at its end
};

// x: the scaled variables at the solution.
struct DesignResult : SolverOutcome {
  std::string objective;
  bool maximises = false;
  double objective_initial = 0, objective_final = 0;
  std::optional<double> objective_true;  // at the solution, where it is a smooth extreme, or a smooth maximum of cases
  std::vector<DesignVariable> variables;
  std::vector<DesignConstraint> constraints;  // of all load cases
  std::vector<DesignCase> cases;              // where the problem has some
  std::vector<DesignCase> terms;              // of a sum or a largest one, where it has none
  std::vector<DesignConflict> conflicts;      // where the limits cannot all hold
  std::vector<DesignRow> history;
  Eigen::VectorXd rho;          // all parameters at the solution, or at the best point where there is none
  Evaluation final_evaluation;  // there, unless stopped: per case what is minimised, then what is bounded
  std::string optimizer;        // as in the problem: "ipopt"
  std::string algorithm;        // in the words of its library
  double optimality = std::numeric_limits<double>::quiet_NaN();  // at the solution, by the yardstick of all:
                                                                 // optimality.hpp; NaN where stopped
  double violation = 0;         // at the solution: largest of the constraints, each relative to its bounds
  double true_violation = 0;    // the same with true extremes in place of smooth ones
  std::optional<long> seed;     // where the method is random
  NlpScale scale;               // by which convergence was judged
  std::string gradient_choice;  // method and why
  long simulations = 0;         // also those of second derivatives
  double wall_seconds = 0;
  std::vector<std::string> warnings;   // sentences
  std::vector<std::string> decisions;  // sentences: which searches were made and why, how each ended
  std::optional<DesignMode> mode;      // where one was asked for, or the poses of the scene do not lead to the end's
  int closing_steps = 0;               // that led a start which does not close to one that does (closing.hpp)
  // The objective and the violation of limits that count: those with true extremes where there are some.
  // The less, the better.
  double reached() const { return (maximises ? -1 : 1) * objective_true.value_or(objective_final); }
  double missed() const { return final_evaluation.ok ? true_violation : violation; }
  void add_counts(const DesignResult& of);
  // Adds the work of an earlier search, and starts where that one did.
  void follow(DesignResult earlier);
  bool is_at_boundary() const;  // a bound of a variable, or a limit, holds the solution back or just holds
  bool ok() const {
    return status == SolverStatus::converged || status == SolverStatus::converged_beyond_limit ||
           status == SolverStatus::searched;
  }
};

// These options are not in the problem.
struct DesignOptions {
  GradientMethod method = GradientMethod::automatic;
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  int threads = 1;                                    // that compute load cases
  std::function<bool(const DesignRow&)> progress;     // after every iteration; false stops, the best so far is kept
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons it
  bool evaluate_stopped = true;                       // the end point of an abandoned search: a last evaluation
  bool compare_differences = true;                    // at the start, difference_comparison.hpp; in the warnings
  // The scale that judges convergence; if absent, about 1 over the objective and its gradient at the start. Runs from
  // several starts share one, so that "converged" means the same of all.
  std::optional<NlpScale> scale = {};
  std::optional<int> mode = {};  // assembly mode at the start (DesignMode); none: that of the scene's poses
};

}  // namespace mbsopt::inline optim
