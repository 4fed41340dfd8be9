#include "app/results/trajectory_exports.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("simulate --mat --gnuplot writes both beside trajectory.csv", "[results]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const CommandOutcome plain = run_command({"simulate", file, "--out", folder.file("plain")});
  REQUIRE(plain.exit_code == kDone);
  CHECK_FALSE(std::filesystem::exists(folder.path / "plain/trajectory.mat"));
  CHECK_FALSE(std::filesystem::exists(folder.path / "plain/trajectory.gp"));
  const CommandOutcome outcome = run_command({"simulate", file, "--mat", "--gnuplot", "--out", folder.file("out")});
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("trajectory.mat trajectory.gp"));
  CHECK_THAT(content_of(folder.path / "out/trajectory.mat"), Catch::StartsWith("MATLAB 5.0 MAT-file"));
  const std::string script = content_of(folder.path / "out/trajectory.gp");
  // 13 columns of the rod after t, then the sensors: the 15th and 16th, counted from 1.
  CHECK_THAT(script, Contains("set ylabel 'swing [rad]'\nplot 'trajectory.csv' skip 1 using 1:15"));
  CHECK_THAT(script, Contains("set ylabel 'tip_y [m]'\nplot 'trajectory.csv' skip 1 using 1:16"));
  CHECK_THAT(script, Contains("'rod [m]'") && Contains("using 1:2 with lines title 'x'"));
  if (std::system("command -v gnuplot >/dev/null 2>&1") != 0) return;  // gnuplot is not installed
  const std::string run = "cd '" + folder.file("out") +
                          "' && gnuplot -e \"set terminal svg; set output 'trajectory.svg'\" trajectory.gp 2>errors";
  REQUIRE(std::system(run.c_str()) == 0);
  CHECK(content_of(folder.path / "out/errors").empty());
  CHECK_THAT(content_of(folder.path / "out/trajectory.svg"), Contains("swing [rad]"));
}
