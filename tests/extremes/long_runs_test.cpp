// Many turns, and much time.
#include <numbers>

#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;

namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr double kTurns = 1e3, kLong = 5e3;
#else
constexpr double kTurns = 1e4, kLong = 1e5;
#endif

}  // namespace

TEST_CASE("an angle is counted over 10^4 turns, of a wheel that nothing stops", "[extremes]") {
  Json p = pendulum();
  p["gravity"] = {0, 0, 0};
  p["simulation"]["end_time"] = 2 * std::numbers::pi * kTurns / 100;
  p["initial"]["conditions"] = {{{"sensor", "theta"}, {"value", 0.3}, {"rate", 100}}};
  set_accuracy(p, "dopri853", 1e-12);
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(run("theta") - 0.3 == Approx(2 * std::numbers::pi * kTurns).epsilon(1e-9));
  CHECK(run("speed") == Approx(100).epsilon(1e-9));
}

TEST_CASE("an angle is counted over 10^4 turns of a drive, and so is its gradient over 10^3", "[extremes]") {
  Json p = pendulum();
  p["parameters"] = {{"w", {{"value", 100}}}};
  p["drives"] = {{{"name", "motor"}, {"type", "angle"}, {"joint", "pin"}, {"law", "w*t"}}};
  p["simulation"]["integrator"]["type"] = "dopri853";
  const double end = 2 * std::numbers::pi * kTurns / 100;
  p["simulation"]["end_time"] = end;
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(run("theta") == Approx(100 * end).epsilon(1e-12));
  p["simulation"]["end_time"] = end / 10;
  const Outcome gradient = gradients(p);
  REQUIRE(gradient.ok());
  CHECK(gradient("theta", "w") == Approx(end / 10).epsilon(1e-9));
}

// 10 m long: about 12 000 swings in 10^5 s.
TEST_CASE("over 10^5 s a pendulum's energy drifts by no more than the tolerance times the time", "[extremes]") {
  Json p = problem("long_pendulum");
  p["bodies"] = {rod("rod", 1, 10, 0, 0, 0)};
  p["joints"] = {hinge("pin", "ground", {0, 0, 0}, "rod", "O")};
  p["sensors"] = {{"E", {{"quantity", "energy"}, {"component", "total"}}}};
  p["objectives"] = {{"E", {{"terminal", "E"}}}};
  const double rtol = 1e-6;
  set_accuracy(p, "dopri853", rtol);
  p["simulation"]["end_time"] = kLong;
  const Outcome run = values(p);
  INFO(run.message() << "; " << run.statistics().steps << " steps");
  REQUIRE(run.ok());
  const double largest_kinetic = 1 * 9.81 * 5;  // [J]
  CHECK(run.statistics().energy_drift < rtol * kLong * largest_kinetic);
  CHECK(run.statistics().max_position_violation < 1e-12 * 10);
  CHECK(run.statistics().max_velocity_violation < 1e-12 * 10);
}
