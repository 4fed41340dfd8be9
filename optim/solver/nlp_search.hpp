// The base of Ipopt's and NLopt's adapters: the points of a search, its solution among them, and the words of its end.
//
// A point that violates a constraint by its tolerance may have a lower objective, and noise moves the objective by its
// own size. So among the feasible points whose objective is the lowest one within the tolerances, the most stationary
// one is the solution (optimality.hpp).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <limits>
#include <string>

#include "optim/solver/evaluated_points.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

class NlpSearch {
 protected:
  static constexpr double kAcceptable = 100;  // times the tolerance: where noise hides the rest
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  // Options: IpoptOptions or NloptOptions, which outlive the search.
  template <class Options>
  NlpSearch(NonlinearProgram& problem, const Options& options, NlpResult& result)
      : problem_(problem),
        result_(result),
        tolerance_(options.tolerance),
        progress_(options.progress),
        points_(problem, result, options.constraint_tolerance, options.records),
        margin_(std::max(options.tolerance, 10 * options.constraint_tolerance)) {}

  // The point is the one of the last call of points_.at(), with derivatives. Returns its optimality if it may be the
  // solution, else infinity.
  double look(const NlpPoint& point);
  bool has_solution() const { return solution_x_.size() > 0 && as_good_as_best(solution_.f); }
  // Reports the last point of points_. Returns whether the search goes on.
  bool report(const NlpPoint& point, double distance) const;
  // The result becomes the solution. If there is none, it becomes the best point.
  void take_solution();
  bool best_is_feasible() const { return points_.feasible(points_.best()); }

  void end_refused();  // at the start
  void end_optimal();
  void end_start_optimal();
  void end_infeasible();
  // The search has settled at this distance. It converged if noise may hide the rest; NaN: it did not.
  void end_settled(double distance, const std::string& why);

  NonlinearProgram& problem_;
  NlpResult& result_;
  const double tolerance_;
  const std::function<bool(const NlpProgress&)>& progress_;
  EvaluatedPoints points_;

 private:
  bool as_good_as_best(double f) const { return (f - points_.best().f) * problem_.f_scale <= margin_; }

  const double margin_;  // of the scaled objective
  Eigen::VectorXd solution_x_;
  NlpPoint solution_;
  double distance_ = std::numeric_limits<double>::infinity();  // of the solution
};

}  // namespace mbsopt::inline optim
