// The measured trade between speed and accuracy of one problem: a sweep of runs into one table (tradeoff_table.hpp).
// Errors are those against a reference that two methods certify (tradeoff_reference.hpp). Times are medians.
//
//   const Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), {.budget_seconds = 20});
//   for (const TradeoffRow& row : tradeoff.rows) std::cout << in_words(row.setting) << ' ' << row.wall_seconds << '\n';
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_table.hpp"

namespace mbsopt::inline optim {

struct TradeoffOptions {
  double budget_seconds = 60;  // 0: the reference, the scene's own settings and the defaults only
  std::function<bool()> interrupted = {};
  std::function<void(const std::string& doing, double done)> progress = {};  // done: 0..1
  Clock clock = {};                                                          // of the budget and of all times
};

// Integrators x tolerances (or steps) x formulations for the motion, the sensors and the objectives; every gradient
// method for their gradients. Curves go from loose to tight, the cheapest next point first. A curve ends if its next
// point would cost more than its share of the budget. It also ends if the reference is no more exact. Afterwards all
// points are timed again, in turn, so that a busy minute does not affect one of them alone.
Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options = {});

}  // namespace mbsopt::inline optim
