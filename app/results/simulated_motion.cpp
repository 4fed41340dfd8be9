#include "app/results/simulated_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "app/results/trajectory_mat.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/integrate/model_choice.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/run/output_times.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "core/start/assembly.hpp"
#include "core/start/model_warnings.hpp"
#include "optim/objective/integration_error.hpp"
#include "optim/objective/objective_run.hpp"

namespace mbsopt::inline app {
namespace {

std::vector<std::vector<double>> instants_of(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                             const std::function<bool(double t)>& progress) {
  std::vector<std::vector<double>> instants(objectives.size());
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    if (!objectives[i].free_instants()) continue;
    for (const FreeInstants::Instant& instant : objectives[i].free_instants()->nearest(mechanism, progress))
      instants[i].push_back(instant.tau);
  }
  return instants;
}

// Asks for the unit of a run of milliseconds in which nothing visible happens, though the bodies move.
void warn_of_short_run(const Scene& scene, SimulatedMotion& motion) {
  constexpr double kShort = 0.01, kVisible = 1e-5, kRounding = 1e-12;  // s; of a length, rad
  const SimulationSettings& settings = scene.simulation;
  const double span = settings.end_time - settings.start_time;
  const Eigen::VectorXd moved = motion.simulation.y_end - motion.simulation.y_initial;
  const double length = SceneFacts(scene).scale().length;
  double most = 0;  // of a length, rad
  for (Eigen::Index i = 0; 14 * i < moved.size(); ++i)
    most = std::max(
        {most, moved.segment<3>(7 * i).norm() / (length > 0 ? length : 1), moved.segment<4>(7 * i + 3).norm()});
  if (scene.equilibrium || span > kShort || most > kVisible || most < kRounding) return;
  motion.warnings.push_back(
      fmt::format("simulation.end_time: in {:.3g} s nothing moves by more than {:.0e} of its "
                  "length: is the time in ms? Write the unit, as in \"{:.3g} [s]\"",
                  span, most, settings.end_time));
}

}  // namespace

SimulatedMotion simulated_motion(Run& run, const Eigen::VectorXd& rho) {
  const Scene& scene = run.problem.scene;
  const SimulationSettings& settings = scene.simulation;
  const std::vector<Objective> objectives = objectives_of(run.problem);
  const std::vector<bool> no_derivatives(scene.parameters.size(), false);
  const Mechanism mechanism(scene, rho, no_derivatives);

  SimulatedMotion motion;
  const Assembly assembly(mechanism, settings.start_time);
  if (!assembly.result().ok) {
    motion.simulation.status = SimulationStatus::assembly_failed;
    motion.simulation.message = assembly.result().message;
    motion.simulation.last_good_time = settings.start_time;
    return motion;
  }
  motion.model = assembly.summary();
  add_model(mechanism, settings, motion.model);
  motion.warnings = model_warnings(mechanism, assembly);

  motion.running.columns = {"t"};
  std::vector<std::shared_ptr<const PointCost>> terms;  // g of a sum or x of a mean or extreme; null if there is none
  for (const Objective& objective : objectives) {
    motion.running.columns.push_back(objective.name());
    terms.push_back(objective.expression(mechanism));
  }
  RunOptions options;
  options.progress = run.watched("simulating");
  const auto recorded = [&](std::span<const Cost> costs) {
    Sampling sampling = record_motion(mechanism, scene, motion);
    motion.running.rows.clear();
    sampling.observe = [&, record = sampling.observe](std::size_t i, const StatePoint& at) {
      record(i, at);
      std::vector<double>& row = motion.running.rows.emplace_back(std::vector<double>{at.t});
      for (const auto& term : terms) row.push_back(term ? term->value(at) : std::numeric_limits<double>::quiet_NaN());
    };
    return simulate(mechanism, settings, costs, sampling, options);
  };
  try {
    motion.simulation = run_objectives(objectives, mechanism, settings, recorded, options.progress);
    motion.instants = instants_of(objectives, mechanism, options.progress);
  } catch (const NoMotion&) {  // the simulation ends there, too
    motion.simulation = recorded({});
    if (motion.simulation.ok()) throw;
  }
  if (motion.simulation.ok()) {
    motion.true_values = true_extremes(objectives, mechanism, settings, motion.simulation.steps, options.progress);
    if (interrupted()) motion.simulation.status = SimulationStatus::stopped;
  }
  run.progress.finish();
  if (!motion.simulation.ok()) return motion;
  warn_of_short_run(scene, motion);
  motion.psi = motion.simulation.psi;
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    motion.psi(static_cast<Eigen::Index>(i)) += objectives[i].parameters_only(rho);
  }
  for (std::string& words : missed_peaks(objectives, motion.psi, motion.true_values))
    motion.warnings.push_back(std::move(words));
  return motion;
}

void add_instants(Run& run, const SimulatedMotion& motion) {
  Json& objectives = run.result["objectives"];
  for (std::size_t i = 0; i < motion.instants.size(); ++i)
    if (const std::string& name = run.problem.objectives[i].name;
        !motion.instants[i].empty() && objectives.contains(name))
      objectives[name]["instants"] = motion.instants[i];
}

void write_trajectory(Run& run, const Trajectory& trajectory, const std::vector<SingularPosition>& singular) {
  std::vector<std::optional<double>> first_missing(trajectory.columns.size());  // [s], per column
  for (const std::vector<double>& row : trajectory.rows) {
    const auto contains = [&](const SingularPosition& s) { return std::abs(row.front() - s.t) < s.half; };
    if (std::ranges::any_of(singular, contains)) continue;  // their warning names what is missing
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (!std::isfinite(row[k]) && !first_missing[k]) first_missing[k] = row.front();
    }
  }
  for (std::size_t k = 0; k < first_missing.size(); ++k) {
    if (first_missing[k])
      run.warn(
          fmt::format("'{}' is too large for a number at t = {:.6g} s, and empty in trajectory.csv. Look at masses, "
                      "inertias, coordinates and the forces on the bodies",
                      trajectory.columns[k], *first_missing[k]));
  }
  const bool motion_ends_early = interrupted();  // by an earlier Ctrl-C: what there is of it is kept
  const std::function<bool(double)> watch = run.watched("writing trajectory.csv");
  const std::optional<std::string> text = to_csv(trajectory, [&](double t) { return watch(t) || motion_ends_early; });
  run.progress.finish();
  if (!text) return run.stopped("trajectory.csv was not written");
  run.write("trajectory.csv", *text);
  if (run.context.options.mat) run.write("trajectory.mat", to_mat(trajectory));
}

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
  table.rows.swap(rows);
  rows.clear();
  run.write("sensitivities.csv", to_csv(table));
  // Steps across a kink do not know its instant: other tolerances tell whether that matters.
  const auto kink = std::ranges::find(result.statistics.jumps, 0.0, &Jump::size);
  if (kink == result.statistics.jumps.end()) return;
  const Scene tight = with_errors_times(0.1, scene, result.statistics.steps);
  if (!simulate_tlm(mechanism, tight.simulation, {}, sampling, options).ok()) return;
  constexpr double kResolved = 1e-4;  // of a column: as of gradients
  for (std::size_t c = 1; c < table.columns.size(); ++c) {
    double largest = 0, change = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      largest = std::max(largest, std::abs(rows[i][c]));
      change = std::max(change, std::abs(rows[i][c] - table.rows[i][c]));
    }
    if (change > kResolved * largest)
      return run.warn(
          fmt::format("the steps do not resolve the sensitivities: a tenth of the integration errors changes "
                      "{} by {:.2g}. {}. Tighten simulation.integrator.rtol and atol, or round the kink",
                      table.columns[c], change, in_words(scene, *kink)));
  }
}

}  // namespace mbsopt::inline app
