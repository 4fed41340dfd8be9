#include "core/watch/run_guard.hpp"

#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// A block in a bushing about its centre, set turning.
Scene block_in_rubber(VectorField omega, double damping) {
  Scene s;
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("block", 1, {0.1, 0.15, 0.2, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  s.bodies[0].angular_velocity = std::move(omega);
  BushingSpec rubber;
  rubber.body1 = "ground", rubber.body2 = "block";
  rubber.stiffness = {100.0, 100.0, 100.0}, rubber.torsional_stiffness = {1.0, 2.0, 3.0};
  rubber.torsional_damping = {damping, damping, damping};
  s.forces.push_back({"rubber", rubber});
  s.simulation.end_time = 5;
  return s;
}

SimulationResult run(const Scene& s) { return simulate(Mechanism(s, nominal(s)), s.simulation); }

}  // namespace

TEST_CASE("a bushing that comes to half a turn ends the run by its name and angle", "[simulation]") {
  const std::string method = GENERATE("dopri5", "radau5", "cvodes_adams");
  const bool about_one_axis = GENERATE(true, false);
  Scene scene = about_one_axis ? block_in_rubber(vec("0", "0", "20"), 0) : block_in_rubber(vec("3", "1", "20"), 0.1);
  scene.simulation.integrator.type = method;
  const SimulationResult result = run(scene);
  CHECK(result.status == SimulationStatus::not_credible);
  CHECK_THAT(result.message, Catch::Contains("forces[0], the bushing between 'ground' and 'block', is turned by 3.1"));
  CHECK(result.statistics.steps < 1000);
}

TEST_CASE("a bushing below half a turn runs through", "[simulation]") {
  const SimulationResult result = run(block_in_rubber(vec("0.3", "0.1", "5"), 0.1));
  INFO(result.message);
  CHECK(result.ok());
}

TEST_CASE("a balanced wheel at rest in its bearing gains no energy", "[simulation]") {
  Scene scene = block_in_rubber(vec("0", "0", "0"), 0);
  scene.forces.clear();
  scene.gravity = {-2.2512474472877626, -8.659975506981569, -4.013993665859441};
  scene.bodies[0].mass = 1.97;
  scene.bodies[0].position = vec("0", "0", "0");
  scene.bodies[0].orientation =
      EulerParametersField{{0.7077766159238739, 0.0838023093128962, -0.6589369293806315, -0.24048192864246531}};
  Joint bearing;
  bearing.name = "bearing", bearing.type = "revolute", bearing.body1 = "ground", bearing.body2 = "block";
  bearing.axis1 = VectorField{-0.9736399286915033, 0.198272345849592, 0.11726195516408827};
  bearing.axis2 = vec("0", "0", "1");
  scene.joints.push_back(bearing);
  scene.simulation.end_time = 0.1;
  const SimulationResult result = run(scene);
  INFO(result.message);
  CHECK(result.ok());
}

TEST_CASE("a body that turns more often than steps are allowed is refused at the start", "[simulation]") {
  const auto [method, wx, wy, info] = GENERATE(
      table<std::string, std::string, std::string, std::string>({{"dopri853", "1e9", "3e8", "1.04e+09 rad/s"},
                                                                 {"dopri853", "1e200", "3e199", "1.04e+200 rad/s"},
                                                                 {"cvodes_adams", "1e9", "3e8", "1.04e+09 rad/s"}}));
  Scene scene = block_in_rubber(vec(wx, wy, "0"), 0);
  scene.forces.clear();
  scene.simulation.integrator.type = method;
  const SimulationResult result = run(scene);
  CHECK(result.status == SimulationStatus::not_credible);
  CHECK_THAT(result.message, Catch::Contains("body 'block' turns at " + info) && Catch::Contains("half turn"));
  CHECK(result.statistics.steps == 0);
}

TEST_CASE("projections say how much of the motion a small penalty leaves to them", "[simulation]") {
  Scene scene = n_four_bar(1);
  scene.simulation.end_time = 1;
  FormulationSettings& formulation = scene.simulation.formulation;
  formulation = FormulationSettings::penalty();
  formulation.projection = Projection::position_velocity;
  CHECK(run(scene).statistics.max_acceleration_residual < 1e-4);
  formulation.alpha = 1e2;
  CHECK(run(scene).statistics.max_acceleration_residual > 1e-3);
}
