// The measured trade between speed and accuracy of one problem. It covers integrators x tolerances (or steps) x
// formulations for the motion, the sensors and the objectives, and every gradient method for their gradients. Errors
// are those against a reference that two methods certify (tradeoff_reference.hpp).
//
//   const Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), {.budget_seconds = 20});
//   for (const TradeoffRow& row : tradeoff.rows) std::cout << in_words(row.setting) << ' ' << row.wall_seconds << '\n';
//
// Curves go from loose to tight, the cheapest next point first. A curve ends if its next point would cost more than its
// share of the budget. It also ends if the reference is no more exact. Afterwards all points are timed again, in turn,
// so that a busy minute does not affect one of them alone. Times are medians.
#pragma once

#include <vector>

#include "optim/tradeoff/tradeoff_measurement.hpp"

namespace mbsopt::inline optim {

Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options = {});

}  // namespace mbsopt::inline optim
