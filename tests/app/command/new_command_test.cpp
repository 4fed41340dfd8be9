#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "app/command/starter_files.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

// The current folder as long as it lives.
struct WorkingFolder {
  explicit WorkingFolder(const fs::path& folder) : before(fs::current_path()) { fs::current_path(folder); }
  ~WorkingFolder() { fs::current_path(before); }
  WorkingFolder(const WorkingFolder&) = delete;
  WorkingFolder& operator=(const WorkingFolder&) = delete;
  fs::path before;
};

}  // namespace

TEST_CASE("every starter file is valid and does what its head says", "[new]") {
  struct Kind {
    std::string name;
    std::vector<std::string> commands;
  };
  const auto [kind, commands] =
      GENERATE(Kind{"pendulum", {"simulate", "gradient", "design"}}, Kind{"four-bar", {"kinematics", "gradient"}},
               Kind{"suspension", {"simulate", "design"}}, Kind{"identify", {"identify"}});
  const TemporaryFolder folder;
  const WorkingFolder here(folder.path);
  const CommandOutcome made = run_command({"new", kind});
  INFO(made.err);
  REQUIRE(made.exit_code == kDone);
  const std::string file = kind + ".json", text = content_of(file);
  CHECK_THAT(made.out, Contains("wrote " + file));
  CHECK(run_command({"validate", file, "--quiet", "--out", "out/validate"}).exit_code == kDone);
  for (const std::string& command : commands) {
    CHECK_THAT(text, Contains("mbsopt " + command + " " + file));
    const CommandOutcome outcome = run_command({command, file, "--quiet", "--out", "out/" + command});
    INFO(command << outcome.out << outcome.err);
    CHECK(outcome.exit_code == kDone);
    CHECK(json_of("out/" + command + "/result.json").at("warnings").empty());
  }
  if (kind == "pendulum")  // J theta'' = -m g L/2 cos(theta), a quarter period of 1.85407 sqrt(2L/(3g)) without damping
    CHECK(json_of("out/design/result.json").at("parameters").at("L").at("value").get<double>() ==
          Approx(1.5 * 9.81 * std::pow(0.4 / 1.854075, 2)).epsilon(0.02));
  if (kind == "identify") {
    const auto parameters = json_of("out/identify/result.json").at("parameters");
    CHECK(parameters.at("k").at("value").get<double>() == Approx(50).epsilon(0.01));
    CHECK(parameters.at("c").at("value").get<double>() == Approx(0.8).epsilon(0.1));
  }

  const CommandOutcome again = run_command({"new", kind});
  CHECK(again.exit_code == kBadInput);
  CHECK_THAT(again.err, Contains(file) && Contains("exists already"));
  CHECK(content_of(file) == text);
}

TEST_CASE("new writes all files of a kind or none, and knows no other kinds", "[new]") {
  const TemporaryFolder folder;
  const WorkingFolder here(folder.path);
  folder.write("identify.csv", "mine");
  const CommandOutcome outcome = run_command({"new", "identify"});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("identify.csv: exists already"));
  CHECK_FALSE(fs::exists("identify.json"));
  CHECK(content_of("identify.csv") == "mine");

  const CommandOutcome wrong = run_command({"new", "suspenson"});
  CHECK(wrong.exit_code == kBadInput);
  CHECK_THAT(wrong.err, Contains("did you mean 'suspension'") && Contains("four-bar"));
  CHECK(run_command({"new"}).exit_code == kBadInput);
}
