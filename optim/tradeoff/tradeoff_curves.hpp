// The settings of a sweep as work-precision curves, and what an error on one is worth.
//
// An error can be small by chance: with its sign it passes through zero as the tolerance falls. So each setting has,
// beside its error, a bound: the largest error of it and of all tighter settings of its curve. At this tolerance, and
// at any tighter one that was measured, the error was no larger. Bounds never rise along a curve, by definition; they
// say nothing of tolerances in between or beyond, so the bound of the tightest setting is no more than its own error.
//
//   bound_errors(rows);
//   for (const WorkPrecisionCurve& curve : work_precision_curves(rows, quantities, q))
//     for (const std::size_t i : curve.line) plot(rows[i].wall_seconds, rows[i].bounds(q));
#pragma once

#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_row.hpp"

namespace mbsopt {

// Fills in the bounds. Rows of a curve stand in the order of their tolerances or steps, though not side by side. NaN
// where the row is not ok or has no such error; such rows raise no bound.
void bound_errors(std::vector<TradeoffRow>& rows);

// Whether an answer with this error is nearer than zero, for the motion than the start: below 1 where it is relative.
bool better_than_zero(const Quantity& quantity, double error);

// Rows, by index, from loose to tight; only those whose bound is better than zero.
struct WorkPrecisionCurve {
  std::string name;
  std::vector<std::size_t> line;    // right-hand sides grow, bounds fall or stay
  std::vector<std::size_t> beside;  // dominated: a tighter setting needed no more right-hand sides
};
// Of one quantity; none of settings that stand alone.
std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity);

// Of rows from loose to tight those that no tighter one was as fast as: what a plot over time connects. Unlike a line's
// right-hand sides, times are a matter of the machine and of chance.
std::vector<std::size_t> slower_and_slower(const std::vector<TradeoffRow>& rows, const std::vector<std::size_t>& some);

}  // namespace mbsopt
