#include "app/results/tradeoff_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "app/results/trajectory_csv.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt::inline app {
namespace {

// Sets names and values of columns together, so that they correspond.
class Row {
 public:
  void add(std::string_view column, std::string_view text) { push(column, csv_cell(text)); }
  void add(std::string_view column, double value) {
    push(column, std::isfinite(value) ? fmt::format("{:.6g}", value) : "");
  }
  void add(std::string_view column, long value) { push(column, std::to_string(value)); }
  void add(const std::string& prefix, const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors) {
    for (std::size_t q = 0; q < quantities.size(); ++q)
      add(prefix + quantities[q].name, errors(static_cast<Eigen::Index>(q)));
  }
  static std::string table(const std::vector<Row>& rows) {
    if (rows.empty()) return "";
    std::string text = fmt::format("{}\n", fmt::join(rows.front().columns_, ","));
    for (const Row& row : rows) text += fmt::format("{}\n", fmt::join(row.values_, ","));
    return text;
  }

 private:
  void push(std::string_view column, std::string value) {
    columns_.push_back(csv_cell(column)), values_.push_back(std::move(value));
  }
  std::vector<std::string> columns_, values_;
};

template <class T, std::size_t n>
std::string_view word_of(const Choice<T> (&choices)[n], T value) {
  return std::ranges::find(choices, value, &Choice<T>::value)->word;
}

Row row_of(const TradeoffRow& r, const std::vector<Quantity>& quantities) {
  const IntegratorSettings& i = r.setting.simulation.integrator;
  const FormulationSettings& f = r.setting.simulation.formulation;
  const SimulationStatistics& s = r.statistics;
  const bool is_penalty = f.type == FormulationType::penalty;
  const auto count = [](bool known, long value) { return known ? std::to_string(value) : ""; };
  Row row;
  row.add("curve", r.setting.curve);
  row.add("method", r.setting.gradient ? to_string(*r.setting.gradient) : "simulate");
  row.add("integrator", i.type);
  row.add("rtol", i.step ? kNaN : i.rtol);
  row.add("atol", i.step ? kNaN : i.atol);
  row.add("step", i.step.value_or(kNaN));
  row.add("formulation", word_of(kFormulations, f.type));
  row.add("alpha", f.alpha);
  row.add("linear_solver", is_penalty ? word_of(kLinearSolvers, f.linear_solver) : "");
  row.add("projection", word_of(kProjections, f.projection));
  row.add("status", to_string(r.status));
  row.add("wall_seconds", r.ok() ? r.wall_seconds : kNaN);
  row.add("repetitions", static_cast<long>(r.runs.size()));
  for (const auto& [name, value] : {std::pair{"steps", s.steps},
                                    {"rejected", s.rejected},
                                    {"rhs_evaluations", s.rhs_evaluations},
                                    {"factorisations", s.factorisations},
                                    {"jacobians", s.jacobians}})
    row.add(name, count(r.status != RowStatus::skipped, value));
  row.add("memory_bytes", count(s.adjoint_memory_bytes > 0, s.adjoint_memory_bytes));
  row.add("position_violation", r.ok() ? s.max_position_violation : kNaN);
  row.add("velocity_violation", r.ok() ? s.max_velocity_violation : kNaN);
  row.add("error ", quantities, r.errors);
  row.add("bound ", quantities, r.bounds);
  std::string front;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const bool has_sign = quantities[q].kind == QuantityKind::objective || quantities[q].kind == QuantityKind::gradient;
    if (has_sign) row.add("deviation " + quantities[q].name, r.deviations(static_cast<Eigen::Index>(q)));
    if (q < r.pareto.size() && r.pareto[q]) front += (front.empty() ? "" : "; ") + quantities[q].name;
  }
  row.add("pareto", front);
  row.add("message", r.message);
  return row;
}

}  // namespace

std::string to_csv(const Tradeoff& tradeoff) {
  std::vector<Row> rows;
  for (const TradeoffRow& row : tradeoff.rows) rows.push_back(row_of(row, tradeoff.quantities()));
  return Row::table(rows);
}

std::string to_csv(const PenaltyStudy& study) {
  const std::vector<Quantity>& quantities = study.table.quantities();
  std::vector<Row> rows;
  for (const PenaltyStudyRow& r : study.rows) {
    Row& row = rows.emplace_back();
    row.add("alpha", r.alpha);
    row.add("acceleration model_error", r.model_error);
    row.add("acceleration rounding", r.rounding_error);
    row.add("acceleration augmented_lagrangian", r.augmented_error);
    for (const auto& [name, index] :
         {std::pair<std::string, std::size_t>{"quasidefinite", r.quasidefinite}, {"cholesky", r.cholesky}}) {
      const TradeoffRow& run = study.table.rows[index];
      row.add(name + " status", run.ok() ? "ok" : "failed");
      row.add(name + " wall_seconds", run.ok() ? run.wall_seconds : kNaN);
      row.add(name + " steps", run.statistics.steps);
      row.add(name + " rhs_evaluations", run.statistics.rhs_evaluations);
      row.add(name + " factorisations", run.statistics.factorisations);
      row.add(name + " drift", run.ok() ? run.statistics.max_position_violation : kNaN);
      row.add(name + " error ", quantities, run.errors);
      row.add(name + " message", run.message);
    }
    row.add("rounding ", quantities, r.rounding);
  }
  return Row::table(rows);
}

}  // namespace mbsopt::inline app
