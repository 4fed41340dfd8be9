// Measures the trade between speed and accuracy, and writes it to result.json, the terminal and the page.
#include <fmt/format.h>

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/run_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/results/optimized_problem.hpp"
#include "app/results/tradeoff_results.hpp"
#include "app/run/command.hpp"
#include "app/run/provenance.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/fit/windows.hpp"
#include "optim/tradeoff/advice.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Index;

constexpr double kAdvisedAccuracies[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};

Json row_json(const Tradeoff& tradeoff, const TradeoffRow& row) {
  Json json{{"setting", in_words(row.setting)}, {"status", to_string(row.status)}};
  if (!row.message.empty()) json["message"] = row.message;
  if (row.ok()) json["wall_seconds"] = row.wall_seconds;
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
std::string cause_of_uncertainty(const Quantity& q, const std::vector<ObjectiveSpec>& objectives) {
  const std::string any = "a chaotic motion, or a law that is not smooth?";
  const auto spec = std::ranges::find(objectives, q.objective_name, &ObjectiveSpec::name);
  if (spec == objectives.end() || !spec->is_extreme()) return any;
  return fmt::format(
      "too much `sharpness`, {:g} now: give it some tens to hundreds, divided by the range of its values? "
      "Or {}",
      spec->sharpness.value_or(ObjectiveSpec::kSharpness), any);
}

// A plot shows the curves of a quantity for one group of methods.
constexpr std::string_view kExplicit = "explicit methods", kImplicit = "implicit and multistep methods",
                           kFormulation = "formulations", kGradient = "gradient methods";

std::string_view group_of(const TradeoffSetting& setting) {
  if (setting.gradient) return kGradient;
  if (setting.curve != setting.simulation.integrator.type) return kFormulation;
  return explicit_method(setting.curve) ? kExplicit : kImplicit;
}

constexpr std::size_t kInk = 7;  // the colour of the style that is grey

// The row of the file's own settings that holds a quantity, if it was measured.
std::optional<std::size_t> own_row(const Tradeoff& tradeoff, const Quantity& q) {
  const std::optional<std::size_t> own = q.kind == QuantityKind::gradient ? tradeoff.own_gradient : tradeoff.own;
  return own && tradeoff.rows[*own].ok() ? own : std::nullopt;
}

// Draws lines through bounds; points instead of a line of one setting.
LinePlot work_precision(const Tradeoff& tradeoff, const ObjectiveUnits& units, std::size_t quantity,
                        std::string_view group) {
  const std::vector<TradeoffRow>& rows = tradeoff.rows;
  const Quantity& q = tradeoff.quantities()[quantity];
  const std::string unit = q.relative                          ? "-"
                           : q.kind == QuantityKind::objective ? shown_unit(units, q.objective_name)
                                                               : kUnknownUnit;
  LinePlot plot{.title = fmt::format("{}: {}", q.name, group),
                .x_label = "time [s]",
                .y_label = fmt::format("{} error of {} [{}]", q.relative ? "relative" : "absolute", q.name, unit),
                .logarithmic_y = true,
                .logarithmic_x = true};
  const auto add = [&](PlotSeries& series, std::size_t row, double error) {
    series.x.push_back(rows[row].wall_seconds);
    series.y.push_back(error);
  };
  for (const WorkPrecisionCurve& curve : work_precision_curves(rows, tradeoff.quantities(), quantity)) {
    if (group_of(rows[curve.line.front()].setting) != group) continue;
    const std::vector<std::size_t> connected = slower_and_slower(rows, curve.line);
    PlotSeries& line =
        plot.series.emplace_back(PlotSeries{curve.name, {}, {}, connected.size() > 1 ? Mark::line : Mark::points});
    for (const std::size_t i : connected) add(line, i, rows[i].bound(quantity));
  }
  if (plot.series.empty()) return plot;
  PlotSeries front{"Pareto front", {}, {}, Mark::rings};
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (group_of(rows[i].setting) == group && rows[i].pareto[quantity] && better_than_zero(q, rows[i].bound(quantity)))
      add(front, i, rows[i].bound(quantity));
  if (!front.x.empty()) plot.series.push_back(std::move(front));
  if (const auto own = own_row(tradeoff, q))
    add(plot.series.emplace_back(PlotSeries{"as in the file", {}, {}, Mark::crosses, {}, kInk}), *own,
        rows[*own].error(quantity));
  return plot;
}

constexpr const char* kHowToRead =
    "Lines lead from loose to tight settings through bounds: the bound of a setting is the largest error of it and of "
    "all tighter settings of its curve, since an error that passes through zero is small by chance. Settings are left "
    "out if a tighter one needed no more right-hand sides or no more time. So is a relative bound of 1 or more, as the "
    "answer zero would have.";

// "The fastest setting for 1e-06 in track: dopri5 at rtol 1e-05, 12 ms (error 3e-07); as in the file: 1.2e-04 in 8 ms."
std::string sentence_of(const Json& result, const Tradeoff& tradeoff, std::size_t quantity) {
  constexpr double kWanted = 1e-6;  // accuracy that suits most tasks; else the tightest that some setting has
  const Quantity& q = tradeoff.quantities()[quantity];
  std::string words = fmt::format("{}: no setting was exact enough to be advised", q.name);
  for (const Json& r : result.value("recommendations", Json::array()))
    if (r.value("quantity", "") == q.name && r.contains("setting") && r.at("accuracy").get<double>() >= 0.99 * kWanted)
      words = "The fastest setting " + r.at("in_words").get<std::string>();
  if (const auto own = own_row(tradeoff, q))
    words +=
        fmt::format("; as in the file: error {} in {}", error_text(tradeoff.rows[*own].error(quantity), q.certificate),
                    duration_text(tradeoff.rows[*own].wall_seconds));
  return words + ".";
}

void add_plots(RunPage& page, const Tradeoff& tradeoff) {
  const ObjectiveUnits units = objective_units(page.run.problem);
  bool any = false;
  for (std::size_t q = 0; q < tradeoff.quantities().size(); ++q) {
    for (const std::string_view group : {kExplicit, kImplicit, kFormulation, kGradient}) {
      const LinePlot plot = work_precision(tradeoff, units, q, group);
      if (plot.series.empty()) continue;
      if (!std::exchange(any, true)) {
        page.heading("Error over time");
        page.begin_choices({"error of", "with"});
      }
      page.begin_choice({tradeoff.quantities()[q].name, std::string(group)});
      page.paragraph(sentence_of(page.run.result, tradeoff, q));
      page.plot(plot);
      page.end_choice();
    }
  }
  if (any) {
    page.end_choices();
    page.note(kHowToRead);
  }
}

void add_rows(RunPage& page, const Tradeoff& tradeoff) {
  if (tradeoff.rows.empty()) return;
  page.heading("All settings");
  std::vector<std::string> header{"setting", "time [ms]", "repetitions", "steps", "right-hand sides", "factorisations"};
  const std::vector<Quantity>& quantities = tradeoff.quantities();
  for (const Quantity& q : quantities) header.push_back(q.name);
  TextTable rows(header), without({"setting", "outcome", "why"});  // without: settings that have no result
  for (const TradeoffRow& r : tradeoff.rows) {
    const Json columns = columns_of(r, quantities);
    if (!r.ok()) {
      without.add({in_words(r.setting), cell(columns.at("status")), r.message});
      continue;
    }
    TableRow& row = rows.add({in_words(r.setting), fmt::format("{:.3g}", 1e3 * r.wall_seconds)});
    for (const char* count : {"repetitions", "steps", "rhs_evaluations", "factorisations"})
      row.push_back(cell(columns.at(count)));
    for (std::size_t q = 0; q < quantities.size(); ++q)
      row.push_back(error_text(r.error(q), quantities[q].certificate) + (r.pareto[q] ? " *" : ""));
  }
  page.table(rows);
  page.paragraph(
      "* on the Pareto front of time and bound: nothing measured is both faster and more exact. tradeoff.csv holds the "
      "bounds, too.");
  if (without.empty()) return;
  page.heading("Settings without a result");
  page.table(without);
}

// Adds the machine, the methods, their difference and the right values, with a warning if these are uncertain.
void show_reference(RunPage& page, const TradeoffReference& reference) {
  Run& run = page.run;
  const TradeoffErrors& errors = *reference.errors;
  page.remark("Times are medians, measured on " + machine_name(run.result.at("machine")) + ".");
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
    if (q.is_uncertain())
      run.warn(fmt::format("the reference of {} is known to {:.1e} only: smaller errors cannot be measured ({})",
                           q.name, q.certificate, cause_of_uncertainty(q, run.problem.objectives)));
  }
  page.heading("Reference");
  page.paragraph(
      fmt::format("{}, certified by {}: smaller errors than the difference of these two cannot be measured. "
                  "Errors are relative, except for those marked as absolute.",
                  in_words(reference.first), in_words(reference.second)));
  run.context.out << fmt::format("reference: {}, certified by {}; {}\n", in_words(reference.first),
                                 in_words(reference.second), duration_text(reference.wall_seconds));
  page.both(table);
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
    run.result["reference"]["without_integration"].push_back(o.name);
    others.push_back(o.name);
  }
  if (others.empty()) return;
  run.context.out << fmt::format("not measured, since they do not depend on the integration: '{}'\n",
                                 fmt::join(others, "', '"));
  page.paragraph(
      fmt::format("Not measured, since they do not depend on the integration: {}.", fmt::join(others, ", ")));
}

// Adds the scene's own settings and the defaults.
void show_given_settings(Run& run, const Tradeoff& tradeoff) {
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
    TableRow cells{in_words(row.setting), row.ok() ? duration_text(row.wall_seconds) : "-"};
    Index column = 0;
    for (const Quantity& q : tradeoff.quantities()) cells.push_back(error_text(row.errors(column++), q.certificate));
    table.add(cells);
    if (!row.ok()) run.warn(fmt::format("{}: {}", in_words(row.setting), row.message));
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

// Adds the errors in the sum of squares of identify, of the scene's own settings and of the defaults.
void show_fit_errors(Run& run, const FitErrors& fit) {
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

// Adds advice per quantity, and for the task of the file, a design or an identification, if it has one.
void show_recommendations(RunPage& page, const Tradeoff& tradeoff, TaskAdviser* adviser) {
  Run& run = page.run;
  TextTable table({"quantity", "accuracy", "fastest setting"});
  const auto add = [&](const char* list, const Json& advice) {
    run.result[list].push_back(advice);
    run.context.out << cell(advice.at("in_words")) << '\n';
    table.add({cell(advice.at("aim")), fmt::format("{:.0e}", advice.at("accuracy").get<double>()),
               cell(advice.at("setting_in_words"))});
  };
  for (std::size_t q = 0; q < tradeoff.quantities().size(); ++q) {
    run.context.out << '\n';
    for (const double accuracy : kAdvisedAccuracies) {
      Json advice = advice_json(tradeoff, recommend(tradeoff, {q}, accuracy));
      advice["quantity"] = tradeoff.quantities()[q].name;
      add("recommendations", advice);
    }
  }
  if (adviser) run.context.out << '\n';
  for (const double accuracy : kAdvisedAccuracies)
    if (adviser) add("task_recommendations", advice_json(tradeoff, adviser->at(accuracy), adviser->fit()));
  page.heading("What to use");
  page.table(table);
}

// Says how many settings were measured, and why the others were not.
void show_outcomes(Run& run, const Tradeoff& tradeoff) {
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

// Adds the choice of --apply. The run fails if there is nothing to choose.
void show_applied(RunPage& page, const Tradeoff& tradeoff, const Recommendation& advice, const FitErrors* fit) {
  const Json& json = page.run.result["applied"] = advice_json(tradeoff, advice, fit);
  const std::string words = json["in_words"];
  if (!advice.row) return page.run.failed("no recommended.json: " + words);
  page.run.context.out << "\napplied " << words << '\n';
  page.paragraph("Applied in recommended.json, " + words + ".");
}

// Work-precision plots, and all settings.
void add_work_precision(RunPage& page, const Tradeoff& tradeoff) {
  const Json recommendations = page.run.result.value("recommendations", Json::array());
  if (!tradeoff.reference.errors->moves())
    page.verdict("Nothing moves, so all settings are equally exact.");
  else if (!recommendations.empty())
    page.verdict(fmt::format("{} settings were measured; the fastest {}.",
                             std::ranges::count(tradeoff.rows, RowStatus::ok, &TradeoffRow::status),
                             cell(recommendations.front().at("in_words"))));
  add_plots(page, tradeoff);
  add_rows(page, tradeoff);
}

// Measures, and shows what was measured.
void sweep(Run& run) {
  constexpr double kFits = 0.2;  // of the budget, for the sums of squares at settings that may be advised
  const TradeoffOptions options{
      .budget_seconds = run.context.options.budget,
      .interrupted = [] { return interrupted(); },
      .progress = [&](const std::string& doing, double done) { run.progress.fraction(doing, done); }};
  const Problem& problem = run.problem;
  Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), options);
  run.progress.finish();
  if (!tradeoff.ok())
    return tradeoff.interrupted ? run.stopped("there was no reference yet, nothing is kept")
                                : run.failed(tradeoff.message);
  RunPage page(run);
  show_reference(page, tradeoff.reference);
  if (!tradeoff.rows.empty()) run.write("tradeoff.csv", to_csv(tradeoff));
  show_given_settings(run, tradeoff);
  const std::vector<CsvTable> data = problem.identification ? data_of(problem) : std::vector<CsvTable>();
  const CutProblem cut = cut_into_windows(problem, data, [](double) { return !interrupted(); });
  run.warn(cut.warnings);
  tradeoff.interrupted = tradeoff.interrupted || interrupted();
  // The sum of squares of `identify` is not an objective of the file; the integrator limits its accuracy.
  std::optional<FitErrors> fit;
  if (problem.identification && !tradeoff.interrupted)
    show_fit_errors(run, fit.emplace(cut.problem, cut.data, options.interrupted));
  TaskAdviser adviser(problem, tradeoff, fit ? &*fit : nullptr, kFits * options.budget_seconds);
  if (options.budget_seconds > 0) {
    show_recommendations(page, tradeoff, !tradeoff.interrupted && (problem.design || fit) ? &adviser : nullptr);
    show_outcomes(run, tradeoff);
  }
  if (tradeoff.interrupted) {
    run.stopped(tradeoff.rows.empty() ? "nothing was measured yet" : "tradeoff.csv holds what was measured");
  } else if (run.context.options.apply) {
    const Recommendation advice = adviser.at(*run.context.options.apply);
    show_applied(page, tradeoff, advice, adviser.fit());
    if (advice.row)
      run.write("recommended.json", recommended_problem_text(run, tradeoff.rows[*advice.row].setting.simulation));
  }
  add_work_precision(page, tradeoff);
  page.write();
}

}  // namespace

int tradeoff_command(const CommandContext& context) {
  const CommandOptions& options = context.options;
  if (options.apply && options.budget == 0)
    throw std::invalid_argument("--apply: with --budget 0 nothing is measured that could be recommended");
  Run run(context);
  const Scene& scene = run.problem.scene;
  const Mechanism mechanism(scene, parameter_values(scene));
  run.start();
  const Json machine = machine_json();
  run.result["machine"] = machine;
  if (!settle_accuracy(run)) return run.finish();
  if (!assembled(run, mechanism, Assembly(mechanism, scene.simulation.start_time))) return run.finish();
  context.out << machine_name(machine) << '\n';
  const Json& load = machine.at("load");
  if (load.is_number() && load.get<double>() > 0.7 * machine.at("cores").get<double>())
    run.warn(fmt::format("the machine is busy (load {:.1f}): times come out longer than they are", load.get<double>()));
  sweep(run);
  return run.finish();
}

}  // namespace mbsopt::inline app
