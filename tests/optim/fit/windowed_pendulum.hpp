// A double pendulum whose record is cut into windows.
#pragma once

#include <catch2/catch.hpp>
#include <random>
#include <string>

#include "optim/fit/experiment.hpp"
#include "optim/problem/parameter_values.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

namespace mbsopt::testing {

inline constexpr double kWindowNoise = 0.003;

// Damping d in both joints; angles q1, q2 and rates o1, o2 at the start.
inline Scene damped_double_pendulum() {
  Scene s = double_pendulum();
  s.gravity = {0.0, -9.81, 0.0};
  add_parameters(s, {{"d", 0.05}, {"q1", 0.4}, {"q2", 0.7}, {"o1", 0.5}, {"o2", -1}});
  s.bodies[0].angular_velocity = vec("0", "0", "0");
  for (const char* joint : {"A", "B"}) {
    Rsda damper;
    damper.joint = joint, damper.damping = f("d");
    s.forces.push_back({std::string("damper_") + joint, damper});
  }
  s.conditions = {{"theta1", f("q1 - pi/2"), f("o1")}, {"theta2", f("q2"), f("o2")}};
  return s;
}

// A double pendulum that swings for 4 s, angles at 100 Hz, in windows of 1 s with a start each.
inline Problem windowed(double length = 1) {
  Problem p;
  p.scene = damped_double_pendulum();
  p.scene.simulation.integrator.rtol = 1e-8;
  p.identification.emplace();
  p.identification->variables = {"c2", "d"};
  ExperimentSpec e;
  e.name = "swing", e.free = {"q1", "q2", "o1", "o2"};
  e.windows.emplace().length = length;
  for (const char* angle : {"theta1", "theta2"}) {
    ChannelSpec channel;
    channel.column = channel.sensor = angle, channel.sigma = kWindowNoise;
    e.channels.push_back(channel);
  }
  p.identification->experiments.push_back(e);
  return p;
}

// Its record: 100 samples per second.
inline CsvTable motion(const Problem& p, double noise, double duration = 4) {
  CsvTable table;
  table.name = "swing.csv", table.header = {"t", "theta1", "theta2"}, table.columns.resize(3);
  for (std::size_t i = 0; i <= static_cast<std::size_t>(100 * duration); ++i) {
    table.columns[0].push_back(0.01 * static_cast<double>(i)), table.lines.push_back(i + 2);
    table.columns[1].push_back(0), table.columns[2].push_back(0);
  }
  ExperimentSpec whole = p.identification->experiments[0];
  whole.windows.reset();
  const Experiment run(p.scene, whole, "here", table, parameter_values(p.scene), {});
  const Experiment::Residuals r = run.residuals(Eigen::VectorXd());
  REQUIRE(r.ok);
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < run.samples().size(); ++i) {
    const Experiment::Sample& s = run.samples()[i];
    table.columns[1 + s.channel][s.time] =
        -kWindowNoise * r.z(static_cast<Eigen::Index>(i)) + noise * normal(generator);
  }
  return table;
}

inline Parameter& parameter(Problem& p, const std::string& name) {
  return p.scene.parameters[static_cast<std::size_t>(parameter_indices(p.scene, {name}).front())];
}

}  // namespace mbsopt::testing
