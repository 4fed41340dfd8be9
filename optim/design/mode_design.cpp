#include "optim/design/design_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/expression/counted.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/start/assembly.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

Mechanism without_derivatives(const Scene& scene, const Eigen::VectorXd& rho) {
  return Mechanism(scene, rho, std::vector<bool>(scene.parameters.size(), false));
}

// The start of a design that was not begun.
DesignResult not_begun(const Problem& problem) {
  DesignResult none;
  none.objective = problem.design->name();
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
  std::vector<Body> bodies = result.mode ? result.mode->bodies : std::vector<Body>{};
  if (bodies.empty() && posed) bodies = problem.scene.bodies;
  result.mode = DesignMode{mode, static_cast<int>(modes.size()), std::move(bodies)};
  return result;
}

}  // namespace mbsopt::inline optim
