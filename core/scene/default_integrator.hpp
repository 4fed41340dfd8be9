// The default integrator is dopri853 at rtol 1e-8, atol 1e-10, with steps of at most 1/150 of the run. It costs three
// times the right-hand sides of dopri5 at 1e-6 and is a thousand times more exact (docs/tradeoffs.md). The limit covers
// what step-size control cannot see: a pulse between two steps, the quadrature of an objective, a kink in a derivative
// of a law.
#pragma once

#include "core/scene/settings.hpp"

namespace mbsopt {

inline IntegratorSettings default_integrator(double start_time, double end_time) {
  constexpr double kSteps = 150;  // in the run, at least
  IntegratorSettings settings;
  settings.type = "dopri853";
  settings.rtol = 1e-8;
  settings.atol = 1e-10;
  if (end_time > start_time) settings.max_step = (end_time - start_time) / kSteps;
  return settings;
}

}  // namespace mbsopt
