#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include "app/results/tradeoff_results.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"
#include "tests/app/signal_handler.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

// Wall time, of which a busy machine has less: what is asserted holds even where nothing but the file's own settings
// and the defaults was measured.
const std::string kBudget = "1";

// The columns of the header that are not quoted, and the number of lines.
struct Csv {
  std::vector<std::string> columns;
  std::vector<std::string> lines;
};

Csv csv_of(const fs::path& file) {
  std::istringstream text(content_of(file));
  Csv csv;
  std::string line;
  std::getline(text, line);
  std::istringstream header(line);
  for (std::string column; std::getline(header, column, ',');) csv.columns.push_back(column);
  while (std::getline(text, line)) csv.lines.push_back(line);
  return csv;
}

}  // namespace

TEST_CASE("tradeoff: a table of all settings, plots, and advice in words for each quantity", "[command]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const CommandOutcome outcome =
      run_command({"tradeoff", file, "--budget", kBudget, "--out", folder.file("out"), "--quiet"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("certified by") && Contains("for 1e-04 in track: ") &&
                              Contains("for 1e-06 in gradient of end: ") && Contains("rtol"));
  const Csv csv = csv_of(folder.path / "out/tradeoff.csv");
  CHECK(csv.lines.size() > 30);  // a row per curve, however little time there is
  for (const char* column :
       {"integrator", "rtol", "step", "formulation", "alpha", "status", "wall_seconds", "rhs_evaluations",
        "factorisations", "memory_bytes", "error motion", "error sensors", "error track", "error end",
        "error gradient of track", "bound track", "pareto", "message"}) {
    INFO(column);
    CHECK(std::count(csv.columns.begin(), csv.columns.end(), column) == 1);
  }
  for (const char* method : {"adjoint", "tlm", "cvodes_forward", "cvodes_adjoint", "fd", "penalty", "quasidefinite"})
    CHECK(std::any_of(csv.lines.begin(), csv.lines.end(),
                      [&](const std::string& line) { return line.find(method) != std::string::npos; }));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "ok");
  CHECK_FALSE(result.at("machine").at("cpu").get<std::string>().empty());
  CHECK(result.at("reference").at("quantities").at("track").at("apart").get<double>() < 1e-9);
  CHECK(result.at("objectives").at("track").at("gradient").contains("k"));
  CHECK(result.at("recommendations").size() == 6 * 6);  // motion, sensors, two objectives, two gradients
  for (const auto& r : result.at("recommendations")) {
    if (!r.contains("setting")) continue;
    const std::string quantity = r.at("quantity");
    const double bound = r.at("bounds").at(quantity);
    CHECK(bound <= r.at("accuracy").get<double>());
    CHECK(r.at("errors").at(quantity).get<double>() <= bound);
  }
  CHECK(result.at("settings").at("defaults").at("errors").at("track").get<double>() < 1e-4);
  const std::string report = content_of(folder.path / "out/report.html");
  CHECK_THAT(report, Contains("<svg") && Contains("Pareto front") && Contains("What to use") &&
                         Contains("Lines lead from loose to tight settings through bounds") &&
                         Contains(result.at("machine").at("cpu").get<std::string>()));
  CHECK(report.find("nan") == std::string::npos);
  const auto measured =
      std::ranges::count_if(csv.lines, [](const std::string& line) { return line.find(",ok,") != std::string::npos; });
  CHECK_THAT(report, Contains(std::to_string(measured) + " settings were measured; the fastest"));
  // The file has the default settings: they are listed once.
  CHECK_THAT(outcome.out, Contains("(as in the file) at") && !Contains("(defaults) at") &&
                              Contains("the file's settings are the defaults"));
  for (const char* list : {"recommendations", "task_recommendations"})
    for (const auto& r : result.at(list))
      CHECK(
          r.at("in_words")
              .get<std::string>()
              .ends_with(" in " + r.at("aim").get<std::string>() + ": " + r.at("setting_in_words").get<std::string>()));
}

TEST_CASE("tradeoff --apply writes a problem that runs and has the accuracy, its comments kept", "[command]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  std::string text = kPendulum;
  text.insert(text.find("\"gravity\""), "// downwards\n  ");
  text.insert(text.find("\"end_time\""), "\"integrator\": {\"type\": \"rk4\", \"step\": 0.01}, ");
  const std::string file = folder.write("rod.json", text);
  const CommandOutcome outcome = run_command({"tradeoff", file, "--budget", kBudget, "--apply", "1e-6", "--out",
                                              folder.file("out"), "--set", "parameters.k.value=25", "--quiet"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const fs::path applied = folder.path / "out/recommended.json";
  CHECK_THAT(content_of(applied), Contains("// downwards") && Contains("\"value\": 25"));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("applied").at("status") == "ok");
  CHECK(result.at("applied").at("bounds").at("gradient of track").get<double>() <= 1e-6);
  CHECK(result.at("applied").at("bounds").at("track").get<double>() <= 1e-6);
  CHECK_THAT(outcome.out, Contains(" in track, ") && Contains(" in gradient of track)"));
  REQUIRE(run_command({"simulate", applied.string(), "--out", folder.file("again"), "--quiet"}).exit_code == kDone);
  const auto again = json_of(folder.path / "again/result.json").at("objectives");
  for (const char* name : {"track", "end"}) {
    INFO(name);
    const double exact = result.at("objectives").at(name).at("value");
    CHECK(std::abs(again.at(name).at("value").get<double>() - exact) <= 1e-6 * std::abs(exact));
  }
}

TEST_CASE("tradeoff --apply of a file that identifies covers the sum of squares and its gradient", "[command]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  folder.write("swing.csv", "t,theta\n0,0.01\n0.25,-0.05\n0.5,-0.2\n0.75,-0.3\n1,-0.35\n");
  std::string text = kPendulum;
  text.replace(text.find("\"design\""), std::string::npos, R"("identification": {"variables": ["k"],
    "experiments": [{"name": "swing", "data": "swing.csv", "channels": [{"column": "theta", "sensor": "swing"}]}]}})");
  const CommandOutcome outcome = run_command({"tradeoff", folder.write("fit.json", text), "--budget", kBudget,
                                              "--apply", "1e-4", "--out", folder.file("out"), "--quiet"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const auto applied = json_of(folder.path / "out/result.json").at("applied");
  CHECK(applied.at("fit").at("error").get<double>() <= 1e-4);
  CHECK(applied.at("fit").at("gradient_error").get<double>() <= 1e-4);
  CHECK_THAT(applied.at("in_words").get<std::string>(),
             Contains("in the sum of squares, ") && Contains("in its gradient"));
}

TEST_CASE("tradeoff --apply of an accuracy that nothing has fails in words and keeps the table", "[command]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const CommandOutcome outcome =
      run_command({"tradeoff", file, "--budget", kBudget, "--apply", "1e-15", "--out", folder.file("out"), "--quiet"});
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.err, Contains("no recommended.json") && Contains("the reference itself is certain to"));
  CHECK(fs::exists(folder.path / "out/tradeoff.csv"));
  CHECK_FALSE(fs::exists(folder.path / "out/recommended.json"));
  CHECK_THAT(outcome.out, !Contains("applied"));
  CHECK_THAT(content_of(folder.path / "out/report.html"), !Contains("Applied in recommended.json"));
}

TEST_CASE("tradeoff of an equilibrium says that nothing moves, and what it does not measure", "[command]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  std::string text = kPendulum;
  const auto begin = text.find("\"objectives\"");
  text.replace(begin, text.rfind('}') - begin,
               R"("initial": {"equilibrium": true}, "objectives": {"slowest": {"eigenvalue": {"mode": 1}}})");
  const CommandOutcome outcome = run_command(
      {"tradeoff", folder.write("rest.json", text), "--budget", kBudget, "--out", folder.file("out"), "--quiet"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.err, Contains("nothing moves: "));
  CHECK_THAT(outcome.out, Contains("not measured, since they do not depend on the integration: 'slowest'"));
  CHECK(json_of(folder.path / "out/result.json").at("reference").at("without_integration") ==
        nlohmann::json::array({"slowest"}));
  CHECK_THAT(
      content_of(folder.path / "out/report.html"),
      Contains("Nothing moves") && Contains("Not measured, since they do not depend on the integration: slowest"));
}

TEST_CASE("an error below the certainty of the reference is shown as this certainty", "[command]") {
  CHECK(error_text(2.7e-10, 5e-6) == "< 5.0e-06");
  CHECK(error_text(0, 5e-6) == "< 5.0e-06");
  CHECK(error_text(6e-6, 5e-6) == "6.0e-06");
  CHECK(error_text(0, 0) == "0.0e+00");
  CHECK(error_text(std::nan(""), 5e-6) == "-");
}

TEST_CASE("tradeoff passes on the warnings of the file's settings, and doubts the sharpness of a peak", "[command]") {
  const TemporaryFolder folder;
  // The peak is at the start, and its exponential falls to 1/e in 0.1 ms.
  const std::string file = folder.write("block.json", R"({
    "format": 1, "name": "block",
    "bodies": [{"name": "block", "mass": 2, "inertia": [1, 1, 1]}],
    "joints": [{"name": "rail", "type": "translational", "body2": "block", "axis1": [1, 0, 0], "axis2": [1, 0, 0]}],
    "forces": [{"name": "pull", "type": "force", "body": "block", "components": ["-50*x - 2*vx", 0, 0]}],
    "sensors": {"x": {"quantity": "position", "body": "block", "component": "x"},
                "vx": {"quantity": "velocity", "body": "block", "component": "x"}},
    "initial": {"conditions": [{"sensor": "x", "value": 0.3, "rate": -1}]},
    "simulation": {"end_time": 1},
    "objectives": {"peak": {"maximum_of": "1e3*x", "sharpness": 10}}})");
  const auto check_advice = [](const std::string& words) {
    CHECK_THAT(words, Contains("the steps do not resolve the peaks of objective 'peak'") &&
                          Contains("Give it less `sharpness`: some tens to hundreds, divided by the range"));
  };
  check_advice(run_command({"simulate", file, "--out", folder.file("simulated"), "--quiet"}).err);
  std::ostringstream out, err;
  const bool terminal = true;
  REQUIRE(run_command_line({"tradeoff", file, "--budget", "0", "--out", folder.file("out")}, out, err, terminal) ==
          kDone);
  check_advice(err.str());
  CHECK_THAT(err.str(), Contains("as in the file: the steps do not resolve"));
  CHECK_THAT(err.str(), Contains("the reference of peak is known to ") &&
                            Contains("(too much `sharpness`, 10 now: give it some tens to hundreds"));
  CHECK_THAT(err.str(), Contains("reference, gauss6 at rtol 1e-07 [####"));
}

TEST_CASE("tradeoff: a file without objectives is measured by its sensors and its motion", "[command]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  std::string text = kPendulum;
  const auto begin = text.find(",\n  \"objectives\"");
  text.erase(begin, text.rfind('}') - begin);
  const std::string file = folder.write("bare.json", text);
  const CommandOutcome outcome =
      run_command({"tradeoff", file, "--budget", kBudget, "--apply", "1e-4", "--out", folder.file("out"), "--quiet",
                   "--set", "parameters.k.allow_unused=true", "--set", "parameters.L.allow_unused=true"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("applied for 1e-04 in sensors: "));
}

TEST_CASE("tradeoff: options that make no sense are bad input", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const std::vector<std::vector<std::string>> wrong{
      {"--budget", "0", "--apply", "1e-4"}, {"--budget", "-1"}, {"--apply", "0"}};
  for (const std::vector<std::string>& options : wrong) {
    std::vector<std::string> arguments{"tradeoff", file, "--out", folder.file("out")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const CommandOutcome outcome = run_command(arguments);
    INFO(options[0] << ' ' << options[1]);
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains(options[0]) || Contains(options.back()) || Contains(options[1]));
    CHECK_FALSE(fs::exists(folder.path / "out"));
  }
}

TEST_CASE("tradeoff: SIGTERM leaves what was measured", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  std::thread killer([] {
    wait_for_handler(SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    ::kill(::getpid(), SIGTERM);
  });
  const CommandOutcome outcome = run_command({"tradeoff", file, "--budget", "600", "--out", folder.file("out")});
  killer.join();
  CHECK(outcome.exit_code == kInterrupted);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "interrupted");
  const std::string message = result.at("message");
  CHECK_THAT(message, Contains("tradeoff.csv holds what was measured") || Contains("nothing is kept"));
  CHECK(fs::exists(folder.path / "out/tradeoff.csv") == (message.find("tradeoff.csv") != std::string::npos));
}

TEST_CASE("tradeoff does not overwrite the outcome of a design", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum), out = folder.file("out");
  REQUIRE(run_command({"design", file, "--out", out, "--set", "parameters.k.upper=30", "--quiet"}).exit_code == kDone);
  const CommandOutcome outcome = run_command({"tradeoff", file, "--out", out, "--budget", "0"});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("holds the outcome of 'design'"));
}
