#include <fmt/format.h>

#include <cmath>

#include "app/report/run_report.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/case_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/run/command.hpp"
#include "app/run/run.hpp"
#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"
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
  std::vector<ComparedMethod> methods{{"adjoint", "adjoint", check.adjoint_cost, check.adjoint},
                                      {"tlm", "tlm", check.tlm_cost, check.tlm}};
  if (check.discrete) methods.push_back({"fd_frozen", "differences, frozen steps", check.frozen_cost, check.frozen});
  methods.push_back({"fd_free", "differences, free steps", check.free_cost, check.free});
  return methods;
}

// "agrees 3.1e-14": the verdict, and its relative difference.
std::string compared(Verdict verdict, double difference) {
  const std::string words(to_string(verdict));
  return std::isfinite(difference) && verdict != Verdict::zero ? fmt::format("{} {:.1e}", words, difference) : words;
}

std::string derivative(double value) { return std::isfinite(value) ? significant(value, 11) : "failed"; }

void print_entries(std::ostream& out, const GradientCheck& check, const ObjectiveUnits& units,
                   const std::vector<std::optional<double>>& true_values) {
  out << (check.discrete ? "\nfrozen: differences on the steps of the base run; free: with step-size control at work. "
                           "Relative to tlm:\n"
                         : "\nadjoint, tlm: the sensitivities by CVODES, backward and forward; its steps cannot be "
                           "frozen. Relative to tlm:\n");
  for (std::size_t i = 0; i < check.objectives.size(); ++i) {
    out << '\n' << objective_line(check.objectives[i], check.psi(static_cast<Eigen::Index>(i)), true_values[i], units);
    TextTable table(
        {"parameter", "adjoint", "tlm", "fd frozen", "fd free", "adjoint = tlm", "fd frozen = tlm", "fd free = tlm"});
    for (const CheckedEntry& e : check.entries) {
      if (e.objective != check.objectives[i]) continue;
      table.add({e.parameter, derivative(e.adjoint), derivative(e.tlm), e.frozen_verdict ? derivative(e.frozen) : "-",
                 derivative(e.free), compared(e.exact, e.tlm_adjoint),
                 e.frozen_verdict ? compared(*e.frozen_verdict, e.frozen_difference) : "-",
                 e.free_verdict ? compared(*e.free_verdict, e.free_difference) : "-"});
    }
    out << table.text();
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

std::string weighted_sum(const GradientCheck& check, const Eigen::VectorXd& w) {
  std::string text;
  for (std::size_t i = 0; i < check.objectives.size(); ++i) {
    const double weight = w(static_cast<Eigen::Index>(i));
    const char* sign = weight < 0 ? "-" : "+";
    if (!text.empty()) text += fmt::format(" {} {:.3g} {}", sign, std::abs(weight), check.objectives[i]);
    if (text.empty()) text = fmt::format("{:.3g} {}", weight, check.objectives[i]);
  }
  return text;
}

void print_identities(std::ostream& out, const GradientCheck& check) {
  if (check.identities.empty()) return;
  out << "\nadjoint identity w'(psi_rho d) by tlm = (psi_rho'w)'d by adjoint, d random in all parameters, w random:\n";
  for (const IdentityCheck& identity : check.identities) {
    out << fmt::format("  of {}: {:.6g}, defect {:.1e} of its terms: {}\n", weighted_sum(check, identity.w),
                       identity.adjoint, identity.relative_defect, identity.passed ? "agrees" : "DISAGREES");
  }
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
    out << fmt::format("  {}: {}\n", objective, compared(c.worst_verdict(objective), c.worst_difference(objective)));
  }
}

void print_costs(std::ostream& out, const GradientCheck& check) {
  TextTable table({"cost", "seconds", "simulations"});
  const auto add = [&](const char* name, const MethodCost& cost) {
    table.add(
        {name, fmt::format("{:.2g}", cost.wall_seconds), fmt::format("{:.{}f}", cost.ratio, cost.ratio < 10 ? 1 : 0)});
  };
  add("one simulation", check.simulation);
  for (const ComparedMethod& method : compared_methods(check)) add(method.name, method.cost);
  out << '\n' << table.text();
  out << fmt::format(
      "one simulation: a run with the same objectives and tolerances, without derivatives; medians of {} in turn with "
      "adjoint and tlm\n",
      counted(check.timing_rounds, "round"));
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
  verdict["method"] = c.method, verdict["against"] = c.discrete, verdict["rtol"] = c.rtol;
  for (const ContinuousEntry& e : c.entries)
    verdict["entries"][e.objective][e.parameter] = {{"difference", e.difference}, {"verdict", to_string(e.verdict)}};
}

void add_to_result(Json& result, const GradientCheck& check, const std::vector<std::optional<double>>& true_values) {
  for (std::size_t i = 0; i < check.objectives.size(); ++i) {
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    Json& objective = result["objectives"][check.objectives[i]];
    objective = objective_json(check.psi(row), true_values[i]);
    objective["gradient"] = by_name(check.parameters, check.adjoint.row(row));
  }
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
  const ObjectiveUnits units = objective_units(run.problem);
  add_units(run.result, units);
  print_simulation(context.out, scene, check.statistics);
  warn_of_stiffness(run, check.statistics, true);
  print_entries(context.out, check, units, true_values);
  print_taylor(context.out, check);
  print_identities(context.out, check);
  print_continuous(context.out, check);
  print_costs(context.out, check);
  if (!check.wrong_terms.empty()) context.out << "\nterms in C++, against differences of their own values:\n";
  for (const std::string& wrong : check.wrong_terms) context.out << "  " << wrong << '\n';
  context.out << fmt::format("\n{}\n", check.passed() ? "all gradients agree" : "THE GRADIENTS DISAGREE");
  const bool cases_agree = check_cases(run);
  if (!check.passed() || !cases_agree) run.disagrees();
  run.write("report.html", check_report(scene, run.result));
  return run.finish();
}

}  // namespace mbsopt::inline app
