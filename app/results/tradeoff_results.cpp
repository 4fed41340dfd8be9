#include "app/results/tradeoff_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"
#include "core/simulate/simulation_warnings.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kAdvisedAccuracies[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};

Json row_json(const Tradeoff& tradeoff, const TradeoffRow& row) {
  Json json{{"setting", in_words(row.setting)}, {"status", to_string(row.status)}};
  if (!row.ok()) json["message"] = row.message;
  if (row.ok()) json["wall_seconds"] = row.wall_seconds;
  json["errors"] = errors_json(tradeoff.quantities(), row.errors);
  return json;
}

// Figures of a row, and for a gradient those of its simulation.
Eigen::VectorXd figures_of(const Tradeoff& tradeoff, std::size_t row, Eigen::VectorXd TradeoffRow::*figures) {
  Eigen::VectorXd all = tradeoff.rows[row].*figures;
  Eigen::Index q = 0;
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
    add(errors(static_cast<Eigen::Index>(q)), tradeoff.quantities()[q].certificate, tradeoff.quantities()[q].name);
  if (advice.fit) {
    add(advice.fit->cost, fit->certificate().cost, "the sum of squares");
    add(advice.fit->gradient, fit->certificate().gradient, "its gradient");
  }
  return fmt::format("{}{}", parts.size() == 1 ? "error " : "errors: ", fmt::join(parts, ", "));
}

// An advice in words and figures: "for 1e-04 in track: dopri5 at rtol 1e-05, 12 ms (error 3.1e-05)", or why there is
// none. fit is null if nothing is fitted.
Json advice_json(const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit) {
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

void add_right_values(Run& run, const Answer& exact) {
  const std::vector<Parameter>& parameters = run.problem.scene.parameters;
  Eigen::Index row = 0;
  for (const ObjectiveSpec& o : run.problem.objectives) {
    Json& objective = run.result["objectives"][o.name];
    objective["value"] = exact.psi(row);
    for (std::size_t k = 0; k < parameters.size() && exact.psi_rho.size() > 0; ++k)
      objective["gradient"][parameters[k].name] = exact.psi_rho(row, static_cast<Eigen::Index>(k));
    ++row;
  }
}

}  // namespace

std::string error_text(double error, double certificate) {
  if (!std::isfinite(error)) return "-";
  return error < certificate ? fmt::format("< {:.1e}", certificate) : fmt::format("{:.1e}", error);
}

std::string duration_text(double seconds) {
  return seconds < 1 ? fmt::format("{:.3g} ms", 1e3 * seconds) : fmt::format("{:.3g} s", seconds);
}

Json errors_json(const std::vector<Quantity>& quantities, const Eigen::VectorXd& errors) {
  Json json = Json::object();
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const double error = errors(static_cast<Eigen::Index>(q));
    if (std::isfinite(error)) json[quantities[q].name] = error;
  }
  return json;
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
    const bool objective = q.kind == QuantityKind::objective;
    const std::string words = objective ? significant(errors.exact().psi(q.objective), 14)
                              : q.kind == QuantityKind::motion && q.relative
                                  ? fmt::format("{:.3g} m from its start", q.scale)
                                  : "";
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
  for (const ObjectiveSpec& o : run.problem.objectives) {
    if (std::ranges::count(errors.quantities(), o.name, &Quantity::objective_name) > 0) continue;
    json["without_integration"].push_back(o.name);
    others.push_back("'" + o.name + "'");
  }
  if (!others.empty())
    run.context.out << fmt::format("not measured, since they do not depend on the integration: {}\n",
                                   fmt::join(others, ", "));
  add_right_values(run, errors.exact());
}

void add_given_settings(Run& run, const Tradeoff& tradeoff) {
  std::vector<std::string> header{"setting", "time"};
  for (const Quantity& q : tradeoff.quantities()) header.push_back(q.name);
  TextTable table(header);
  const auto add = [&](std::optional<std::size_t> index, Json& json, bool shown) {
    if (!index) return;
    const TradeoffRow& row = tradeoff.rows[*index];
    json.update(row_json(tradeoff, row));
    if (!shown) return;
    std::vector<std::string> cells{in_words(row.setting), row.ok() ? duration_text(row.wall_seconds) : "-"};
    Eigen::Index column = 0;
    for (const Quantity& q : tradeoff.quantities()) cells.push_back(error_text(row.errors(column++), q.certificate));
    table.add(cells);
    if (!row.ok()) run.warn(fmt::format("{}: {}", cells[0], row.message));
  };
  const bool is_default = tradeoff.own == tradeoff.defaults;
  const auto add_both = [&](const char* name, std::optional<std::size_t> simulation,
                            std::optional<std::size_t> gradient, bool shown) {
    if (simulation) add(simulation, run.result["settings"][name], shown);
    if (gradient) add(gradient, run.result["settings"][name]["gradient"], shown);
  };
  add_both("own", tradeoff.own, tradeoff.own_gradient, true);
  add_both("defaults", tradeoff.defaults, tradeoff.default_gradient, !is_default);
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

void add_recommendations(Run& run, const Tradeoff& tradeoff) {
  for (std::size_t q = 0; q < tradeoff.quantities().size(); ++q) {
    run.context.out << '\n';
    for (const double accuracy : kAdvisedAccuracies) {
      Json& json = run.result["recommendations"].emplace_back(
          advice_json(tradeoff, recommend(tradeoff, {q}, accuracy), nullptr));
      json["quantity"] = tradeoff.quantities()[q].name;
      run.context.out << json["in_words"].get<std::string>() << '\n';
    }
  }
}

void add_task_recommendations(Run& run, const Tradeoff& tradeoff, TaskAdviser& adviser) {
  run.context.out << '\n';
  for (const double accuracy : kAdvisedAccuracies) {
    const Json& json =
        run.result["task_recommendations"].emplace_back(advice_json(tradeoff, adviser.at(accuracy), adviser.fit()));
    run.context.out << json["in_words"].get<std::string>() << '\n';
  }
}

void add_outcomes(Run& run, const Tradeoff& tradeoff) {
  const auto count = [&](RowStatus status) { return std::ranges::count(tradeoff.rows, status, &TradeoffRow::status); };
  for (const TradeoffRow& row : tradeoff.rows)
    if (!row.ok())
      run.result["skipped"].push_back(
          {{"setting", in_words(row.setting)}, {"status", to_string(row.status)}, {"message", row.message}});
  const auto measured = count(RowStatus::ok);
  const bool all = measured == std::ssize(tradeoff.rows);
  run.context.out << fmt::format("\n{} measured, {} failed, {} abandoned, {} skipped{}; {}\n",
                                 counted(measured, "setting"), count(RowStatus::failed), count(RowStatus::abandoned),
                                 count(RowStatus::skipped), all ? "" : " (tradeoff.csv says why)",
                                 duration_text(tradeoff.wall_seconds));
}

void add_applied(Run& run, const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit) {
  const Json& json = run.result["applied"] = advice_json(tradeoff, advice, fit);
  const std::string words = json["in_words"];
  if (!advice.row) return run.failed("no recommended.json: " + words);
  run.context.out << "\napplied " << words << '\n';
}

}  // namespace mbsopt::inline app
