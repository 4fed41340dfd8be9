// The base of Ipopt's and NLopt's adapters: the points of a search, its result among them, and the words of its end.
#pragma once

#include <functional>
#include <limits>
#include <string>

#include "optim/solver/evaluated_points.hpp"
#include "optim/solver/nonlinear_program.hpp"
#include "optim/solver/stationary_point.hpp"

namespace mbsopt {

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
        solution_(problem, points_, options.tolerance, options.constraint_tolerance) {}

  // Reports the last point of points_. Returns whether the search goes on.
  bool told(const NlpPoint& point, double distance) const;
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
  StationaryPoint solution_;
};

}  // namespace mbsopt
