// Every command with CVODES: as the file's integrator, and as a method of `gradient` and `check` on any file.
#include <catch2/catch.hpp>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

const std::vector<std::string> kAccurate{"--set", "simulation.integrator.rtol=1e-9", "--set",
                                         "simulation.integrator.atol=1e-11"};

CommandOutcome run_with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_command(arguments);
}

std::vector<std::string> by(const std::string& integrator) {
  std::vector<std::string> more = kAccurate;
  more.insert(more.end(), {"--set", "simulation.integrator.type=" + integrator});
  return more;
}

}  // namespace

TEST_CASE("gradient: CVODES gives the discrete derivatives to 1e-6, and says what it used", "[command][cvodes]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum), out = folder.file("out");
  REQUIRE(run_with({"gradient", file, "--out", out, "--method", "tlm"}, kAccurate).exit_code == kDone);
  const auto reference = json_of(folder.path / "out/result.json").at("objectives");
  for (const std::string method : {"cvodes_forward", "cvodes_adjoint"}) {
    const CommandOutcome outcome = run_with({"gradient", file, "--out", out, "--method", method}, kAccurate);
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    CHECK_THAT(outcome.out, Contains("with cvodes_adams") && Contains(method) && Contains("not by dopri853"));
    const auto result = json_of(folder.path / "out/result.json");
    CHECK(result.at("methods").at(method).at("integrator") == "cvodes_adams");
    for (const char* objective : {"track", "end"}) {
      for (const char* parameter : {"L", "k"}) {
        const double derivative = result.at("objectives").at(objective).at("gradient").at(parameter);
        CHECK(derivative == Approx(reference.at(objective).at("gradient").at(parameter).get<double>()).epsilon(1e-6));
      }
    }
  }
}

TEST_CASE("simulate, gradient, check and design with CVODES in the file", "[command][cvodes]") {
  const TemporaryFolder folder;
  const std::string integrator = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  const std::string file = folder.write("rod.json", kPendulum);
  const auto run = [&](const std::string& command, std::vector<std::string> more = {}) {
    const std::vector<std::string> chosen = by(integrator);
    more.insert(more.end(), chosen.begin(), chosen.end());
    return run_with({command, file, "--out", folder.file(command)}, more);
  };
  const CommandOutcome simulated = run("simulate");
  CHECK(simulated.exit_code == kDone);
  CHECK_THAT(simulated.out, Contains("with " + integrator));
  CHECK(json_of(folder.path / "simulate/result.json").at("simulation").at("max_position_violation") < 1e-6);

  CHECK_THAT(run("gradient").out, Contains("gradients by cvodes_adjoint: 2 variables"));
  CHECK_THAT(run("gradient", {"--method", "adjoint"}).out, Contains("cvodes_adjoint instead of adjoint"));
  CHECK(run("gradient", {"--method", "fd"}).exit_code == kDone);

  const CommandOutcome checked = run("check");
  INFO(checked.out << checked.err);
  CHECK(checked.exit_code == kDone);
  CHECK_THAT(checked.out, Contains("steps cannot be frozen"));
  const std::string discrete = integrator == "cvodes_bdf" ? "radau5" : "dopri853";
  CHECK_THAT(checked.out, Contains("against the derivatives of " + discrete));
  CHECK(json_of(folder.path / "check/result.json").at("methods").contains("fd_frozen") == false);

  const CommandOutcome designed = run("design");
  INFO(designed.out << designed.err);
  CHECK(designed.exit_code == kDone);
  REQUIRE(run_with({"design", file, "--out", folder.file("reference")}, kAccurate).exit_code == kDone);
  const auto k_of = [&](const char* of) {
    return json_of(folder.path / of / "result.json").at("parameters").at("k").at("value").get<double>();
  };
  CHECK(k_of("design") == Approx(k_of("reference")).epsilon(1e-5));
}

TEST_CASE("check: CVODES stands beside the discrete methods", "[command][cvodes]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"check", folder.write("rod.json", kPendulum), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("of the differential equation, against the derivatives of dopri853") &&
                              Contains("track: agrees") && Contains("end: agrees"));
  const auto result = json_of(folder.path / "out/result.json");
  const auto& verdict = result.at("verdict").at("continuous");
  CHECK(verdict.at("ran") == true);
  CHECK(verdict.at("rtol") <= 1e-9);
  CHECK(verdict.at("entries").at("track").at("L").at("verdict") == "agrees");
  CHECK(verdict.at("entries").at("track").at("L").at("difference") < 1e-6);
  CHECK(result.at("methods").at(verdict.at("method").get<std::string>()).at("gradient").at("end").at("k").is_number());
}

TEST_CASE("a run of CVODES that fails keeps the motion so far and says why", "[command][cvodes]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const CommandOutcome outcome =
      run_with({"simulate", file, "--out", folder.file("out"), "--set", "simulation.integrator.max_steps=20", "--set",
                "simulation.output_step=0.001"},
               by("cvodes_adams"));
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains("more than 20 steps") && Contains("t = "));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "failed");
  CHECK(result.at("last_good_time") > 0);
  CHECK(content_of(folder.path / "out/trajectory.csv").size() > 500);
}
