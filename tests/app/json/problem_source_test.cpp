#include "app/json/problem_source.hpp"

#include <catch2/catch.hpp>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("words that begin with a path of the problem get its place", "[json]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("a.json", "{\n  \"gravity\": [0, 0, -9.81],\n  \"drives\": [{\"law\": 1}]\n}");
  const auto source = read_problem_source(file, {});
  CHECK(source->placed("gravity: is normal") == file + ":2:14: gravity: is normal");
  CHECK(source->placed("drives[0].law: is short") == file + ":3:22: drives[0].law: is short");
  CHECK(source->placed("drives[0].csv: is short") == file + ":3:14: drives[0].csv: is short");  // the nearest
  CHECK(read_problem_source(file, {"gravity=[0, 0, 0]"})->placed("gravity: is 0") == "--set gravity: is 0");
  CHECK_FALSE(source->placed("the gravity: is normal"));
  CHECK_FALSE(source->placed("simulation: is missing"));
  CHECK_FALSE(source->placed("no path at all"));
  CHECK_FALSE(source->placed("a..b: is no path"));
  CHECK(std::filesystem::remove(file));
  CHECK(source->placed("gravity: is normal") == file + ":2:14: gravity: is normal");
  CHECK_THROWS_AS(read_problem_source(file, {}), InputError);
}

TEST_CASE("a law whose samples are too short is refused at its place in the file", "[command]") {
  const TemporaryFolder folder;
  folder.write("law.csv", "t,x\n0,0\n0.2,0.1\n0.4,0.3\n");
  std::string text = kPendulum;
  text.insert(text.find("  \"forces\""),
              "  \"drives\": [{\"name\": \"motor\", \"type\": \"angle\", \"joint\": \"pin\",\n"
              "    \"law\": {\"csv\": \"law.csv\", \"time\": \"t\", \"column\": \"x\"}}],\n");
  const std::string file = folder.write("rod.json", text);
  for (const char* command : {"validate", "simulate"}) {
    const CommandOutcome outcome = run_command({command, file, "--out", folder.file("out")});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("rod.json:11:12: drives[0].law: its samples cover 0 s to 0.4 s"));
  }
}

TEST_CASE("a name of a body that is empty is refused at its place", "[command]") {
  const TemporaryFolder folder;
  std::string text = kPendulum;
  const std::string ground = "\"tsda\", \"body1\": \"ground\"";
  text.replace(text.find(ground), ground.size(), "\"tsda\", \"body1\": \"\"");
  const CommandOutcome outcome = run_command({"validate", folder.write("rod.json", text), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("rod.json:10:") && Contains("forces[0].body1: is empty; expected: first body"));
}
