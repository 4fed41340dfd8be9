// Integration by CVODES (SUNDIALS): multistep methods of variable order and step, `cvodes_adams` (orders 1 to 12,
// fixed-point iteration) and `cvodes_bdf` (orders 1 to 5, Newton's method, for stiff scenes). Its derivatives are those
// of the solution of the differential equation, found by integrating further differential equations (the
// sensitivities forward, the adjoint backward), each to its own error: a second opinion that shares neither steps nor
// projection with the discrete derivatives of simulation.hpp.
//
//   simulate(mechanism, settings, costs)       takes these where settings.integrator.type is cvodes_*
//   cvodes_forward(mechanism, with_cvodes(settings), costs)       asks for them whatever the type
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

// Returns settings with the same span and tolerances, without a fixed step. The method becomes cvodes_adams if it is
// none of CVODES.
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
