#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <map>
#include <thread>

#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

// Each mechanism's freedoms are known from its joints. Andrews' mechanism starts where K1 and K2 are in line, so that
// the other bodies stand still for an instant; they move all the same.
TEST_CASE("validate names the motion that is free", "[command]") {
  const std::map<std::string, std::vector<std::string>> known{
      {"four_bar/spatial",
       {"'coupler_bar' turns about the axis through joints 'B' and 'C'",
        "'crank_bar', 'coupler_bar', 'rocker_bar' move together"}},
      {"four_bar/redundant", {"'crank_bar', 'coupler_bar', 'rocker_bar' move together"}},
      {"four_bar/kinematics", {}},
      // The rod and the plane are in line for 'left' at the start only.
      {"car_axis/simulate",
       {"'left' moves alone with 4 degrees of freedom", "'right' moves alone with 5 degrees of freedom",
        "'left', 'right' move together"}},
      {"andrews/simulate", {"'K1', 'K2', 'K3', 'K4', 'K5', 'K6', 'K7' move together"}},
      {"double_pendulum/gradient",
       {"'lower' turns about the axis through joint 'elbow' along [0, 1, 0]", "'upper', 'lower' move together"}},
      {"boom/lift", {"'load' turns freely about joint 'hook'"}},
      {"bushing/engine_mount", {"'block' moves freely"}},
      {"joints/gear_train", {"'motor', 'between', 'drum' move together"}},
      {"quarter_car/ride", {"'wheel' slides along [0, 0, 1]", "'body' slides along [0, 0, 1]"}},
  };
  const TemporaryFolder folder;
  int runs = 0;
  for (const auto& [name, motions] : known) {
    INFO(name);
    const std::string out = folder.file(std::to_string(runs++));
    const CommandOutcome outcome = run_command({"validate", file_of(name).string(), "--out", out});
    CHECK(outcome.exit_code == kDone);
    CHECK(json_of(out + "/result.json").at("model").at("free") == motions);
    for (const std::string& motion : motions) CHECK_THAT(outcome.out, Contains("free: " + motion));
  }
}

TEST_CASE("validate and simulate refuse motion without any mass", "[command]") {
  const TemporaryFolder folder;
  const std::string command = GENERATE(as<std::string>{}, "validate", "simulate", "design");
  const CommandOutcome outcome = run_command({command, folder.write("rod.json", kPendulum), "--out", folder.file("out"),
                                              "--set", "bodies[0].mass=0", "--set", "bodies[0].inertia=[0, 0, 0]"});
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains(command + " failed: the accelerations at the start, t = 0 s, cannot be computed. A "
                                             "body without mass or inertia in a direction that no joint holds has "
                                             "none: 'rod'. Give it some, or hold it"));
}

TEST_CASE("an axis of the wrong sign may be what makes the axes of a joint differ", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_command({"validate", folder.write("rod.json", kPendulum), "--out",
                                              folder.file("out"), "--set", "joints[0].axis2=[0, 0, -1]"});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("axis1 differs from axis2: make them equal, or give normal1 and normal2"));
}

TEST_CASE("validate takes a prescribed acceleration, which only kinematics uses", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", R"({
    "format": 1, "name": "rod", "bodies": [{"name": "rod", "mass": 1, "inertia": [1, 1, 1]}],
    "joints": [{"name": "pin", "type": "revolute", "body2": "rod", "axis1": [0, 1, 0], "axis2": [0, 1, 0]}],
    "sensors": {"phi": {"quantity": "angle", "joint": "pin"}},
    "initial": {"conditions": [{"sensor": "phi", "value": 0.3, "rate": 1, "acceleration": 2}]},
    "simulation": {"end_time": 1}})");
  const CommandOutcome outcome = run_command({"validate", file, "--out", folder.file("out")});
  INFO(outcome.out << outcome.err);
  CHECK(outcome.exit_code == kDone);
  CHECK(run_command({"simulate", file, "--out", folder.file("simulated")}).exit_code == kBadInput);
}

// 401 rows at 100 Hz; one column has no samples between 1.5 and 1.8 s. Windows are parts of one record.
TEST_CASE("validate says what the columns of a record hold", "[command][identification]") {
  const TemporaryFolder folder;
  std::istringstream rows(content_of(std::filesystem::path(MBSOPT_SOURCE_DIR) / "data/identification/arm.csv"));
  std::string record, row;
  for (int i = -1; std::getline(rows, row); ++i) {
    if (i > 150 && i < 180) row = row.substr(0, row.find(',') + 1) + row.substr(row.find(',', row.find(',') + 1));
    record += row + "\n";
  }
  const CommandOutcome outcome = run_command({"validate", file_of("double_pendulum/identify_windows").string(), "--set",
                                              "identification.experiments[0].data=" + folder.write("arm.csv", record),
                                              "--out", folder.file("out")});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("largest gap") && Contains("rad/s"));
  const auto channels = json_of(folder.path / "out/result.json").at("preflight").at("channels");
  REQUIRE(channels.size() == 4);
  CHECK(channels[0].at("experiment") == "arm");
  CHECK(channels[0].at("samples") == 401 - 29);
  CHECK(channels[0].at("missing") == 29);
  CHECK(channels[0].at("largest_gap").get<double>() == Approx(0.3));
  CHECK(channels[1].at("samples") == 401);
  for (const auto& channel : channels) CHECK(channel.at("interval").get<double>() == Approx(0.01));
  CHECK(channels[1].at("largest_gap").get<double>() == Approx(0.01));
  CHECK(channels[1].at("unit") == "rad");
  CHECK(channels[2].at("unit") == "rad/s");
}

TEST_CASE("validate that is interrupted within the guesses of starts says so", "[command]") {
  const TemporaryFolder folder;
  struct sigaction of_tests = {};
  ::sigaction(SIGTERM, nullptr, &of_tests);
  std::thread interrupting([&] {
    struct sigaction now = of_tests;
    for (; now.sa_handler == of_tests.sa_handler; ::sigaction(SIGTERM, nullptr, &now))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(::getpid(), SIGTERM);
  });
  const CommandOutcome outcome =
      run_command({"validate", MBSOPT_SOURCE_DIR "/problems/double_pendulum/identify_windows.json", "--set",
                   "identification.experiments[0].windows.length=0.05", "--out", folder.file("out")});
  interrupting.join();
  CHECK(outcome.exit_code == kInterrupted);
  CHECK(json_of(folder.path / "out/result.json").at("status") == "interrupted");
}
