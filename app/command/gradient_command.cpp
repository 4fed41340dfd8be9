#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/report/run_page.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/case_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/cvodes/cvodes.hpp"
#include "core/expression/counted.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/gradient_doubts.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/objective/objective_run.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline app {
namespace {

constexpr GradientMethod kMethods[] = {GradientMethod::automatic,      GradientMethod::tlm,
                                       GradientMethod::adjoint,        GradientMethod::cvodes_forward,
                                       GradientMethod::cvodes_adjoint, GradientMethod::differences};

void show_objectives(RunPage& page, const Evaluation& evaluation,
                     const std::vector<std::optional<double>>& true_values) {
  Run& run = page.run;
  run.result["objectives"] = objectives_json(names_of(run.problem.objectives), evaluation.psi, true_values,
                                             names_of(run.problem.scene.parameters), evaluation.psi_rho);
  add_units(run.result, objective_units(run.problem));
  for (const auto& [name, objective] : run.result["objectives"].items())
    run.context.out << objective_line(name, objective);
  page.verdict(fmt::format("{} of {} by {}: {}.", counted(run.problem.objectives.size(), "gradient"),
                           counted(run.problem.scene.parameters.size(), "parameter"),
                           run.result.at("methods").begin().key(),
                           fmt::join(objective_values(run.result.at("objectives")), ", ")));
  add_objectives(page);
  page.print(gradient_table(run));
  add_gradients(page);
}

constexpr Eigen::Index kColumns = 6;   // of a table
constexpr double kPoorlyKnown = 1e-4;  // of the largest entry, or of the gradient where that is larger

std::string entry_text(double value, double error) { return std::abs(value) <= error ? "0" : significant(value, 6); }

bool hides_entries(const ObjectiveHessian& H) {
  return ((H.value.array() != 0) && (H.value.array().abs() <= H.error.array())).any();
}

std::string accuracy(const ObjectiveHessian& H) {
  if (H.largest_error == 0) return "exact";
  if (H.largest_entry <= H.largest_error) return "zero, as far as differences can tell";
  return fmt::format("estimated error {:.1e} of the largest entry{}", H.relative(),
                     hides_entries(H) ? "; entries within their own error are shown as 0" : "");
}

// The lower triangle.
void print_hessian(std::ostream& out, const ObjectiveHessian& H, const std::string& objective,
                   const std::vector<std::string>& parameters) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  out << fmt::format("\n{}: {}\n", objective, accuracy(H));
  for (Eigen::Index first = 0; first < n; first += kColumns) {
    const Eigen::Index end = std::min(first + kColumns, n);
    std::vector<std::string> header{"d2 " + objective};
    header.insert(header.end(), parameters.begin() + first, parameters.begin() + end);
    TextTable table(header);
    for (Eigen::Index p = first; p < n; ++p) {
      TableRow row{parameters[static_cast<std::size_t>(p)]};
      for (Eigen::Index q = first; q < std::min(end, p + 1); ++q)
        row.push_back(entry_text(H.value(p, q), H.error(p, q)));
      table.add(std::move(row));
    }
    out << table.text();
  }
}

// Second derivatives: into result.json, and as tables. Warns of those that differences did not determine well.
void add_hessians(Run& run, const Hessians& hessians) {
  const std::vector<std::string> parameters = names_of(run.problem.scene.parameters);
  const std::string method(hessian_method(hessians.method));
  run.result["methods"]["hessian"] = {{"wall_seconds", hessians.wall_seconds}, {"gradients", hessians.gradients}};
  run.result["hessian_method"] = method;
  run.context.out << fmt::format("\nsecond derivatives by {}: {}, {:.3g} s\n", method,
                                 counted(hessians.gradients, "gradient"), hessians.wall_seconds);
  for (std::size_t i = 0; i < hessians.of.size(); ++i) {
    const ObjectiveHessian& H = hessians.of[i];
    const std::string& name = run.problem.objectives[i].name;
    Json& objective = run.result["objectives"][name];
    objective["hessian"] = Json::object();
    for (std::size_t p = 0; p < parameters.size(); ++p)
      objective["hessian"][parameters[p]] = by_name(parameters, H.value.row(static_cast<Eigen::Index>(p)));
    objective["hessian_error"] = H.relative();
    print_hessian(run.context.out, H, name, parameters);
    const double size = std::max(H.largest_entry, H.gradient);
    if (H.largest_error <= kPoorlyKnown * size) continue;
    run.warn(
        fmt::format("the second derivatives of '{}' are known to {:.1g} of the largest only: differences at different "
                    "steps do not agree; is it smooth here (abs, min, max)?",
                    name, H.largest_error / size));
  }
}

// The gradients are complete and stay, even if this fails.
void add_second_derivatives(Run& run, Evaluator& evaluator) {
  HessianOptions options;
  options.progress = [&](int done, int of) {
    run.progress.fraction("second derivatives", static_cast<double>(done) / of);
    return !interrupted();
  };
  const Hessians found = hessians(evaluator, evaluator.start(), options);
  run.progress.finish();
  if (interrupted() || !found.ok)
    return run.broke_off("the gradients are kept, there are no second derivatives",
                         "no second derivatives: " + found.message);
  add_hessians(run, found);
}

}  // namespace

int gradient_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (run.problem.objectives.empty()) throw std::invalid_argument("objectives: there are none to differentiate");

  GradientMethod wanted =
      *std::ranges::find(kMethods, context.options.method, [](GradientMethod method) { return to_string(method); });
  if (context.options.hessian) {
    require_second_order(scene, wanted);
    if (wanted == GradientMethod::automatic) wanted = GradientMethod::adjoint;
  }

  const Mechanism mechanism(scene, parameter_values(scene));
  run.start();
  if (!settle_accuracy(run)) return run.finish();
  const Assembly assembly(mechanism, scene.simulation.start_time);
  if (!assembled(run, mechanism, assembly)) return run.finish();

  double last_good_time = scene.simulation.start_time;
  EvaluatorOptions options;
  options.method = wanted;
  options.progress = run.watched("differentiating", &last_good_time);
  std::vector<std::string> left_out;
  const Problem needed = what_objectives_need(run.problem, &left_out);
  say_left_out(run, left_out, "objective");
  Evaluator evaluator(needed.scene, objectives_of(needed), {}, options);
  const Evaluation& evaluation = evaluator.gradients(evaluator.start());
  run.progress.finish();
  run.result["simulation"] = to_json(evaluation.statistics);
  add_derivative_counts(run, needed.scene, evaluation.statistics);
  run.warn(evaluation.warnings);
  run.warn(gradient_doubts(evaluator, evaluation));
  run.progress.finish();
  if (!evaluation.ok) {
    run.broke_off("no gradient was finished", evaluation.message, last_good_time);
    return run.finish();
  }
  const std::string method(to_string(evaluation.method));
  run.result["methods"][method] = {{"wall_seconds", evaluation.wall_seconds}, {"simulations", evaluation.simulations}};
  Scene simulated = scene;
  if (evaluation.method == GradientMethod::cvodes_forward || evaluation.method == GradientMethod::cvodes_adjoint)
    simulated.simulation = with_cvodes(scene.simulation);
  run.result["methods"][method]["integrator"] = simulated.simulation.integrator.type;
  print_simulation(context.out, simulated, evaluation.statistics);
  warn_of_stiffness(run, evaluation.statistics, true);
  context.out << fmt::format("gradients by {}, {:.3g} s\n\n", evaluation.choice.empty() ? method : evaluation.choice,
                             evaluation.wall_seconds);
  const std::vector<std::optional<double>> true_values = evaluator.true_values(evaluator.start());
  RunPage page(run);
  show_objectives(page, evaluation, true_values);
  run.warn(missed_peaks(evaluator.objectives(), evaluation.psi, true_values));
  add_cases(run, true, options.method);
  if (context.options.hessian) add_second_derivatives(run, evaluator);
  add_simulation(page, scene);
  page.write();
  return run.finish();
}

}  // namespace mbsopt::inline app
