#include <catch2/catch.hpp>
#include <string>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// A block on a rail along x, driven by x = 3 t^2 against gravity: the force is (6 + 9.81) m.
CommandOutcome driven_block(const TemporaryFolder& folder, const std::string& mass, const std::string& law = "3*t^2") {
  const std::string file = folder.write("block.json", R"({
    "format": 1, "name": "block", "gravity": [-9.81, 0, 0],
    "bodies": [{"name": "block", "mass": )" + mass + R"(, "inertia": [1, 1, 1]}],
    "joints": [{"name": "rail", "type": "translational", "body2": "block", "axis1": [1, 0, 0], "axis2": [1, 0, 0]}],
    "drives": [{"name": "motor", "type": "displacement", "joint": "rail", "law": ")" +
                                                          law + R"("}],
    "simulation": {"end_time": 1, "output_step": 0.5}})");
  return run_command({"kinematics", file, "--out", folder.file("out")});
}

}  // namespace

TEST_CASE("kinematics gives the least and the largest force of each drive", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = driven_block(folder, "2");
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const auto motor = json_of(folder.path / "out/result.json").at("drives").at("motor");
  CHECK(motor.at("force_min").get<double>() == Approx(31.62).epsilon(1e-12));
  CHECK(motor.at("force_max").get<double>() == Approx(31.62).epsilon(1e-12));
}

TEST_CASE("kinematics fails in words where a force is too large for a number", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = driven_block(folder, "1e149", "1e160*t^2");
  INFO(outcome.out << outcome.err);
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains("the forces of the drives are too large for numbers at t = 0 s"));
  CHECK_THAT(outcome.out, !Contains("inf"));
}
