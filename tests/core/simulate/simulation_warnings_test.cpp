#include "core/simulate/simulation_warnings.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

TEST_CASE("a penalty that leaves the joints to the projections is said, with alpha", "[simulate]") {
  Scene scene;
  scene.simulation.formulation = FormulationSettings::penalty();
  scene.simulation.formulation.projection = Projection::position_velocity;
  SimulationStatistics statistics;
  statistics.max_acceleration_residual = 2e-5;
  CHECK(simulation_warnings(scene, scene.simulation, statistics).empty());
  statistics.max_acceleration_residual = 2e-3;
  const std::vector<std::string> warnings = simulation_warnings(scene, scene.simulation, statistics);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("simulation.formulation.alpha is 1e+09: raise it"));
}

TEST_CASE("joints that contradict each other by more than rounding are said", "[simulate]") {
  Scene scene;
  SimulationStatistics statistics;
  statistics.relative_position_violation = 1e-12, statistics.max_position_violation = 1e-6;  // in micrometres
  CHECK(simulation_warnings(scene, scene.simulation, statistics).empty());
  statistics.relative_position_violation = statistics.max_position_violation = 1e-8;
  const std::vector<std::string> warnings = simulation_warnings(scene, scene.simulation, statistics);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("contradict each other by 1.0e-08"));
  scene.simulation.formulation.projection = Projection::none;  // whose drift is no contradiction
  CHECK(simulation_warnings(scene, scene.simulation, statistics).empty());
}
