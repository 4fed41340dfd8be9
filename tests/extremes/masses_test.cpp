// Bodies of very different mass, and of none.
#include "tests/extremes/four_bar.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

TEST_CASE("a four-bar whose coupler is 1e-8 to 1e8 times as heavy as its cranks takes the time that its energy says",
          "[extremes]") {
  FourBar bars;
  bars.coupler_mass = GENERATE(0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6, 1e8);
  INFO("ratio " << bars.coupler_mass);
  const Outcome run = gradients(bars.json(), GENERATE(GradientMethod::tlm));
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(bars.time_to(run("theta")) - 1) < 1e-7);
  CHECK(run.statistics().max_position_violation < 1e-12);
}

TEST_CASE("mass ratios between neighbours of 1e8 either way, ground - light - heavy - light and the reverse",
          "[extremes]") {
  FourBar bars;
  const double ratio = GENERATE(1e-8, 1e-4, 1e4, 1e8);
  bars.rocker_mass = ratio;
  if (GENERATE(false, true)) bars.crank_mass = ratio;
  INFO("crank " << bars.crank_mass << " kg, rocker " << bars.rocker_mass << " kg");
  const Outcome run = values(bars.json());
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(bars.time_to(run("theta")) - 1) < 1e-7);
}

TEST_CASE("the gradient with a light or a heavy coupler is that of the energy integral", "[extremes]") {
  FourBar bars;
  bars.coupler_mass = GENERATE(1e-8, 1e-4, 1.0, 1e4, 1e8);
  Json p = bars.json();
  p["parameters"] = {{"theta0", {{"value", bars.theta0}}}, {"rate0", {{"value", bars.rate0}}}};
  p["initial"]["conditions"] = {{{"sensor", "theta"}, {"value", "theta0"}, {"rate", "rate0"}}};
  const Outcome tlm = gradients(p, GradientMethod::tlm), adjoint = gradients(p, GradientMethod::adjoint);
  INFO("ratio " << bars.coupler_mass << ": " << tlm.message() << adjoint.message());
  REQUIRE((tlm.ok() && adjoint.ok()));
  // t(theta_end; rate0) = 1:  theta_end' = - t_rate0/t_theta_end, by central differences of the integral.
  const double end = tlm("theta"), h = 1e-4;
  FourBar more = bars, less = bars;
  more.rate0 += h, less.rate0 -= h;
  const double expected = -(more.time_to(end) - less.time_to(end)) / (bars.time_to(end + h) - bars.time_to(end - h));
  CHECK(tlm("theta", "rate0") == Approx(expected).epsilon(1e-6));
  CHECK(adjoint("theta", "rate0") == Approx(tlm("theta", "rate0")).epsilon(1e-10));
  CHECK(adjoint("theta", "theta0") == Approx(tlm("theta", "theta0")).epsilon(1e-10));
}

// A bar without mass from a pin to a hinge is a rod of constant length: the distance joint, another equation.
TEST_CASE("a massless bar that its joints cover moves as the rod that it is", "[extremes]") {
  Json p = problem("hung");
  Json block = rod("block", 1, 1, 1, 0, 0);
  p["bodies"] = {rod("bar", 0, 1, 0, 0, 0), block};
  p["joints"] = {hinge("pin", "ground", {0, 0, 0}, "bar", "O"), hinge("link", "bar", "tip", "block", "O")};
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "block"}, {"point", "tip"}, {"component", "x"}}},
                  {"y", {{"quantity", "position"}, {"body", "block"}, {"point", "tip"}, {"component", "y"}}}};
  p["objectives"] = {{"x", {{"terminal", "x"}}}, {"y", {{"terminal", "y"}}}};
  set_accuracy(p, GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5"), 1e-10);
  Json q = p;
  q["bodies"] = {block};
  q["joints"] = {{{"name", "rod"},
                  {"type", "distance"},
                  {"body2", "block"},
                  {"point1", {0, 0, 0}},
                  {"point2", "O"},
                  {"length", 1}}};
  const Outcome by_bar = values(p), by_rod = values(q);
  INFO(by_bar.message() << by_rod.message());
  REQUIRE((by_bar.ok() && by_rod.ok()));
  CHECK(std::abs(by_bar("x") - by_rod("x")) < 1e-7);
  CHECK(std::abs(by_bar("y") - by_rod("y")) < 1e-7);
}

// A01 of the IFToMM library, at 1 s.
TEST_CASE("a point mass has no inertia to turn, and swings as the pendulum it is where its joint holds it",
          "[extremes]") {
  Json p = problem("point");
  p["bodies"] = {{{"name", "bob"}, {"mass", 1}, {"inertia", {0, 0, 0}}, {"position", {-1, 0, 0}}}};
  p["joints"] = {hinge("pin", "ground", {0, 0, 0}, "bob", {1, 0, 0})};
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "bob"}, {"component", "x"}}},
                  {"y", {{"quantity", "position"}, {"body", "bob"}, {"component", "y"}}}};
  p["objectives"] = {{"x", {{"terminal", "x"}}}, {"y", {{"terminal", "y"}}}};
  set_accuracy(p, GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5"), 1e-10);
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(run("x") - 0.9862917511318753) < 1e-8);
  CHECK(std::abs(run("y") + 0.1650108531255412) < 1e-8);
}

TEST_CASE("a body that lacks mass or inertia where no joint holds it is named, by every kind of integrator",
          "[extremes]") {
  Json p = problem("ghost");
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "ghost"}, {"component", "x"}}}};
  p["objectives"] = {{"x", {{"terminal", "x"}}}};
  const int kind = GENERATE(0, 1, 2, 3);
  p["bodies"] = {{{"name", "ghost"}, {"mass", kind == 0 ? 0 : 1}, {"inertia", {0, 0, 0}}, {"position", {1, 0, 0}}}};
  if (kind == 2) p["bodies"][0]["inertia"] = {0, 0.1, 0.1};  // a thin rod on a ball joint: free to spin
  const Json ball = {{"name", "ball"},   {"type", "spherical"}, {"body1", "ground"},
                     {"body2", "ghost"}, {"point1", {0, 0, 0}}, {"point2", {-1, 0, 0}}};
  if (kind == 2 || kind == 3) p["joints"] = {ball};
  p["simulation"]["integrator"]["type"] = GENERATE(as<std::string>{}, "dopri5", "radau5", "cvodes_bdf");
  const Outcome run = values(p);
  INFO("kind " << kind);
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("without mass or inertia in a direction that no joint holds") &&
                                Contains("'ghost'") && Contains("Give it some, or hold it"));
}
