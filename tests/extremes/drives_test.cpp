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

TEST_CASE("a law with a pole ends the run soon and in words that tell the time", "[extremes]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "radau5", "sdirk4", "cvodes_bdf");
  const auto [law, time] = GENERATE(table<std::string, double>(
      {{"tan(2*t)", 0.785398}, {"0.01/(t - 0.5)", 0.5}, {"0.01/(t - 0.5)^2", 0.5}, {"0.1*log(abs(t - 0.5))", 0.5}}));
  for (const bool drive : {true, false}) {
    if (!drive && law.find("log") != std::string::npos) continue;  // has an integral: such a force is followed
    Json p = drive ? driven(law, method) : pendulum();
    if (!drive) {
      p["forces"] = {
          {{"name", "push"}, {"type", "force"}, {"body", "rod"}, {"point", "tip"}, {"components", {0, law, 0}}}};
      p["simulation"]["integrator"]["type"] = method;
    }
    p["simulation"]["integrator"]["max_steps"] = 200000;
    const TemporaryFolder folder;
    const CommandOutcome run =
        run_command({"simulate", folder.write("p.json", p.dump()), "--out", folder.file("out"), "--quiet"});
    INFO((drive ? "drive " : "force ") << law << " by " << method << ": " << run.err);
    CHECK(run.exit_code == 1);
    const Json result = json_of(folder.path / "out/result.json");
    CHECK(result.at("last_good_time").get<double>() == Approx(time).margin(0.01));
    CHECK_THAT(run.err,
               (Contains("Look for ") && Contains("law")) || Contains("jumps") || Contains("Does a drive ask"));
  }
}

TEST_CASE("a motion that grows beyond all bounds ends the run in words, with the body, its speed and the time",
          "[extremes]") {
  Json p = pendulum();
  const bool feeds = GENERATE(true, false);
  p["forces"] = feeds ? Json{{{"name", "coil"}, {"type", "rsda"}, {"joint", "pin"}, {"damping", -1e3}}}
                      : Json{{{"name", "push"},
                              {"type", "force"},
                              {"body", "rod"},
                              {"point", "tip"},
                              {"components", {"exp(100*t)", 0, 0}}}};
  if (!feeds) p["joints"] = Json::array(), p["sensors"].erase("theta"), p["sensors"].erase("speed");
  p["objectives"] = {{"y", {{"terminal", "tip_y"}}}};
  p["simulation"]["integrator"]["type"] = GENERATE(as<std::string>{}, "dopri5", "cvodes_adams");
  const TemporaryFolder folder;
  const CommandOutcome run =
      run_command({"simulate", folder.write("p.json", p.dump()), "--out", folder.file("out"), "--quiet"});
  INFO(run.err);
  CHECK(run.exit_code == 1);
  CHECK_THAT(run.err, Contains("body 'rod'") && Contains(" at t = ") && Contains("grows beyond all bounds"));
  if (feeds) CHECK_THAT(run.err, Contains("forces[0].damping: is -1000: it feeds energy"));
}

TEST_CASE("the rounding of a law is no jump of it", "[extremes]") {
  const Outcome run = values(driven("exp(5*t) - 1", GENERATE(as<std::string>{}, "dopri5", "cvodes_bdf")));
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(run("theta") == Approx(std::exp(5.0) - 1).epsilon(1e-4));
}
