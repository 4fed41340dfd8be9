#include <catch2/catch.hpp>
#include <string>
#include <utility>

#include "app/terminal/exit_code.hpp"
#include "optim/problem/csv_table.hpp"
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

TEST_CASE("a linkage far from the origin moves as the one at the origin, to the rounding of its place", "[command]") {
  const TemporaryFolder folder;
  // The first and the last angle of the coupler of a four-bar; its guesses are off by 0.2 rad.
  const auto angles_at = [&](const std::string& off) {
    const auto pin = [](const std::string& name, const std::string& bodies, const std::string& points) {
      return R"({"name": ")" + name + R"(", "type": "revolute", )" + bodies + ", " + points +
             R"(, "axis1": [0, 0, 1], "axis2": [0, 0, 1]})";
    };
    const auto bar = [](const std::string& name, const std::string& x, const std::string& y, const std::string& angle) {
      return R"({"name": ")" + name + R"(", "mass": 1, "inertia": [1, 1, 1], "position": [)" + x + ", " + y +
             R"(, 0], "orientation": {"axis": [0, 0, 1], "angle": )" + angle + "}}";
    };
    const std::string far = R"("body1": "ground", "body2": )", x = off + " + 1.6";
    const std::string file = folder.write(
        "far.json", R"({"format": 1, "name": "far", "gravity": [0, 0, 0],
      "bodies": [)" + bar("crank", off, "0", "0.5") +
                        "," + bar("coupler", "\"" + off + " + 0.3\"", "0.25", "0.2") + "," +
                        bar("rocker", "\"" + x + "\"", "0", "2") + R"(],
      "joints": [)" + pin("A", far + R"("crank")", R"("point1": [)" + off + ", 0, 0]") +
                        "," + pin("B", R"("body1": "crank", "body2": "coupler")", R"("point1": [0.4, 0, 0])") + "," +
                        pin("C", R"("body1": "coupler", "body2": "rocker")",
                            R"("point1": [1.5, 0, 0], "point2": [1.2, 0, 0])") +
                        "," + pin("D", far + R"("rocker")", R"("point1": [")" + x + R"(", 0, 0])") + R"(],
      "drives": [{"name": "m", "type": "angle", "joint": "A", "law": "0.7 + t"}],
      "sensors": {"b": {"quantity": "angle", "joint": "B"}, "viol": {"quantity": "constraint_violation"}},
      "simulation": {"end_time": 0.1, "output_step": 0.05}})");
    const CommandOutcome outcome = run_command({"kinematics", file, "--out", folder.file("far_" + off)});
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    const CsvTable table = read_csv(folder.file("far_" + off) + "/trajectory.csv");
    const double rounding = 1e-15 * (1 + std::stod(off));
    for (const double violation : table.column("viol")) CHECK(violation < 10 * rounding);
    return std::pair(table.column("b").front(), table.column("b").back());
  };
  const auto [first, last] = angles_at("0");
  const auto [far_first, far_last] = angles_at("100000");
  CHECK(far_first == Approx(first).margin(1e-9));
  CHECK(far_last == Approx(last).margin(1e-9));
}
