#include "app/results/sensitivities_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/results/trajectory_csv.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/run/output_times.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt {

void require_sensitivities(const Scene& scene) {
  if (scene.sensors.empty())
    throw std::invalid_argument("sensors: there are none whose --sensitivities could be written");
  if (scene.parameters.empty())
    throw std::invalid_argument("parameters: there are none in which --sensitivities could be taken");
}

void write_sensitivities(Run& run) {
  const Scene& scene = run.problem.scene;
  const Mechanism mechanism(scene, parameter_values(scene));
  Trajectory table;
  table.columns = {"t"};
  for (const Sensor& sensor : scene.sensors) {
    for (const Parameter& parameter : scene.parameters)
      table.columns.push_back(fmt::format("d {}/d {}", sensor.name, parameter.name));
  }
  Eigen::VectorXd y_bar(mechanism.states()), gradient(mechanism.parameters());
  TangentSampling sampling;
  sampling.times = output_times(scene.simulation);
  std::vector<std::vector<double>> rows;
  // s(y(rho), rho):  ds/drho = s_rho + (dy/drho)' s_y
  sampling.observe = [&](std::size_t, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
    std::vector<double> row{at.t};
    for (int sensor = 0; sensor < mechanism.sensors(); ++sensor) {
      y_bar.setZero();
      gradient.setZero();
      mechanism.add_sensor_gradient(sensor, at, 1, y_bar, gradient);
      gradient.noalias() += y_rho.transpose() * y_bar;
      row.insert(row.end(), gradient.begin(), gradient.end());
    }
    rows.push_back(std::move(row));
  };
  RunOptions options;
  options.progress = run.watched("differentiating");
  const SimulationResult result = simulate_tlm(mechanism, scene.simulation, {}, sampling, options);
  run.progress.finish();
  if (result.status == SimulationStatus::stopped) return run.stopped("there is no sensitivities.csv");
  if (!result.ok()) return run.failed("no sensitivities: " + result.message, result.last_good_time);
  table.rows.swap(rows), rows.clear();
  run.write("sensitivities.csv", to_csv(table));
  // Steps across a kink do not know its instant: other tolerances tell whether that matters.
  const auto kink = std::ranges::find(result.statistics.jumps, 0.0, &Jump::size);
  if (kink == result.statistics.jumps.end()) return;
  const Scene tight = with_errors_times(0.1, scene, result.statistics.steps);
  if (!simulate_tlm(mechanism, tight.simulation, {}, sampling, options).ok()) return;
  constexpr double kResolved = 1e-4;  // of a column: as of gradients
  for (std::size_t c = 1; c < table.columns.size(); ++c) {
    double largest = 0, change = 0;
    for (std::size_t i = 0; i < rows.size(); ++i)
      largest = std::max(largest, std::abs(rows[i][c])),
      change = std::max(change, std::abs(rows[i][c] - table.rows[i][c]));
    if (change > kResolved * largest)
      return run.warn(
          fmt::format("the steps do not resolve the sensitivities: a tenth of the integration errors changes "
                      "{} by {:.2g}. {}. Tighten simulation.integrator.rtol and atol, or round the kink",
                      table.columns[c], change, in_words(scene, *kink)));
  }
}

}  // namespace mbsopt
