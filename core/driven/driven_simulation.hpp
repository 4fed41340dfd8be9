// simulate, simulate_tlm and simulate_adjoint of mechanisms whose drives leave nothing free. With J = Phi_q of full
// column rank the state at t is a function of rho alone, so that no sweep goes through time:
//
//   J q_rho = -Phi_rho,    J v_rho = -(Phi_q v + Phi_t)_q q_rho - (Phi_q v + Phi_t)_rho
//   psi_rho = sum of w (g_y y_rho + g_rho) over the instants taken, w: the weights of the quadrature
//
// The tangent multiplies with y_rho, the adjoint solves with J' per instant and objective. Both are the derivatives of
// a projection (core/projection/projection.hpp), which depends on nothing but t and rho here.
#pragma once

#include <span>

#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt {

class Mechanism;

// Whether the run is solved: there are drives, they leave nothing free at the start, and no setting asks for an
// integration (solve "dynamics", a fixed step, CVODES, soft joints, no projection, a start from equilibrium).
// Throws std::invalid_argument where solve is "kinematics" and that cannot be.
bool is_solved(const Mechanism& mechanism, const SimulationSettings& settings, const Assembly& start);

// Whether a run would be solved if its mechanism could be assembled: by its settings and the number of its equations.
bool may_be_solved(const Mechanism& mechanism, const SimulationSettings& settings);

SimulationResult driven_simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                                 std::span<const Cost> costs, const Sampling& sampling, const RunOptions& options,
                                 const Assembly& start);
// unknown: observers get no ydot, so that no equations of motion are solved for it. without_tangents: nor are
// derivatives of velocities computed; those rows of y_rho are meaningless.
enum class Rates { known, unknown, without_tangents };
SimulationResult driven_tlm(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                            const TangentSampling& sampling, const RunOptions& options, const Assembly& start,
                            Rates rates = Rates::known);
SimulationResult driven_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const RunOptions& options, const Assembly& start);

}  // namespace mbsopt
