#include "core/start/equilibrium.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// An arm on a hinge about y held by a torsional spring against its weight: k theta = m g c cos(theta).
Scene held_arm() {
  Scene s;
  add_parameters(s, {{"m", 2.0}, {"c", 0.5}, {"k", 30.0}, {"g", 9.81}});
  s.gravity = vec("0", "0", "-g");
  Body b = plain_body("arm", 1, {0.1, 0.2, 0.2, 0.0, 0.0, 0.0}, vec("0", "0", "0"));
  b.mass = f("m"), b.com = vec("c", "0", "0");
  s.bodies.push_back(b);
  Joint j = hinge("A", "ground", vec("0", "0", "0"), "arm", vec("0", "0", "0"));
  j.axis1 = vec("0", "1", "0"), j.axis2 = vec("0", "1", "0");
  s.joints.push_back(j);
  Rsda spring;
  spring.joint = "A", spring.stiffness = f("k"), spring.damping = 0.3;
  s.forces.push_back({"spring", spring});
  s.sensors.push_back(angle_sensor("theta", "A"));
  s.equilibrium = true;
  return s;
}

double sag(double m, double c, double k, double g) {  // k theta = m g c cos(theta), by Newton's method
  double theta = 0;
  for (int i = 0; i < 50; ++i) {
    theta -= (k * theta - m * g * c * std::cos(theta)) / (k + m * g * c * std::sin(theta));
  }
  return theta;
}

}  // namespace

TEST_CASE("an arm on a torsional spring starts where spring and weight balance", "[equilibrium]") {
  const Scene scene = held_arm();
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  const double theta = sag(2, 0.5, 30, 9.81);
  CHECK(assembly.result().angles(0) == Approx(theta).epsilon(1e-12));
  CHECK(assembly.result().y.tail(7).norm() == 0);
  // Its derivatives: (k + m g c sin) theta' = (m g c)' cos - k' theta
  const MatrixXd y_rho = assembly.tangent();
  const double slope = 30 + 2 * 9.81 * 0.5 * std::sin(theta);
  const double expected[] = {9.81 * 0.5 * std::cos(theta) / slope, 2 * 9.81 * std::cos(theta) / slope, -theta / slope,
                             2 * 0.5 * std::cos(theta) / slope};
  VectorXd y_bar = VectorXd::Zero(14), rho_bar = VectorXd::Zero(4);
  const VectorXd angles = assembly.result().angles;
  mechanism.add_sensor_gradient(0, {0, assembly.result().y, angles}, 1, y_bar, rho_bar);
  for (int k = 0; k < 4; ++k) CHECK(y_bar.dot(y_rho.col(k)) + rho_bar(k) == Approx(expected[k]).epsilon(1e-10));
}

TEST_CASE("a simulation from equilibrium stays there", "[equilibrium]") {
  Scene scene = held_arm();
  scene.simulation.end_time = 2;
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult run = simulate(mechanism, scene.simulation);
  REQUIRE(run.ok());
  CHECK((run.y_end - run.y_initial).lpNorm<Eigen::Infinity>() < 1e-10);
}

TEST_CASE("a closed loop hangs where its potential energy is least, and moves as differences say", "[equilibrium]") {
  Scene scene = four_bar();
  scene.gravity = {0.0, -9.81, 0.0};
  scene.equilibrium = true;
  Tsda spring;
  spring.body2 = "coupler", spring.point1 = vec("0.2", "1.5", "0"), spring.point2 = vec("L2/3", "0", "0");
  spring.stiffness = 25.0, spring.free_length = 0.3;
  scene.forces.push_back({"spring", spring});
  const VectorXd rho = nominal(scene);
  auto state = [&](const VectorXd& at) {
    const Assembly assembly(Mechanism(scene, at), 0);
    INFO(assembly.result().message);
    REQUIRE(assembly.result().ok);
    return assembly.result().y;
  };
  const VectorXd y = state(rho);
  const Mechanism mechanism(scene, rho);
  const MatrixXd y_rho = Assembly(mechanism, 0).tangent();
  for (int k = 0; k < rho.size(); ++k) {
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    const double h = 1e-4;
    VectorXd up = rho, down = rho;
    up(k) += h, down(k) -= h;
    const VectorXd difference = (state(up) - state(down)) / (2 * h);
    CHECK((y_rho.col(k) - difference).lpNorm<Eigen::Infinity>() < 1e-6 * (1 + y_rho.col(k).lpNorm<Eigen::Infinity>()));
  }
}

TEST_CASE("a body that nothing holds has no equilibrium, and the message names it", "[equilibrium]") {
  Scene scene;
  scene.bodies.push_back(plain_body("stone", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  scene.equilibrium = true;
  const Assembly assembly(Mechanism(scene, VectorXd()), 0);
  CHECK_FALSE(assembly.result().ok);
  CHECK_THAT(assembly.result().message, Catch::Contains("static equilibrium not found"));
}

// A double pendulum of 1 m bars, the lower one ten times as heavy and on two springs, folded up at the start: on the
// way down the acceleration rises and falls.
Scene sprung_double_pendulum(double size) {
  Scene s;
  s.gravity = {0.0, -9.81 * size, 0.0};
  const double masses[] = {0.1, 1}, angles[] = {0.415, -1.47};
  double x = 0, y = 0;
  for (int i = 0; i < 2; ++i) {
    Body b = plain_body(i == 0 ? "upper" : "lower", masses[i], {0.01, 0.1, 0.1, 0.0, 0.0, 0.0}, {x, y, 0.0});
    b.inertia = {0.01 * size * size, 0.1 * size * size, 0.1 * size * size, 0.0, 0.0, 0.0};
    b.com = {0.5 * size, 0.0, 0.0};
    b.orientation = turned(fmt::format("{}", angles[i]));
    s.bodies.push_back(b);
    x += size * std::cos(angles[i]), y += size * std::sin(angles[i]);
  }
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "upper", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "upper", {size, 0.0, 0.0}, "lower", vec("0", "0", "0")));
  const double springs[2][5] = {{0.606, 1.155, 0.366, 12.16, 1.303}, {0.43, 1.069, 0.787, 62.95, 1.262}};
  for (const auto& [px, py, at, k, l0] : springs) {
    Tsda spring;
    spring.body2 = "lower", spring.point1 = VectorField{px * size, py * size, 0.0};
    spring.point2 = VectorField{at * size, 0.0, 0.0};
    spring.stiffness = k, spring.free_length = l0 * size;
    s.forces.push_back({"spring", spring});
  }
  s.equilibrium = true;
  s.simulation.end_time = 1;
  return s;
}

TEST_CASE("an equilibrium is found where the acceleration rises and falls on the way, at any size", "[equilibrium]") {
  const double size = GENERATE(1e-6, 1.0, 1e4);
  INFO(size << " m");
  const Scene scene = sprung_double_pendulum(size);
  const Mechanism mechanism(scene, VectorXd());
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  SimulationSettings settings = scene.simulation;
  settings.integrator.atol = 1e-8 * size;
  const SimulationResult run = simulate(mechanism, settings);  // stable: it stays
  REQUIRE(run.ok());
  for (const Eigen::Index body : {0, 7}) {
    const VectorXd moved = (run.y_end - run.y_initial).segment<7>(body);
    CHECK(moved.head<3>().lpNorm<Eigen::Infinity>() < 1e-7 * size);
    CHECK(moved.tail<4>().lpNorm<Eigen::Infinity>() < 1e-7);
  }
}
