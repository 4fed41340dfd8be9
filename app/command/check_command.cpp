// Compares all gradient methods, for the terminal, the report and result.json.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "app/report/run_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/case_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "optim/check/gradient_check.hpp"
#include "optim/objective/objective_run.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline app {
namespace {

struct ComparedMethod {
  const char* key;   // in result.json
  const char* name;  // in the table of costs
  const MethodCost& cost;
  const Eigen::MatrixXd& psi_rho;
};

std::vector<ComparedMethod> compared_methods(const GradientCheck& check) {
  std::vector<ComparedMethod> methods{{"adjoint", "adjoint", check.timing.adjoint, check.adjoint},
                                      {"tlm", "tlm", check.timing.tlm, check.tlm}};
  if (check.discrete) methods.push_back({"fd_frozen", "differences, frozen steps", check.frozen_cost, check.frozen});
  methods.push_back({"fd_free", "differences, free steps", check.free_cost, check.free});
  return methods;
}

// "agrees 3.1e-14": the verdict, "-" if there is none, and its relative difference.
std::string compared(std::string_view verdict, double difference) {
  const bool has_size = std::isfinite(difference) && verdict != "-" && verdict != to_string(Verdict::zero);
  return has_size ? fmt::format("{} {:.1e}", verdict, difference) : std::string(verdict);
}

constexpr std::size_t kMostLadders = 60;  // plots of a page that stays below 400 kB

std::string ladder_id(std::size_t pair) { return fmt::format("ladder-{}", pair); }  // for links

// All derivatives of each objective, and how they compare. A comparison with differences links to their plot.
void show_entries(RunPage& page, const GradientCheck& check) {
  std::ostream& out = page.run.context.out;
  page.heading("Verdicts");
  out << (check.discrete ? "\nfrozen: differences on the steps of the base run; free: with step-size control at work. "
                           "Relative to tlm:\n"
                         : "\nadjoint, tlm: the sensitivities by CVODES, backward and forward; its steps cannot be "
                           "frozen. Relative to tlm:\n");
  const auto derivative = [](double value) { return std::isfinite(value) ? number_cell(value, 11) : "failed"; };
  const auto comparison = [](const std::optional<Verdict>& verdict, double difference) {
    return compared(verdict ? to_string(*verdict) : "-", difference);
  };
  for (const std::string& objective : check.objectives) {
    TextTable table(
        {"parameter", "adjoint", "tlm", "fd frozen", "fd free", "adjoint = tlm", "fd frozen = tlm", "fd free = tlm"});
    for (std::size_t k = 0; k < check.entries.size(); ++k) {
      const CheckedEntry& e = check.entries[k];
      if (e.objective != objective) continue;
      TableRow& row = table.add({e.parameter, derivative(e.adjoint), derivative(e.tlm),
                                 e.frozen_verdict ? derivative(e.frozen) : "-", derivative(e.free),
                                 comparison(e.exact, e.tlm_adjoint), comparison(e.frozen_verdict, e.frozen_difference),
                                 comparison(e.free_verdict, e.free_difference)});
      if (k < kMostLadders) row[6].link = row[7].link = "#" + ladder_id(k);
    }
    const std::string value = objective_line(objective, page.run.result["objectives"][objective]);
    out << '\n' << value << table.text();
    page.paragraph(value);
    page.table(table);
  }
}

void print_taylor(std::ostream& out, const GradientCheck& check) {
  if (check.taylor.empty()) return;
  out << "\nTaylor remainder |psi(rho + h d) - psi - h psi_rho d|, frozen steps, d random in all parameters:\n";
  for (const TaylorCheck& taylor : check.taylor) {
    const std::string found = taylor.slope          ? fmt::format("falls as h^{:.2f}", *taylor.slope)
                              : taylor.rows.empty() ? "could not be evaluated at any h"
                                                    : "has no slope to measure, it is rounding: linear along d";
    const char* verdict = taylor.passed ? "agrees" : taylor.rows.empty() ? "FAILED" : "DISAGREES";
    out << fmt::format("  {}: {}: {}\n", taylor.objective, found, verdict);
  }
}

void print_identities(std::ostream& out, const GradientCheck& check) {
  if (check.identities.empty()) return;
  out << "\nadjoint identity w'(psi_rho d) by tlm = (psi_rho'w)'d by adjoint, d random in all parameters, w random:\n";
  for (const IdentityCheck& identity : check.identities)
    out << fmt::format("  {:.6g}, defect {:.1e} of its terms: {}\n", identity.adjoint, identity.relative_defect,
                       identity.passed ? "agrees" : "DISAGREES");
}

// The worst entry of each objective; all of them are in result.json.
void print_continuous(std::ostream& out, const GradientCheck& check) {
  if (!check.continuous) return;
  const ContinuousCheck& c = *check.continuous;
  if (!c.ran) {
    out << fmt::format("\nindependent sensitivities by CVODES: not available, {}\n", c.message);
    return;
  }
  out << fmt::format("\n{} by {}, of the differential equation, against the derivatives of {}, both at rtol {:g}:\n",
                     c.method, c.integrator, c.discrete, c.rtol);
  for (const std::string& objective : check.objectives) {
    out << fmt::format("  {}: {}\n", objective,
                       compared(to_string(c.worst_verdict(objective)), c.worst_difference(objective)));
  }
}

void print_costs(std::ostream& out, const GradientCheck& check) {
  TextTable table({"cost", "seconds", "simulations"});
  const auto add = [&](const char* name, const MethodCost& cost) {
    table.add(
        {name, fmt::format("{:.2g}", cost.wall_seconds), fmt::format("{:.{}f}", cost.ratio, cost.ratio < 10 ? 1 : 0)});
  };
  add("one simulation", check.timing.simulation);
  for (const ComparedMethod& method : compared_methods(check)) add(method.name, method.cost);
  out << '\n' << table.text();
  out << fmt::format(
      "one simulation: a run with the same objectives and tolerances, without derivatives; medians of {} in turn with "
      "adjoint and tlm\n",
      counted(check.timing.rounds, "round"));
}

Json gradient_json(const GradientCheck& check, const Eigen::MatrixXd& psi_rho) {
  Json gradient = Json::object();
  for (std::size_t i = 0; i < check.objectives.size(); ++i)
    gradient[check.objectives[i]] = by_name(check.parameters, psi_rho.row(static_cast<Eigen::Index>(i)));
  return gradient;
}

void add_continuous(Json& result, const GradientCheck& check) {
  const ContinuousCheck& c = *check.continuous;
  Json& verdict = result["verdict"]["continuous"];
  verdict = {{"ran", c.ran}, {"passed", c.passed()}};
  if (!c.ran) {
    verdict["message"] = c.message;
    return;
  }
  result["methods"][c.method] = {{"wall_seconds", c.wall_seconds},
                                 {"integrator", c.integrator},
                                 {"rtol", c.rtol},
                                 {"gradient", gradient_json(check, c.psi_rho)}};
  verdict["method"] = c.method;
  verdict["against"] = c.discrete;
  verdict["rtol"] = c.rtol;
  for (const ContinuousEntry& e : c.entries)
    verdict["entries"][e.objective][e.parameter] = {{"difference", e.difference}, {"verdict", to_string(e.verdict)}};
}

void add_to_result(Json& result, const GradientCheck& check, const std::vector<std::optional<double>>& true_values) {
  result["objectives"] = objectives_json(check.objectives, check.psi, true_values, check.parameters, check.adjoint);
  for (const ComparedMethod& method : compared_methods(check))
    result["methods"][method.key] = {{"wall_seconds", method.cost.wall_seconds},
                                     {"simulations_wall_ratio", method.cost.ratio},
                                     {"gradient", gradient_json(check, method.psi_rho)}};

  Json& verdict = result["verdict"];
  verdict["passed"] = check.passed();
  if (!check.wrong_terms.empty()) verdict["wrong_terms"] = check.wrong_terms;
  for (const CheckedEntry& e : check.entries) {
    verdict["entries"][e.objective][e.parameter] = {
        {"tlm_adjoint", e.tlm_adjoint},
        {"frozen_difference", e.frozen_difference},
        {"free_difference", e.free_difference},
        {"frozen_error", e.frozen_error},
        {"free_error", e.free_error},
        {"exact", to_string(e.exact)},
        {"frozen", e.frozen_verdict ? Json(to_string(*e.frozen_verdict)) : Json()},
        {"free", e.free_verdict ? Json(to_string(*e.free_verdict)) : Json()}};
    Json& ladder = verdict["entries"][e.objective][e.parameter]["ladder"];
    ladder = {{"h", Json::array()}, {"frozen", Json::array()}, {"free", Json::array()}};
    for (const LadderRung& rung : e.rungs)
      ladder["h"].push_back(rung.h), ladder["frozen"].push_back(rung.frozen), ladder["free"].push_back(rung.free);
  }
  if (check.continuous) add_continuous(result, check);
  for (const TaylorCheck& t : check.taylor) {
    Json& taylor = verdict["taylor"][t.objective];
    taylor = {{"slope", or_null(t.slope)}, {"passed", t.passed}, {"h", Json::array()}, {"remainder", Json::array()}};
    for (const TaylorRow& row : t.rows) taylor["h"].push_back(row.h), taylor["remainder"].push_back(row.remainder);
  }
  for (const IdentityCheck& i : check.identities) {
    verdict["identities"].push_back({{"weights", by_name(check.objectives, i.w)},
                                     {"direction", by_name(check.parameters, i.d)},
                                     {"relative_defect", i.relative_defect},
                                     {"passed", i.passed}});
  }
}

// Adds the series if a logarithmic axis can show any of it.
void add_positive(LinePlot& plot, PlotSeries series) {
  if (std::ranges::any_of(series.y, [](double y) { return y > 0; })) plot.series.push_back(std::move(series));
}

// |central difference - tangent-linear model| over the step h, per kind of steps.
LinePlot ladder_plot(const CheckedEntry& e, const std::string& unit, const Parameter& parameter) {
  const std::string step = parameter.unit.empty() ? kUnknownUnit : parameter.unit;
  LinePlot plot{.title = fmt::format("d {}/d {}: differences over their step", e.objective, e.parameter),
                .x_label = fmt::format("step h of {} [{}]", e.parameter, step),
                .y_label = fmt::format("|difference - derivative| [{}]", unit_per(unit, step)),
                .logarithmic_y = true,
                .logarithmic_x = true};
  for (const auto& [difference, name] :
       {std::pair(&LadderRung::frozen, "on frozen steps"), std::pair(&LadderRung::free, "with step-size control")}) {
    PlotSeries series{name, {}, {}};
    for (const LadderRung& rung : e.rungs) {
      series.x.push_back(rung.h);
      series.y.push_back(std::abs(rung.*difference - e.adjoint));
    }
    add_positive(plot, std::move(series));
  }
  return plot;
}

void add_ladders(RunPage& page, const std::vector<CheckedEntry>& entries) {
  const Scene& scene = page.run.problem.scene;
  page.heading("Differences over their step");
  page.note("Errors fall as h^2 until rounding, or the integrator's error on free steps, takes over as 1/h.");
  page.begin_choices({"objective", "parameter"});
  for (std::size_t k = 0; k < std::min(entries.size(), kMostLadders); ++k) {
    const CheckedEntry& e = entries[k];
    const auto parameter = std::ranges::find(scene.parameters, e.parameter, &Parameter::name);
    if (!std::isfinite(e.adjoint) || parameter == scene.parameters.end()) continue;
    page.begin_choice({e.objective, e.parameter}, ladder_id(k));
    page.plot(ladder_plot(e, unit_of(page.run.result.at("objectives").at(e.objective)), *parameter));
    page.end_choice();
  }
  page.end_choices();
  if (entries.size() > kMostLadders)
    page.note(fmt::format("The first {} of {} plots are drawn.", kMostLadders, entries.size()));
}

void add_taylor(RunPage& page, const std::vector<TaylorCheck>& taylor) {
  std::set<std::string> units;
  for (const TaylorCheck& t : taylor) units.insert(unit_of(page.run.result.at("objectives").at(t.objective)));
  LinePlot plot{.title = "Taylor remainder along a random direction d of all parameters",
                .x_label = "h [-]",
                .y_label = fmt::format("|psi(rho + h d) - psi - h psi_rho d| [{}]",
                                       units.size() == 1 ? *units.begin() : kUnknownUnit),
                .logarithmic_y = true,
                .logarithmic_x = true};
  for (const TaylorCheck& t : taylor) {
    PlotSeries series{t.slope ? fmt::format("{}: h^{:.2f}", t.objective, *t.slope) : t.objective, {}, {}};
    for (const TaylorRow& row : t.rows) {
      series.x.push_back(row.h);
      series.y.push_back(row.remainder);
    }
    add_positive(plot, std::move(series));
  }
  if (plot.series.empty()) return;
  page.heading("Taylor remainder");
  page.plot(plot);
}

// The comparison in a sentence, as tables and as curves.
void show_comparison(RunPage& page, const GradientCheck& check) {
  const auto worst = [&](double CheckedEntry::*difference) {
    double largest = 0;
    for (const CheckedEntry& e : check.entries)
      if (std::isfinite(e.*difference)) largest = std::max(largest, e.*difference);
    return largest;
  };
  page.verdict(fmt::format(
      "{}: tangent-linear model and adjoint differ by at most {:.1e}, differences on frozen steps by {:.1e}, on free "
      "steps by {:.1e} of an entry.",
      check.passed() ? "All gradients agree" : "Gradients disagree", worst(&CheckedEntry::tlm_adjoint),
      worst(&CheckedEntry::frozen_difference), worst(&CheckedEntry::free_difference)));
  show_entries(page, check);
  add_ladders(page, check.entries);
  add_taylor(page, check.taylor);
}

}  // namespace

int check_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (run.problem.objectives.empty()) throw std::invalid_argument("objectives: there are none to differentiate");
  if (scene.parameters.empty()) throw std::invalid_argument("parameters: there are none to differentiate with");
  const Mechanism mechanism(scene, parameter_values(scene));
  run.start();
  if (!settle_accuracy(run)) return run.finish();
  const Assembly assembly(mechanism, scene.simulation.start_time);
  if (!assembled(run, mechanism, assembly)) return run.finish();

  double last_good_time = scene.simulation.start_time;
  GradientCheckOptions options;
  options.simulation_progress = run.watched("simulating", &last_good_time);
  options.progress = [&](int done, int of) { run.progress.fraction("checking", static_cast<double>(done) / of); };
  std::vector<std::string> left_out;
  const Problem needed = what_objectives_need(run.problem, &left_out);
  say_left_out(run, left_out, "objective");
  const GradientCheck check = check_gradients(needed, options);
  run.progress.finish();
  if (interrupted() || !check.ran) {
    run.broke_off("nothing was compared", check.message, last_good_time);
    return run.finish();
  }

  run.result["simulation"] = to_json(check.statistics);
  add_derivative_counts(run, needed.scene, check.statistics);
  run.warn(check.warnings);
  const Evaluator evaluator(needed.scene, objectives_of(needed));
  const std::vector<std::optional<double>> true_values = evaluator.true_values(evaluator.start());
  add_to_result(run.result, check, true_values);
  run.warn(missed_peaks(evaluator.objectives(), check.psi, true_values));
  add_units(run.result, objective_units(run.problem));
  print_simulation(context.out, scene, check.statistics);
  warn_of_stiffness(run, check.statistics, true);
  RunPage page(run);
  show_comparison(page, check);
  print_taylor(context.out, check);
  print_identities(context.out, check);
  print_continuous(context.out, check);
  print_costs(context.out, check);
  if (!check.wrong_terms.empty()) context.out << "\nterms in C++, against differences of their own values:\n";
  for (const std::string& wrong : check.wrong_terms) context.out << "  " << wrong << '\n';
  context.out << fmt::format("\n{}\n", check.passed() ? "all gradients agree" : "THE GRADIENTS DISAGREE");
  const bool cases_agree = check_cases(run);
  if (!check.passed() || !cases_agree) run.disagrees();
  add_gradients(page);
  add_objectives(page);
  add_simulation(page, scene);
  page.write();
  return run.finish();
}

}  // namespace mbsopt::inline app
