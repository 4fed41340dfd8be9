#include <catch2/catch.hpp>

#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("import writes a problem that validates and simulates, and says what it dropped", "[command]") {
  for (const char* model : {"arm.urdf", "hopper.xml", "satellite.xml"}) {
    INFO(model);
    const TemporaryFolder folder;
    const std::string source = std::string(MBSOPT_SOURCE_DIR) + "/examples/models/" + model;
    const CommandOutcome written = run_command({"import", source, "--out", folder.file("new")});
    CHECK(written.exit_code == kDone);
    const std::string file = written.out.substr(0, written.out.find(".json") + 5);
    if (std::string(model) == "arm.urdf") CHECK_THAT(written.out, Contains("dropped: line 11: limit"));
    for (const char* command : {"validate", "simulate"}) {
      const CommandOutcome outcome = run_command({command, file, "--quiet", "--out", folder.file(command)});
      INFO(outcome.out << outcome.err);
      CHECK(outcome.exit_code == kDone);
      CHECK(json_of(folder.file(command) + "/result.json").at("warnings").empty());
    }
    const CommandOutcome again = run_command({"import", source, "--out", folder.file("new")});
    CHECK(again.exit_code == kBadInput);
    CHECK_THAT(again.err, Contains("import does not overwrite"));
  }
}

TEST_CASE("import and new into a folder that cannot be created say so", "[command]") {
  const TemporaryFolder folder;
  const std::string taken = folder.write("taken", "a file");
  const std::string model = std::string(MBSOPT_SOURCE_DIR) + "/examples/models/arm.urdf";
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"import", model}, std::vector<std::string>{"new", "four-bar"}}) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"--out", taken});
    const CommandOutcome outcome = run_command(words);
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("taken: the output folder cannot be created"));
  }
}

TEST_CASE("import of a broken model ends with exit 2, its line, and no file", "[command]") {
  const TemporaryFolder folder;
  const std::string model = folder.write("arm.urdf", "<robot name='arm'>\n<link name='a'></lnk></robot>");
  const CommandOutcome outcome = run_command({"import", model, "--out", folder.file("new")});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("arm.urdf:2:"));
  CHECK_FALSE(std::filesystem::exists(folder.path / "new"));
  CHECK(run_command({"import", folder.file("absent.urdf")}).exit_code == kBadInput);
}
