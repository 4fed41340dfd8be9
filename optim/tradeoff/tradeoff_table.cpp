#include "optim/tradeoff/tradeoff_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace mbsopt::inline optim {
namespace {

// Returns the rows that cost less than every tighter one, in the same order. `some` goes from loose to tight.
template <typename Cost>
std::vector<std::size_t> not_dominated(const std::vector<std::size_t>& some, const Cost& cost_of) {
  std::vector<std::size_t> left;
  for (auto i = some.rbegin(); i != some.rend(); ++i)
    if (left.empty() || cost_of(*i) < cost_of(left.back())) left.push_back(*i);
  std::ranges::reverse(left);
  return left;
}

}  // namespace

std::string in_words(const TradeoffSetting& setting) {
  const IntegratorSettings& s = setting.simulation.integrator;
  std::string name = setting.curve;
  if (setting.stands_alone()) {  // for any method
    name = fmt::format("{} ({})", s.type, name);
    if (setting.gradient) name = fmt::format("{}, {}", to_string(*setting.gradient), name);
  }
  return in_words(ReferenceMethod{name, s.rtol, s.step});
}

std::string_view to_string(RowStatus status) {
  constexpr std::string_view kWords[] = {"ok", "failed", "abandoned", "skipped"};
  return kWords[static_cast<std::size_t>(status)];
}

void bound_errors(std::vector<TradeoffRow>& rows) {
  std::map<std::string, Eigen::VectorXd> largest_of;  // per curve, of the rows from the tightest on
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    row->bounds.setConstant(row->errors.size(), kNaN);
    if (!row->ok()) continue;
    Eigen::VectorXd& largest = largest_of[row->setting.curve];
    if (largest.size() == 0) largest.setZero(row->errors.size());
    for (Eigen::Index q = 0; q < row->errors.size(); ++q)
      if (std::isfinite(row->errors(q))) row->bounds(q) = largest(q) = std::max(largest(q), row->errors(q));
  }
}

std::vector<bool> pareto_front(const std::vector<double>& cost, const std::vector<double>& error) {
  std::vector<std::size_t> finite;
  for (std::size_t i = 0; i < cost.size(); ++i)
    if (std::isfinite(cost[i]) && std::isfinite(error[i])) finite.push_back(i);
  std::ranges::stable_sort(finite, {}, [&](std::size_t i) { return std::pair(cost[i], error[i]); });
  std::vector<bool> front(cost.size(), false);
  double least = std::numeric_limits<double>::infinity();  // error of what costs no more
  for (const std::size_t i : finite)
    if (error[i] < least) front[i] = true, least = error[i];
  return front;
}

void mark_fronts(std::vector<TradeoffRow>& rows, const std::vector<Quantity>& quantities) {
  for (TradeoffRow& row : rows) row.pareto.clear();
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    std::vector<double> cost, bound;
    for (const TradeoffRow& row : rows) {
      const double b = row.bounds(static_cast<Eigen::Index>(q));
      cost.push_back(row.ok() ? row.wall_seconds : kNaN);
      bound.push_back(std::isfinite(b) ? std::max(b, quantities[q].certificate) : kNaN);
    }
    const std::vector<bool> front = pareto_front(cost, bound);
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].pareto.push_back(front[i]);
  }
}

bool better_than_zero(const Quantity& quantity, double error) {
  return std::isfinite(error) && (!quantity.relative || error < 1);
}

std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity) {
  std::vector<WorkPrecisionCurve> curves;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TradeoffSetting& setting = rows[i].setting;
    if (setting.stands_alone() ||
        !better_than_zero(quantities[quantity], rows[i].bounds(static_cast<Eigen::Index>(quantity))))
      continue;
    auto curve = std::ranges::find(curves, setting.curve, &WorkPrecisionCurve::name);
    if (curve == curves.end()) curve = curves.insert(curve, WorkPrecisionCurve{setting.curve, {}});
    curve->line.push_back(i);
  }
  for (WorkPrecisionCurve& curve : curves)
    curve.line = not_dominated(curve.line, [&](std::size_t i) { return rows[i].statistics.rhs_evaluations; });
  return curves;
}

std::vector<std::size_t> slower_and_slower(const std::vector<TradeoffRow>& rows, const std::vector<std::size_t>& some) {
  return not_dominated(some, [&](std::size_t i) { return rows[i].wall_seconds; });
}

}  // namespace mbsopt::inline optim
