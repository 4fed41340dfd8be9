#include "optim/tradeoff_curves.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

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

bool has_digits(const Quantity& quantity, double error) {
  return std::isfinite(error) && (!quantity.relative || error < 1);
}

std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity) {
  std::vector<WorkPrecisionCurve> curves;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TradeoffRow& row = rows[i];
    if (stands_alone(row.setting) || !has_digits(quantities[quantity], row.bounds(static_cast<Eigen::Index>(quantity))))
      continue;
    auto curve = std::find_if(curves.begin(), curves.end(),
                              [&](const WorkPrecisionCurve& c) { return c.name == row.setting.curve; });
    if (curve == curves.end()) curve = curves.insert(curve, WorkPrecisionCurve{row.setting.curve, {}, {}});
    curve->line.push_back(i);
  }
  for (WorkPrecisionCurve& curve : curves) {
    std::vector<std::size_t> line;
    long least = std::numeric_limits<long>::max();  // right-hand sides, of the tighter ones
    for (auto i = curve.line.rbegin(); i != curve.line.rend(); ++i) {
      const long work = rows[*i].statistics.rhs_evaluations;
      (work < least ? line : curve.beside).push_back(*i);
      least = std::min(least, work);
    }
    curve.line.assign(line.rbegin(), line.rend());
    std::reverse(curve.beside.begin(), curve.beside.end());
  }
  return curves;
}

}  // namespace mbsopt
