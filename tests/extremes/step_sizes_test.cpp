// Steps too large, and runs of one step.
#include "tests/app/run_command.hpp"
#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

TEST_CASE("a fixed step too large for stability ends the run in words, before numbers get large", "[extremes]") {
  Json p = oscillator(1e6, 1, 1.01);
  const auto [method, step] = GENERATE(
      table<std::string, double>({{"euler", 1e-3}, {"rk2", 5e-3}, {"rk4", 5e-3}, {"dopri5", 5e-3}, {"rk4", 0.1}}));
  p["simulation"]["integrator"] = {{"type", method}, {"step", step}};
  const Outcome run = values(p);
  INFO(method << ", step " << step);
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("a smaller simulation.integrator.step") || Contains("use a smaller step"));
}

TEST_CASE("a fixed step too large for a swing ends the run in words, by every kind of method", "[extremes]") {
  Json p = pendulum();
  p["simulation"]["end_time"] = 10;
  const std::string method = GENERATE(as<std::string>{}, "euler", "rk4", "dopri5", "dopri853", "radau5", "gauss6");
  const double step = GENERATE(10, 3, 1);
  p["simulation"]["integrator"] = {{"type", method}, {"step", step}};
  const Outcome run = values(p);
  INFO(method << ", step " << step << ": " << run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("a smaller simulation.integrator.step") || Contains("se a smaller step"));
}

TEST_CASE("a run too short for the digits of its time is refused", "[extremes]") {
  Json p = pendulum();
  const double start = GENERATE(1e9, 1e15, -1e12);
  p["simulation"]["start_time"] = start, p["simulation"]["end_time"] = start + 1;
  const TemporaryFolder folder;
  const CommandOutcome run = run_command({"simulate", folder.write("p.json", p.dump()), "--out", folder.file("out")});
  INFO(run.err);
  CHECK(run.exit_code == 2);
  CHECK_THAT(run.err, Contains("simulation.end_time: is 1 s after start_time") && Contains("let time begin near 0"));
  p["simulation"]["start_time"] = 1e6, p["simulation"]["end_time"] = 1e6 + 1;
  CHECK(values(p).ok());
}

TEST_CASE("a run so long that its times could not be told from each other says so, and does not blame the mechanism",
          "[extremes]") {
  Json p = pendulum();
  p["simulation"]["end_time"] = GENERATE(1e30, 1e300);
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "bs3", "radau5");
  p["simulation"]["integrator"] = {{"type", method}};
  const Outcome run = values(p);
  INFO(method << ", to " << p["simulation"]["end_time"] << ": " << run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("is too long for this motion") && Contains("simulation.end_time"));
}

TEST_CASE("steps, tolerances and rows that no run gets through are refused with their place in the file",
          "[extremes]") {
  const auto [key, value, words] = GENERATE(table<std::string, double, std::string>(
      {{"integrator.step", 1e-300, "the run would need more steps than max_steps, 1e+07, allows; take a longer step"},
       {"integrator.step", 0, "greater than 0"},
       {"integrator.rtol", 1e300, "a relative tolerance must be below 1"},
       {"integrator.rtol", 0, "greater than 0"},
       {"integrator.atol", 0, "greater than 0"},
       {"output_step", 1e-12, "rows of trajectory.csv; take a longer one"}}));
  Json p = pendulum();
  Json& settings = p["simulation"];
  settings[Json::json_pointer("/" + std::string(key == "output_step" ? key : "integrator/" + key.substr(11)))] = value;
  const TemporaryFolder folder;
  const CommandOutcome run = run_command({"simulate", folder.write("p.json", p.dump()), "--out", folder.file("out")});
  INFO(run.err);
  CHECK(run.exit_code == 2);
  CHECK_THAT(run.err, Contains("p.json:1:") && Contains("simulation." + key + ": ") && Contains(words));
}

TEST_CASE("an initial step too large is taken back by step-size control", "[extremes]") {
  Json p = pendulum();
  set_accuracy(p, GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5"), 1e-9);
  const Outcome usual = values(p);
  p["simulation"]["integrator"]["initial_step"] = 1;
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE((usual.ok() && run.ok()));
  CHECK(run.statistics().rejected > 0);
  CHECK(std::abs(run("theta") - usual("theta")) < 1e-7);
}

TEST_CASE("a run of one step ends at its end time, within the error of one step of the method", "[extremes]") {
  const auto [method, order] = GENERATE(table<std::string, int>({{"euler", 1},
                                                                 {"rk2", 2},
                                                                 {"bs3", 3},
                                                                 {"rk4", 4},
                                                                 {"dopri5", 5},
                                                                 {"verner6", 6},
                                                                 {"dopri853", 8},
                                                                 {"sdirk2", 2},
                                                                 {"sdirk3", 3},
                                                                 {"sdirk4", 4},
                                                                 {"radau5", 5},
                                                                 {"gauss4", 4},
                                                                 {"gauss6", 6}}));
  Json p = pendulum();
  p["parameters"] = {{"rate0", {{"value", 2}}}};
  p["initial"]["conditions"] = {{{"sensor", "theta"}, {"value", 0.3}, {"rate", "rate0"}}};
  const double h = 0.02;
  p["simulation"]["end_time"] = h;
  set_accuracy(p, "dopri853", 1e-13);
  const Outcome exact = gradients(p);
  p["simulation"]["integrator"] = {{"type", method}, {"step", h}};
  const Outcome tlm = gradients(p, GradientMethod::tlm), adjoint = gradients(p, GradientMethod::adjoint);
  INFO(method << ": " << tlm.message());
  REQUIRE((exact.ok() && tlm.ok() && adjoint.ok()));
  CHECK(tlm.statistics().steps == 1);
  // Rates of the motion are of the order of w = sqrt(3 g/2) = 3.8 1/s and rate: (w h)^(order + 1), and rounding.
  const double bound = 10 * std::pow(4 * h, order + 1) + 1e-13;
  CHECK(std::abs(tlm("theta") - exact("theta")) < bound);
  CHECK(std::abs(tlm("theta", "rate0") - exact("theta", "rate0")) < bound);
  CHECK(adjoint("theta", "rate0") == Approx(tlm("theta", "rate0")).epsilon(1e-12));
}

TEST_CASE("an end time of a billionth of a second is one step, and right", "[extremes]") {
  Json p = pendulum();
  p["initial"]["conditions"] = {{{"sensor", "theta"}, {"value", 0.3}, {"rate", 2}}};
  const double end = GENERATE(1e-6, 1e-9, 1e-12);
  p["simulation"]["end_time"] = end;
  p["simulation"]["integrator"]["type"] = GENERATE(as<std::string>{}, "dopri5", "radau5", "cvodes_bdf");
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(run("theta") - (0.3 + 2 * end)) < 10 * end * end + 1e-15);
}
