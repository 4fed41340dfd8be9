// A pendulum with a viscous pin, its angle measured from the upward vertical (theta = pi hangs down):
//   theta'' = w2 sin(theta) - c theta'           w2 = m g a/J [1/s^2],  c = k/J [1/s]
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

namespace pendulum {

// m = 1 kg, a = 1 mm: the inertia about the pin is m g a/w2.
inline mbsopt::Problem problem(double w2, double c, double theta0, double omega0) {
  using mbsopt::Expression;
  mbsopt::Problem p;
  mbsopt::Scene& s = p.scene;
  s.name = "pendulum";
  s.gravity = {0.0, -9.81, 0.0};
  mbsopt::testing::add_parameters(s, {{"w2", w2}, {"c", c}, {"theta0", theta0}, {"omega0", omega0}});
  s.parameters[0].lower = 1, s.parameters[0].upper = 1000;
  s.parameters[1].lower = 0;
  s.definitions = {{"J", Expression::parse("9.81*0.001/w2")}};
  mbsopt::Body arm;
  arm.name = "arm", arm.mass = 1.0, arm.com = {0.0, 0.001, 0.0};
  arm.inertia = {1e-4, 1e-4, Expression::parse("J - 0.001^2"), 0.0, 0.0, 0.0};
  arm.orientation = mbsopt::AxisAngleField{{0.0, 0.0, 1.0}, Expression::parse("theta0")};
  s.bodies = {arm};
  s.joints = {mbsopt::testing::hinge("pin", "ground", "O", "arm", "O")};
  mbsopt::Rsda friction;
  friction.joint = "pin", friction.damping = Expression::parse("c*J");
  s.forces = {{"friction", friction}};
  s.sensors = {mbsopt::testing::angle_sensor("theta", "pin")};
  s.conditions = {{"theta", Expression::parse("theta0"), Expression::parse("omega0")}};
  s.simulation.integrator.rtol = 1e-8, s.simulation.integrator.atol = 1e-10;
  return p;
}

// Its exact motion by classical Runge-Kutta steps of 1 ms, written without the toolkit, sampled every `stride` ms.
inline mbsopt::CsvTable exact_motion(double w2, double c, double theta, double omega, double end, int stride = 10) {
  mbsopt::CsvTable table;
  table.name = "exact", table.header = {"t", "theta"}, table.columns.resize(2);
  const double h = 1e-3;
  auto acceleration = [&](double q, double v) { return w2 * std::sin(q) - c * v; };
  for (int i = 0; i * h <= end + 1e-9; ++i) {
    if (i % stride == 0) {
      table.columns[0].push_back(i * h), table.columns[1].push_back(theta);
      table.lines.push_back(table.lines.size() + 2);
    }
    const double v1 = omega, a1 = acceleration(theta, v1);
    const double v2 = omega + h / 2 * a1, a2 = acceleration(theta + h / 2 * v1, v2);
    const double v3 = omega + h / 2 * a2, a3 = acceleration(theta + h / 2 * v2, v3);
    const double v4 = omega + h * a3, a4 = acceleration(theta + h * v3, v4);
    theta += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    omega += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return table;
}

inline void add_noise(mbsopt::CsvTable& table, double sigma, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;  // sigma may be 0
  for (double& x : table.columns[1]) x += sigma * normal(generator);
}

inline mbsopt::ExperimentSpec experiment(const std::string& name, const std::vector<std::string>& free) {
  mbsopt::ExperimentSpec e;
  e.name = name, e.free = free;
  mbsopt::ChannelSpec channel;
  channel.column = "theta", channel.sensor = "theta", channel.sigma = 0.01;
  e.channels = {channel};
  return e;
}

}  // namespace pendulum
