#include <fmt/format.h>

#include <cmath>

#include "app/results/tradeoff_results.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

std::string error_cell(const PenaltyRun& run, Eigen::Index q) {
  return run.ok ? fmt::format("{:.0e}", run.errors(q)) : "-";
}

void print_penalty(Run& run, const PenaltyStudy& study, const std::vector<std::size_t>& shown) {
  const std::vector<Quantity>& quantities = study.reference.errors->quantities();
  const FormulationSettings& f = study.formulation;
  run.context.out << fmt::format(
      "\npenalty with xi {:g}, omega {:g}, {}; {} at rtol {:g}, atol {:g}. Accelerations: relative errors at {} "
      "states\n",
      f.xi, f.omega, f.projection == Projection::none ? "not projected" : "projected", study.integrator, study.rtol,
      study.atol, study.reference.errors->exact().motion.times.size());
  std::vector<std::string> header{"alpha", "model error", "rounding, cholesky", "augmented Lagrangian"};
  TextTable accelerations(header);
  for (const PenaltyStudyRow& row : study.rows) {
    accelerations.add({fmt::format("{:.0e}", row.alpha), significant(row.model_error, 2),
                       significant(row.rounding_error, 2), significant(row.augmented_error, 2)});
  }
  run.context.out << '\n' << accelerations.text() << "\nq: quasi-definite, c: cholesky\n";
  header = {"alpha"};
  for (const std::size_t q : shown) header.insert(header.end(), {quantities[q].name + " q", "c"});
  header.insert(header.end(), {"drift q", "c", "right-hand sides q", "c", "time q", "c"});
  TextTable runs(header);
  for (const PenaltyStudyRow& row : study.rows) {
    std::vector<std::string> cells{fmt::format("{:.0e}", row.alpha)};
    const PenaltyRun &a = row.quasidefinite, &b = row.cholesky;
    for (const std::size_t q : shown) {
      cells.push_back(error_cell(a, static_cast<Eigen::Index>(q)));
      cells.push_back(error_cell(b, static_cast<Eigen::Index>(q)));
    }
    for (const PenaltyRun* r : {&a, &b})
      cells.push_back(r->ok ? fmt::format("{:.0e}", r->statistics.max_position_violation) : "-");
    for (const PenaltyRun* r : {&a, &b}) cells.push_back(std::to_string(r->statistics.rhs_evaluations));
    for (const PenaltyRun* r : {&a, &b}) cells.push_back(r->ok ? duration_text(r->wall_seconds) : "-");
    runs.add(cells);
  }
  run.context.out << runs.text();
  for (const PenaltyStudyRow& row : study.rows) {
    if (!row.quasidefinite.ok)
      run.warn(fmt::format("alpha {:.0e}, quasi-definite: {}", row.alpha, row.quasidefinite.message));
    if (!row.cholesky.ok) run.warn(fmt::format("alpha {:.0e}, cholesky: {}", row.alpha, row.cholesky.message));
  }
  const PenaltyRun& c = study.constrained;
  if (c.ok)
    run.context.out << fmt::format("augmented Lagrangian with the same integrator: {}, {}, drift {:.0e}\n",
                                   counted(c.statistics.rhs_evaluations, "right-hand side"),
                                   duration_text(c.wall_seconds), c.statistics.max_position_violation);
}

Json penalty_json(const PenaltyStudy& study) {
  const std::vector<Quantity>& quantities = study.reference.errors->quantities();
  const auto run_json = [&](const PenaltyRun& r) {
    Json json{{"status", r.ok ? "ok" : "failed"}, {"rhs_evaluations", r.statistics.rhs_evaluations}};
    if (!r.ok) json["message"] = r.message;
    if (r.ok) json["wall_seconds"] = r.wall_seconds, json["drift"] = r.statistics.max_position_violation;
    json["errors"] = errors_json(quantities, r.errors);
    return json;
  };
  Json json{{"integrator", study.integrator},
            {"rtol", study.rtol},
            {"atol", study.atol},
            {"xi", study.formulation.xi},
            {"omega", study.formulation.omega},
            {"augmented_lagrangian", run_json(study.constrained)}};
  json["rows"] = Json::array();
  for (const PenaltyStudyRow& row : study.rows) {
    json["rows"].push_back({{"alpha", row.alpha},
                            {"acceleration",
                             {{"model_error", number_or_null(row.model_error)},
                              {"rounding", number_or_null(row.rounding_error)},
                              {"augmented_lagrangian", number_or_null(row.augmented_error)}}},
                            {"quasidefinite", run_json(row.quasidefinite)},
                            {"cholesky", run_json(row.cholesky)},
                            {"rounding", errors_json(quantities, row.rounding)}});
  }
  return json;
}

}  // namespace

void add_penalty_study(Run& run, const PenaltyStudy& study) {
  print_penalty(run, study, main_quantities(study.reference.errors->quantities()));
  run.result["penalty"] = penalty_json(study);
}

}  // namespace mbsopt
