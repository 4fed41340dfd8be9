#include <fmt/format.h>

#include "app/results/tradeoff_results.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

void print_penalty(Run& run, const PenaltyStudy& study) {
  const std::vector<Quantity>& quantities = study.table.quantities();
  const FormulationSettings& f = study.formulation;
  run.context.out << fmt::format(
      "\npenalty with xi {:g}, omega {:g}, {}; {} at rtol {:g}, atol {:g}. Accelerations: relative errors at {} "
      "states\n",
      f.xi, f.omega, f.projection == Projection::none ? "not projected" : "projected", study.integrator.type,
      study.integrator.rtol, study.integrator.atol, study.table.reference.errors->exact().motion.times.size());
  TextTable accelerations({"alpha", "model error", "rounding, cholesky", "augmented Lagrangian"});
  const std::vector<std::size_t> shown = main_quantities(quantities);
  std::vector<std::string> header{"alpha"};
  for (const std::size_t q : shown) header.insert(header.end(), {quantities[q].name + " q", "c"});
  header.insert(header.end(), {"drift q", "c", "right-hand sides q", "c", "time q", "c"});
  TextTable runs(header);
  for (const PenaltyStudyRow& row : study.rows) {
    const std::string alpha = fmt::format("{:.0e}", row.alpha);
    accelerations.add({alpha, significant(row.model_error, 2), significant(row.rounding_error, 2),
                       significant(row.augmented_error, 2)});
    std::vector<std::string> cells{alpha};
    const auto add_both = [&](const auto& text_of, bool always = false) {
      for (const std::size_t i : {row.quasidefinite, row.cholesky}) {
        const TradeoffRow& r = study.table.rows[i];
        cells.push_back(r.ok() || always ? text_of(r) : "-");
      }
    };
    for (const std::size_t q : shown)
      add_both([&](const TradeoffRow& r) { return fmt::format("{:.0e}", r.errors(static_cast<Eigen::Index>(q))); });
    add_both([](const TradeoffRow& r) { return fmt::format("{:.0e}", r.statistics.max_position_violation); });
    add_both([](const TradeoffRow& r) { return std::to_string(r.statistics.rhs_evaluations); }, true);
    add_both([](const TradeoffRow& r) { return duration_text(r.wall_seconds); });
    runs.add(cells);
  }
  run.context.out << '\n' << accelerations.text() << "\nq: quasi-definite, c: cholesky\n" << runs.text();
  for (const PenaltyStudyRow& row : study.rows)
    for (const auto& [name, i] : {std::pair{"quasi-definite", row.quasidefinite}, {"cholesky", row.cholesky}})
      if (const TradeoffRow& r = study.table.rows[i]; !r.ok())
        run.warn(fmt::format("alpha {:.0e}, {}: {}", row.alpha, name, r.message));
  if (const TradeoffRow& c = study.table.rows.front(); c.ok())
    run.context.out << fmt::format("augmented Lagrangian with the same integrator: {}, {}, drift {:.0e}\n",
                                   counted(c.statistics.rhs_evaluations, "right-hand side"),
                                   duration_text(c.wall_seconds), c.statistics.max_position_violation);
}

Json penalty_json(const PenaltyStudy& study) {
  const std::vector<Quantity>& quantities = study.table.quantities();
  const auto run_json = [&](std::size_t index) {
    const TradeoffRow& r = study.table.rows[index];
    Json json{{"status", r.ok() ? "ok" : "failed"}, {"rhs_evaluations", r.statistics.rhs_evaluations}};
    if (!r.ok()) json["message"] = r.message;
    if (r.ok()) json["wall_seconds"] = r.wall_seconds, json["drift"] = r.statistics.max_position_violation;
    json["errors"] = errors_json(quantities, r.errors);
    return json;
  };
  Json json{{"integrator", study.integrator.type},
            {"rtol", study.integrator.rtol},
            {"atol", study.integrator.atol},
            {"xi", study.formulation.xi},
            {"omega", study.formulation.omega},
            {"augmented_lagrangian", run_json(0)},
            {"rows", Json::array()}};
  for (const PenaltyStudyRow& row : study.rows) {
    json["rows"].push_back({{"alpha", row.alpha},
                            {"acceleration",
                             {{"model_error", row.model_error},
                              {"rounding", row.rounding_error},
                              {"augmented_lagrangian", row.augmented_error}}},
                            {"quasidefinite", run_json(row.quasidefinite)},
                            {"cholesky", run_json(row.cholesky)},
                            {"rounding", errors_json(quantities, row.rounding)}});
  }
  return json;
}

}  // namespace

void add_penalty_study(Run& run, const PenaltyStudy& study) {
  print_penalty(run, study);
  run.result["penalty"] = penalty_json(study);
}

}  // namespace mbsopt::inline app
