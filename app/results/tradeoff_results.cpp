#include "app/results/tradeoff_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "app/results/trajectory_csv.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt::inline app {
namespace {

template <class T, std::size_t n>
std::string_view word_of(const Choice<T> (&choices)[n], T value) {
  return std::ranges::find(choices, value, &Choice<T>::value)->word;
}

Json if_known(bool known, const auto& value) { return known ? Json(value) : Json(); }

void add_errors(Json& row, const std::string& prefix, const std::vector<Quantity>& quantities,
                const Eigen::VectorXd& errors) {
  Eigen::Index column = 0;
  for (const Quantity& q : quantities) row[prefix + q.name] = errors(column++);
}

std::string csv_text(const Json& value) {
  if (value.is_string()) return csv_cell(value.get<std::string>());
  if (!value.is_number_float()) return value.is_null() ? "" : value.dump();
  return std::isfinite(value.get<double>()) ? fmt::format("{:.6g}", value.get<double>()) : "";
}

}  // namespace

Json columns_of(const TradeoffRow& r, const std::vector<Quantity>& quantities) {
  const IntegratorSettings& i = r.setting.simulation.integrator;
  const FormulationSettings& f = r.setting.simulation.formulation;
  const SimulationStatistics& s = r.statistics;
  const bool ran = r.status != RowStatus::skipped;
  Json row{{"curve", r.setting.curve},
           {"method", r.setting.gradient ? to_string(*r.setting.gradient) : "simulate"},
           {"integrator", i.type},
           {"rtol", if_known(!i.step, i.rtol)},
           {"atol", if_known(!i.step, i.atol)},
           {"step", if_known(i.step.has_value(), i.step.value_or(0))},
           {"formulation", word_of(kFormulations, f.type)},
           {"alpha", f.alpha},
           {"linear_solver", f.type == FormulationType::penalty ? word_of(kLinearSolvers, f.linear_solver) : ""},
           {"projection", word_of(kProjections, f.projection)},
           {"status", to_string(r.status)},
           {"wall_seconds", if_known(r.ok(), r.wall_seconds)},
           {"repetitions", r.runs.size()},
           {"steps", if_known(ran, s.steps)},
           {"rejected", if_known(ran, s.rejected)},
           {"rhs_evaluations", if_known(ran, s.rhs_evaluations)},
           {"factorisations", if_known(ran, s.factorisations)},
           {"jacobians", if_known(ran, s.jacobians)},
           {"memory_bytes", if_known(s.adjoint_memory_bytes > 0, s.adjoint_memory_bytes)},
           {"position_violation", if_known(r.ok(), s.max_position_violation)},
           {"velocity_violation", if_known(r.ok(), s.max_velocity_violation)}};
  add_errors(row, "error ", quantities, r.errors);
  add_errors(row, "bound ", quantities, r.bounds);
  std::vector<std::string> front;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const bool has_sign = quantities[q].kind == QuantityKind::objective || quantities[q].kind == QuantityKind::gradient;
    if (has_sign) row["deviation " + quantities[q].name] = r.deviations(static_cast<Eigen::Index>(q));
    if (q < r.pareto.size() && r.pareto[q]) front.push_back(quantities[q].name);
  }
  row["pareto"] = fmt::format("{}", fmt::join(front, "; "));
  row["message"] = r.message;
  return row;
}

std::string to_csv(const Tradeoff& tradeoff) {
  std::string text;
  for (const TradeoffRow& row : tradeoff.rows) {
    const Json all = columns_of(row, tradeoff.quantities());
    std::vector<std::string> columns, cells;
    for (const auto& [column, value] : all.items()) {
      columns.push_back(csv_cell(column));
      cells.push_back(csv_text(value));
    }
    if (text.empty()) text = fmt::format("{}\n", fmt::join(columns, ","));
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

Json errors_json(const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors) {
  Json json = Json::object();
  Eigen::Index column = 0;
  for (const Quantity& q : quantities)
    if (const double error = errors(column++); std::isfinite(error)) json[q.name] = error;
  return json;
}

std::string error_text(double error, double certificate) {
  if (!std::isfinite(error)) return "-";
  return error < certificate ? fmt::format("< {:.1e}", certificate) : fmt::format("{:.1e}", error);
}

std::string duration_text(double seconds) {
  return seconds < 1 ? fmt::format("{:.3g} ms", 1e3 * seconds) : fmt::format("{:.3g} s", seconds);
}

}  // namespace mbsopt::inline app
