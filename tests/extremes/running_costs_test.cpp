// Running costs that the steps do not resolve, or that have no integral.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/app/run_command.hpp"
#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

namespace {

Json judged(const std::string& running, const std::string& method, double step = 0) {
  Json p = pendulum();
  p["objectives"] = {{"judged", {{"running", running}}}};
  p["simulation"]["integrator"] = {{"type", method}};
  if (step > 0) p["simulation"]["integrator"]["step"] = step;
  return p;
}

std::string warnings_of(const Json& p) {
  const TemporaryFolder folder;
  const CommandOutcome run =
      run_command({"simulate", folder.write("p.json", p.dump()), "--out", folder.file("out"), "--quiet"});
  INFO(run.err);
  REQUIRE(run.exit_code == 0);
  return run.err;
}

}  // namespace

TEST_CASE("a running cost with a pole has no integral and ends the run in words, with the objective and the time",
          "[extremes]") {
  const auto [method, step] = GENERATE(table<std::string, double>({{"euler", 0.003},
                                                                   {"rk2", 0.01},
                                                                   {"bs3", 0},
                                                                   {"rk4", 0.01},
                                                                   {"dopri5", 0},
                                                                   {"dopri853", 0},
                                                                   {"sdirk4", 0},
                                                                   {"radau5", 0},
                                                                   {"gauss4", 0.01}}));
  for (const char* g : {"1/(t - 0.50123)", "1/(t - 0.50123)^2", "tan(t + pi/2 - 0.50123)", "1/abs(t - 0.50123)"}) {
    const Outcome run = values(judged(g, method, step));
    INFO(method << ", " << g << ": " << run.message());
    CHECK_FALSE(run.ok());
    CHECK_THAT(run.message(), Contains("running cost of objective 'judged'") && Contains("near t = 0.50123 s") &&
                                  Contains("its integral does not exist"));
  }
}

TEST_CASE("a pole that the motion passes is one, too", "[extremes]") {
  const Outcome run = values(judged("1/(theta + 0.5)", GENERATE(as<std::string>{}, "dopri5", "radau5")));
  INFO(run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("'judged'") && Contains("its integral does not exist"));
}

TEST_CASE("CVODES, whose steps follow running costs, ends at a pole and names the objective", "[extremes]") {
  const Outcome run = values(judged("1/(t - 0.50123)", GENERATE(as<std::string>{}, "cvodes_bdf", "cvodes_adams")));
  INFO(run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("beyond t = 0.50123 s") && Contains("pole or jump") && Contains("'judged'"));
}

// Its nearest stage may lie anywhere: many places of the pole.
TEST_CASE("a running cost that grows without bounds but has an integral is no pole, and is right or a warning",
          "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5");
  const bool root = GENERATE(true, false);
  const auto integral = [&](double of) { return root ? 2 * std::sqrt(of) : of - of * std::log(of); };  // from 0
  int all = 0, right = 0;
  for (double pole = 0.40123; pole < 0.6; pole += 0.0107) {
    const std::string distance = fmt::format("abs(t - {})", pole);
    const Json p = judged(root ? "1/sqrt(" + distance + ")" : "-log(" + distance + ")", method);
    const Outcome run = values(p);
    INFO(method << ", pole " << pole << ": " << run.message());
    REQUIRE(run.ok());
    const double exact = integral(pole) + integral(1 - pole);
    INFO(run("judged") << " for " << exact);
    const bool is_right = std::abs(run("judged") - exact) < 0.2 * exact;
    ++all, right += is_right;
    CHECK((is_right ||
           warnings_of(p).find("do not resolve the running cost of objective 'judged'") != std::string::npos));
  }
  INFO(method << ": " << right << " of " << all);
  CHECK(right > 0.6 * all);
}

TEST_CASE("a running cost that the steps do not resolve is a warning with its name, the error and what to change",
          "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5", "sdirk4");
  for (const char* g : {"sin(1000*t + 1e-9*theta)^2", "1/((t - 0.50123 + 1e-9*theta)^2 + 1e-8)"}) {
    INFO(method << ", " << g);
    CHECK_THAT(warnings_of(judged(g, method)), Contains("do not resolve the running cost of objective 'judged'") &&
                                                   Contains("estimated error of") && Contains("max_step"));
  }
}

// dopri853 has weights of both signs, whose sizes add up to 13 times the step.
TEST_CASE("a running cost that turns within a small part of the run is right, or a warning", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5");
  for (double turns = 200; turns < 2000; turns *= 1.3) {
    const auto g = [&](double t) { return 0.1 + std::cos(turns * std::exp(-std::pow((t - 0.5) / 0.01, 2))); };
    double exact = 0;
    constexpr int kParts = 200'000;
    for (int i = 0; i < kParts; ++i) exact += g((i + 0.5) / kParts) / kParts;
    const Json p =
        judged(fmt::format("0.1 + cos({}*exp(-((t - 0.5 + 1e-12*theta)/0.01)^2))", turns), method);  // of the state
    const Outcome run = values(p);
    REQUIRE(run.ok());
    INFO(method << ", " << turns << ": " << run("judged") << " for " << exact << ", estimate "
                << run.statistics().quadrature.error);
    CHECK((std::abs(run("judged") - exact) < 0.02 * std::abs(exact) ||
           warnings_of(p).find("do not resolve the running cost") != std::string::npos));
  }
}

TEST_CASE("a peak of time alone is right, or a warning where few stages notice its feet", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5", "sdirk4");
  const double top = GENERATE(0.31, 0.50123);
  const bool has_feet = GENERATE(true, false);
  const Json p = judged(
      has_feet ? fmt::format("1/((t - {})^2 + 1e-8)", top) : fmt::format("1e4*exp(-(1e4*(t - {}))^2)", top), method);
  const double exact =
      has_feet ? 1e4 * (std::atan(1e4 * (1 - top)) + std::atan(1e4 * top)) : std::sqrt(std::numbers::pi);
  const Outcome run = values(p);
  REQUIRE(run.ok());
  INFO(method << ", " << top << ": " << run("judged") << " for " << exact);
  if (method == "dopri853" || method == "dopri5") CHECK(run("judged") == Approx(exact).epsilon(2e-3));
  CHECK((std::abs(run("judged") - exact) < 2e-3 * exact ||
         warnings_of(p).find("do not resolve the running cost") != std::string::npos));
}

TEST_CASE("a resolved running cost is none, and its error is less than twice the estimate", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "bs3", "dopri5", "dopri853", "sdirk2", "sdirk4", "radau5");
  const Json p = judged("2 + sin(10*t)", method);
  const Outcome run = values(p);
  REQUIRE(run.ok());
  const double error = std::abs(run("judged") - (2 + (1 - std::cos(10.0)) / 10));
  INFO(method << ": error " << error << ", estimate " << run.statistics().quadrature.error);
  CHECK(error < 2 * run.statistics().quadrature.error * 2 + 1e-13);  // of an integral of 2
  CHECK(run.statistics().quadrature.error < 1e-2);
  CHECK_THAT(warnings_of(p), !Contains("do not resolve"));
}

TEST_CASE("a running cost that sets in within a step is neither a pole nor unresolved", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "rk4", "radau5");
  for (int k = 0; k < 20; ++k) {
    const double t0 = 0.5 + 0.0025 * k;  // over a few steps
    const Json p = judged("max(0, t - " + std::to_string(t0) + ")^2", method, method == "rk4" ? 0.01 : 0);
    const Outcome run = values(p);
    INFO(method << " from " << t0 << ": " << run.message());
    REQUIRE(run.ok());
    CHECK(run("judged") == Approx(std::pow(1 - t0, 3) / 3).epsilon(1e-3));
  }
}

TEST_CASE("a running cost that is met but for rounding is no warning", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5");
  CHECK_THAT(warnings_of(judged("1e-30*sin(1000*t)^2", method)), !Contains("do not resolve"));
}
