#include <fmt/format.h>

#include <stdexcept>

#include "core/cvodes/cvodes.hpp"
#include "core/cvodes/cvodes_run.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt {

bool is_cvodes(std::string_view integrator) { return integrator == "cvodes_adams" || integrator == "cvodes_bdf"; }

SimulationSettings with_cvodes(SimulationSettings settings) {
  std::string& type = settings.integrator.type;
  const Method* method = runge_kutta_method(type);
  if (!is_cvodes(type)) {
    type = method && method->implicit() ? "cvodes_bdf" : "cvodes_adams";
    settings.integrator.options = {};  // the other method's
  }
  settings.integrator.step.reset();
  if (settings.solve == Solve::kinematics) settings.solve = Solve::automatic;
  return settings;
}

namespace cvodes {

const SimulationSettings& possible(const SimulationSettings& settings, const RunOptions& options) {
  const std::string& type = settings.integrator.type;
  if (!is_cvodes(type)) throw std::invalid_argument(fmt::format("integrator '{}' is not one of CVODES'", type));
  if (settings.integrator.step) {
    throw std::invalid_argument(
        fmt::format("integrator '{}' chooses its own steps: give rtol and atol, no step", type));
  }
  if (!settings.events.empty()) {
    throw std::invalid_argument(fmt::format("integrator '{}' does not end steps at simulation.events", type));
  }
  if (options.frozen) {
    throw std::invalid_argument(
        fmt::format("integrator '{}' cannot repeat the steps of another run: its steps and orders are its own", type));
  }
  return settings;
}

}  // namespace cvodes

SimulationResult cvodes_simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                                 std::span<const Cost> costs, const Sampling& sampling, const RunOptions& options) {
  cvodes::ForwardRun run(mechanism, settings, costs, options);
  cvodes::ForwardRun::Hooks hooks;
  if (sampling.observe) {
    hooks.sampled = [&](const SampleEvent& event, const StatePoint& at) {
      if (!event.cost) sampling.observe(event.index, at);
    };
  }
  run.go(sampling.times, hooks);
  return run.finish();
}

}  // namespace mbsopt
