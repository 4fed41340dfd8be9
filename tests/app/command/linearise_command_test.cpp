#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// m x'' + c x' + k x = u on a rail along x.
constexpr const char* kBlock = R"({
  "format": 1, "name": "block", "gravity": [0, 0, -9.81],
  "parameters": {"k": 50, "c": 2, "u": 0, "at": 0.3},
  "bodies": [{"name": "block", "mass": 2, "inertia": [1, 1, 1], "position": ["at", 0, 0]}],
  "joints": [{"name": "rail", "type": "translational", "body2": "block", "axis1": [1, 0, 0], "axis2": [1, 0, 0]}],
  "forces": [{"name": "pull", "type": "force", "body": "block", "components": ["u - k*x - c*vx", 0, 0]}],
  "sensors": {"x": {"quantity": "position", "body": "block", "component": "x"},
              "vx": {"quantity": "velocity", "body": "block", "component": "x"}},
  "simulation": {"end_time": 1}})";

}  // namespace

TEST_CASE("linearise writes eigenvalues and a transfer function, and warns beside an equilibrium", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("block.json", kBlock);
  const auto arguments = [&](const std::string& at) {
    return std::vector<std::string>{"linearise", file, "--out", folder.file("out"),   "--inputs", "u",
                                    "--outputs", "x",  "--set", "parameters.at=" + at};
  };
  const CommandOutcome rest = run_command(arguments("0"));
  INFO(rest.out << rest.err);
  REQUIRE(rest.exit_code == kDone);
  CHECK_THAT(rest.err, !Contains("no equilibrium"));
  const auto x = json_of(folder.path / "out/result.json").at("linearisation");
  CHECK(x.at("frequencies").at(0).get<double>() == Approx(5 / (2 * std::numbers::pi)).epsilon(1e-12));
  CHECK(x.at("damping_ratios").at(0).get<double>() == Approx(0.1).epsilon(1e-12));
  CHECK(x.at("eigenvalues").at(1).at(1).get<double>() == Approx(-std::sqrt(24.75)).epsilon(1e-12));
  // C A^-1 B = -1/k, whatever the basis is
  const double A21 = x.at("A").at(1).at(0), B = x.at("B").at(1).at(0), C = x.at("C").at(0).at(0);
  CHECK(C * B / A21 == Approx(-1 / 50.0).epsilon(1e-12));
  CHECK(x.at("D").at(0).at(0).get<double>() == 0);
  const std::string report = content_of(folder.path / "out/report.html");
  CHECK_THAT(report, Contains("From inputs to outputs") && Contains(">0.02<") && Contains("x by u"));

  const CommandOutcome stretched = run_command(arguments("0.3"));
  REQUIRE(stretched.exit_code == kDone);
  CHECK_THAT(stretched.err, Contains("no equilibrium, bodies accelerate there"));
}

TEST_CASE("linearise takes a later state, and refuses what is not there", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("block.json", kBlock);
  const auto run = [&](const std::string& option, const std::string& value) {
    return run_command({"linearise", file, "--out", folder.file("out"), option, value});
  };
  CHECK(run("--at", "0.5").exit_code == kDone);
  CHECK(json_of(folder.path / "out/result.json").at("linearisation").at("time").get<double>() == Approx(0.5));
  CHECK_THAT(run("--at", "-1").err, Contains("must be after start_time"));
  CHECK_THAT(run("--inputs", "w").err,
             Contains("--inputs: there is no parameter 'w'") && Contains("known: k, c, u, at"));
  CHECK_THAT(run("--outputs", "y").err, Contains("--outputs: there is no sensor 'y'") && Contains("known: x, vx"));
  CHECK(run("--outputs", "y").exit_code == kBadInput);
}

TEST_CASE("a mechanism in which nothing is free is not linearised", "[command]") {
  const TemporaryFolder folder;
  std::string text = kBlock;
  const std::size_t drives = text.find("\"forces\"");
  text.insert(drives, R"("drives": [{"name": "shift", "type": "displacement", "joint": "rail", "law": "at"}], )");
  const CommandOutcome outcome =
      run_command({"linearise", folder.write("block.json", text), "--out", folder.file("out")});
  INFO(outcome.out << outcome.err);
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains("leave nothing free"));
}
