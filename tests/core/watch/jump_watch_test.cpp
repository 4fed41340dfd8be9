#include "core/watch/jump_watch.hpp"

#include <catch2/catch.hpp>

#include "core/simulate/simulation_warnings.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

// A bar on a hinge, without gravity, that a torque turns.
Scene turned_bar(const std::string& torque) {
  Scene s = pendulum();
  add_parameters(s, {{"tp", 0.4}});
  s.gravity = {0.0, 0.0, 0.0};
  s.sensors.push_back(point_sensor("x", "position", "bar", "O", "x"));
  Torque load;
  load.body = "bar", load.components = {Expression::parse("0"), Expression::parse("0"), Expression::parse(torque)};
  s.forces.push_back({"push", load});
  return s;
}

std::vector<std::string> warnings(const Scene& scene) {
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult run = simulate_tlm(mechanism, scene.simulation);
  INFO(run.message);
  REQUIRE(run.ok());
  return simulation_warnings(scene, scene.simulation, run.statistics);
}

Scene with_law(Scene s, const std::string& law) {
  Rsda spring;
  spring.joint = "A", spring.law = Expression::parse(law);
  s.forces = {{"catch", spring}};
  return s;
}

}  // namespace

TEST_CASE("a force that jumps when a parameter says so is a warning by both names, with the time and the size",
          "[gradient]") {
  const std::string type = GENERATE(as<std::string>{}, "dopri5", "radau5", "cvodes_adams");
  const std::pair<const char*, bool> jumps[] = {
      // and whether gradients follow the instant
      {"1 + abs(t - tp)/(t - tp)", true}, {"(t - tp)/sqrt((t - tp)^2)", true}, {"2*max(0, t - tp)/(t - tp)", true},
      {"2*atan(1/(t - tp))/pi", false},   {"2*atan2(0, tp - t)/pi", false},    {"abs(t - tp)*(t - tp)^(-1)", true},
      {"(t - tp)/abs(t - tp)", true}};
  for (const auto& [law, followed] : jumps) {
    Scene s = turned_bar(law);
    s.simulation.integrator.type = type;
    const std::vector<std::string> said = warnings(s);
    INFO(type << ", " << law);
    if (followed && type != "cvodes_adams") {
      CHECK(said.empty());
      s.simulation.follows_kinks = false;
      CHECK(warnings(s).size() == 1);
      continue;
    }
    REQUIRE(said.size() == 1);
    CHECK_THAT(said[0], Contains("the law of force 'push' jumps by 2 at t = 0.4 s") && Contains("depends on 'tp'"));
  }
}

TEST_CASE("a jump at an angle is a warning that the motion moves its instant", "[gradient]") {
  Scene s = with_law(turned_bar("0"), "-0.1*abs(angle - 0.2)/(angle - 0.2)");  // from 0.1 on
  s.conditions = {value_of("theta", "a"), rate_of("theta", "0.5")};
  CHECK(warnings(s).empty());
  s.simulation.follows_kinks = false;
  const std::vector<std::string> said = warnings(s);
  REQUIRE(said.size() == 1);
  CHECK_THAT(said[0], Contains("the law of force 'catch' jumps by 0.2") && Contains("depends on the motion"));
}

TEST_CASE("a later jump is a warning of its own if it depends on another parameter", "[gradient]") {
  const std::string passed = "abs(theta + 0.5)/(theta + 0.5)", timed = "abs(t - tp)/(t - tp)",
                    again = "abs(t - 2*tp)/(t - 2*tp)";
  Scene s = turned_bar("0.01*(" + passed + " + " + timed + " + " + again + ")");
  s.conditions = {value_of("theta", "0"), rate_of("theta", "-3")};
  s.simulation.follows_kinks = false;
  const std::vector<std::string> said = warnings(s);
  for (const std::string& w : said) UNSCOPED_INFO(w);
  REQUIRE(said.size() == 2);
  CHECK_THAT(said[0], Contains("depends on the motion"));
  CHECK_THAT(said[1], Contains("at t = 0.4 s") && Contains("depends on 'tp'"));
}

TEST_CASE("a drive whose acceleration jumps when a parameter says so is a warning by its name", "[gradient]") {
  Scene s = pendulum();
  add_parameters(s, {{"tp", 0.4}});
  Drive drive;
  drive.name = "motor", drive.type = "angle", drive.joint = "A",
  drive.law = Expression::parse("0.1 + max(0, t - tp)^2");
  s.drives = {drive};
  s.simulation.solve = Solve::dynamics;
  CHECK(warnings(s).empty());
  s.simulation.solve = Solve::automatic;  // solved: nothing follows the instant
  const std::vector<std::string> said = warnings(s);
  REQUIRE(said.size() == 1);
  CHECK_THAT(said[0], Contains("the acceleration of drive 'motor' jumps by 2 at t = 0.4 s") && Contains("'tp'"));
}

TEST_CASE("values that are continuous, and jumps whose instants are fixed, are no warnings", "[gradient]") {
  const char* const laws[] = {"abs(t - tp)",
                              "max(0, t - tp)",
                              "sin(t - tp)/(t - tp + 1e-300)",
                              "sqrt(abs(t - tp))",
                              "tanh((t - tp)/0.01)",
                              "abs(t - 0.4)/(t - 0.4)*tp",
                              "1/(x + 3 + tp)",
                              "((t - tp)^2 - 1)/(t - tp - 1)",
                              "max(0, t - tp)^2/(t - tp)"};
  for (const char* law : laws) {
    INFO(law);
    CHECK(warnings(turned_bar(law)).empty());
  }
}

TEST_CASE("nothing is said of a jump where no derivative is carried", "[gradient]") {
  const Scene s = turned_bar("abs(t - tp)/(t - tp)");
  const Mechanism mechanism(s, nominal(s), std::vector<bool>(s.parameters.size(), false));
  CHECK(simulate_tlm(mechanism, s.simulation).statistics.jumps.empty());
  CHECK(simulate(Mechanism(s, nominal(s)), s.simulation).statistics.jumps.empty());
}

// A bar turns at a constant rate until a spring of one side catches it at 0.2 rad, at t = 0.4 s.
TEST_CASE("a kink that the motion crosses is noted with its instant, and smooth laws are not", "[gradient]") {
  struct Case {
    const char* law;
    bool kink;
  };
  const Case cases[] = {{"-3*max(0, angle - 0.2)", true},
                        {"-3*abs(angle - 0.2) + 3*(0.2 - angle)", true},
                        {"-3*max(0, angle - 0.2)^1.5", true},
                        {"-3*max(0, angle - 0.2)^3", true},
                        {"-table(angle, [-9, 0.2, 9], [0, 0, 30])", true},
                        {"-0.1*tanh(angle - 0.2)", false},
                        {"-3*max(0, angle - 2)", false}};
  for (const Case& c : cases) {
    Scene s = with_law(turned_bar("0"), c.law);
    s.conditions = {value_of("theta", "0"), rate_of("theta", "0.5")};
    CHECK(simulate_tlm(Mechanism(s, nominal(s)), s.simulation).statistics.jumps.empty());
    s.simulation.follows_kinks = false;
    const SimulationResult run = simulate_tlm(Mechanism(s, nominal(s)), s.simulation);
    INFO(c.law << ": " << run.message);
    REQUIRE(run.ok());
    REQUIRE(run.statistics.jumps.size() == (c.kink ? 1U : 0U));
    if (!c.kink) continue;
    CHECK(run.statistics.jumps[0].size == 0);
    CHECK(run.statistics.jumps[0].motion);
    CHECK(run.statistics.jumps[0].t == Approx(0.4).epsilon(1e-4));  // found on the dense output of the step across it
    CHECK(simulation_warnings(s, s.simulation, run.statistics).empty());
  }
}
