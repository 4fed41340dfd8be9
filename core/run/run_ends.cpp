#include "core/run/run_ends.hpp"

#include <fmt/format.h>

namespace mbsopt {

SimulationResult result_at_start(const Assembly& start, double t, std::size_t costs) {
  SimulationResult result;
  result.psi.setZero(static_cast<Eigen::Index>(costs));
  result.last_good_time = t;
  result.y_initial = start.result().y;
  if (start.result().ok) return result;
  result.status = SimulationStatus::assembly_failed;
  result.message = start.result().message;
  return result;
}

void report_step(const StatePoint& here, const RunOptions& options, SimulationResult& result) {
  if (options.after_step) options.after_step(here);
  if (!options.progress || options.progress(here.t)) return;
  result.status = SimulationStatus::stopped;
  result.message = fmt::format("stopped at t = {:.6g} s", here.t);
}

void add_terminal_costs(std::span<const Cost> costs, const StatePoint& end, SimulationResult& result) {
  for (std::size_t o = 0; o < costs.size(); ++o)
    if (costs[o].terminal) result.psi(static_cast<Eigen::Index>(o)) += costs[o].terminal->value(end);
  if (result.psi.allFinite()) return;
  result.status = SimulationStatus::not_finite;
  result.message = not_finite_costs(costs, result.psi);
}

void add_start_gradient(const Assembly& start, const Eigen::MatrixXd& lambda, Eigen::MatrixXd mu,
                        SimulationResult& result) {
  start.add_adjoint(lambda, mu);
  result.psi_y_initial = lambda.transpose();
  result.psi_rho = mu.transpose();
}

}  // namespace mbsopt
