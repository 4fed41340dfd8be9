// Springs as stiff as steel blocks, and springs of zero length.
#include "tests/app/run_command.hpp"
#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

TEST_CASE("an oscillator of 1e2 to 1e10 N/m follows its cosine over sixteen periods, its gradient too", "[extremes]") {
  const double k = GENERATE(1e2, 1e4, 1e6, 1e8, 1e10), w = std::sqrt(k), amplitude = 0.01;
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5", "gauss6");
  Json p = oscillator(k, 1, 1 + amplitude);
  const double end = 100 / w;
  p["simulation"]["end_time"] = end;
  set_accuracy(p, method, 1e-9);
  const Outcome run = gradients(p);
  INFO(method << ", " << k << " N/m: " << run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(run("x") - (1 + amplitude * std::cos(100))) < 1e-6 * amplitude);
  const double expected = -amplitude * std::sin(100) * 100 / (2 * k);  // x_k = -a sin(w T) T/(2 w), w T = 100
  CHECK(std::abs(run("x", "k") - expected) < 1e-5 * amplitude * 100 / (2 * k));
}

// A01 with its rod made of a spring: the bob hangs m(g + v^2/l)/k below it, 3e-9 m, and oscillates about that at 1e5
// rad/s. The motion of the rod is the limit.
TEST_CASE("a rod of 1e10 N/m swings as a rigid one, by the implicit methods", "[extremes]") {
  Json p = oscillator(1e10, 1, -1);
  p["gravity"] = {0, -9.81, 0};
  p["sensors"]["y"] = {{"quantity", "position"}, {"body", "ball"}, {"component", "y"}};
  p["objectives"]["y"] = {{"terminal", "y"}};
  p["forces"][0]["damping"] = GENERATE(0.0, 1e5);
  p["simulation"]["end_time"] = 1;
  set_accuracy(p, "radau5", 1e-8);
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(run("x") - 0.9862917511318753) < 1e-7);
  CHECK(std::abs(run("y") + 0.1650108531255412) < 1e-7);
}

TEST_CASE("a spring without free length passes through zero length as the cosine it is, its gradient too",
          "[extremes]") {
  const double k = 100, T = 2, x0 = 0.3;
  Json p = oscillator(k, 0, x0);
  p["simulation"]["end_time"] = T;
  set_accuracy(p, GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5"), 1e-9);
  for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
    const Outcome run = gradients(p, method);
    INFO(run.message());
    REQUIRE(run.ok());
    CHECK(std::abs(run("x") - x0 * std::cos(10 * T)) < 1e-6);
    CHECK(std::abs(run("x", "k") + x0 * std::sin(10 * T) * T / 20) < 1e-7);
  }
}

// On its way the ball is at l0 + (x0 - l0) cos(w t) until the origin, where the spring turns round; then the same
// mirrored.
TEST_CASE(
    "a spring with a free length turns round as it passes through zero length: the motion is right, the gradient "
    "refused in words",
    "[extremes]") {
  const double x0 = 0.3, l0 = 0.1, w = 10, first = std::acos(-l0 / (x0 - l0)) / w;
  Json p = oscillator(w * w, l0, x0);
  const double T = 2 * first + 0.1;  // there again, and on: a whole period of the two arcs later it is at x0 once more
  p["simulation"]["end_time"] = first + 0.05;
  set_accuracy(p, "dopri5", 1e-9);
  // Just past the origin: moving at -v, pulled back towards it by l0 - |x|, mirrored: |x| = l0 - l0 cos + (v/w) sin.
  const double v = (x0 - l0) * w * std::sin(w * first), t = 0.05;
  const double expected = -(l0 - l0 * std::cos(w * t) + v / w * std::sin(w * t));
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(run("x") - expected) < 1e-7);
  CHECK(T > first);

  for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
    const Outcome refused = gradients(p, method);
    REQUIRE_FALSE(refused.ok());
    CHECK_THAT(refused.message(), Contains("zero length") && Contains("'ball'") && Contains("gradient"));
  }
  p["simulation"]["end_time"] = 0.9 * first;  // before it gets there the gradient is there
  const Outcome before = gradients(p);
  REQUIRE(before.ok());
  CHECK(before("x", "k") == Approx(-(x0 - l0) * std::sin(w * 0.9 * first) * 0.9 * first / (2 * w)).epsilon(1e-6));
}

TEST_CASE("a spring that starts at zero length has no direction and no force: a warning says so", "[extremes]") {
  const TemporaryFolder folder;
  const CommandOutcome run = run_command(
      {"simulate", folder.write("oscillator.json", oscillator(100, 0.1, 0).dump()), "--out", folder.file("out")});
  CHECK(run.exit_code == 0);
  CHECK_THAT(run.err, Contains("warning: ") && Contains("zero length at the start"));
}

TEST_CASE("a law without a value at zero length is refused in words, not numbers", "[extremes]") {
  Json p = oscillator(100, 0.1, 0.3);
  Json& spring = p["forces"][0];
  for (const char* field : {"stiffness", "free_length", "damping"}) spring.erase(field);
  spring["law"] = "k*(l - 0.1) + 1e-30/l";
  p["simulation"]["end_time"] = 0.3;
  set_accuracy(p, "dopri5", 1e-9);
  const Outcome refused = gradients(p);
  REQUIRE_FALSE(refused.ok());
  CHECK_THAT(refused.message(), Contains("zero length") && Contains("its law has no finite value") && !Contains("inf"));
}
