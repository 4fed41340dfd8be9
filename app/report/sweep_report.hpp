// report.html of `sweep`: the points with the least and largest value of each objective, the best points, and each
// objective over each varied parameter.
#pragma once

#include <string>

#include "app/files/result_json.hpp"
#include "app/results/trajectory_csv.hpp"
#include "app/run/sweep_points.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// table has the columns of sweep.csv: the number of the point, its varied parameters, its objectives. A missing value
// is NaN.
std::string sweep_report(const Problem& problem, const SweepPoints& points, const Json& result,
                         const Trajectory& table);

}  // namespace mbsopt
