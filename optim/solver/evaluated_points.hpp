// The points of a nonlinear program that a solver evaluates. Each is computed once, and failures are separate from
// results. It keeps the best point for any outcome of the solver.
//
//   EvaluatedPoints points(problem, result, 1e-8);
//   const NlpPoint& p = points.at(x, Wanted::derivatives);   // from memory when x was asked for before
//   if (!p.ok) ...                                           // also what evaluate() throws, and what is not finite
//   points.best().f                                          // feasible before infeasible, then the lower f
#pragma once

#include <Eigen/Core>
#include <deque>
#include <string>
#include <unordered_map>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

class EvaluatedPoints {
 public:
  // Counts evaluations into `outcome`, with the first error. records may be null.
  EvaluatedPoints(NonlinearProgram& problem, SolverOutcome& outcome, double constraint_tolerance,
                  PointRecords* records = nullptr);

  // Moves x into the bounds first, because methods may leave them by a rounding error. The reference is valid until the
  // next call.
  const NlpPoint& at(const Eigen::VectorXd& x, Wanted wanted);
  const Eigen::VectorXd& x() const { return x_; }  // of the last call, within the bounds

  bool is_new() const { return is_new_; }        // whether the last call computed (or recalled) a point not in memory
  bool is_better() const { return is_better_; }  // whether that point became the best
  bool feasible(const NlpPoint& point) const { return problem_.violation(point.c) <= constraint_tolerance_; }
  bool have_best() const { return have_best_; }
  const Eigen::VectorXd& best_x() const { return best_x_; }
  const NlpPoint& best() const { return best_; }
  int failed_in_a_row() const { return failed_in_a_row_; }
  const std::string& last_error() const { return last_error_; }

 private:
  struct Kept {
    NlpPoint point;
    Wanted wanted = Wanted::values;
  };
  NlpPoint computed(Wanted wanted);
  void keep_best(const NlpPoint& point);

  NonlinearProgram& problem_;
  SolverOutcome& outcome_;
  const double constraint_tolerance_;
  PointRecords* const records_;
  std::unordered_map<std::string, Kept> kept_;  // by the bytes of x
  std::deque<std::string> order_;               // oldest first
  Eigen::VectorXd x_, best_x_;
  NlpPoint best_, abandoned_;
  bool have_best_ = false, is_new_ = false, is_better_ = false;
  int failed_in_a_row_ = 0;
  std::string last_error_;
};

// The bounds for a local search from x. Methods derive their first steps from bounds: asymptotes of mma, multipliers of
// ipopt. Bounds that are far from variables of size 1 are infinite here; EvaluatedPoints keeps them.
Eigen::VectorXd near_bounds(const Eigen::VectorXd& bounds, const Eigen::VectorXd& x);

// Feasible before infeasible, less infeasible before more, then the lower objective. The violations are sums, 0 where
// feasible.
bool is_better(double f, double violations, double than_f, double than_violations);

}  // namespace mbsopt::inline optim
