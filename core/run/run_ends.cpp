#include "core/run/run_ends.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/sensor/body_at.hpp"

namespace mbsopt {

SimulationResult result_at_start(const Assembly& start, double t, std::size_t costs) {
  SimulationResult result;
  result.psi.setZero(static_cast<Eigen::Index>(costs));
  result.last_good_time = t;
  result.y_initial = start.result().y;
  if (!start.result().ok) result.stop(SimulationStatus::assembly_failed, start.result().message);
  return result;
}

double fastest_followed_rate(const MechanismData& data, const Eigen::VectorXd& y) {
  double fastest = 0;
  for (const JointAngle& a : data.angles)
    fastest = std::max(fastest, std::abs(a.rate(body_at(y, a.body1), body_at(y, a.body2))));
  return fastest;
}

void report_step(const StatePoint& here, const RunOptions& options, SimulationResult& result) {
  if (options.after_step) options.after_step(here);
  if (!options.progress || options.progress(here.t)) return;
  result.stop(SimulationStatus::stopped, fmt::format("stopped at t = {:.6g} s", here.t));
}

void note_state(double position, double relative, double velocity, const Energy& energy, SimulationStatistics& s) {
  s.max_position_violation = std::max(s.max_position_violation, position);
  s.relative_position_violation = std::max(s.relative_position_violation, relative);
  s.max_velocity_violation = std::max(s.max_velocity_violation, velocity);
  s.energy_final = energy.kinetic + energy.potential;
  s.energy_drift = std::max(s.energy_drift, std::abs(s.energy_final - s.energy_initial));
}

void add_terminal_costs(std::span<const Cost> costs, const StatePoint& end, SimulationResult& result) {
  for (std::size_t o = 0; o < costs.size(); ++o)
    if (costs[o].terminal) result.psi(static_cast<Eigen::Index>(o)) += costs[o].terminal->value(end);
  if (!result.psi.allFinite()) result.stop(SimulationStatus::not_finite, not_finite_costs(costs, result.psi));
}

void add_start_gradient(const Assembly& start, const Eigen::MatrixXd& lambda, Eigen::MatrixXd mu,
                        SimulationResult& result) {
  start.add_adjoint(lambda, mu);
  result.psi_y_initial = lambda.transpose();
  result.psi_rho = mu.transpose();
}

}  // namespace mbsopt
