// report.html of `sweep`: where each objective is least and largest, the best points, each objective over each varied
// parameter.
#pragma once

#include <string>

#include "app/files/result_json.hpp"
#include "app/results/trajectory_csv.hpp"
#include "app/run/sweep_points.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// table: as in sweep.csv: the number of the point, its varied parameters, its objectives; NaN where there is no value.
std::string sweep_report(const Problem& problem, const SweepPoints& points, const Json& result,
                         const Trajectory& table);

}  // namespace mbsopt
