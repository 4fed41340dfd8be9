// Tolerances for each kind of component and for bodies by name.
#include "core/step/component_tolerances.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// Two free masses on springs: one of 1 rad/s, one of 40 rad/s.
Scene slow_and_fast() {
  Scene s;
  s.gravity = {0.0, 0.0, 0.0};
  for (const char* name : {"slow", "fast"}) {
    s.bodies.push_back(body(name, vec("0", "0", "0"), vec("1.2", "0", "0"), turned("0")));
    Tsda spring;
    spring.body1 = "ground", spring.body2 = name, spring.point1 = vec("0", "0", "0");
    spring.stiffness = name == std::string("slow") ? 1.0 : 1600.0, spring.free_length = 1.0;
    s.forces.push_back({name + std::string("_spring"), spring});
  }
  s.simulation.end_time = 2;
  return s;
}

SimulationResult run(const Scene& scene) { return simulate(Mechanism(scene, VectorXd()), scene.simulation); }

double error_of(const SimulationResult& result, int body) {
  const double w = body == 0 ? 1 : 40;
  return std::abs(result.y_end(7 * body) - 1 - 0.2 * std::cos(2 * w));
}

}  // namespace

TEST_CASE("each component has the tolerance of its kind or of its body", "[tolerances]") {
  const Mechanism mechanism(slow_and_fast(), VectorXd());
  IntegratorSettings s;
  s.rtol = 2e-6, s.atol = 1e-8;  // twice what was given: tradeoff scales all alike
  s.rtol_of = KindTolerances{1e-6, 1e-5, {}, 1e-3, {{"fast", 1e-2}}};
  const ComponentTolerances tolerances(mechanism.data(), s);
  const auto of = [&](Eigen::Index i) { return tolerances.of(i, 1) - 1e-8; };
  for (const auto& [i, expected] : {std::pair{0, 2e-6}, {3, 2e-5}, {6, 2e-5}, {14, 2e-6}, {17, 2e-3}, {20, 2e-3}}) {
    INFO("component " << i);
    CHECK(of(i) == Approx(expected).epsilon(1e-9));
  }
  for (const Eigen::Index i : {7, 10, 21, 27}) CHECK(of(i) == Approx(2e-2).epsilon(1e-9));
}

TEST_CASE("the same tolerance of every kind takes the very steps of the number", "[tolerances]") {
  for (const char* type : {"dopri5", "radau5", "cvodes_bdf"}) {
    Scene scene = slow_and_fast();
    scene.simulation.integrator.type = type;
    const SimulationResult plain = run(scene);
    const double rtol = scene.simulation.integrator.rtol;
    scene.simulation.integrator.rtol_of = KindTolerances{rtol, rtol, rtol, rtol, {}};
    const SimulationResult kinds = run(scene);
    INFO(type);
    REQUIRE(plain.ok());
    CHECK(plain.statistics.steps == kinds.statistics.steps);
    CHECK(plain.y_end == kinds.y_end);
  }
}

TEST_CASE("a body with a loose tolerance of its own no longer sets the steps", "[tolerances]") {
  for (const char* type : {"dopri5", "radau5", "cvodes_adams"}) {
    Scene scene = slow_and_fast();
    IntegratorSettings& s = scene.simulation.integrator;
    s.type = type;
    s.rtol = 1e-9, s.atol = 1e-10;
    const SimulationResult tight = run(scene);
    s.rtol_of = KindTolerances{1e-9, {}, {}, {}, {{"fast", 1e-5}}};
    s.atol_of = KindTolerances{1e-10, {}, {}, {}, {{"fast", 1e-6}}};
    const SimulationResult loose = run(scene);
    INFO(type << ": " << tight.statistics.steps << " and " << loose.statistics.steps << " steps");
    REQUIRE((tight.ok() && loose.ok()));
    CHECK(10 * loose.statistics.steps < 7 * tight.statistics.steps);
    CHECK(error_of(loose, 0) < 1e-7);
    CHECK(error_of(loose, 1) > 10 * error_of(tight, 1));
  }
}
