// Drives whose law jumps.
#include "tests/app/run_command.hpp"
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
  CHECK_THAT(run.message(), Contains("'motor'") && Contains("jumps by 0.2 at t = 0.5 s") &&
                                Contains("Let it pass smoothly, over a short time"));
}

TEST_CASE("a jump of a drive's rate is an impact and ends the run in words, however small a part of the law it is",
          "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "radau5", "rk4", "cvodes_bdf");
  const std::string law =
      GENERATE(as<std::string>{}, "max(0, t - 0.5)", "1e3*max(0, t - 0.5)", "10*sin(t) + 1e-3*max(0, t - 0.5)");
  const Outcome run = values(driven(law, method));
  INFO(method << ", " << law << ": " << run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("'motor'") && Contains("at t = 0.5 s: an impact") &&
                                Contains("Let the rate change over a short time"));
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

TEST_CASE("a law that is no number at the start is refused with its place in the file", "[extremes]") {
  const auto [law, words] = GENERATE(table<std::string, std::string>({{"log(t)", "'log(t)' is -inf"},
                                                                      {"sqrt(t - 0.5)", "is not a number"},
                                                                      {"sqrt(t)", "the rate of 'sqrt(t)' is inf"},
                                                                      {"1/t", "'1/t' is inf"}}));
  const bool rate = words.rfind("the rate", 0) == 0;
  Json drive = driven(law, "dopri5"), spring = pendulum(), push = pendulum();
  spring["forces"] = {{{"name", "spring"}, {"type", "rsda"}, {"joint", "pin"}, {"law", law}}};
  push["forces"] = {
      {{"name", "push"}, {"type", "force"}, {"body", "rod"}, {"point", "tip"}, {"components", {0, law, 0}}}};
  const TemporaryFolder folder;
  for (const auto& [p, place] :
       {std::pair<Json, std::string>{drive, "drives[0].law"}, std::pair<Json, std::string>{spring, "forces[0].law"},
        std::pair<Json, std::string>{push, "forces[0].components[1]"}}) {
    if (rate && place != "drives[0].law") continue;  // only a drive has to have one
    const CommandOutcome run = run_command({"simulate", folder.write("p.json", p.dump()), "--out", folder.file("out")});
    INFO(place << ": " << run.err);
    CHECK(run.exit_code == 2);
    CHECK_THAT(run.err, Contains("p.json:1:") && Contains(place + ": ") && Contains(words) &&
                            Contains("at the start, t = 0 s") && Contains("root, logarithm or division"));
    CHECK_FALSE(std::filesystem::exists(folder.path / "out"));
  }
}

TEST_CASE("a force that has no number from some time on ends the run in words, with that time", "[extremes]") {
  Json p = pendulum();
  p["forces"] = {{{"name", "spring"}, {"type", "rsda"}, {"joint", "pin"}, {"law", "sqrt(0.5 - t)"}}};
  p["simulation"]["integrator"]["type"] = GENERATE(as<std::string>{}, "dopri5", "cvodes_adams");
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("beyond t = 0.5 s") && Contains("Look for ") && Contains(" law "));
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
