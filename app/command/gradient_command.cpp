#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "app/report/run_report.hpp"
#include "app/results/accuracy_results.hpp"
#include "app/results/case_results.hpp"
#include "app/results/hessian_results.hpp"
#include "app/results/left_out_bodies.hpp"
#include "app/results/objective_units.hpp"
#include "app/run/command.hpp"
#include "app/run/run.hpp"
#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"
#include "core/cvodes/cvodes.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/gradient_doubts.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt {
namespace {

const std::map<std::string, GradientMethod> kMethods{{"auto", GradientMethod::automatic},
                                                     {"tlm", GradientMethod::tlm},
                                                     {"adjoint", GradientMethod::adjoint},
                                                     {"cvodes_forward", GradientMethod::cvodes_forward},
                                                     {"cvodes_adjoint", GradientMethod::cvodes_adjoint},
                                                     {"fd", GradientMethod::differences}};

void add_objectives(Run& run, const Evaluation& evaluation, const std::vector<std::optional<double>>& true_values) {
  const Scene& scene = run.problem.scene;
  std::vector<std::string> header{"parameter", "value"};
  const ObjectiveUnits units = objective_units(run.problem);
  for (std::size_t i = 0; i < run.problem.objectives.size(); ++i) {
    const std::string& name = run.problem.objectives[i].name;
    const auto row = static_cast<Eigen::Index>(i);
    run.result["objectives"][name] = objective_json(evaluation.psi(row), true_values[i]);
    run.result["objectives"][name]["gradient"] = by_name(names_of(scene.parameters), evaluation.psi_rho.row(row));
    run.context.out << objective_line(name, evaluation.psi(row), true_values[i], units);
    header.push_back("d " + name);
  }
  add_units(run.result, units);
  TextTable table(header);
  for (std::size_t k = 0; k < scene.parameters.size(); ++k) {
    std::vector<std::string> row{scene.parameters[k].name, significant(scene.parameters[k].value)};
    for (Eigen::Index i = 0; i < evaluation.psi.size(); ++i) {
      row.push_back(significant(evaluation.psi_rho(i, static_cast<Eigen::Index>(k)), 12));
    }
    table.add(std::move(row));
  }
  run.context.out << '\n' << table.text();
}

// The gradients are complete and stay, even if this fails.
void add_second_derivatives(Run& run, Evaluator& evaluator) {
  const std::vector<std::string> objectives = names_of(run.problem.objectives);
  const std::vector<std::string> parameters = names_of(run.problem.scene.parameters);
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
  add_hessians(run.result, found, objectives, parameters);
  print_hessians(run.context.out, found, objectives, parameters);
  run.warn(hessian_warnings(found, objectives));
}

}  // namespace

int gradient_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (run.problem.objectives.empty()) throw std::invalid_argument("objectives: there are none to differentiate");

  GradientMethod wanted = kMethods.at(context.options.method);
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
  options.progress = [&, show = run.watched("differentiating")](double t) {
    last_good_time = t;
    return show(t);
  };
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
  add_objectives(run, evaluation, evaluator.true_values(evaluator.start()));
  add_cases(run, true, options.method);
  if (context.options.hessian) add_second_derivatives(run, evaluator);
  run.write("report.html", gradient_report(scene, run.result));
  return run.finish();
}

}  // namespace mbsopt
