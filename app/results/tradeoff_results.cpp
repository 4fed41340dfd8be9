#include "app/results/tradeoff_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"
#include "core/simulate/simulation_warnings.hpp"

namespace mbsopt {
namespace {

Json row_json(const Tradeoff& tradeoff, std::size_t index) {
  const TradeoffRow& row = tradeoff.rows[index];
  Json json{{"setting", in_words(row.setting)}, {"status", to_string(row.status)}};
  if (row.status != RowStatus::ok) json["message"] = row.message;
  if (row.status == RowStatus::ok) json["wall_seconds"] = row.wall_seconds;
  json["errors"] = errors_json(tradeoff.reference.errors->quantities(), row.errors);
  return json;
}

// Includes the bounds of the choice, and for a gradient those of its simulation.
Json recommended_json(const Tradeoff& tradeoff, std::size_t index) {
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  Json json = row_json(tradeoff, index);
  json["bounds"] = errors_json(quantities, tradeoff.rows[index].bounds);
  const std::optional<std::size_t> simulation = simulation_of(tradeoff, index);
  if (simulation && simulation != index) {
    json["errors"].update(errors_json(quantities, tradeoff.rows[*simulation].errors));
    json["bounds"].update(errors_json(quantities, tradeoff.rows[*simulation].bounds));
  }
  return json;
}

std::string names_of(const std::vector<Quantity>& quantities, const std::vector<std::size_t>& indices) {
  std::string names;
  for (const std::size_t q : indices) names += (names.empty() ? "" : " and ") + quantities[q].name;
  return names;
}

// "error 3.1e-05", of several "errors: 7.5e-08 in path, 2.9e-06 in gradient of path"
std::string errors_text(const Tradeoff& tradeoff, const TaskAdvice& advice) {
  const Recommendation& r = advice.recommendation;
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  const std::size_t simulation = simulation_of(tradeoff, *r.row).value_or(*r.row);
  const auto error = [&](std::size_t q) {
    const bool of_gradient = quantities[q].kind == QuantityKind::gradient;
    return error_text(tradeoff.rows[of_gradient ? *r.row : simulation].errors(static_cast<Eigen::Index>(q)),
                      quantities[q].certificate);
  };
  if (r.quantities.size() == 1 && !advice.fit) return "error " + error(r.quantities[0]);
  std::string text = "errors: ";
  for (const std::size_t q : r.quantities)
    text += fmt::format("{}{} in {}", text.ends_with(": ") ? "" : ", ", error(q), quantities[q].name);
  if (advice.fit)
    text += fmt::format(", {} in the sum of squares, {} in its gradient",
                        error_text(advice.fit->cost, advice.fit_certificate.cost),
                        error_text(advice.fit->gradient, advice.fit_certificate.gradient));
  return text;
}

// The words of a recommendation: its purpose and its setting.
struct RecommendationWords {
  double accuracy;
  std::string aim, setting;  // "track"; "dopri5 at rtol 1e-05, 12 ms (error 3.1e-05)", or why there is none

  std::string sentence() const { return fmt::format("for {:.0e} in {}: {}", accuracy, aim, setting); }
  Json json() const {
    return {{"accuracy", accuracy}, {"aim", aim}, {"setting_in_words", setting}, {"in_words", sentence()}};
  }
};

RecommendationWords words_of(const Tradeoff& tradeoff, const TaskAdvice& advice, bool of_fit = false) {
  const Recommendation& r = advice.recommendation;
  RecommendationWords words{r.accuracy, names_of(tradeoff.reference.errors->quantities(), r.quantities), r.why_not};
  if (of_fit) words.aim += " and the sum of squares of identify with its gradient";
  if (!r.row) return words;
  const TradeoffRow& row = tradeoff.rows[*r.row];
  words.setting =
      fmt::format("{}, {} ({})", in_words(row.setting), duration_text(row.wall_seconds), errors_text(tradeoff, advice));
  return words;
}

constexpr std::array kAdvisedAccuracies{1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};

Json task_json(const Tradeoff& tradeoff, const TaskAdvice& advice, const RecommendationWords& words) {
  Json json = words.json();
  if (advice.recommendation.row) json.update(recommended_json(tradeoff, *advice.recommendation.row));
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
  }
  const std::vector<Parameter>& parameters = run.problem.scene.parameters;
  for (std::size_t i = 0; i < run.problem.objectives.size(); ++i) {
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    Json& objective = run.result["objectives"][run.problem.objectives[i].name];
    objective["value"] = errors.exact().psi(row);
    for (std::size_t k = 0; k < parameters.size() && errors.exact().psi_rho.size() > 0; ++k)
      objective["gradient"][parameters[k].name] = errors.exact().psi_rho(row, static_cast<Eigen::Index>(k));
  }
  run.context.out << fmt::format("reference: {}, certified by {}; {}\n", in_words(reference.first),
                                 in_words(reference.second), duration_text(reference.wall_seconds))
                  << '\n'
                  << table.text();
  for (const Quantity& q : errors.quantities()) {
    if (!q.is_doubtful()) continue;
    run.warn(fmt::format("the reference of {} is known to {:.1e} only: smaller errors cannot be measured ({})", q.name,
                         q.certificate, doubt(q, run.problem.objectives)));
  }
  if (!errors.moves())
    run.warn(
        fmt::format("nothing moves: the mechanism stays within {:.1e} m of its start, so all settings are equally "
                    "exact. Start it off its equilibrium to compare settings",
                    errors.extent()));
  std::string others;
  for (const ObjectiveSpec& o : run.problem.objectives) {
    const auto same = [&](const Quantity& q) { return q.objective_name == o.name; };
    if (std::ranges::any_of(errors.quantities(), same)) continue;
    run.result["reference"]["without_integration"].push_back(o.name);
    others += (others.empty() ? "'" : ", '") + o.name + "'";
  }
  if (!others.empty())
    run.context.out << fmt::format("not measured, since they do not depend on the integration: {}\n", others);
}

void add_given_settings(Run& run, const Tradeoff& tradeoff) {
  std::vector<std::string> header{"setting", "time"};
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  for (const Quantity& q : quantities) header.push_back(q.name);
  TextTable table(header);
  const bool is_default = tradeoff.own == tradeoff.defaults;
  const auto add = [&](const char* name, const std::optional<std::size_t>& simulation,
                       const std::optional<std::size_t>& gradient, bool shown) {
    for (const std::optional<std::size_t>& i : {simulation, gradient}) {
      if (!i || !shown) continue;
      const TradeoffRow& row = tradeoff.rows[*i];
      std::vector<std::string> cells{in_words(row.setting),
                                     row.status == RowStatus::ok ? duration_text(row.wall_seconds) : "-"};
      for (std::size_t q = 0; q < quantities.size(); ++q)
        cells.push_back(error_text(row.errors(static_cast<Eigen::Index>(q)), quantities[q].certificate));
      table.add(cells);
      if (row.status != RowStatus::ok) run.warn(fmt::format("{}: {}", cells[0], row.message));
    }
    if (simulation) run.result["settings"][name] = row_json(tradeoff, *simulation);
    if (gradient) run.result["settings"][name]["gradient"] = row_json(tradeoff, *gradient);
  };
  add("own", tradeoff.own, tradeoff.own_gradient, true);
  add("defaults", tradeoff.defaults, tradeoff.default_gradient, !is_default);
  run.context.out << "\nerrors\n" << table.text();
  if (is_default && tradeoff.own) run.context.out << "the file's settings are the defaults\n";
  if (!tradeoff.own || tradeoff.rows[*tradeoff.own].status != RowStatus::ok) return;
  for (const std::string& warning : simulation_warnings(run.problem.scene, tradeoff.rows[*tradeoff.own].statistics))
    run.warn("as in the file: " + warning);
}

void add_fit_errors(Run& run, const FitErrors& errors) {
  Json& json = run.result["fit"];
  if (!errors.ok()) {
    json = {{"message", errors.message}};
    return run.warn("the error of what identify minimises is not known: " + errors.message);
  }
  json = {{"cost", errors.cost},
          {"apart", errors.certificate.cost},
          {"gradient", {{"apart", errors.certificate.gradient}}},
          {"relative", true}};
  TextTable table({"sum of squares of identify", "its error", "of its gradient"});
  table.add({"two methods apart", error_text(errors.certificate.cost), error_text(errors.certificate.gradient)});
  for (const FitErrors::Setting& s : errors.settings) {
    if (!s.message.empty()) {
      json["settings"][s.name] = {{"message", s.message}};
      run.warn(fmt::format("identify, {}: {}", s.name, s.message));
      continue;
    }
    json["settings"][s.name] = {{"error", s.error.cost}, {"gradient_error", s.error.gradient}};
    table.add({s.name, error_text(s.error.cost, errors.certificate.cost),
               error_text(s.error.gradient, errors.certificate.gradient)});
  }
  run.context.out << '\n' << table.text();
}

void add_recommendations(Run& run, const Tradeoff& tradeoff) {
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    run.context.out << '\n';
    for (const double accuracy : kAdvisedAccuracies) {
      const Recommendation r = recommend(tradeoff, {q}, accuracy);
      const RecommendationWords words = words_of(tradeoff, {r, {}});
      Json json = words.json();
      json["quantity"] = quantities[q].name;
      if (r.row) json.update(recommended_json(tradeoff, *r.row));
      run.result["recommendations"].push_back(json);
      run.context.out << words.sentence() << '\n';
    }
  }
}

void add_task_recommendations(Run& run, const Tradeoff& tradeoff, TaskAdviser& adviser) {
  run.context.out << '\n';
  for (const double accuracy : kAdvisedAccuracies) {
    const TaskAdvice advice = adviser.at(accuracy);
    const RecommendationWords words = words_of(tradeoff, advice, run.problem.identification.has_value());
    run.result["task_recommendations"].push_back(task_json(tradeoff, advice, words));
    run.context.out << words.sentence() << '\n';
  }
}

void add_outcomes(Run& run, const Tradeoff& tradeoff) {
  const auto count = [&](RowStatus status) {
    return std::count_if(tradeoff.rows.begin(), tradeoff.rows.end(),
                         [&](const TradeoffRow& row) { return row.status == status; });
  };
  for (const TradeoffRow& row : tradeoff.rows)
    if (row.status != RowStatus::ok)
      run.result["skipped"].push_back(
          {{"setting", in_words(row.setting)}, {"status", to_string(row.status)}, {"message", row.message}});
  const auto measured = count(RowStatus::ok);
  const bool all = measured == static_cast<std::ptrdiff_t>(tradeoff.rows.size());
  run.context.out << fmt::format("\n{} measured, {} failed, {} abandoned, {} skipped{}; {}\n",
                                 counted(measured, "setting"), count(RowStatus::failed), count(RowStatus::abandoned),
                                 count(RowStatus::skipped), all ? "" : " (tradeoff.csv says why)",
                                 duration_text(tradeoff.wall_seconds));
}

void add_applied(Run& run, const Tradeoff& tradeoff, const TaskAdvice& advice) {
  const RecommendationWords words = words_of(tradeoff, advice, run.problem.identification.has_value());
  run.result["applied"] = task_json(tradeoff, advice, words);
  if (!advice.recommendation.row) return run.failed("no recommended.json: " + words.sentence());
  run.context.out << "\napplied " << words.sentence() << '\n';
}

}  // namespace mbsopt
