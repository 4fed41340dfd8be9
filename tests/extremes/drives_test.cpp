// Drives whose law jumps.
#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

namespace {

Json driven(const std::string& law, const std::string& method) {
  Json p = pendulum();
  p["drives"] = {{{"name", "motor"}, {"type", "angle"}, {"joint", "pin"}, {"law", law}}};
  p["simulation"]["integrator"]["type"] = method;
  if (method == "rk4") p["simulation"]["integrator"]["step"] = 0.01;
  return p;
}

}  // namespace

TEST_CASE("a drive that jumps ends the run in words, with its name, the time and the size of the jump", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "radau5", "rk4", "cvodes_bdf");
  const Outcome run = values(driven("0.1*abs(t - 0.5)/(t - 0.5)", method));
  INFO(method << ": " << run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("'motor'") && Contains("jumps by 0.2 at t = 0.5 s"));
}

TEST_CASE("a jump of a drive's rate is an impact and ends the run in words, however small a part of the law it is",
          "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "radau5", "rk4", "cvodes_bdf");
  const std::string law =
      GENERATE(as<std::string>{}, "max(0, t - 0.5)", "1e3*max(0, t - 0.5)", "10*sin(t) + 1e-3*max(0, t - 0.5)");
  const Outcome run = values(driven(law, method));
  INFO(method << ", " << law << ": " << run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("'motor'") && Contains("at t = 0.5 s: an impact"));
}

TEST_CASE("a jump at an event is one, too", "[extremes]") {
  Json p = driven("max(0, t - 0.5)", "dopri5");
  p["simulation"]["events"] = {0.5};
  const Outcome run = values(p);
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("'motor'") && Contains("at t = 0.5 s: an impact"));
}

TEST_CASE("a drive whose acceleration jumps, or that is steep, is followed", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "radau5", "rk4");
  const auto [law, expected] = GENERATE(table<std::string, double>({{"0.2*max(0, t - 0.5)^2", 0.05},
                                                                    {"0.1*tanh(1e4*(t - 0.5))", 0.1},
                                                                    {"1e-9*sin(40*t)", 1e-9 * std::sin(40.0)},
                                                                    {"1e-3 + 0*t", 1e-3}}));
  if (method == "rk4" && law.find("tanh") != std::string::npos) return;  // its steps are too large for that
  const Outcome run = values(driven(law, method));
  INFO(method << ", " << law << ": " << run.message());
  REQUIRE(run.ok());
  CHECK(run("theta") == Approx(expected).epsilon(1e-12).margin(1e-15));
}

TEST_CASE("a wheel that a drive turns evenly about its centre needs no acceleration, and that is no failure",
          "[extremes]") {
  Json p = driven("3*t", GENERATE(as<std::string>{}, "dopri5", "radau5", "rk4"));
  p["bodies"][0]["com"] = {0, 0, 0};
  if (GENERATE(false, true)) p["gravity"] = {0, 0, 0};
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(run("theta") == Approx(3).epsilon(1e-12));
}
