#include "app/results/tradeoff_csv.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <vector>

#include "app/files/csv_cell.hpp"

namespace mbsopt {
namespace {

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string(); }

// Sets names and values of columns together, so that they correspond.
class Row {
 public:
  void text(std::string_view column, std::string_view value) { add(column, csv_cell(value)); }
  void real(std::string_view column, double value) { add(column, number(value)); }
  void count(std::string_view column, long value) { add(column, std::to_string(value)); }
  std::string header() const { return fmt::format("{}\n", fmt::join(columns_, ",")); }
  std::string line() const { return fmt::format("{}\n", fmt::join(values_, ",")); }

 private:
  void add(std::string_view column, std::string value) {
    columns_.push_back(csv_cell(column));
    values_.push_back(std::move(value));
  }
  std::vector<std::string> columns_, values_;
};

std::string table(const std::vector<Row>& rows) {
  std::string text = rows.empty() ? std::string() : rows.front().header();
  for (const Row& row : rows) text += row.line();
  return text;
}

const char* name_of(FormulationType type) {
  return type == FormulationType::penalty ? "penalty" : "augmented_lagrangian";
}
const char* name_of(Projection projection) {
  return projection == Projection::none       ? "none"
         : projection == Projection::velocity ? "velocity"
                                              : "position_velocity";
}
const char* name_of(LinearSolver solver) { return solver == LinearSolver::cholesky ? "cholesky" : "quasidefinite"; }

void add_errors(Row& row, const std::string& prefix, const std::vector<Quantity>& quantities,
                const Eigen::VectorXd& errors) {
  for (std::size_t q = 0; q < quantities.size(); ++q)
    row.real(prefix + quantities[q].name, errors(static_cast<Eigen::Index>(q)));
}

Row row_of(const TradeoffRow& r, const std::vector<Quantity>& quantities) {
  const IntegratorSettings& i = r.setting.simulation.integrator;
  const FormulationSettings& f = r.setting.simulation.formulation;
  const bool was_run = r.status != RowStatus::skipped, ok = r.status == RowStatus::ok;
  const double none = std::nan("");
  Row row;
  row.text("curve", r.setting.curve);
  row.text("method", r.setting.gradient ? to_string(*r.setting.gradient) : "simulate");
  row.text("integrator", i.type);
  row.real("rtol", i.step ? none : i.rtol);
  row.real("atol", i.step ? none : i.atol);
  row.real("step", i.step.value_or(none));
  row.text("formulation", name_of(f.type));
  row.real("alpha", f.alpha);
  row.text("linear_solver", f.type == FormulationType::penalty ? name_of(f.linear_solver) : "");
  row.text("projection", name_of(f.projection));
  row.text("status", to_string(r.status));
  row.real("wall_seconds", ok ? r.wall_seconds : none);
  row.count("repetitions", r.repetitions);
  const SimulationStatistics& s = r.statistics;
  const auto add = [&](const char* name, long value) { row.text(name, was_run ? std::to_string(value) : ""); };
  add("steps", s.steps);
  add("rejected", s.rejected);
  add("rhs_evaluations", s.rhs_evaluations);
  add("factorisations", s.factorisations);
  add("jacobians", s.jacobians);
  row.text("memory_bytes", s.adjoint_memory_bytes > 0 ? std::to_string(s.adjoint_memory_bytes) : "");
  row.real("position_violation", ok ? s.max_position_violation : none);
  row.real("velocity_violation", ok ? s.max_velocity_violation : none);
  add_errors(row, "error ", quantities, r.errors);
  add_errors(row, "bound ", quantities, r.bounds);
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const bool has_sign = quantities[q].kind == QuantityKind::objective || quantities[q].kind == QuantityKind::gradient;
    if (has_sign) row.real("deviation " + quantities[q].name, r.deviations(static_cast<Eigen::Index>(q)));
  }
  std::string front;
  for (std::size_t q = 0; q < quantities.size(); ++q)
    if (q < r.pareto.size() && r.pareto[q]) front += (front.empty() ? "" : "; ") + quantities[q].name;
  row.text("pareto", front);
  row.text("message", r.message);
  return row;
}

void add_run(Row& row, const std::string& name, const PenaltyRun& run, const std::vector<Quantity>& quantities) {
  const double none = std::nan("");
  row.text(name + " status", run.ok ? "ok" : "failed");
  row.real(name + " wall_seconds", run.ok ? run.wall_seconds : none);
  row.count(name + " steps", run.statistics.steps);
  row.count(name + " rhs_evaluations", run.statistics.rhs_evaluations);
  row.count(name + " factorisations", run.statistics.factorisations);
  row.real(name + " drift", run.ok ? run.statistics.max_position_violation : none);
  add_errors(row, name + " error ", quantities, run.errors);
  row.text(name + " message", run.message);
}

}  // namespace

std::string to_csv(const Tradeoff& tradeoff) {
  std::vector<Row> rows;
  for (const TradeoffRow& row : tradeoff.rows) rows.push_back(row_of(row, tradeoff.reference.errors->quantities()));
  return table(rows);
}

std::string to_csv(const PenaltyStudy& study) {
  const std::vector<Quantity>& quantities = study.reference.errors->quantities();
  std::vector<Row> rows;
  for (const PenaltyStudyRow& r : study.rows) {
    Row& row = rows.emplace_back();
    row.real("alpha", r.alpha);
    row.real("acceleration model_error", r.model_error);
    row.real("acceleration rounding", r.rounding_error);
    row.real("acceleration augmented_lagrangian", r.augmented_error);
    add_run(row, "quasidefinite", r.quasidefinite, quantities);
    add_run(row, "cholesky", r.cholesky, quantities);
    add_errors(row, "rounding ", quantities, r.rounding);
  }
  return table(rows);
}

}  // namespace mbsopt
