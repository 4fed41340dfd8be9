#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <string>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

TEST_CASE("help and version are results, an unknown command is bad input", "[command]") {
  CHECK(run_command({"--help"}).exit_code == kDone);
  CHECK_THAT(run_command({"--help"}).out, Contains("simulate") && Contains("identify"));
  CHECK_THAT(run_command({"--version"}).out, Contains("mbsopt 0."));
  CHECK(run_command({}).exit_code == kBadInput);
  CHECK(run_command({"simulat", "x.json"}).exit_code == kBadInput);
  CHECK_THAT(run_command({"simulat", "x.json"}).err, Contains("did you mean 'simulate'"));
  CHECK(run_command({"simulate"}).exit_code == kBadInput);
  CHECK(run_command({"simulate", "x.json", "--thread", "2"}).exit_code == kBadInput);
  CHECK(run_command({"simulate", "x.json", "--threads", "0"}).exit_code == kBadInput);
}

TEST_CASE("an argument that nothing takes is named, with the option that may be meant", "[command]") {
  const CommandOutcome option = run_command({"simulate", "x.json", "--outt", "x"});
  CHECK(option.exit_code == kBadInput);
  CHECK_THAT(option.err, Contains("simulate: there is no option '--outt' (did you mean '--out'?); known: ") &&
                             Contains("--threads"));
  CHECK_THAT(run_command({"simulate", "x.json", "--outt=x"}).err, Contains("no option '--outt' (did you mean"));
  CHECK_THAT(run_command({"simulate", "x.json", "y.json", "z"}).err, Contains("simulate: nothing takes 'y.json z'"));
}

TEST_CASE("a decimal comma is answered by the point that decimals have", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  CHECK_THAT(run_command({"validate", file, "--out", folder.file("out"), "--set", "bodies[0].mass=\"1,2\""}).err,
             Contains("before ','; decimals have a point"));
}

TEST_CASE("help is a command, too", "[command]") {
  const CommandOutcome all = run_command({"help"}), design = run_command({"help", "design"});
  CHECK(all.exit_code == kDone);
  CHECK(all.out == run_command({"--help"}).out);
  CHECK(design.exit_code == kDone);
  CHECK_THAT(design.out, Contains("--set"));
  CHECK(design.out == run_command({"design", "--help"}).out);
}

TEST_CASE("the outcome of a design survives other commands, but not another design", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum), out = folder.file("out");
  REQUIRE(run_command({"simulate", file, "--out", out}).exit_code == kDone);
  REQUIRE(run_command({"design", file, "--out", out, "--set", "parameters.k.upper=30"}).exit_code == kDone);
  const std::string before = content_of(folder.path / "out/result.json");
  for (const char* command : {"validate", "simulate", "gradient", "check"}) {
    const CommandOutcome outcome = run_command({command, file, "--out", out});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("holds the outcome of 'design'") && Contains(std::string("out_") + command));
    CHECK(content_of(folder.path / "out/result.json") == before);
  }
  CHECK(run_command({"design", file, "--out", out, "--set", "parameters.k.upper=31"}).exit_code == kDone);
}

TEST_CASE("bad input ends with exit 2 and its place, before anything is written", "[command]") {
  const TemporaryFolder folder;
  std::string text = kPendulum;
  text.replace(text.find("\"mass\": 2"), 9, "\"mass\": -2");
  const std::string file = folder.write("rod.json", text);
  for (const char* command : {"validate", "simulate", "gradient", "check", "design"}) {
    const CommandOutcome outcome = run_command({command, file, "--out", folder.file("out")});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("rod.json:6:") && Contains("bodies[0].mass"));
    CHECK_FALSE(fs::exists(folder.path / "out"));
  }
  CHECK(run_command({"validate", folder.file("absent.json")}).exit_code == kBadInput);
}

TEST_CASE("--set changes fields, creates missing objects, and is checked", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum), out = folder.file("out");
  CHECK(run_command({"simulate", file, "--out", out, "--set", "simulation.end_time=0.5", "--set",
                     "simulation.integrator.type=rk4", "--set", "simulation.integrator.step=0.01"})
            .exit_code == kDone);
  CHECK(json_of(folder.path / "out/result.json").at("simulation").at("steps") == 50);
  const CommandOutcome wrong = run_command({"simulate", file, "--out", out, "--set", "bodies[0].mass=-1"});
  CHECK(wrong.exit_code == kBadInput);
  CHECK_THAT(wrong.err, Contains("--set") && Contains("bodies[0].mass"));
}

TEST_CASE("two problems of one name do not share a folder", "[command]") {
  const TemporaryFolder folder;
  const std::string out = folder.file("out");
  REQUIRE(run_command({"validate", folder.write("a.json", kPendulum), "--out", out}).exit_code == kDone);
  const std::string before = content_of(folder.path / "out/result.json");
  const CommandOutcome second = run_command({"validate", folder.write("b.json", kPendulum), "--out", out});
  CHECK(second.exit_code == kBadInput);
  CHECK_THAT(second.err, Contains("another problem"));
  CHECK(content_of(folder.path / "out/result.json") == before);
  CHECK(run_command({"simulate", folder.file("a.json"), "--out", out}).exit_code == kDone);
}

TEST_CASE("schema prints JSON that describes a problem", "[command]") {
  const CommandOutcome outcome = run_command({"schema"});
  CHECK(outcome.exit_code == kDone);
  const auto schema = nlohmann::json::parse(outcome.out);
  CHECK(schema.at("properties").contains("bodies"));
}

namespace {

struct FullDisk : std::streambuf {
  int_type overflow(int_type) override { return traits_type::eof(); }
  int sync() override { return -1; }
};

}  // namespace

TEST_CASE("standard output that cannot be written is a failure in words, whatever the command", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const std::vector<std::vector<std::string>> commands{{"schema"},
                                                       {"--help"},
                                                       {"--version"},
                                                       {"validate", file, "--out", folder.file("a")},
                                                       {"simulate", file, "--out", folder.file("b")},
                                                       {"design", file, "--out", folder.file("c")}};
  for (const std::vector<std::string>& arguments : commands) {
    FullDisk disk;
    std::ostream out(&disk);
    std::ostringstream err;
    CHECK(run_command_line(arguments, out, err) == kNumericalFailure);
    CHECK_THAT(err.str(), Contains("standard output cannot be written"));
  }
  CHECK(json_of(folder.path / "c/result.json").at("status") == "ok");  // nothing that was computed is lost
}

TEST_CASE("a result that cannot be written is no bad input, and result.json says that the run failed", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum), out = folder.file("out");
  REQUIRE(run_command({"validate", file, "--out", out}).exit_code == kDone);
  fs::create_directory(out + "/trajectory.csv");  // no file can take its place
  const CommandOutcome outcome = run_command({"simulate", file, "--out", out});
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains("trajectory.csv: cannot be put into place"));
  CHECK(json_of(out + "/result.json").at("status") == "failed");
}

TEST_CASE("--json prints result.json and nothing else on standard output", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  for (const std::string command : {"validate", "simulate", "gradient", "design"}) {
    const CommandOutcome outcome = run_command({command, file, "--json", "--out", folder.file(command)});
    INFO(command << ": " << outcome.err);
    CHECK(outcome.exit_code == kDone);
    CHECK(outcome.out == content_of(folder.path / command / "result.json"));
    CHECK(nlohmann::json::parse(outcome.out).at("status") == "ok");
  }
  const CommandOutcome failed = run_command(
      {"simulate", file, "--json", "--out", folder.file("failed"), "--set", "simulation.integrator.max_steps=3"});
  CHECK(failed.exit_code == kNumericalFailure);
  CHECK(nlohmann::json::parse(failed.out).at("status") == "failed");
  const CommandOutcome bad = run_command({"simulate", file, "--json", "--set", "bodies[0].mass=-1"});
  CHECK(bad.exit_code == kBadInput);
  CHECK(bad.out.empty());
}

TEST_CASE("the help of each command shows an example", "[command]") {
  for (const char* name : {"validate", "simulate", "kinematics", "linearise", "gradient", "check", "design", "identify",
                           "tradeoff", "sweep", "resume", "new", "import", "completion", "schema"}) {
    INFO(name);
    CHECK(run_command({name, "--help"}).out.find(std::string("Example:\n  mbsopt ") + name) != std::string::npos);
  }
}

TEST_CASE("bash completes commands and their options", "[command]") {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "completion") << run_command({"completion"}).out;
  const auto completed = [&](const std::string& words, int last) {
    const std::string out = (folder.path / "out").string();
    const std::string script = "source " + (folder.path / "completion").string() + "; COMP_WORDS=(mbsopt " + words +
                               "); COMP_CWORD=" + std::to_string(last) + "; _mbsopt; echo ${COMPREPLY[@]} > " + out;
    REQUIRE(std::system(("bash -c '" + script + "'").c_str()) == 0);
    return content_of(out);
  };
  CHECK(completed("des", 1) == "design\n");
  CHECK(completed("sweep --sa", 2) == "--samples\n");
  CHECK(completed("new f", 2) == "four-bar\n");
  CHECK(completed("gradient five_bar.json --method ad", 4) == "adjoint\n");
}
