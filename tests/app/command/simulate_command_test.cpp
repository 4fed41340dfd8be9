#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"
#include "tests/app/signal_handler.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

TEST_CASE("validate counts bodies, equations and degrees of freedom", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"validate", folder.write("rod.json", kPendulum), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("1 body") && Contains("1 degree of freedom"));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("model") == nlohmann::json{{"bodies", 1},
                                             {"equations", 6},
                                             {"rank", 6},
                                             {"degrees_of_freedom", 1},
                                             {"redundant", nlohmann::json::array()},
                                             {"free", nlohmann::json::array({"'rod' turns about the axis through joint "
                                                                             "'pin' along [0, 0, 1]"})},
                                             {"type", "planar"},
                                             {"unknowns_per_body", 3}});
}

TEST_CASE("simulate writes the columns of the contract, a row each output step", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const CommandOutcome outcome = run_command({"simulate", file, "--out", folder.file("out")});
  REQUIRE(outcome.exit_code == kDone);
  const auto lines = lines_of(content_of(folder.path / "out/trajectory.csv"));
  REQUIRE(lines.size() == 6);
  CHECK(lines[0] ==
        "t,rod.x,rod.y,rod.z,rod.e0,rod.e1,rod.e2,rod.e3,rod.vx,rod.vy,rod.vz,rod.wx,rod.wy,rod.wz,swing,tip_y");
  CHECK_THAT(lines[1], Catch::StartsWith("0,0,0,0,1,0,0,0,"));
  CHECK_THAT(lines[2], Catch::StartsWith("0.25,"));
  CHECK_THAT(lines[5], Catch::StartsWith("1,"));
}

TEST_CASE("result.json of simulate holds what the contract lists", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  REQUIRE(run_command({"simulate", file, "--out", folder.file("out")}).exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("program") == "mbsopt");
  CHECK(result.at("command") == "simulate");
  CHECK(result.at("problem") == "rod");
  CHECK(result.at("status") == "ok");
  for (const char* key : {"steps", "rejected", "rhs_evaluations", "wall_seconds", "max_position_violation",
                          "max_velocity_violation", "energy_drift"}) {
    CHECK(result.at("simulation").at(key).is_number());
  }
  CHECK(result.at("objectives").at("track").at("value") > 0);
  CHECK(result.at("provenance").at("input_sha256").get<std::string>().size() == 64);
  CHECK(result.at("warnings").is_array());
}

TEST_CASE("the same inputs give the same bytes", "[command]") {
  const TemporaryFolder folder;
  const std::vector<std::string> arguments{"simulate", folder.write("rod.json", kPendulum), "--out",
                                           folder.file("out")};
  REQUIRE(run_command(arguments).exit_code == kDone);
  const std::string trajectory = content_of(folder.path / "out/trajectory.csv");
  const std::string report = content_of(folder.path / "out/report.html");
  const auto result = repeatable(json_of(folder.path / "out/result.json"));
  REQUIRE(run_command(arguments).exit_code == kDone);
  CHECK(content_of(folder.path / "out/trajectory.csv") == trajectory);
  CHECK(content_of(folder.path / "out/report.html") == report);
  CHECK(repeatable(json_of(folder.path / "out/result.json")) == result);
}

TEST_CASE("the report is one page that loads nothing", "[command]") {
  const TemporaryFolder folder;
  REQUIRE(run_command({"simulate", folder.write("rod.json", kPendulum), "--out", folder.file("out")}).exit_code ==
          kDone);
  const std::string report = content_of(folder.path / "out/report.html");
  CHECK_THAT(report, Contains("<svg") && Contains("swing") && Contains("prefers-color-scheme"));
  CHECK_THAT(report, !Contains("http") && !Contains("url(") && !Contains("src="));
}

TEST_CASE("a simulation that fails ends with exit 1, in words, and keeps what was good", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"simulate", folder.write("rod.json", kPendulum), "--out", folder.file("out"), "--set",
                   "simulation.integrator.max_steps=6", "--set", "simulation.output_step=0.001"});
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains("simulate failed: "));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "failed");
  CHECK_FALSE(result.at("message").get<std::string>().empty());
  const double last = result.at("last_good_time");
  CHECK((last > 0 && last < 1));
  CHECK_THAT(content_of(folder.path / "out/report.html"),
             Contains("class=\"banner\"") && Contains("This run failed: " + result.at("message").get<std::string>()) &&
                 Contains("The motion is good up to"));
  const auto lines = lines_of(content_of(folder.path / "out/trajectory.csv"));
  REQUIRE(lines.size() > 2);
  CHECK(std::stod(lines.back()) == Approx(last).margin(0.001));
}

TEST_CASE("a change of energy is explained where dampers take it", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const CommandOutcome free = run_command({"simulate", file, "--out", folder.file("free")});
  const CommandOutcome damped =
      run_command({"simulate", file, "--out", folder.file("damped"), "--set", "forces[0].damping=3"});
  const auto words = Contains("with the work of dampers");
  CHECK_THAT(free.out, !words);
  CHECK_THAT(damped.out, words);
  CHECK_THAT(content_of(folder.path / "free/report.html"), !words);
  CHECK_THAT(content_of(folder.path / "damped/report.html"), words);
}

TEST_CASE("an assembly that cannot be closed ends with exit 1", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"simulate", folder.write("rod.json", kPendulum), "--out", folder.file("out"), "--set",
                   R"(initial.conditions=[{"sensor": "tip_y", "value": 3}])"});
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK(json_of(folder.path / "out/result.json").at("status") == "failed");
  CHECK_FALSE(fs::exists(folder.path / "out/trajectory.csv"));
}

TEST_CASE("SIGTERM stops a simulation at the next step and keeps the rows so far", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  std::thread killer([] {
    wait_for_handler(SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    ::kill(::getpid(), SIGTERM);
  });
  const CommandOutcome outcome = run_command({"simulate", file, "--out", folder.file("out"), "--set",
                                              "simulation.end_time=1e6", "--set", "simulation.output_step=1000"});
  killer.join();
  CHECK(outcome.exit_code == kInterrupted);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "interrupted");
  const std::string message = result.at("message");
  CHECK_THAT(message, Contains("trajectory.csv holds the motion up to "));
  CHECK_THAT(content_of(folder.path / "out/report.html"), Contains("This run was " + message));
  CHECK(lines_of(content_of(folder.path / "out/trajectory.csv")).size() >= 2);
}

TEST_CASE("simulate: a run that fails says how far it came", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_command({"simulate", folder.write("rod.json", kPendulum), "--out",
                                              folder.file("out"), "--set", "simulation.integrator.max_steps=5"});
  CHECK(outcome.exit_code == kNumericalFailure);
  const double reached = json_of(folder.path / "out/result.json").at("last_good_time");
  CHECK(reached < 1);
  CHECK_THAT(outcome.out, !Contains("0 s to 1 s") && Contains("0 s to 0.0"));
}
