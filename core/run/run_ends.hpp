// Runs by all methods do the same at their start, after each step, and at their end.
#pragma once

#include <span>

#include "core/mechanism/mechanism_data.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt {

// The result of a run that has not begun; its status says if there is no state to begin from.
SimulationResult result_at_start(const Assembly& start, double t, std::size_t costs);
// The fastest turning of a joint whose angle is followed [rad/s]. Steps of half a turn or more lose its branch.
double fastest_followed_rate(const MechanismData& data, const Eigen::VectorXd& y);
// Calls the functions of the options after a step that ends here; the run may be stopped by them.
void report_step(const StatePoint& here, const RunOptions& options, SimulationResult& result);
// Notes the violations of the constraints and the energy at the end of a step.
void note_state(double position, double relative, double velocity, const Energy& energy, SimulationStatistics& s);
// Adds the terminal costs to psi, which is then complete: the status says if some of it is not finite.
void add_terminal_costs(std::span<const Cost> costs, const StatePoint& end, SimulationResult& result);

// The gradients of the adjoint method, from those in the state at the start, lambda, and in the parameters, mu.
void add_start_gradient(const Assembly& start, const Eigen::MatrixXd& lambda, Eigen::MatrixXd mu,
                        SimulationResult& result);

}  // namespace mbsopt
