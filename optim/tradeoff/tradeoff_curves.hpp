// The settings of a sweep as work-precision curves, and bounds of their errors.
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

#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_row.hpp"

namespace mbsopt {

// Fills in the bounds. Rows of a curve must be in the order of their tolerances or steps, but not adjacent. A bound is
// NaN if the row is not ok or has no such error; such rows raise no bound.
void bound_errors(std::vector<TradeoffRow>& rows);

// Returns whether an answer with this error is nearer than zero, or for the motion than the start: a relative error is
// below 1.
bool better_than_zero(const Quantity& quantity, double error);

// Indices of rows from loose to tight; only rows whose bound is better than zero.
struct WorkPrecisionCurve {
  std::string name;
  std::vector<std::size_t> line;    // right-hand sides grow, bounds fall or stay
  std::vector<std::size_t> beside;  // dominated: a tighter setting needed no more right-hand sides
};
// The curves of one quantity. Settings that stand alone have none.
std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity);

// Returns the rows that are faster than every tighter one, which a plot over time connects. `some` goes from loose to
// tight.
// Times depend on the machine and on chance; a line's right-hand sides do not.
std::vector<std::size_t> slower_and_slower(const std::vector<TradeoffRow>& rows, const std::vector<std::size_t>& some);

}  // namespace mbsopt
