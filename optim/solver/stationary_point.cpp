#include "optim/solver/stationary_point.hpp"

#include <algorithm>

#include "optim/solver/optimality.hpp"

namespace mbsopt {

StationaryPoint::StationaryPoint(const NonlinearProgram& problem, const EvaluatedPoints& points, double tolerance,
                                 double constraint_tolerance)
    : problem_(problem), points_(points), margin_(std::max(tolerance, 10 * constraint_tolerance)) {}

bool StationaryPoint::as_good_as_best(double f) const { return (f - points_.best().f) * problem_.f_scale <= margin_; }

double StationaryPoint::look(const NlpPoint& point) {
  if (!points_.feasible(point) || !as_good_as_best(point.f)) return std::numeric_limits<double>::infinity();
  const double distance = optimality(problem_, points_.x(), point);
  if (!found() || distance < distance_) x_ = points_.x(), point_ = point, distance_ = distance;
  return distance;
}

}  // namespace mbsopt
