#include "optim/tradeoff/tradeoff_curves.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

namespace mbsopt {

void bound_errors(std::vector<TradeoffRow>& rows) {
  std::map<std::string, Eigen::VectorXd> largest_of;  // per curve, of the rows from the tightest on
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    row->bounds.setConstant(row->errors.size(), std::numeric_limits<double>::quiet_NaN());
    if (row->status != RowStatus::ok) continue;
    Eigen::VectorXd& largest = largest_of[row->setting.curve];
    if (largest.size() == 0) largest.setZero(row->errors.size());
    for (Eigen::Index q = 0; q < row->errors.size(); ++q) {
      if (!std::isfinite(row->errors(q))) continue;
      largest(q) = std::max(largest(q), row->errors(q));
      row->bounds(q) = largest(q);
    }
  }
}

namespace {

// Returns the rows that cost less than every tighter one, in the same order. `some` goes from loose to tight.
template <typename Cost>
std::vector<std::size_t> not_dominated(const std::vector<std::size_t>& some, const Cost& cost_of) {
  std::vector<std::size_t> kept;
  for (auto i = some.rbegin(); i != some.rend(); ++i)
    if (kept.empty() || cost_of(*i) < cost_of(kept.back())) kept.push_back(*i);
  std::reverse(kept.begin(), kept.end());
  return kept;
}

}  // namespace

bool better_than_zero(const Quantity& quantity, double error) {
  return std::isfinite(error) && (!quantity.relative || error < 1);
}

std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity) {
  std::vector<WorkPrecisionCurve> curves;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TradeoffRow& row = rows[i];
    if (stands_alone(row.setting) ||
        !better_than_zero(quantities[quantity], row.bounds(static_cast<Eigen::Index>(quantity))))
      continue;
    auto curve = std::find_if(curves.begin(), curves.end(),
                              [&](const WorkPrecisionCurve& c) { return c.name == row.setting.curve; });
    if (curve == curves.end()) curve = curves.insert(curve, WorkPrecisionCurve{row.setting.curve, {}, {}});
    curve->line.push_back(i);
  }
  for (WorkPrecisionCurve& curve : curves) {
    const std::vector<std::size_t> all = std::exchange(
        curve.line, not_dominated(curve.line, [&](std::size_t i) { return rows[i].statistics.rhs_evaluations; }));
    std::set_difference(all.begin(), all.end(), curve.line.begin(), curve.line.end(), std::back_inserter(curve.beside));
  }
  return curves;
}

std::vector<std::size_t> slower_and_slower(const std::vector<TradeoffRow>& rows, const std::vector<std::size_t>& some) {
  return not_dominated(some, [&](std::size_t i) { return rows[i].wall_seconds; });
}

}  // namespace mbsopt
