#include "core/watch/stiffness.hpp"

#include <catch2/catch.hpp>
#include <map>

#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

constexpr double kInertia = 0.4 + 0.7 * 0.7;  // of pendulum() about its pin [kg m^2]

// A bar that sinks through honey: its rate follows the load within 1/rate seconds, its angle takes minutes.
Scene damped_bar(double rate) {
  Scene scene = pendulum();
  scene.gravity = {0.0, -9.81, 0.0};
  Rsda honey;
  honey.joint = "A", honey.damping = rate * kInertia;
  scene.forces = {{"honey", honey}};
  scene.conditions = {value_of("theta", "theta0"), rate_of("theta", "0")};
  scene.simulation.end_time = 5;
  return scene;
}

SimulationStatistics statistics_of(const Scene& scene, const std::string& integrator, double rtol) {
  SimulationSettings settings = scene.simulation;
  settings.integrator.type = integrator;
  settings.integrator.rtol = rtol, settings.integrator.atol = 1e-2 * rtol;
  const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), settings);
  INFO(integrator << ": " << run.message);
  REQUIRE(run.ok());
  return run.statistics;
}

}  // namespace

// Taylor's polynomials of degree 1 to 4: 2, 2, 2.5127, 2.7853. Hairer, Wanner II, section IV.2: 3.3066 for DOPRI5;
// their DOP853 takes h |lambda| > 6.1 for near to the end.
TEST_CASE("the end of the stability region on the real axis is that of the literature", "[stiffness]") {
  const std::map<std::string, double> expected{
      {"euler", 2}, {"rk2", 2}, {"bs3", 2.5127}, {"rk4", 2.7853}, {"dopri5", 3.3066}};
  for (const auto& [name, value] : expected) {
    INFO(name);
    CHECK(real_stability_boundary(*explicit_method(name)) == Approx(value).margin(1e-4));
  }
  const double boundary = real_stability_boundary(*explicit_method("dopri853"));
  CHECK(boundary > 6.1);
  CHECK(boundary < 1.1 * 6.1);
}

TEST_CASE("steps at the edge of stability are seen, with the rate that keeps them there", "[stiffness]") {
  const Scene scene = damped_bar(500);
  for (const char* integrator : {"dopri5", "verner6", "dopri853"}) {
    for (const double rtol : {1e-4, 1e-6}) {
      INFO(integrator << " at " << rtol);
      const SimulationStatistics s = statistics_of(scene, integrator, rtol);
      CHECK(is_stability_limited(s));
      CHECK(s.stiffest_rate == Approx(500).epsilon(0.02));
      CHECK(s.watched_steps <= s.steps);
      CHECK(s.stability_limited_steps <= s.watched_steps);
    }
  }
}

TEST_CASE("steps that accuracy limits are not called stiff", "[stiffness]") {
  Scene slow = damped_bar(1), swing = point_pendulum(), loop = loaded_four_bar();
  for (const Scene* scene : {&slow, &swing, &loop}) {
    for (const char* integrator : {"dopri5", "verner6", "dopri853"}) {
      for (const double rtol : {1e-3, 1e-6, 1e-9}) {
        INFO(integrator << " at " << rtol);
        const SimulationStatistics s = statistics_of(*scene, integrator, rtol);
        CHECK(s.watched_steps > 0);
        CHECK_FALSE(is_stability_limited(s));
        CHECK(stiffness_warning(s, integrator, true).empty());
      }
    }
  }
}

TEST_CASE("implicit methods and those without a pair of stages are not watched", "[stiffness]") {
  const Scene scene = damped_bar(20);
  for (const char* integrator : {"radau5", "sdirk4", "bs3", "cvodes_bdf"}) {
    INFO(integrator);
    CHECK(statistics_of(scene, integrator, 1e-4).watched_steps == 0);
  }
}

TEST_CASE("the warning says how many steps, what to use, and what it means for a gradient", "[stiffness]") {
  const SimulationStatistics s = statistics_of(damped_bar(500), "dopri5", 1e-4);
  const std::string plain = stiffness_warning(s, "dopri5", false), of_gradient = stiffness_warning(s, "dopri5", true);
  CHECK_THAT(plain, Contains("limited by stability") && Contains("% of the steps of dopri5") &&
                        Contains("5.0e+02 1/s") && Contains("radau5") && !Contains("gradient"));
  CHECK_THAT(of_gradient, Contains(plain) && Contains("gradient is not to be trusted"));
}

TEST_CASE("watching takes no right-hand side", "[stiffness]") {
  const SimulationStatistics s = statistics_of(damped_bar(500), "dopri5", 1e-4);
  // Seven a step; the first is known where a step is tried again; two more for the size of the first step.
  CHECK(s.rhs_evaluations == 7 * s.steps + 6 * s.rejected + 2);
}
