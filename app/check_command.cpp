#include <fmt/format.h>

#include <cmath>

#include "app/command.hpp"
#include "app/interrupt.hpp"
#include "app/objective_values.hpp"
#include "app/run.hpp"
#include "app/text_table.hpp"
#include "core/dynamics/assembly.hpp"
#include "optim/gradient_check.hpp"

namespace mbsopt {
namespace {

std::string relative(double difference) { return std::isfinite(difference) ? fmt::format("{:.1e}", difference) : "-"; }

void print_entries(std::ostream& out, const GradientCheck& check,
                   const std::vector<std::optional<double>>& true_values) {
  for (std::size_t i = 0; i < check.objectives.size(); ++i) {
    out << fmt::format("\n{} = {}{}\n", check.objectives[i], significant(check.psi(static_cast<Eigen::Index>(i)), 12),
                       true_extreme_text(true_values[i]));
    TextTable table({"parameter", "adjoint", "tlm", "fd frozen", "fd free", "tlm-adjoint", "frozen-tlm", "free-tlm",
                     "exact", "frozen"});
    for (const CheckedEntry& e : check.entries) {
      if (e.objective != check.objectives[i]) continue;
      table.add({e.parameter, significant(e.adjoint, 11), significant(e.tlm, 11), significant(e.frozen, 11),
                 significant(e.free, 11), relative(e.tlm_adjoint), relative(e.frozen_difference),
                 relative(e.free_difference), std::string(to_string(e.exact)),
                 std::string(to_string(e.frozen_verdict))});
    }
    out << table.text();
  }
}

void print_other_checks(std::ostream& out, const GradientCheck& check) {
  out << '\n';
  for (const TaylorCheck& taylor : check.taylor) {
    out << fmt::format("Taylor remainder of {} falls as h^{:.2f}: {}\n", taylor.objective, taylor.slope,
                       taylor.passed ? "agrees" : "DISAGREES");
  }
  for (const IdentityCheck& identity : check.identities) {
    out << fmt::format("adjoint identity: defect {:.1e}: {}\n", identity.relative_defect,
                       identity.passed ? "agrees" : "DISAGREES");
  }
}

void print_costs(std::ostream& out, const GradientCheck& check) {
  TextTable table({"cost", "seconds", "simulations"});
  const auto add = [&](const char* name, const MethodCost& cost) {
    table.add({name, fmt::format("{:.3g}", cost.wall_seconds), fmt::format("{:.2f}", cost.ratio)});
  };
  add("one simulation", check.simulation);
  add("adjoint", check.adjoint_cost);
  add("tlm", check.tlm_cost);
  add("differences, frozen steps", check.frozen_cost);
  add("differences, free steps", check.free_cost);
  out << '\n' << table.text();
}

Json gradient_json(const GradientCheck& check, const Eigen::MatrixXd& psi_rho) {
  Json gradient = Json::object();
  for (std::size_t i = 0; i < check.objectives.size(); ++i) {
    for (std::size_t k = 0; k < check.parameters.size(); ++k) {
      gradient[check.objectives[i]][check.parameters[k]] =
          psi_rho(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
    }
  }
  return gradient;
}

void add_to_result(Json& result, const GradientCheck& check, const std::vector<std::optional<double>>& true_values) {
  const Json adjoint = gradient_json(check, check.adjoint);
  for (std::size_t i = 0; i < check.objectives.size(); ++i) {
    const std::string& name = check.objectives[i];
    result["objectives"][name] = objective_json(check.psi(static_cast<Eigen::Index>(i)), true_values[i]);
    result["objectives"][name]["gradient"] = adjoint.value(name, Json::object());
  }
  const auto add = [&](const char* name, const MethodCost& cost, const Eigen::MatrixXd& psi_rho) {
    result["methods"][name] = {{"wall_seconds", cost.wall_seconds},
                               {"simulations_wall_ratio", cost.ratio},
                               {"gradient", gradient_json(check, psi_rho)}};
  };
  add("adjoint", check.adjoint_cost, check.adjoint);
  add("tlm", check.tlm_cost, check.tlm);
  add("fd_frozen", check.frozen_cost, check.frozen);
  add("fd_free", check.free_cost, check.free);

  Json& verdict = result["verdict"];
  verdict["passed"] = check.passed();
  for (const CheckedEntry& e : check.entries) {
    verdict["entries"][e.objective][e.parameter] = {{"tlm_adjoint", e.tlm_adjoint},
                                                    {"frozen_difference", e.frozen_difference},
                                                    {"free_difference", e.free_difference},
                                                    {"exact", to_string(e.exact)},
                                                    {"frozen", to_string(e.frozen_verdict)}};
  }
  for (const TaylorCheck& t : check.taylor) verdict["taylor"][t.objective] = {{"slope", t.slope}, {"passed", t.passed}};
  for (const IdentityCheck& i : check.identities) {
    verdict["identities"].push_back({{"relative_defect", i.relative_defect}, {"passed", i.passed}});
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
  const Assembly assembly(mechanism, scene.simulation.start_time);
  if (!assembly.result().ok) return run.failed(assembly.result().message, scene.simulation.start_time);
  const ModelSummary model = assembly.summary();
  run.result["model"] = to_json(model);
  print_model(context.out, scene.name, model);

  double last_good_time = scene.simulation.start_time;
  GradientCheckOptions options;
  options.simulation_progress = [&](double t) {
    last_good_time = t;
    return !interrupted();
  };
  options.progress = [&](int done, int of) { run.progress.fraction("checking", static_cast<double>(done) / of); };
  const GradientCheck check = check_gradients(run.problem, options);
  run.progress.finish();
  if (interrupted()) return run.stopped();
  if (!check.ran) return run.failed(check.message, last_good_time);

  run.result["simulation"] = to_json(check.statistics);
  const Evaluator evaluator(scene, objectives_of(run.problem));
  const std::vector<std::optional<double>> true_values = evaluator.true_values(evaluator.start());
  add_to_result(run.result, check, true_values);
  print_simulation(context.out, scene.simulation, check.statistics);
  print_entries(context.out, check, true_values);
  print_other_checks(context.out, check);
  print_costs(context.out, check);
  context.out << fmt::format("\n{}\n", check.passed() ? "all gradients agree" : "THE GRADIENTS DISAGREE");
  return check.passed() ? run.done() : run.disagreed();
}

}  // namespace mbsopt
