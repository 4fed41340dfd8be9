#include <catch2/catch.hpp>
#include <map>

#include "app/terminal/exit_code.hpp"
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
