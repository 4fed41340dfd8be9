// report.html of `tradeoff`: work-precision plots, recommendations, the accuracy of the reference. Unlike other reports
// it shows seconds, because it measures them.
#pragma once

#include <string>

#include "app/files/result_json.hpp"
#include "app/results/objective_units.hpp"
#include "optim/tradeoff/penalty_study.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt {

std::string tradeoff_report(const Json& result, const Tradeoff& tradeoff, const ObjectiveUnits& units);
std::string penalty_report(const Json& result, const PenaltyStudy& study);

}  // namespace mbsopt
