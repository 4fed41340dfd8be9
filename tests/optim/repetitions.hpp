// Three small identifications with known truth, for studies over noisy repetitions: exact motions in closed form or by
// Runge-Kutta steps of 1 ms, written without the toolkit, and the problems that fit them.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "tests/optim/pendulum.hpp"

namespace repetitions {

struct Study {
  std::string name;
  mbsopt::Problem problem;
  std::vector<mbsopt::CsvTable> clean;  // a table per experiment, noise to be added to the columns after t
  std::vector<double> truth;            // in the order of the fitted parameters
  double sigma;
};

// A weight on a spring and a damper, started at x0 with speed v0: x = exp(-d t)(x0 cos wt + (v0 + d x0)/w sin wt).
inline mbsopt::CsvTable damped_decay(double w2, double gamma, double x0, double v0, double end, double step) {
  mbsopt::CsvTable table;
  table.name = "decay", table.header = {"t", "x"}, table.columns.resize(2);
  const double d = gamma / 2, w = std::sqrt(w2 - d * d);
  for (int i = 0; i * step <= end + 1e-9; ++i) {
    const double t = i * step;
    table.columns[0].push_back(t);
    table.columns[1].push_back(std::exp(-d * t) * (x0 * std::cos(w * t) + (v0 + d * x0) / w * std::sin(w * t)));
    table.lines.push_back(table.lines.size() + 2);
  }
  return table;
}

// A slider of 2 kg on the x axis: stiffness k, damping c, free length 0; starts at x0 with v0.
inline mbsopt::Problem slider(double k, double c) {
  using mbsopt::Expression;
  mbsopt::Problem p;
  mbsopt::Scene& s = p.scene;
  s.name = "slider", s.gravity = {0.0, 0.0, 0.0};
  mbsopt::testing::add_parameters(s, {{"k", k}, {"c", c}, {"x0", 0.2}, {"v0", 0.0}, {"offset", 0.0}});
  s.parameters[0].lower = 1, s.parameters[0].scale = mbsopt::ParameterScale::log;
  s.parameters[1].lower = 0;
  mbsopt::Body weight;
  weight.name = "weight", weight.mass = 2.0, weight.inertia = {0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  weight.position = {Expression::parse("x0"), 0.0, 0.0};
  s.bodies = {weight};
  mbsopt::Joint rail;
  rail.name = "rail", rail.type = "translational", rail.body1 = "ground", rail.body2 = "weight";
  rail.axis1 = rail.axis2 = mbsopt::VectorField{1.0, 0.0, 0.0};
  s.joints = {rail};
  mbsopt::Tsda spring;  // from far away, so that its length never is zero
  spring.body1 = "ground", spring.body2 = "weight", spring.point1 = mbsopt::VectorField{-10.0, 0.0, 0.0};
  spring.stiffness = Expression::parse("k"), spring.damping = Expression::parse("c"), spring.free_length = 10.0;
  s.forces = {{"spring", spring}};
  s.sensors = {mbsopt::testing::point_sensor("x", "position", "weight", mbsopt::PointField("O"), "x")};
  s.conditions = {{"x", Expression::parse("x0"), Expression::parse("v0")}};
  s.simulation.integrator.rtol = 1e-8, s.simulation.integrator.atol = 1e-10;
  return p;
}

inline mbsopt::ExperimentSpec slider_run(const std::string& name, const std::vector<std::string>& free) {
  mbsopt::ExperimentSpec e = pendulum::experiment(name, free);
  e.channels[0].column = "x", e.channels[0].sensor = "x";
  return e;
}

inline std::vector<Study> studies() {
  std::vector<Study> all;
  {
    Study s{"pendulum", pendulum::problem(64, 0.055, 1.53, 1.55), {}, {64, 0.055, 1.53, 1.55}, 0.02};
    s.problem.identification.emplace();
    s.problem.identification->variables = {"w2", "c"};
    s.problem.identification->experiments = {pendulum::experiment("run1", {"theta0", "omega0"})};
    s.clean = {pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2, 20)};
    all.push_back(std::move(s));
  }
  {  // two runs share stiffness and damping, each has its start
    Study s{"slider, two runs", slider(50, 1.2), {}, {50, 1.2, 0.2, 0.15, -0.1, 0.3}, 0.005};
    s.problem.identification.emplace();
    s.problem.identification->variables = {"k", "c"};
    s.problem.identification->experiments = {slider_run("run1", {"x0", "v0"}), slider_run("run2", {"x0", "v0"})};
    s.problem.identification->experiments[1].overrides = {{"x0", -0.1}};
    s.clean = {damped_decay(25, 0.6, 0.2, 0.15, 3, 0.05), damped_decay(25, 0.6, -0.1, 0.3, 2, 0.05)};
    all.push_back(std::move(s));
  }
  {  // the sensor has an offset and comes late
    Study s{"slider, offset and delay", slider(50, 1.2), {}, {50, 1.2, 0.03, 0.02}, 0.005};
    mbsopt::testing::add_parameters(s.problem.scene, {{"tau", 0.0}});
    s.problem.scene.parameters.back().lower = -0.1, s.problem.scene.parameters.back().upper = 0.1;
    s.problem.identification.emplace();
    s.problem.identification->variables = {"k", "c", "offset", "tau"};
    s.problem.identification->experiments = {slider_run("run1", {})};
    s.problem.identification->experiments[0].channels[0].bias = mbsopt::Expression::parse("offset");
    s.problem.identification->experiments[0].channels[0].delay = mbsopt::Expression::parse("tau");
    s.clean = {damped_decay(25, 0.6, 0.2, 0.0, 4, 0.04)};
    for (double& t : s.clean[0].columns[0]) t += 0.02;
    for (double& x : s.clean[0].columns[1]) x += 0.03;
    all.push_back(std::move(s));
  }
  return all;
}

// The same with noise of its own for every repetition.
inline std::vector<mbsopt::CsvTable> repeated(const Study& study, unsigned repetition) {
  std::vector<mbsopt::CsvTable> data = study.clean;
  std::mt19937 generator(1000 + repetition);
  std::normal_distribution<double> normal(0, study.sigma);
  for (mbsopt::CsvTable& table : data)
    for (std::size_t c = 1; c < table.columns.size(); ++c)
      for (double& x : table.columns[c]) x += normal(generator);
  return data;
}

}  // namespace repetitions
