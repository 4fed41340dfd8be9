// The measured trade between speed and accuracy of one problem. It covers integrators x tolerances (or steps) x
// formulations for the motion, the sensors and the objectives, and every gradient method for their gradients. Errors
// are those against a reference that two methods certify (tradeoff_reference.hpp).
//
//   const Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), {.budget_seconds = 20});
//   for (const TradeoffRow& row : tradeoff.rows) std::cout << in_words(row.setting) << ' ' << row.wall_seconds << '\n';
//
// Settings that differ in tolerance or step only are a curve. Curves go from loose to tight, the cheapest next point
// first. A curve ends if its next point would cost more than its share of the budget. It also ends if the reference is
// no more exact. Afterwards all points are timed again, in turn, so that a busy minute does not affect one of them
// alone. Times are medians.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_reference.hpp"
#include "optim/tradeoff/tradeoff_row.hpp"

namespace mbsopt {

// The cheapest setting for an accuracy; see recommend().
struct Recommendation {
  std::vector<std::size_t> quantities;  // indices; all of them within the accuracy
  double accuracy = 0;
  std::optional<std::size_t> row;  // absent: none
  std::string why_not;
};

struct Tradeoff {
  std::string message;  // why there is nothing
  TradeoffReference reference;
  std::vector<TradeoffRow> rows;
  std::optional<std::size_t> own, defaults, own_gradient, default_gradient;  // rows of the scene's own settings, and
                                                                             // of the program's defaults
  bool interrupted = false;
  double wall_seconds = 0;
  bool ok() const { return reference.ok(); }
};

struct TradeoffOptions {
  double budget_seconds = 60;  // 0: the reference, the scene's own settings and the defaults only
  std::function<bool()> interrupted = {};
  std::function<void(const std::string& doing, double done)> progress = {};  // done: 0..1
  Clock clock = {};                                                          // of the budget and of all times
};

Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options = {});

// The row of the simulation with the settings of a gradient's row. A looser row of the same kind may replace it if it
// is already as exact as the reference. For a simulation's row it is that row. There is none if it was not measured.
std::optional<std::size_t> simulation_of(const Tradeoff& tradeoff, std::size_t row);

// The fastest row whose bounds in these quantities are within the accuracy. A bound excludes errors that pass through
// zero by chance. Of rows that are equally fast to a tenth, it takes the one with the lowest bound, where bounds below
// the certainty of the reference are equal. There is none if the reference is not three times as exact as requested. If
// gradients and other quantities are requested, it takes rows of exact gradients, with the bounds of their simulations.
// `also` is a further condition, tested for the fastest rows first until it holds.
Recommendation recommend(const Tradeoff& tradeoff, std::vector<std::size_t> quantities, double accuracy,
                         const std::function<bool(const TradeoffRow&)>& also = {});

// Returns the objectives, or the sensors if there are none, or the motion.
std::vector<std::size_t> main_quantities(const std::vector<Quantity>& quantities);
// Returns the quantities of an optimiser: the named objectives and their gradients.
std::vector<std::size_t> design_quantities(const std::vector<Quantity>& quantities,
                                           const std::vector<std::string>& objectives);

}  // namespace mbsopt
