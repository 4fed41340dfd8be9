// The problem files that come with the program.
#include <catch2/catch.hpp>
#include <map>

#include "app/json/read_problem.hpp"
#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
namespace fs = std::filesystem;

TEST_CASE("every problem file is right, without a warning", "[problems]") {
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kProblems)) {
    if (entry.path().extension() != ".json" || entry.path().parent_path() == kProblems) continue;
    INFO(entry.path());
    std::vector<std::string> warnings;
    CHECK_NOTHROW(read_problem(entry.path(), {}, &warnings));
    CHECK(warnings.empty());
    ++files;
  }
  CHECK(files >= 24);
}

// Reference values: complex step through an 8th-order method with exact constraints, as in tests/optim/five_bar.hpp.
TEST_CASE("the five-bar with all its numbers as parameters has the reference's derivatives", "[problems]") {
  const TemporaryFolder folder;
  REQUIRE(run_command({"gradient", (kProblems / "five_bar/sensitivities.json").string(), "--out", folder.file("out"),
                       "--set", "simulation.integrator.rtol=1e-10", "--set", "simulation.integrator.atol=1e-12"})
              .exit_code == kDone);
  const auto travel = json_of(folder.path / "out/result.json").at("objectives").at("travel");
  CHECK(travel.at("value").get<double>() == Approx(0.12883112793824).epsilon(1e-8));
  const std::map<std::string, double> reference{{"L01", 0.43585125087835},    {"L02", 1.61976207776287},
                                                {"k1", -0.00068529458007929}, {"k2", -0.00231809881744949},
                                                {"c1", -0.040992678495154},   {"c2", -0.038258434911866},
                                                {"m1", -0.010025945272298},   {"m2", 0.059162921408138},
                                                {"m3", 0.116610652344094},    {"m4", 0.046704924396818}};
  for (const auto& [name, derivative] : reference) {
    INFO(name);
    CHECK(travel.at("gradient").at(name).get<double>() == Approx(derivative).epsilon(1e-8));
  }
  CHECK(travel.at("gradient").size() == 25);
}

TEST_CASE("the chain has 20 bodies, and all of its 24 derivatives are alive", "[problems]") {
  const TemporaryFolder folder;
  REQUIRE(run_command({"gradient", (kProblems / "chain/gradient.json").string(), "--out", folder.file("out"), "--set",
                       "simulation.end_time=0.2"})
              .exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("model").at("bodies") == 20);
  const auto& gradient = result.at("objectives").at("drop").at("gradient");
  CHECK(gradient.size() == 24);
  for (const auto& derivative : gradient) CHECK(derivative != 0);
}
