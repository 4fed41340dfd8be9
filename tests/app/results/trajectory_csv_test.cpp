#include "app/results/trajectory_csv.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <vector>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("a cell without a finite number is empty", "[csv]") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  CHECK(to_csv({{"t", "x", "y"}, {{0.5, kInfinity, 2}, {1, -3, kInfinity - kInfinity}}}) == "t,x,y\n0.5,,2\n1,-3,\n");
}

TEST_CASE("a trajectory whose writing is stopped has no text", "[csv]") {
  const Trajectory trajectory{{"t", "x"}, {{0, 1}, {0.5, 2}, {1, 3}}};
  std::vector<double> seen;
  const auto until = [&](double last) { return [&seen, last](double t) { return seen.push_back(t), t <= last; }; };
  CHECK(!to_csv(trajectory, until(0.4)));
  CHECK(seen == std::vector<double>{0, 0.5});
  CHECK(to_csv(trajectory, until(1)) == "t,x\n0,1\n0.5,2\n1,3\n");
}

TEST_CASE("a sensor that is too large for a number is warned of", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("ball.json", R"({
    "format": 1, "name": "ball", "gravity": [0, 0, 0],
    "bodies": [{"name": "ball", "mass": 1, "inertia": [1, 1, 1], "angular_velocity": [0, 0, 1e5]}],
    "sensors": {"far": {"quantity": "velocity", "body": "ball", "point": [1e150, 0, 0], "component": "norm"}},
    "simulation": {"end_time": 1e-5, "output_step": 5e-6}})");
  const CommandOutcome outcome = run_command({"simulate", file, "--out", folder.file("out")});
  INFO(outcome.out << outcome.err);
  CHECK_THAT(outcome.err, Contains("'far' is too large for a number at t = 0 s"));
  CHECK_THAT(content_of(folder.path / "out/trajectory.csv"), !Contains("inf"));
}
