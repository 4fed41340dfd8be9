// The default integrator is dopri853 at rtol 1e-8, atol 1e-10, with steps of at most 1/150 of the run. It costs three
// times the right-hand sides of dopri5 at 1e-6 and is a thousand times more exact (docs/tradeoffs.md). The limit covers
// what step-size control cannot see: a pulse between two steps, the quadrature of an objective, a kink in a derivative
// of a law.
#pragma once

#include "core/scene/settings.hpp"

namespace mbsopt {

IntegratorSettings default_integrator(double start_time, double end_time);

// The fields of an integrator that a file gives; defaults replace the rest. A type in the file keeps its own tolerances
// (settings.hpp) and has no limit of the step.
struct IntegratorGiven {
  bool type = false, rtol = false, atol = false, step = false, max_step = false;
};
void choose_what_is_left_out(SimulationSettings& settings, const IntegratorGiven& given);

}  // namespace mbsopt
