// The measured trade between speed and accuracy of one problem: a sweep of runs into one table, a row per setting, with
// what it costs and how large its errors are. Errors are those against a reference that two methods certify
// (tradeoff_reference.hpp). Times are medians. Rows that differ in tolerance, step or alpha only are a curve.
//
//   const Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), {.budget_seconds = 20});
//   for (const TradeoffRow& row : tradeoff.rows) std::cout << in_words(row.setting) << ' ' << row.wall_seconds << '\n';
//
// An error can be small by chance: with its sign it passes through zero as the tolerance falls. So each setting also
// has a bound: the largest error of it and of all tighter settings of its curve. At this tolerance, and at any tighter
// measured one, the error was no larger. Bounds never rise along a curve, by definition. They do not cover tolerances
// in between or beyond, so the bound of the tightest setting is only its own error.
//
//   bound_errors(rows);
//   for (const WorkPrecisionCurve& curve : work_precision_curves(rows, quantities, q))
//     for (const std::size_t i : curve.line) plot(rows[i].wall_seconds, rows[i].bounds(q));
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt::inline optim {

// The curves of settings that stand alone.
inline constexpr const char *kOwnSettings = "as in the file", *kDefaults = "defaults";

struct TradeoffSetting {
  std::string curve;  // the common settings: "dopri5", "penalty 1e+07, cholesky: dopri5"
  SimulationSettings simulation;
  std::optional<GradientMethod> gradient;  // absent: a simulation

  // Returns whether it belongs to no curve: the scene's own settings and the defaults.
  bool stands_alone() const { return curve == kOwnSettings || curve == kDefaults; }
};
// "dopri5 at rtol 1e-06", "adjoint, rk4 with steps of 0.005 s"
std::string in_words(const TradeoffSetting& setting);

enum class RowStatus {
  ok,
  failed,     // its own failure: a step too large, a method without the ability
  abandoned,  // took longer than its share, or the user ended it
  skipped,    // would have taken longer
};
std::string_view to_string(RowStatus status);

struct TradeoffRow {
  TradeoffSetting setting;
  RowStatus status = RowStatus::ok;
  std::string message;       // why it is not ok
  double wall_seconds = 0;   // median
  std::vector<double> runs;  // [s], of this median
  SimulationStatistics statistics;
  Eigen::VectorXd errors;      // per quantity of the reference; NaN: not of this row
  Eigen::VectorXd deviations;  // likewise, with a sign
  Eigen::VectorXd bounds;      // likewise, the largest error from here on along the curve
  std::vector<bool> pareto;    // per quantity: nothing is faster and has a lower bound, as far as is certain
  bool within_floor = false;   // no error is larger than what the reference is certain of

  bool ok() const { return status == RowStatus::ok; }
  double error(std::size_t q) const { return errors(static_cast<Eigen::Index>(q)); }
  double bound(std::size_t q) const { return bounds(static_cast<Eigen::Index>(q)); }
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
  const std::vector<Quantity>& quantities() const { return reference.errors->quantities(); }
};

// Fills in the bounds. Rows of a curve must be in the order of their tolerances or steps, but not adjacent. A bound is
// NaN if the row is not ok or has no such error; such rows raise no bound.
void bound_errors(std::vector<TradeoffRow>& rows);

// Returns whether no other setting beats each one in both. A setting with infinite cost or error is never on the front;
// the first of equals is.
std::vector<bool> pareto_front(const std::vector<double>& cost, const std::vector<double>& error);
// Marks the front of time and bound. Bounds below the certainty of the reference count as equal to it.
void mark_fronts(std::vector<TradeoffRow>& rows, const std::vector<Quantity>& quantities);

// Returns whether an answer with this error is nearer than zero, or for the motion than the start: a relative error is
// below 1.
bool better_than_zero(const Quantity& quantity, double error);

// A curve of one quantity: indices of rows from loose to tight, whose bounds are better than zero. Right-hand sides
// grow along it, and bounds fall or stay: it leaves out rows that a tighter one dominates with no more right-hand
// sides.
struct WorkPrecisionCurve {
  std::string name;
  std::vector<std::size_t> line;
};
// Settings that stand alone have none.
std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity);

// Returns the rows that are faster than every tighter one, which a plot over time connects. `some` goes from loose to
// tight. Times depend on the machine and on chance; a line's right-hand sides do not.
std::vector<std::size_t> slower_and_slower(const std::vector<TradeoffRow>& rows, const std::vector<std::size_t>& some);

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
