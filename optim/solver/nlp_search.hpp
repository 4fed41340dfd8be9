// The base of Ipopt's and NLopt's adapters: the points of a search, its solution among them, and the verdict on it.
//
// Each point is computed once, and failures are separate from results: also what evaluate() throws, and what is not
// finite. The best point is kept for any outcome of the solver: feasible before infeasible, then the lower f.
//
// A point that violates a constraint by its tolerance may have a lower objective, and noise moves the objective by its
// own size. So among the feasible points whose objective is the lowest one within the tolerances, the most stationary
// one is the solution (optimality.hpp).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <deque>
#include <functional>
#include <limits>
#include <string>
#include <unordered_map>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

class NlpSearch {
 protected:
  static constexpr double kAcceptable = 100;  // times the tolerance: where noise hides the rest

  // Options: IpoptOptions or NloptOptions, which outlive the search. Evaluations are counted into the result.
  template <class Options>
  NlpSearch(NonlinearProgram& problem, const Options& options, NlpResult& result)
      : problem_(problem),
        result_(result),
        tolerance_(options.tolerance),
        constraint_tolerance_(options.constraint_tolerance),
        progress_(options.progress),
        margin_(std::max(options.tolerance, 10 * options.constraint_tolerance)) {}

  // From memory if x was asked for before. Moves x into the bounds first, because methods may leave them by a rounding
  // error. The reference is valid until the next call.
  const NlpPoint& at(const Eigen::VectorXd& x, Wanted wanted);
  const Eigen::VectorXd& x() const { return x_; }  // of the last call, within the bounds
  bool is_new() const { return is_new_; }          // whether the last call computed a point not in memory
  bool is_best() const { return is_best_; }        // whether that point became the best
  bool feasible(const NlpPoint& point) const { return problem_.violation(point.c) <= constraint_tolerance_; }
  const Eigen::VectorXd& best_x() const { return best_x_; }
  const NlpPoint& best() const { return best_; }
  bool best_is_feasible() const { return feasible(best_); }

  // The point is the one of the last call of at(), with derivatives. Returns its optimality if it may be the solution,
  // else infinity.
  double look(const NlpPoint& point);
  bool has_solution() const { return solution_x_.size() > 0 && as_good_as_best(solution_.f); }
  // Reports the last point. Returns whether the search goes on.
  bool report(const NlpPoint& point, double distance) const;
  // The result becomes the solution. If there is none, it becomes the best point.
  void take_solution();

  // Whether the problem is told of each best point: what the search tries next is near it.
  bool moves_to_best_ = true;

  void end_refused();  // at the start
  // Takes the solution and judges it by feasibility and optimality alone, whichever method found it and however that
  // ended. why: the reason in words if it is not optimal.
  void conclude(const std::string& why);

  NonlinearProgram& problem_;
  NlpResult& result_;
  const double tolerance_;
  int failed_in_a_row_ = 0;
  std::string last_error_;

 private:
  struct Kept {
    NlpPoint point;
    Wanted wanted = Wanted::values;
  };
  NlpPoint computed(Wanted wanted);
  void keep_best(const NlpPoint& point);
  bool as_good_as_best(double f) const { return (f - best_.f) * problem_.f_scale <= margin_; }

  const double constraint_tolerance_;
  const std::function<bool(const NlpProgress&)>& progress_;
  const double margin_;                         // of the scaled objective
  std::unordered_map<std::string, Kept> kept_;  // by the bytes of x
  std::deque<std::string> order_;               // oldest first
  Eigen::VectorXd x_, best_x_, solution_x_;
  NlpPoint best_, solution_, abandoned_;
  bool is_new_ = false, is_best_ = false;
  double distance_ = std::numeric_limits<double>::infinity();  // of the solution
};

// The bounds for a local search from x. Methods derive their first steps from bounds: asymptotes of mma, multipliers of
// ipopt. Bounds that are far from variables of size 1 are infinite here; NlpSearch keeps them.
Eigen::VectorXd near_bounds(const Eigen::VectorXd& bounds, const Eigen::VectorXd& x);

// Feasible before infeasible, less infeasible before more, then the lower objective. The violations are sums, 0 where
// feasible.
bool is_better(double f, double violations, double than_f, double than_violations);

}  // namespace mbsopt::inline optim
