#include "core/scene/default_integrator.hpp"

namespace mbsopt {

IntegratorSettings default_integrator(double start_time, double end_time) {
  constexpr double kSteps = 150;  // in the run, at least
  IntegratorSettings settings;
  settings.type = "dopri853";
  settings.rtol = 1e-8;
  settings.atol = 1e-10;
  if (end_time > start_time) settings.max_step = (end_time - start_time) / kSteps;
  return settings;
}

void choose_what_is_left_out(SimulationSettings& settings, const IntegratorGiven& given) {
  const IntegratorSettings chosen = default_integrator(settings.start_time, settings.end_time);
  IntegratorSettings& s = settings.integrator;
  if (!given.type) s.type = chosen.type;
  if (s.type != chosen.type) return;
  if (!given.rtol) s.rtol = chosen.rtol;
  if (!given.atol) s.atol = chosen.atol;
  if (!given.type && !given.step && !given.max_step) s.max_step = chosen.max_step;
}

}  // namespace mbsopt
