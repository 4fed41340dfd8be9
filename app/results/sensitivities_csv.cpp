#include "app/results/sensitivities_csv.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "app/results/trajectory_csv.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"

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
    table.rows.push_back(std::move(row));
  };
  RunOptions options;
  options.progress = run.watched("differentiating");
  const SimulationResult result = simulate_tlm(mechanism, scene.simulation, {}, sampling, options);
  run.progress.finish();
  if (result.status == SimulationStatus::stopped) return run.stopped("there is no sensitivities.csv");
  if (!result.ok()) return run.failed("no sensitivities: " + result.message, result.last_good_time);
  run.write("sensitivities.csv", to_csv(table));
}

}  // namespace mbsopt
