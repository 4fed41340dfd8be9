// The solution among the points of a search. A point that violates a constraint by its tolerance may have a lower
// objective, and noise moves the objective by its own size. So among the feasible points whose objective is the lowest
// one within the tolerances, the most stationary one is the solution (optimality.hpp).
//
//   StationaryPoint solution(problem, points, tolerance, constraint_tolerance);
//   solution.look(points.at(x, Wanted::derivatives));   // after every new point
//   if (solution.found()) solution.x();
#pragma once

#include <Eigen/Core>
#include <limits>

#include "optim/solver/evaluated_points.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt {

class StationaryPoint {
 public:
  StationaryPoint(const NonlinearProgram& problem, const EvaluatedPoints& points, double tolerance,
                  double constraint_tolerance);

  // The point is the one of the last call of points.at(), with derivatives. Returns its optimality if it may be the
  // solution, else infinity.
  double look(const NlpPoint& point);

  bool found() const { return x_.size() > 0 && as_good_as_best(point_.f); }
  const Eigen::VectorXd& x() const { return x_; }
  const NlpPoint& point() const { return point_; }
  double distance() const { return distance_; }

 private:
  bool as_good_as_best(double f) const;

  const NonlinearProgram& problem_;
  const EvaluatedPoints& points_;
  const double margin_;  // of the scaled objective
  Eigen::VectorXd x_;
  NlpPoint point_;
  double distance_ = std::numeric_limits<double>::infinity();
};

}  // namespace mbsopt
