#include "app/results/case_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "app/results/objective_units.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/check/gradient_check.hpp"
#include "optim/problem/load_cases.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline app {

int case_threads(const Run& run) {
  const int asked = run.context.options.threads;
  return asked > 0 ? asked : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

void add_cases(Run& run, bool gradients, GradientMethod method) {
  const Problem& problem = run.problem;
  if (problem.cases.empty() || problem.objectives.empty() || interrupted()) return;
  const std::vector<std::string> objectives = names_of(problem.objectives);
  const std::vector<std::string> parameters = names_of(problem.scene.parameters);
  EvaluatorOptions options;
  options.method = method;
  options.progress = run.watched("load cases");
  options.threads = case_threads(run);
  Evaluator evaluator(problem, objectives, parameters, options);
  const Eigen::VectorXd rho = evaluator.start();
  const Evaluation all = gradients ? evaluator.gradients(rho) : evaluator.values(rho);
  run.progress.finish();
  if (!all.ok) return run.broke_off("the load cases are incomplete", all.message);
  const std::vector<std::optional<double>> true_values = evaluator.true_values(rho);
  for (std::size_t c = 0; c < evaluator.cases(); ++c) {
    const Evaluation& e = all.of_cases[c];
    run.result["cases"][evaluator.case_name(c)]["objectives"] =
        objectives_json(objectives, e.psi, std::span(true_values).subspan(c * objectives.size(), objectives.size()),
                        gradients ? parameters : std::vector<std::string>(), e.psi_rho);
  }
  Json shown{{"cases", run.result["cases"]}};
  add_units(shown, objective_units(problem));
  run.context.out << '\n' << objective_table(shown).text();
}

bool check_cases(Run& run) {
  bool all_agree = true;
  for (const CaseSpec& load_case : run.problem.cases) {
    Problem of_case = what_objectives_need(problem_of(run.problem, load_case));
    for (Parameter& p : of_case.scene.parameters) p.allow_unused = true;
    GradientCheckOptions options;
    options.simulation_progress = run.watched("checking case " + load_case.name);
    const GradientCheck check = check_gradients(of_case, options);
    run.progress.finish();
    if (interrupted() || !check.ran) {
      run.broke_off("not all load cases were compared",
                    fmt::format("case '{}': {}", load_case.name,
                                in_names_of_problem(check.message, load_case, run.problem.scene)));
      return true;
    }
    all_agree = all_agree && check.passed();
    run.result["cases"][load_case.name]["verdict"]["passed"] = check.passed();
    run.context.out << fmt::format("case {}: {}\n", load_case.name,
                                   check.passed() ? "all gradients agree" : "THE GRADIENTS DISAGREE");
  }
  return all_agree;
}

}  // namespace mbsopt::inline app
