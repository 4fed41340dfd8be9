// Options of step-size control and of Newton's method, and what a run counts.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

Scene swinging(const std::string& type) {
  Scene s = double_pendulum();
  s.gravity = {0.0, -9.81, 0.0};
  s.simulation.end_time = 0.5;
  s.simulation.integrator.type = type;
  return s;
}

// A torque reverses within a tenth of a millisecond, which asks for short steps.
Scene jerked(const std::string& type) {
  Scene s = swinging(type);
  Torque motor;
  motor.body = "upper", motor.components = {f("0"), f("0"), f("40*tanh((t - 0.2)/1e-4)")};
  s.forces.push_back({"motor", motor});
  return s;
}

SimulationResult run(const Scene& scene) { return simulate(Mechanism(scene, nominal(scene)), scene.simulation); }

long sum(const SimulationStatistics::Rejections& r) {
  return r.error_test + r.not_converged + r.off_constraints + r.not_finite + r.placed_again;
}

}  // namespace

TEST_CASE("options that are given their default values change no bit", "[options]") {
  const std::string type = GENERATE("dopri5", "dopri853", "radau5", "sdirk3");
  Scene scene = jerked(type);
  const SimulationResult plain = run(scene);
  IntegratorOptions& o = scene.simulation.integrator.options;
  o.factor_min = 0.2, o.factor_max = 6, o.safety = 0.9, o.controller = "PI", o.min_step = 1e-13;
  if (type == "radau5" || type == "sdirk3") {
    o.newton_iterations = 10;
    o.newton_tolerance = std::min(1e-2, std::sqrt(scene.simulation.integrator.rtol));
  }
  const SimulationResult given = run(scene);
  INFO(type << ": " << plain.message << given.message);
  REQUIRE(plain.ok());
  REQUIRE(given.ok());
  CHECK(given.steps.sizes == plain.steps.sizes);
  CHECK(given.y_end == plain.y_end);
}

TEST_CASE("factor_max bounds how fast steps grow, a smaller safety takes more of them", "[options]") {
  Scene scene = jerked("radau5");
  const SimulationResult plain = run(scene);
  const auto largest_growth = [](const SimulationResult& result) {
    double largest = 0;  // the last two steps are cut to the end
    for (std::size_t i = 1; i + 2 < result.steps.sizes.size(); ++i)
      largest = std::max(largest, result.steps.sizes[i] / result.steps.sizes[i - 1]);
    return largest;
  };
  REQUIRE(plain.ok());
  CHECK(largest_growth(plain) > 1.6);
  IntegratorOptions& o = scene.simulation.integrator.options;
  o.factor_max = 1.5;
  const SimulationResult slower = run(scene);
  REQUIRE(slower.ok());
  CHECK(largest_growth(slower) <= 1.5 * (1 + 1e-12));
  o = {};
  o.safety = 0.6;
  const SimulationResult safer = run(scene);
  REQUIRE(safer.ok());
  CHECK(safer.statistics.steps > plain.statistics.steps);
}

TEST_CASE("newton_tolerance says how far the stages are from their solution", "[options]") {
  Scene scene = swinging(GENERATE("radau5", "sdirk4"));
  const Mechanism m(scene, nominal(scene));
  const auto error = [&](double tolerance) {
    scene.simulation.integrator.options.newton_tolerance = tolerance;
    const SimulationResult result = run(scene);
    RunOptions to_rounding;
    to_rounding.frozen = &result.steps;
    const SimulationResult exact = simulate(m, scene.simulation, {}, {}, to_rounding);
    REQUIRE(result.ok());
    REQUIRE(exact.ok());
    return (result.y_end - exact.y_end).cwiseAbs().maxCoeff();
  };
  const double loose = error(0.5), tight = error(1e-7);
  INFO(scene.simulation.integrator.type << ": " << loose << ", " << tight);
  CHECK(loose > 0);
  CHECK(tight < 1e-2 * loose);
}

TEST_CASE("every controller keeps the tolerance, and its gradients by TLM and adjoint agree", "[options]") {
  Scene scene = swinging(GENERATE("dopri5", "radau5", "rodas4"));
  add_parameters(scene, {{"push", 4.0}});
  Torque motor;
  motor.body = "upper", motor.components = {f("0"), f("0"), f("push*t")};
  scene.forces.push_back({"motor", motor});
  scene.simulation.integrator.rtol = 1e-11, scene.simulation.integrator.atol = 1e-13;
  const Eigen::VectorXd exact = run(scene).y_end;
  scene.simulation.integrator.rtol = 1e-6, scene.simulation.integrator.atol = 1e-8;
  scene.simulation.integrator.options.controller = GENERATE("I", "PI", "PID");
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].terminal = costs[0].running = std::make_shared<StateNorm>();
  const SimulationResult tlm = simulate_tlm(m, scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(m, scene.simulation, costs);
  INFO(scene.simulation.integrator.type << " " << scene.simulation.integrator.options.controller << ": " << tlm.message
                                        << adjoint.message);
  REQUIRE(tlm.ok());
  REQUIRE(adjoint.ok());
  CHECK((tlm.y_end - exact).cwiseAbs().maxCoeff() < 1e-4);  // a hundred tolerances of a step
  CHECK(tlm.psi_rho.cwiseAbs().maxCoeff() > 1e-3);
  CHECK((tlm.psi_rho - adjoint.psi_rho).cwiseAbs().maxCoeff() < 1e-10 * tlm.psi_rho.cwiseAbs().maxCoeff());
}

TEST_CASE("controllers propose different steps", "[options]") {
  Scene scene = jerked("dopri5");
  std::vector<std::vector<double>> sizes;
  for (const char* controller : {"I", "PI", "PID"}) {
    scene.simulation.integrator.options.controller = controller;
    const SimulationResult result = run(scene);
    REQUIRE(result.ok());
    sizes.push_back(result.steps.sizes);
  }
  CHECK(sizes[0] != sizes[1]);
  CHECK(sizes[1] != sizes[2]);
  CHECK(sizes[0] != sizes[2]);
}

TEST_CASE("a step that would fall below min_step ends the run with its name and the time", "[options]") {
  Scene scene = jerked(GENERATE("dopri5", "radau5", "cvodes_adams", "cvodes_bdf"));
  INFO(scene.simulation.integrator.type);
  REQUIRE(run(scene).ok());
  scene.simulation.integrator.options.min_step = 3e-3;
  const SimulationResult result = run(scene);
  CHECK(result.status == SimulationStatus::step_too_small);
  CHECK_THAT(result.message, Contains("min_step, 0.003 s") && Contains("t = "));
  CHECK(result.last_good_time < 0.21);
}

TEST_CASE("too few iterations of Newton's method are a failure in words", "[options]") {
  Scene scene = jerked("radau5");
  scene.simulation.integrator.options.newton_iterations = 1;
  scene.simulation.integrator.options.min_step = 1e-4;
  const SimulationResult result = run(scene);
  CHECK(result.status == SimulationStatus::step_too_small);
  CHECK_THAT(result.message, Contains("Newton's method did not converge") && Contains("min_step"));
  CHECK(result.statistics.rejections.not_converged > 0);
}

TEST_CASE("a run counts its iterations, linear solves and the reasons of its rejected steps", "[options]") {
  const std::string type = GENERATE("dopri5", "dopri853", "radau5", "sdirk4", "cvodes_adams", "cvodes_bdf");
  const SimulationResult result = run(jerked(type));
  const SimulationStatistics& s = result.statistics;
  INFO(type << ": " << result.message << " " << s.newton_iterations << " " << s.linear_solves);
  REQUIRE(result.ok());
  CHECK(s.rejected > 0);
  CHECK(sum(s.rejections) == s.rejected);
  if (type == "radau5" || type == "sdirk4" || type == "cvodes_bdf") {
    CHECK(s.newton_iterations >= s.steps);
    CHECK(s.linear_solves > s.newton_iterations);
  } else {
    CHECK(s.newton_iterations == 0);
    CHECK(s.linear_solves == s.rhs_evaluations);
  }
}
