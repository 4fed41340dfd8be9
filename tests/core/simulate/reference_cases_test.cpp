// Published and independently computed motions: ../shared/cases.md holds the figures and their sources.
#include <array>
#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

void set_accuracy(Scene& scene, const std::string& method, double rtol) {
  scene.simulation.integrator.type = method;
  scene.simulation.integrator.rtol = rtol;
  scene.simulation.integrator.atol = 0.01 * rtol;
}

}  // namespace

TEST_CASE("A01: the simple pendulum is right at 10 s to 1e-8 m", "[reference]") {
  Scene scene = point_pendulum();
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853");
  set_accuracy(scene, method, 1e-10);
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), scene.simulation);
  REQUIRE(run.ok());
  INFO(method);
  CHECK(std::abs(run.y_end(0) + 0.2750874625761169) < 1e-8);
  CHECK(std::abs(run.y_end(1) + 0.9614192050991251) < 1e-8);
  CHECK(std::abs(run.y_end(7) - 4.175598100951729) < 1e-8);
  CHECK(std::abs(run.y_end(8) + 1.194749054560475) < 1e-8);
  CHECK(run.statistics.max_position_violation < 1e-12);
}

TEST_CASE("A02: two four-bar windows through their singular positions are right at 10 s to 1e-7 m", "[reference]") {
  Scene scene = n_four_bar(2);
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853");
  set_accuracy(scene, method, 1e-10);
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult run = simulate(mechanism, scene.simulation);
  REQUIRE(run.ok());
  INFO(method);
  const VectorXd angles;
  const StatePoint end{10, run.y_end, angles};
  CHECK(std::abs(mechanism.sensor_value(0, end) - 0.3284581115408154) < 1e-7);
  CHECK(std::abs(mechanism.sensor_value(1, end) - 0.944518538178601) < 1e-7);
}

TEST_CASE("A02: forty windows are right to 5e-6 m over 10 s and ten passages of their singular position",
          "[reference]") {
  Scene scene = n_four_bar(40);
  set_accuracy(scene, "dopri853", 1e-8);
  const Mechanism mechanism(scene, VectorXd());
  const std::array<std::array<double, 3>, 5> expected{{{1, -0.1153568806321099, -0.9933241113004502},
                                                       {2, 0.03446630730040716, 0.999405860329563},
                                                       {4, 0.06934203222799917, 0.9975929443247336},
                                                       {5, -0.5401900506755263, -0.8415430524644431},
                                                       {10, 0.1805122266867284, 0.9835727405823116}}};
  Sampling sampling;
  for (const auto& row : expected) sampling.times.push_back(row[0]);
  sampling.observe = [&](std::size_t i, const StatePoint& at) {
    INFO("t = " << at.t << " s");
    CHECK(std::abs(mechanism.sensor_value(0, at) - expected[i][1]) < 5e-6);
    CHECK(std::abs(mechanism.sensor_value(1, at) - expected[i][2]) < 5e-6);
  };
  const SimulationResult run = simulate(mechanism, scene.simulation, {}, sampling);
  REQUIRE(run.ok());
  CHECK(run.statistics.energy_drift < 1e-4);
}

// IVP test set. A light axle on springs between two supports: the left one at the origin, the right one on a road that
// turns about it by asin(r/L sin(w t)), so that the supports keep their distance L. The axle's masses are L apart (a
// distance joint); the left one stays above its support, at right angles to the road (a point on the plane through the
// origin normal to it: xl xb + yl yb = 0). Their inertias are arbitrary, nothing turns them.
TEST_CASE("the car axis is right at 3 s to 1e-9", "[reference]") {
  Scene scene;
  scene.gravity = {0.0, -1.0, 0.0};
  add_parameters(scene, {{"L", 1.0}, {"r", 0.1}, {"w", 10.0}});
  const InertiaField ball{0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  scene.bodies = {plain_body("left", 5e-4, ball, {0.0, 0.5, 0.0}), plain_body("right", 5e-4, ball, {1.0, 0.5, 0.0}),
                  plain_body("road", 1, ball, {0.0, 0.0, 0.0})};
  for (std::size_t k : {0u, 1u}) scene.bodies[k].velocity = {-0.5, 0.0, 0.0};
  Joint axle;
  axle.name = "axle", axle.type = "distance", axle.body1 = "left", axle.body2 = "right", axle.length = f("L");
  Joint upright;
  upright.name = "upright", upright.type = "point_on_plane", upright.body1 = "road", upright.body2 = "left";
  upright.axis1 = vec("1", "0", "0");
  scene.joints = {hinge("turn", "ground", vec("0", "0", "0"), "road", vec("0", "0", "0")), axle, upright};
  Drive bumps;
  bumps.name = "bumps", bumps.type = "angle", bumps.joint = "turn", bumps.law = f("asin(r/L*sin(w*t))");
  scene.drives = {bumps};
  Tsda spring;
  spring.body2 = "left", spring.stiffness = 1.0, spring.free_length = 0.5;
  scene.forces.push_back({"left_spring", spring});
  spring.body1 = "road", spring.point1 = vec("L", "0", "0"), spring.body2 = "right";
  scene.forces.push_back({"right_spring", spring});
  scene.simulation.end_time = 3;
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853");
  set_accuracy(scene, method, 1e-12);
  const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  INFO(method << ": " << run.message);
  REQUIRE(run.ok());
  const double expected[] = {0.0493455784275242,  0.496989460230009,   1.041742524885425,  0.373911027265359,
                             -0.0770583684035921, 0.00744686659206958, 0.0175568157534866, 0.770341043779106};
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Eigen::Index body = k / 2, component = k % 2;
    INFO("body " << body << ", component " << component);
    CHECK(std::abs(run.y_end(7 * body + component) - expected[k]) < 1e-9);
    CHECK(std::abs(run.y_end(21 + 7 * body + component) - expected[4 + k]) < 1e-9);
  }
}
