#include <fmt/format.h>

#include <functional>

#include "app/report/line_plot.hpp"
#include "app/report/tradeoff_page.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/tradeoff_results.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {

void show_penalty_study(RunPage& page, const PenaltyStudy& study) {
  Run& run = page.run;
  const Tradeoff& table = study.table;
  const std::vector<Quantity>& quantities = table.quantities();
  const auto run_json = [&](const TradeoffRow& row) {
    Json json{{"status", row.ok() ? "ok" : "failed"}};
    add_columns(json, table, row, {"rhs_evaluations", "message", "wall_seconds"});
    if (row.ok()) json["drift"] = row.statistics.max_position_violation;
    json["errors"] = errors_json(quantities, row.errors);
    return json;
  };
  const FormulationSettings& f = study.formulation;
  const IntegratorSettings& i = study.integrator;
  const TradeoffRow& constrained_run = table.rows.front();
  Json& json = run.result["penalty"];
  json = {{"integrator", i.type}, {"rtol", i.rtol},   {"atol", i.atol},
          {"xi", f.xi},           {"omega", f.omega}, {"augmented_lagrangian", run_json(constrained_run)},
          {"rows", Json::array()}};
  std::vector<std::string> header{"alpha"};
  for (const AccelerationError& e : kAccelerationErrors) header.push_back(e.words);
  TextTable accelerations(header);
  header = {"alpha", "solver", "right-hand sides", "time", "drift"};
  const std::vector<std::size_t> shown = main_quantities(quantities);
  for (const std::size_t q : shown) header.push_back("error of " + quantities[q].name);
  TextTable runs(header);
  for (const PenaltyStudyRow& row : study.rows) {
    const std::string alpha = fmt::format("{:.0e}", row.alpha);
    Json entry{{"alpha", row.alpha}};
    TableRow cells{alpha};
    for (const AccelerationError& e : kAccelerationErrors) {
      entry["acceleration"][e.column] = row.*e.value;
      cells.push_back(error_text(row.*e.value));
    }
    accelerations.add(cells);
    for (const PenaltyRun& solver : kPenaltyRuns) {
      const TradeoffRow& r = table.rows[row.*solver.row];
      entry[solver.column] = run_json(r);
      cells = {alpha, solver.words, std::to_string(r.statistics.rhs_evaluations),
               r.ok() ? duration_text(r.wall_seconds) : "-",
               r.ok() ? error_text(r.statistics.max_position_violation) : "-"};
      for (const std::size_t q : shown) cells.push_back(error_text(r.errors(static_cast<Eigen::Index>(q))));
      runs.add(cells);
      if (!r.ok()) run.warn(fmt::format("alpha {}, {}: {}", alpha, solver.words, r.message));
    }
    entry["rounding"] = errors_json(quantities, row.rounding);
    json["rows"].push_back(entry);
  }
  run.context.out << fmt::format(
      "\npenalty with xi {:g}, omega {:g}, {}; {} at rtol {:g}, atol {:g}. Accelerations: relative errors at {} "
      "states\n",
      f.xi, f.omega, f.projection == Projection::none ? "not projected" : "projected", i.type, i.rtol, i.atol,
      table.reference.errors->exact().motion.times.size());
  page.heading("Accelerations");
  page.both(accelerations);
  page.heading("Runs");
  page.paragraph(fmt::format("{} at rtol {:g}; xi {:g}, omega {:g}.", i.type, i.rtol, f.xi, f.omega));
  page.both(runs);
  if (constrained_run.ok())
    run.context.out << fmt::format("augmented Lagrangian with the same integrator: {}, {}, drift {:.0e}\n",
                                   counted(constrained_run.statistics.rhs_evaluations, "right-hand side"),
                                   duration_text(constrained_run.wall_seconds),
                                   constrained_run.statistics.max_position_violation);
}

void add_penalty_plots(RunPage& page, const PenaltyStudy& study) {
  struct OverAlpha {
    std::string name;
    std::function<double(const PenaltyStudyRow&)> value_of;
    Mark mark = Mark::line;
  };
  const auto add_plot = [&](const std::string& title, const std::string& label, const std::vector<OverAlpha>& curves) {
    LinePlot plot{
        .title = title, .x_label = "alpha [-]", .y_label = label, .logarithmic_y = true, .logarithmic_x = true};
    for (const OverAlpha& curve : curves) {
      PlotSeries& series = plot.series.emplace_back(PlotSeries{curve.name, {}, {}, curve.mark});
      for (const PenaltyStudyRow& row : study.rows)
        series.x.push_back(row.alpha), series.y.push_back(curve.value_of(row));
    }
    page.plot(plot);
  };
  page.heading("Errors over alpha");
  std::vector<OverAlpha> of_accelerations;
  for (const AccelerationError& e : kAccelerationErrors) {
    const bool is_penalty = e.value != &PenaltyStudyRow::augmented_error;
    of_accelerations.push_back({e.legend, e.value, is_penalty ? Mark::line : Mark::dashed});
  }
  add_plot("Relative error of accelerations", "relative error [-]", of_accelerations);
  Eigen::Index column = 0;
  for (const Quantity& q : study.table.quantities()) {
    std::vector<OverAlpha> curves;
    for (const PenaltyRun& solver : kPenaltyRuns)
      curves.push_back(
          {solver.words, [&](const PenaltyStudyRow& row) { return study.table.rows[row.*solver.row].errors(column); }});
    curves.push_back({"rounding by Cholesky on equal steps",
                      [&](const PenaltyStudyRow& row) { return row.rounding(column); }, Mark::dashed});
    add_plot("Error of " + q.name, fmt::format("error of {} [{}]", q.name, q.relative ? "-" : kUnknownUnit), curves);
    ++column;
  }
}

}  // namespace mbsopt::inline app
