// Mechanisms that share compiled expressions are those that compile them.
#include "core/mechanism/scene_programs.hpp"

#include <catch2/catch.hpp>

#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("an expression is compiled once, by whichever mechanism asks first", "[mechanism]") {
  Scene scene;
  add_parameters(scene, {{"L", 2}, {"w", 3}});
  ScenePrograms programs(scene);
  const Expression length = f("L/2"), same = length, law = f("w*t^2");
  CHECK(programs.field(length) == programs.field(same));
  CHECK(programs.law(law) == programs.law(law));
  const std::vector<double> inputs{2, 3, 5};
  Program::Scratch scratch;
  for (const Program& p : *programs.law(law)) p.grow(scratch);
  CHECK((*programs.law(law))[0].value(inputs, scratch) == 75);
  CHECK((*programs.law(law))[1].value(inputs, scratch) == 30);
  CHECK((*programs.law(law))[2].value(inputs, scratch) == 6);
  CHECK_THROWS_AS(programs.field(f("unknown")), UnknownName);
  SampledLaw samples;
  samples.curve =
      std::make_shared<const Curve>(Interpolation::spline, std::vector{0.0, 1.0, 2.0}, std::vector{0.0, 1.0, 4.0});
  CHECK(programs.law(samples) == programs.law(SampledLaw(samples)));
}

TEST_CASE("mechanisms that share programs have the numbers of those that do not", "[mechanism]") {
  const Scene scene = every_force_four_bar();
  const auto programs = std::make_shared<ScenePrograms>(scene);
  Eigen::VectorXd rho = nominal(scene);
  for (int k = 0; k < 3; ++k, rho *= 1.01) {
    const Mechanism shared(scene, rho, {}, {}, programs), own(scene, rho);
    const SimulationResult a = simulate(shared, scene.simulation, {}), b = simulate(own, scene.simulation, {});
    CHECK(a.y_end == b.y_end);
  }
}
