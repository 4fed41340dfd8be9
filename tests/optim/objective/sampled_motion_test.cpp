#include "optim/objective/sampled_motion.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/mechanism/mechanism.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;

namespace {

constexpr double kBobMass = 3, kIzz = 0.7;

Mechanism free_body() {
  Scene scene;
  Body b;
  b.name = "b", b.mass = kBobMass;
  b.inertia = {0.4, 0.5, kIzz, 0.0, 0.0, 0.0};
  scene.bodies = {b};
  return Mechanism(scene, Eigen::VectorXd());
}

Eigen::VectorXd state(double x, double turned) {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(14);
  y(0) = x, y(3) = std::cos(turned / 2), y(6) = std::sin(turned / 2);
  return y;
}

}  // namespace

// int |x1 - x2|^2 dm of a body turned by a about z through its centre of mass: 4 sin(a/2)^2 Izz
TEST_CASE("two poses of a body are apart by the root mean square of its points' distances", "[sampled_motion]") {
  const MotionDistance distance(free_body());
  CHECK(distance.between(state(0, 0), state(0.3, 0)) == Approx(0.3));
  const double a = GENERATE(1e-6, 0.2, 2.0, 3.1);
  CHECK(distance.between(state(0, 0), state(0, a)) == Approx(2 * std::sin(a / 2) * std::sqrt(kIzz / kBobMass)));
  CHECK(distance.between(state(1, a), state(1, a)) == 0);
  // p and -p are the same pose
  Eigen::VectorXd other = state(1, a);
  other.segment<4>(3) *= -1;
  CHECK(distance.between(state(1, a), other) == 0);
}

TEST_CASE("sample times divide the span and end at its end", "[sampled_motion]") {
  SimulationSettings settings;
  settings.start_time = 1, settings.end_time = 1.7;
  const std::vector<double> times = sample_times(settings, 7);
  REQUIRE(times.size() == 7);
  CHECK(times.front() == Approx(1.1));
  CHECK(times.back() == 1.7);
}

TEST_CASE("a recorded motion holds states and sensors at its times", "[sampled_motion]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.end_time = 0.5;
  Eigen::VectorXd rho(static_cast<Eigen::Index>(problem.scene.parameters.size()));
  for (Eigen::Index k = 0; k < rho.size(); ++k) rho(k) = problem.scene.parameters[static_cast<std::size_t>(k)].value;
  const Mechanism mechanism(problem.scene, rho);
  SampledMotion motion;
  motion.times = sample_times(problem.scene.simulation, 4);
  const SimulationResult run = simulate(mechanism, problem.scene.simulation, {}, record_motion(mechanism, motion));
  REQUIRE(run.ok());
  CHECK((motion.states.col(3) - run.y_end).norm() < 1e-12);
  const MotionDistance distance(mechanism);
  CHECK(distance.between(motion, motion) == 0);
  CHECK(distance.extent(motion, run.y_initial) > 1e-3);
  // Sensor r2_y is the second one, and the mechanism falls.
  CHECK(motion.sensors.rows() == 2);
  CHECK(motion.sensors(1, 3) < -2);
}
