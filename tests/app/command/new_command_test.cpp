#include <catch2/catch.hpp>
#include <cmath>

#include "app/command/starter_files.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("every starter file validates, runs without warnings and has exact gradients", "[command]") {
  REQUIRE(starters().size() == 4);
  for (const Starter& starter : starters()) {
    INFO(starter.kind);
    const TemporaryFolder folder;
    const CommandOutcome written = run_command({"new", std::string(starter.kind), "--out", folder.file("new")});
    CHECK(written.exit_code == kDone);
    const std::string file = folder.file("new/" + std::string(starter.kind) + ".json");
    CHECK_THAT(written.out, Contains(file));
    std::vector<std::string> commands{"validate", "simulate", std::string(starter.next)};
    if (starter.kind != "identify") commands.insert(commands.end(), {"gradient", "check"});  // it has no objective
    for (const std::string& command : commands) {
      const CommandOutcome outcome = run_command({command, file, "--quiet", "--out", folder.file("out_" + command)});
      INFO(command << "\n" << outcome.out << outcome.err);
      CHECK(outcome.exit_code == kDone);
      CHECK(json_of(folder.file("out_" + command + "/result.json")).at("warnings").empty());
    }
  }
}

TEST_CASE("the starter designs converge, and the starter fit finds what its data were made with", "[command]") {
  const TemporaryFolder folder;
  for (const char* kind : {"four-bar", "suspension", "identify"}) {
    INFO(kind);
    REQUIRE(run_command({"new", kind, "--out", folder.path.string()}).exit_code == kDone);
    const std::string file = folder.file(std::string(kind) + ".json"), out = folder.file(std::string(kind) + "_out");
    const bool fits = std::string(kind) == "identify";
    REQUIRE(run_command({fits ? "identify" : "design", file, "--quiet", "--out", out}).exit_code == kDone);
    const auto result = json_of(out + "/result.json");
    CHECK(result.at("optimizer").at("status") == "converged");
    if (!fits) continue;
    for (const auto& [name, truth] : {std::pair{"J", 0.02}, {"friction", 0.004}, {"release.theta0", 0.9}}) {
      INFO(name);
      const auto& found = result.at("parameters").at(name);
      // Four standard errors: the noise has a fixed seed, so that this either holds or does not.
      CHECK(std::abs(found.at("value").get<double>() - truth) < 4 * found.at("std_error").get<double>());
    }
  }
}

TEST_CASE("new does not overwrite files", "[command]") {
  const TemporaryFolder folder;
  const std::string data = folder.write("identify.csv", "mine");
  const CommandOutcome outcome = run_command({"new", "identify", "--out", folder.path.string()});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("identify.csv") && Contains("does not overwrite"));
  CHECK(content_of(data) == "mine");
  CHECK_FALSE(std::filesystem::exists(folder.path / "identify.json"));
}

TEST_CASE("new names the kinds that there are", "[command]") {
  const CommandOutcome outcome = run_command({"new", "gearbox"});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("pendulum") && Contains("four-bar") && Contains("suspension"));
  CHECK_THAT(run_command({"new", "penduum"}).err, Contains("there is no 'penduum' (did you mean 'pendulum'?)"));
}
