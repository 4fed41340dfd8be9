#include "optim/objective/gauss_newton.hpp"

#include <algorithm>

#include "optim/objective/curvature_of_run.hpp"

namespace mbsopt::inline optim {

Hessians gauss_newton(const Evaluator& evaluator, const Evaluation& at, std::size_t count) {
  Hessians result;
  result.ok = at.ok;
  result.message = at.message;
  if (!at.ok) return result;
  if (count == 1 && at.curvature.size() > 0) {
    result.of.emplace_back().value = at.curvature;
    return result;
  }
  result.gradients = 1;
  require_second_order(evaluator.scene(), GradientMethod::automatic);
  const std::span<const Objective> all = evaluator.objectives();
  const std::span<const Objective> objectives = all.first(count > 0 ? count : all.size());
  CurvatureOfRun curvature(objectives, evaluator.variables());
  if (std::ranges::any_of(objectives, &Objective::needs_simulation)) {
    const SimulationSettings& settings = evaluator.scene().simulation;
    const Mechanism mechanism = evaluator.mechanism(at.rho, true);
    const SimulationResult run =
        simulate_tlm(mechanism, settings, {}, curvature.sampling(mechanism, at.steps, settings),
                     {&at.steps, evaluator.options().progress});
    result.ok = run.ok();
    result.message = run.message;
    if (!run.ok()) return result;
  }
  for (std::size_t i = 0; i < objectives.size(); ++i) result.of.emplace_back().value = curvature.matrix(i, at.rho);
  return result;
}

}  // namespace mbsopt::inline optim
