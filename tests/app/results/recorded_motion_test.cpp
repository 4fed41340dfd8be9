#include "app/results/recorded_motion.hpp"

#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("the force of a joint that holds a body on its track is that of a reaction sensor", "[results]") {
  Scene scene = pendulum();
  Sensor sensor;
  sensor.name = "R", sensor.quantity = "reaction", sensor.kind = "force", sensor.joint = scene.joints[0].name;
  sensor.component = "y";
  scene.sensors = {sensor};
  const Eigen::VectorXd rho = parameter_values(scene);
  const Mechanism mechanism(scene, rho);
  RecordedMotion motion;
  REQUIRE(simulate(mechanism, scene.simulation, {}, record_motion(mechanism, scene, motion), {}).ok());
  const Trajectory &table = motion.forces, &trajectory = motion.trajectory;
  CHECK(table.columns == std::vector<std::string>{"t", sensor.joint + ".x", sensor.joint + ".y", sensor.joint + ".z"});
  REQUIRE(table.rows.size() == trajectory.rows.size());
  for (std::size_t k = 0; k < table.rows.size(); ++k) CHECK(table.rows[k][2] == trajectory.rows[k].back());
}
