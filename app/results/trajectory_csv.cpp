#include "app/results/trajectory_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "app/files/csv_cell.hpp"

namespace mbsopt {
namespace {

constexpr int kDefaultIntervals = 200;

}  // namespace

// start, start + output_step, ..., end: the end is always a row, exactly once.
std::vector<double> output_times(const SimulationSettings& settings) {
  const double span = settings.end_time - settings.start_time;
  const double step = settings.output_step.value_or(span / kDefaultIntervals);
  const double tolerance = 1e-9;  // of a step: 5/0.01 is not 500 in floating point
  const auto whole_steps = static_cast<long>(std::floor(span / step + tolerance));
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(whole_steps) + 2);
  for (long k = 0; k <= whole_steps; ++k) times.push_back(settings.start_time + static_cast<double>(k) * step);
  if (times.back() < settings.end_time - tolerance * step) {
    times.push_back(settings.end_time);
  } else {
    times.back() = settings.end_time;
  }
  return times;
}

std::vector<std::string> trajectory_columns(const Scene& scene) {
  std::vector<std::string> columns{"t"};
  for (const Body& body : scene.bodies) {
    for (const char* suffix : {"x", "y", "z", "e0", "e1", "e2", "e3", "vx", "vy", "vz", "wx", "wy", "wz"}) {
      columns.push_back(body.name + "." + suffix);
    }
  }
  for (const Sensor& sensor : scene.sensors) columns.push_back(sensor.name);
  return columns;
}

Sampling record_trajectory(const Mechanism& mechanism, const Scene& scene, Trajectory& trajectory) {
  trajectory.columns = trajectory_columns(scene);
  Sampling sampling;
  sampling.times = output_times(scene.simulation);
  sampling.observe = [&mechanism, &trajectory](std::size_t, const StatePoint& at) {
    std::vector<double> row{at.t};
    row.reserve(trajectory.columns.size());
    for (int body = 0; body < mechanism.bodies(); ++body) {
      const Eigen::Matrix<double, 13, 1> values = body_row(mechanism, body, at);
      row.insert(row.end(), values.begin(), values.end());
    }
    for (int sensor = 0; sensor < mechanism.sensors(); ++sensor) row.push_back(mechanism.sensor_value(sensor, at));
    trajectory.rows.push_back(std::move(row));
  };
  return sampling;
}

std::optional<std::string> to_csv(const Trajectory& trajectory, const std::function<bool(double)>& go_on) {
  std::string text;
  std::array<char, 32> number;  // the shortest text that reads back as the same double has 24 characters at most
  for (const std::string& column : trajectory.columns) text += (text.empty() ? "" : ",") + csv_cell(column);
  text += '\n';
  for (const std::vector<double>& row : trajectory.rows) {
    if (!row.empty() && !go_on(row.front())) return std::nullopt;
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (k > 0) text += ',';
      if (std::isfinite(row[k])) text.append(number.data(), std::to_chars(number.begin(), number.end(), row[k]).ptr);
    }
    text += '\n';
  }
  return text;
}

std::string to_csv(const std::vector<std::string>& columns, const std::vector<std::vector<double>>& rows) {
  return *to_csv({columns, rows}, [](double) { return true; });
}

}  // namespace mbsopt
