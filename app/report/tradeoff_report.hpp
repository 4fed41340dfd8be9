// report.html of `tradeoff`: work-precision plots, what is recommended, how far the reference can be trusted. Unlike
// other reports it shows seconds: they are what was measured.
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
