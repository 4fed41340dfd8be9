#include "optim/design/design_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "core/expression/counted.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/start/assembly.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

// Times the tolerance: docs/design-optimisation.md, `converged`.
constexpr double kStationary = 100;

Mechanism without_derivatives(const Scene& scene, const Eigen::VectorXd& rho) {
  return Mechanism(scene, rho, std::vector<bool>(scene.parameters.size(), false));
}

bool may_improve(const DesignSpec& spec, const DesignResult& result) {
  if (result.status == SolverStatus::no_progress) return true;
  return result.status == SolverStatus::converged && !(result.optimality <= kStationary * spec.optimizer.tolerance);
}

// The problem at the values of a result, with the poses there as its guess; none if it does not close.
std::optional<Problem> continued(const Problem& problem, const DesignResult& result) {
  Problem next = problem;
  for (std::size_t p = 0; p < next.scene.parameters.size(); ++p)
    next.scene.parameters[p].value = result.rho(static_cast<Eigen::Index>(p));
  const Mechanism mechanism = without_derivatives(next.scene, result.rho);
  const Assembly reached(mechanism, next.scene.simulation.start_time);
  if (!reached.result().ok) return {};
  set_guess(next.scene, mechanism, {reached.result().y.head(reached.result().y.size() / 2), 0});
  return next;
}

// Far from the start its poses may lead to another mode, a jump that stops a search. A search that ends without being
// stationary continues with the poses that it has reached as its guess. It does so while the design improves. Returns
// whether the problem has other poses now.
bool keep_mode(Problem& problem, const DesignOptions& options, DesignResult& result) {
  constexpr int kMostMoves = 5;
  constexpr double kHeld = 1e-6;  // violation of limits: what ranks as feasible
  bool moved = false;
  DesignOptions without_comparison = options;
  without_comparison.compare_differences = false;
  for (int k = 0; k < kMostMoves && may_improve(*problem.design, result); ++k) {
    std::optional<Problem> next = continued(problem, result);
    if (!next) break;
    DesignResult more;
    try {
      more = single_design(*next, without_comparison);
    } catch (const std::exception&) {  // a singular position, where parameters stand against each other
      break;
    }
    const bool is_better = more.final_evaluation.ok && more.violation <= std::max(result.violation, kHeld) &&
                           more.objective_final < result.objective_final;
    more.add_work_of(result);
    if (!is_better) {
      result.take_counts(more);
      result.simulations = more.simulations;
      result.wall_seconds = more.wall_seconds;
      if (more.status == SolverStatus::stopped) result.end(more.status, more.message);
      break;
    }
    more.prepend(std::move(result.history));
    result = std::move(more);
    problem = *std::move(next);
    moved = true;
  }
  return moved;
}

// The start of a design that was not begun.
DesignResult not_begun(const Problem& problem) {
  DesignResult none;
  none.objective = problem.design->minimize;
  none.optimizer = problem.design->optimizer.chosen();
  for (const std::string& name : problem.design->variables) {
    const Parameter& p = *std::ranges::find(problem.scene.parameters, name, &Parameter::name);
    none.variables.push_back({p.name, p.unit, p.value, p.value, p.lower, p.upper, false, false});
  }
  none.rho = parameter_values(problem.scene);
  return none;
}

}  // namespace

StartModes modes_at(const Scene& scene, const DesignOptions& options) {
  const Mechanism mechanism = without_derivatives(scene, parameter_values(scene));
  const double t = scene.simulation.start_time;
  StartModes found;
  found.modes = assembly_modes(mechanism, t, [&] {
    found.abandoned = options.simulation_progress && !options.simulation_progress(t);
    return !found.abandoned;
  });
  return found;
}

DesignResult design_in_mode(const Problem& given, const DesignOptions& options) {
  const int mode = *options.mode;
  const auto [modes, abandoned] = modes_at(given.scene, options);
  if (abandoned) {
    DesignResult none = not_begun(given);
    none.end_on_request();
    return none;
  }
  if (mode >= static_cast<int>(modes.size())) {
    DesignResult none = not_begun(given);
    none.mode = DesignMode{mode, static_cast<int>(modes.size())};
    none.message = fmt::format("has no assembly mode {}: {} found at its start", mode, counted(modes.size(), "mode"));
    return none;
  }
  Problem problem = given;
  const Mechanism mechanism = without_derivatives(given.scene, parameter_values(given.scene));
  const bool posed = mode > 0 || !Assembly(mechanism, given.scene.simulation.start_time).result().ok;
  if (posed) set_guess(problem.scene, mechanism, modes[static_cast<std::size_t>(mode)]);
  DesignOptions without_mode = options;
  without_mode.mode.reset();
  DesignResult result = single_design(problem, without_mode);
  const bool moved = keep_mode(problem, without_mode, result);
  std::vector<Body> bodies = result.mode ? result.mode->bodies : std::vector<Body>{};
  if (bodies.empty() && (posed || moved)) bodies = problem.scene.bodies;
  result.mode = DesignMode{mode, static_cast<int>(modes.size()), std::move(bodies)};
  return result;
}

}  // namespace mbsopt::inline optim
