// Integration by CVODES (SUNDIALS): multistep methods of variable order and step. `cvodes_adams` has orders 1 to 12 and
// fixed-point iteration. `cvodes_bdf` has orders 1 to 5 and Newton's method, for stiff scenes. CVODES integrates
// further differential equations for the derivatives of the solution, each to its own error: forward sensitivities, or
// the adjoint backward. They share neither steps nor projection with the discrete derivatives of simulation.hpp: a
// second opinion.
//
//   simulate(mechanism, settings, costs)       uses CVODES where settings.integrator.type is cvodes_*
//   cvodes_forward(mechanism, with_cvodes(settings), costs)       uses CVODES for every type
//
// CVODES does not project: constraints drift by the tolerance. docs/cvodes.md.
//   Hindmarsh et al., "SUNDIALS: suite of nonlinear and differential/algebraic equation solvers", ACM TOMS 31 (2005);
//   Serban, Hindmarsh, "CVODES: the sensitivity-enabled ODE solver in SUNDIALS", ASME IDETC 2005.
#pragma once

#include <span>
#include <string_view>

#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class Mechanism;

bool is_cvodes(std::string_view integrator);

// Returns settings with the same span and tolerances, without a fixed step. A method that CVODES does not have becomes
// cvodes_adams.
SimulationSettings with_cvodes(SimulationSettings settings);

// Each throws std::invalid_argument for frozen steps, which a multistep method cannot take, and for a fixed step.
SimulationResult cvodes_simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                                 std::span<const Cost> costs = {}, const Sampling& sampling = {},
                                 const RunOptions& options = {});
SimulationResult cvodes_forward(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs = {}, const TangentSampling& sampling = {},
                                const RunOptions& options = {});
SimulationResult cvodes_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const RunOptions& options = {});

}  // namespace mbsopt
