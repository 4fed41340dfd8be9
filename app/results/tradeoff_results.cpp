#include "app/results/tradeoff_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "app/results/objective_units.hpp"
#include "app/results/trajectory_csv.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"
#include "core/scene/vocabulary.hpp"
#include "core/simulate/simulation_warnings.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Index;

constexpr double kAdvisedAccuracies[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};

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

std::string csv_of(const std::vector<Json>& rows) {
  std::string text;
  for (const Json& row : rows) {
    std::vector<std::string> columns, cells;
    for (const auto& [column, value] : row.items())
      columns.push_back(csv_cell(column)), cells.push_back(csv_text(value));
    if (text.empty()) text = fmt::format("{}\n", fmt::join(columns, ","));
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

// Adds the columns of a row that have a value.
void add_columns(Json& json, const Tradeoff& tradeoff, const TradeoffRow& row,
                 std::initializer_list<const char*> names) {
  const Json columns = columns_of(row, tradeoff.quantities());
  for (const char* name : names)
    if (const Json& value = columns.at(name); !value.is_null() && value != "") json[name] = value;
}

Json row_json(const Tradeoff& tradeoff, const TradeoffRow& row) {
  Json json{{"setting", in_words(row.setting)}};
  add_columns(json, tradeoff, row, {"status", "message", "wall_seconds"});
  json["errors"] = errors_json(tradeoff.quantities(), row.errors);
  return json;
}

// Figures of a row, and for a gradient those of its simulation.
Eigen::VectorXd figures_of(const Tradeoff& tradeoff, std::size_t row, Eigen::VectorXd TradeoffRow::*figures) {
  Eigen::VectorXd all = tradeoff.rows[row].*figures;
  Index q = 0;
  for (const Quantity& quantity : tradeoff.quantities()) {
    const std::optional<std::size_t> with = row_with(tradeoff, row, quantity.kind);
    if (with) all(q) = (tradeoff.rows[*with].*figures)(q);
    ++q;
  }
  return all;
}

// "error 3.1e-05", of several "errors: 7.5e-08 in path, 2.9e-06 in gradient of path"
std::string errors_text(const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit) {
  const Eigen::VectorXd errors = figures_of(tradeoff, *advice.row, &TradeoffRow::errors);
  std::vector<std::string> parts;
  const auto add = [&](double error, double certificate, const std::string& name) {
    const bool alone = advice.quantities.size() == 1 && !advice.fit;
    parts.push_back(error_text(error, certificate) + (alone ? "" : " in " + name));
  };
  for (const std::size_t q : advice.quantities)
    add(errors(static_cast<Index>(q)), tradeoff.quantities()[q].certificate, tradeoff.quantities()[q].name);
  if (advice.fit) {
    add(advice.fit->cost, fit->certificate().cost, "the sum of squares");
    add(advice.fit->gradient, fit->certificate().gradient, "its gradient");
  }
  return fmt::format("{}{}", parts.size() == 1 ? "error " : "errors: ", fmt::join(parts, ", "));
}

// An advice in words and figures: "for 1e-04 in track: dopri5 at rtol 1e-05, 12 ms (error 3.1e-05)", or why there is
// none. fit is null if nothing is fitted.
Json advice_json(const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit = nullptr) {
  std::vector<std::string> names;
  for (const std::size_t q : advice.quantities) names.push_back(tradeoff.quantities()[q].name);
  const std::string aim = fmt::format("{}{}", fmt::join(names, " and "),
                                      fit ? " and the sum of squares of identify with its gradient" : "");
  std::string setting = advice.why_not;
  if (advice.row) {
    const TradeoffRow& row = tradeoff.rows[*advice.row];
    setting = fmt::format("{}, {} ({})", in_words(row.setting), duration_text(row.wall_seconds),
                          errors_text(tradeoff, advice, fit));
  }
  Json json{{"accuracy", advice.accuracy},
            {"aim", aim},
            {"setting_in_words", setting},
            {"in_words", fmt::format("for {:.0e} in {}: {}", advice.accuracy, aim, setting)}};
  if (!advice.row) return json;
  json.update(row_json(tradeoff, tradeoff.rows[*advice.row]));
  for (const auto& [name, figures] : {std::pair{"errors", &TradeoffRow::errors}, {"bounds", &TradeoffRow::bounds}})
    json[name] = errors_json(tradeoff.quantities(), figures_of(tradeoff, *advice.row, figures));
  if (advice.fit) json["fit"] = {{"error", advice.fit->cost}, {"gradient_error", advice.fit->gradient}};
  return json;
}

// Says what may make a reference uncertain.
std::string doubt(const Quantity& q, const std::vector<ObjectiveSpec>& objectives) {
  const std::string any = "a chaotic motion, or a law that is not smooth?";
  const auto spec = std::ranges::find(objectives, q.objective_name, &ObjectiveSpec::name);
  if (spec == objectives.end() || !spec->is_extreme()) return any;
  return fmt::format(
      "too much `sharpness`, {:g} now: give it some tens to hundreds, divided by the range of its values? "
      "Or {}",
      spec->sharpness.value_or(ObjectiveSpec::kSharpness), any);
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

Json columns_of(const PenaltyStudyRow& r, const PenaltyStudy& study) {
  const std::vector<Quantity>& quantities = study.table.quantities();
  Json row{{"alpha", r.alpha}};
  for (const AccelerationError& e : kAccelerationErrors) row[fmt::format("acceleration {}", e.column)] = r.*e.value;
  for (const PenaltyRun& solver : kPenaltyRuns) {
    const TradeoffRow& run = study.table.rows[r.*solver.row];
    const std::string prefix = std::string(solver.column) + " ";
    const Json columns = columns_of(run, quantities);
    row[prefix + "status"] = run.ok() ? "ok" : "failed";
    for (const char* column : {"wall_seconds", "steps", "rhs_evaluations", "factorisations"})
      row[prefix + column] = columns.at(column);
    row[prefix + "drift"] = columns.at("position_violation");
    add_errors(row, prefix + "error ", quantities, run.errors);
    row[prefix + "message"] = run.message;
  }
  add_errors(row, "rounding ", quantities, r.rounding);
  return row;
}

std::string to_csv(const Tradeoff& tradeoff) {
  std::vector<Json> rows;
  for (const TradeoffRow& row : tradeoff.rows) rows.push_back(columns_of(row, tradeoff.quantities()));
  return csv_of(rows);
}

std::string to_csv(const PenaltyStudy& study) {
  std::vector<Json> rows;
  for (const PenaltyStudyRow& row : study.rows) rows.push_back(columns_of(row, study));
  return csv_of(rows);
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

void add_reference(Run& run, const TradeoffReference& reference) {
  const TradeoffErrors& errors = *reference.errors;
  const auto method = [](const ReferenceMethod& m) {
    return Json{{"integrator", m.integrator},
                m.step ? Json{"step", *m.step} : Json{"rtol", m.rtol},
                {"wall_seconds", m.wall_seconds}};
  };
  Json& json = run.result["reference"];
  json = {{"first", method(reference.first)}, {"second", method(reference.second)}};
  if (!reference.gradients_by.empty()) json["gradients_by"] = reference.gradients_by;
  TextTable table({"quantity", "reference", "two methods apart"});
  for (const Quantity& q : errors.quantities()) {
    json["quantities"][q.name] = {{"apart", q.certificate}, {"relative", q.relative}, {"scale", q.scale}};
    std::string words;
    if (q.kind == QuantityKind::objective) words = significant(errors.exact().psi(q.objective), 14);
    if (q.kind == QuantityKind::motion && q.relative) words = fmt::format("{:.3g} m from its start", q.scale);
    table.add({q.name, words, fmt::format("{:.1e}{}", q.certificate, q.relative ? "" : " (absolute)")});
    if (q.is_doubtful())
      run.warn(fmt::format("the reference of {} is known to {:.1e} only: smaller errors cannot be measured ({})",
                           q.name, q.certificate, doubt(q, run.problem.objectives)));
  }
  run.context.out << fmt::format("reference: {}, certified by {}; {}\n", in_words(reference.first),
                                 in_words(reference.second), duration_text(reference.wall_seconds))
                  << '\n'
                  << table.text();
  if (!errors.moves())
    run.warn(
        fmt::format("nothing moves: the mechanism stays within {:.1e} m of its start, so all settings are equally "
                    "exact. Start it off its equilibrium to compare settings",
                    errors.extent()));
  std::vector<std::string> others;
  Index row = 0;
  for (const ObjectiveSpec& o : run.problem.objectives) {
    Json& objective = run.result["objectives"][o.name];
    objective["value"] = errors.exact().psi(row);
    if (errors.exact().psi_rho.size() > 0 && !run.problem.scene.parameters.empty())
      objective["gradient"] = by_name(names_of(run.problem.scene.parameters), errors.exact().psi_rho.row(row));
    ++row;
    if (std::ranges::count(errors.quantities(), o.name, &Quantity::objective_name) > 0) continue;
    json["without_integration"].push_back(o.name);
    others.push_back("'" + o.name + "'");
  }
  if (!others.empty())
    run.context.out << fmt::format("not measured, since they do not depend on the integration: {}\n",
                                   fmt::join(others, ", "));
}

void add_given_settings(Run& run, const Tradeoff& tradeoff) {
  std::vector<std::string> header{"setting", "time"};
  for (const Quantity& q : tradeoff.quantities()) header.push_back(q.name);
  TextTable table(header);
  const bool is_default = tradeoff.own == tradeoff.defaults;
  const auto add = [&](const char* name, bool gradient, std::optional<std::size_t> index, bool shown) {
    if (!index) return;
    const TradeoffRow& row = tradeoff.rows[*index];
    Json& json = run.result["settings"][name];
    (gradient ? json["gradient"] : json).update(row_json(tradeoff, row));
    if (!shown) return;
    std::vector<std::string> cells{in_words(row.setting), row.ok() ? duration_text(row.wall_seconds) : "-"};
    Index column = 0;
    for (const Quantity& q : tradeoff.quantities()) cells.push_back(error_text(row.errors(column++), q.certificate));
    table.add(cells);
    if (!row.ok()) run.warn(fmt::format("{}: {}", cells[0], row.message));
  };
  add("own", false, tradeoff.own, true);
  add("own", true, tradeoff.own_gradient, true);
  add("defaults", false, tradeoff.defaults, !is_default);
  add("defaults", true, tradeoff.default_gradient, !is_default);
  run.context.out << "\nerrors\n" << table.text();
  if (is_default && tradeoff.own) run.context.out << "the file's settings are the defaults\n";
  if (!tradeoff.own || !tradeoff.rows[*tradeoff.own].ok()) return;
  for (const std::string& warning :
       simulation_warnings(run.problem.scene, run.problem.scene.simulation, tradeoff.rows[*tradeoff.own].statistics))
    run.warn("as in the file: " + warning);
}

void add_fit_errors(Run& run, const FitErrors& fit) {
  Json& json = run.result["fit"];
  const FitErrors::Error& apart = fit.certificate();
  if (!fit.ok()) {
    json = {{"message", apart.message}};
    return run.warn("the error of what identify minimises is not known: " + apart.message);
  }
  json = {{"cost", fit.cost()}, {"apart", apart.cost}, {"gradient", {{"apart", apart.gradient}}}, {"relative", true}};
  TextTable table({"sum of squares of identify", "its error", "of its gradient"});
  table.add({"two methods apart", error_text(apart.cost), error_text(apart.gradient)});
  const SimulationSettings& own = run.problem.scene.simulation;
  for (const auto& [name, settings] : {std::pair{"own", own}, {"defaults", with_defaults(own)}}) {
    const FitErrors::Error error = fit.at(settings);
    if (!error.ok()) {
      json["settings"][name] = {{"message", error.message}};
      run.warn(fmt::format("identify, {}: {}", name, error.message));
      continue;
    }
    json["settings"][name] = {{"error", error.cost}, {"gradient_error", error.gradient}};
    table.add({name, error_text(error.cost, apart.cost), error_text(error.gradient, apart.gradient)});
  }
  run.context.out << '\n' << table.text();
}

void add_recommendations(Run& run, const Tradeoff& tradeoff, TaskAdviser* adviser) {
  const auto add = [&](const char* list, const Json& advice) {
    run.context.out << run.result[list].emplace_back(advice)["in_words"].get<std::string>() << '\n';
  };
  for (std::size_t q = 0; q < tradeoff.quantities().size(); ++q) {
    run.context.out << '\n';
    for (const double accuracy : kAdvisedAccuracies) {
      Json advice = advice_json(tradeoff, recommend(tradeoff, {q}, accuracy));
      advice["quantity"] = tradeoff.quantities()[q].name;
      add("recommendations", advice);
    }
  }
  if (!adviser) return;
  run.context.out << '\n';
  for (const double accuracy : kAdvisedAccuracies)
    add("task_recommendations", advice_json(tradeoff, adviser->at(accuracy), adviser->fit()));
}

void add_outcomes(Run& run, const Tradeoff& tradeoff) {
  std::size_t count[4] = {};  // by status
  for (const TradeoffRow& row : tradeoff.rows) {
    ++count[static_cast<std::size_t>(row.status)];
    if (!row.ok())
      run.result["skipped"].push_back(
          {{"setting", in_words(row.setting)}, {"status", to_string(row.status)}, {"message", row.message}});
  }
  run.context.out << fmt::format("\n{} measured, {} failed, {} abandoned, {} skipped{}; {}\n",
                                 counted(count[0], "setting"), count[1], count[2], count[3],
                                 count[0] == tradeoff.rows.size() ? "" : " (tradeoff.csv says why)",
                                 duration_text(tradeoff.wall_seconds));
}

void add_applied(Run& run, const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit) {
  const Json& json = run.result["applied"] = advice_json(tradeoff, advice, fit);
  const std::string words = json["in_words"];
  if (!advice.row) return run.failed("no recommended.json: " + words);
  run.context.out << "\napplied " << words << '\n';
}

void add_penalty_study(Run& run, const PenaltyStudy& study) {
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
    std::vector<std::string> cells{alpha};
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
      for (const std::size_t q : shown) cells.push_back(error_text(r.errors(static_cast<Index>(q))));
      runs.add(cells);
      if (!r.ok()) run.warn(fmt::format("alpha {}, {}: {}", alpha, solver.words, r.message));
    }
    entry["rounding"] = errors_json(quantities, row.rounding);
    json["rows"].push_back(entry);
  }
  run.context.out << fmt::format(
      "\npenalty with xi {:g}, omega {:g}, {}; {} at rtol {:g}, atol {:g}. Accelerations: relative errors at {} "
      "states\n\n{}\n{}",
      f.xi, f.omega, f.projection == Projection::none ? "not projected" : "projected", i.type, i.rtol, i.atol,
      table.reference.errors->exact().motion.times.size(), accelerations.text(), runs.text());
  if (constrained_run.ok())
    run.context.out << fmt::format("augmented Lagrangian with the same integrator: {}, {}, drift {:.0e}\n",
                                   counted(constrained_run.statistics.rhs_evaluations, "right-hand side"),
                                   duration_text(constrained_run.wall_seconds),
                                   constrained_run.statistics.max_position_violation);
}

}  // namespace mbsopt::inline app
