// simulate, simulate_tlm and simulate_adjoint of mechanisms whose drives leave no freedom. J = Phi_q has full column
// rank, so the state at t is a function of rho alone and no sweep through time is necessary:
//
//   J q_rho = -Phi_rho,    J v_rho = -(Phi_q v + Phi_t)_q q_rho - (Phi_q v + Phi_t)_rho
//   psi_rho = sum of w (g_y y_rho + g_rho) over the instants taken, w: the weights of the quadrature
//
// The tangent multiplies with y_rho. The adjoint solves with J' per instant and objective. Both are the derivatives of
// a projection (core/projection/projection.hpp), which depends only on t and rho here.
#pragma once

#include <span>

#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt {

class Mechanism;

// Returns whether the run is solved, not integrated: drives exist and leave no freedom at the start, and no setting
// demands an integration. Such settings are: solve "dynamics", a fixed step, CVODES, soft joints, no projection, a
// start from equilibrium. Throws std::invalid_argument if solve is "kinematics" and the run cannot be solved.
bool is_solved(const Mechanism& mechanism, const SimulationSettings& settings, const Assembly& start);

// Returns whether the settings and the number of equations allow a solved run, if the mechanism can be assembled.
bool may_be_solved(const Mechanism& mechanism, const SimulationSettings& settings);

SimulationResult driven_simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                                 std::span<const Cost> costs, const Sampling& sampling, const RunOptions& options,
                                 const Assembly& start);
// With `unknown`, observers get no ydot, and no equations of motion are solved for it. `without_tangents` also omits
// the derivatives of velocities; those rows of y_rho are meaningless.
enum class Rates { known, unknown, without_tangents };
SimulationResult driven_tlm(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                            const TangentSampling& sampling, const RunOptions& options, const Assembly& start,
                            Rates rates = Rates::known);
SimulationResult driven_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const RunOptions& options, const Assembly& start);

}  // namespace mbsopt
