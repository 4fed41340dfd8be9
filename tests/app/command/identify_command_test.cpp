#include <signal.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include "app/files/journal.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/killed_run.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// The rod's own motion at k = 20 as the measurement: t and the last column but one, the angle.
std::string measured_swing(const TemporaryFolder& folder) {
  const std::string file = folder.write("rod.json", kPendulum);
  REQUIRE(run_command({"simulate", file, "--out", folder.file("motion"), "--set", "simulation.output_step=0.02",
                       "--set", "simulation.integrator.rtol=1e-10"})
              .exit_code == kDone);
  std::istringstream rows(content_of(folder.path / "motion/trajectory.csv"));
  std::string csv = "t,theta\n", row;
  std::getline(rows, row);
  while (std::getline(rows, row)) {
    const std::size_t last = row.rfind(','), before = row.rfind(',', last - 1);
    csv += row.substr(0, row.find(',')) + row.substr(before, last - before) + "\n";
  }
  return csv;
}

std::string identification_problem() {
  std::string text = kPendulum;
  text.replace(text.find("\"k\": {\"value\": 20"), 17, "\"k\": {\"value\": 15");
  text.erase(text.rfind('}'));
  return text + R"(,
  "identification": {"experiments": [{"name": "swing", "data": "swing.csv", "time": "t",
      "channels": [{"column": "theta", "sensor": "swing", "sigma": 0.01}]}], "variables": ["k"]}})";
}

}  // namespace

TEST_CASE("identify: the parameter that made the motion is found, with its uncertainty", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  const CommandOutcome outcome =
      run_command({"identify", file, "--out", folder.file("out"), "--set", "simulation.integrator.rtol=1e-10"});
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("std error") && Contains("swing") && Contains("95 % interval"));

  const auto result = json_of(folder.path / "out/result.json");
  const auto& k = result.at("parameters").at("k");
  CHECK(k.at("initial") == 15);
  CHECK(k.at("value").get<double>() == Approx(20).epsilon(1e-7));
  CHECK(k.at("ci95").at(0) <= k.at("value"));
  CHECK(k.at("ci95").at(1) >= k.at("value"));
  CHECK(result.at("identifiability").at("unidentifiable").empty());
  CHECK(result.at("experiments").at("swing").at("channels").at("theta").at("samples") == 51);
  CHECK(result.at("provenance").at("data_sha256").contains("swing.csv"));

  const std::string residuals = content_of(folder.path / "out/residuals.csv");
  CHECK_THAT(residuals, Catch::StartsWith("experiment,channel,t,measured,model,residual,prediction\nswing,theta,0,"));
  CHECK_THAT(content_of(folder.path / "out/report.html"), Contains("residual of theta") &&
                                                              Contains("degrees of freedom") && Contains("rms/sigma") &&
                                                              Contains("condition number"));
}

TEST_CASE("identify: optimized.json starts where the fit ended, from its own folder", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  REQUIRE(run_command({"identify", file, "--out", folder.file("deep/out")}).exit_code == kDone);
  REQUIRE(run_command({"identify", folder.file("deep/out/optimized.json"), "--out", folder.file("again")}).exit_code ==
          kDone);
  const auto first = json_of(folder.path / "deep/out/result.json"), again = json_of(folder.path / "again/result.json");
  CHECK(again.at("parameters").at("k").at("initial") == first.at("parameters").at("k").at("value"));
  CHECK(again.at("optimizer").at("objective_initial").get<double>() ==
        Approx(first.at("optimizer").at("objective_final").get<double>()).epsilon(1e-9));
}

TEST_CASE("identify: a record with a bad cell is bad input, with its line", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", "t,theta\n0,0\n0.1,oops\n");
  const CommandOutcome outcome =
      run_command({"identify", folder.write("fit.json", identification_problem()), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("swing.csv:3"));
  CHECK_THAT(outcome.err, Contains("fit.json:") && Contains("identification.experiments[0].data: "));
  CHECK_FALSE(std::filesystem::exists(folder.path / "out"));
}

TEST_CASE("a column or a file that is missing is bad input of every command, at its place in the problem",
          "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", "time,tehta\n0,0\n0.1,0.2\n");
  const std::string file = folder.write("fit.json", identification_problem());
  for (const char* command : {"validate", "identify"}) {
    const CommandOutcome outcome = run_command({command, file, "--out", folder.file("out")});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("identification.experiments[0].time: ") && Contains("no column 't'") &&
                                Contains("identification.experiments[0].channels[0].column: ") &&
                                Contains("did you mean 'tehta'?"));
    CHECK_THAT(run_command({command, file, "--set", "identification.experiments[0].data=absent.csv"}).err,
               Contains("identification.experiments[0].data: there is no file") && Contains("absent.csv"));
  }
  CHECK_FALSE(std::filesystem::exists(folder.path / "out"));
}

TEST_CASE("identify: the same parameter by the forward sensitivities of CVODES", "[command][cvodes]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  const CommandOutcome outcome =
      run_command({"identify", file, "--out", folder.file("out"), "--set", "simulation.integrator.rtol=1e-10", "--set",
                   "simulation.integrator.type=cvodes_adams"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("parameters").at("k").at("value").get<double>() == Approx(20).epsilon(1e-6));
}

TEST_CASE("identify: a fit that ends without a minimum prints no intervals, and says why", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  const CommandOutcome outcome = run_command(
      {"identify", file, "--out", folder.file("out"), "--set", "identification.optimizer.max_iterations=1"});
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.out, Contains("no standard errors and intervals: they hold at a minimum"));
  CHECK(outcome.out.find('[') == std::string::npos);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("parameters").at("k").at("std_error").is_null());
  CHECK(result.at("parameters").at("k").at("ci95").at(0).is_null());
  CHECK_THAT(content_of(folder.path / "out/report.html"), Contains("There are no standard errors and intervals"));
}

TEST_CASE("identify: what only the data can tell is placed in the problem file", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  const auto refused = [&](const std::string& set) {
    const CommandOutcome outcome = run_command({"identify", file, "--out", folder.file("out"), "--set", set});
    CHECK(outcome.exit_code == kBadInput);
    return outcome.err;
  };
  std::string late = identification_problem();
  late.replace(late.find("\"sigma\": 0.01"), 13, "\"sigma\": 0.01, \"delay\": 5");
  const CommandOutcome outcome =
      run_command({"identify", folder.write("late.json", late), "--out", folder.file("late")});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err,
             Catch::Matches(".*late.json:\\d+:\\d+: identification.experiments\\[0\\].channels\\[0\\].delay: is up to "
                            "5 s[^]*"));
  CHECK_THAT(refused("identification.experiments[0].channels[0].gain=0"), Contains("gain: is 0"));
  CHECK_THAT(refused("identification.loss={\"type\": \"huber\", \"scale\": 1e-300}"),
             Contains("loss.scale: is 1e-300 sigma"));
}

TEST_CASE("identify: an angle that wraps, is in degrees or never moves costs no result", "[command]") {
  const TemporaryFolder folder;
  std::istringstream rows(measured_swing(folder));
  // Shifted by a turn in the middle of the record; in degrees; constant.
  std::string row, wrapped = "t,theta\n", degrees = wrapped, still = wrapped;
  std::getline(rows, row);
  for (int i = 0; std::getline(rows, row); ++i) {
    const std::string t = row.substr(0, row.find(',') + 1);
    const double theta = std::stod(row.substr(row.find(',') + 1));
    wrapped += t + std::to_string(theta + (i < 25 ? 0 : 2 * M_PI)) + "\n";
    degrees += t + std::to_string(300 + theta * 180 / M_PI) + "\n";
    still += t + "0.1\n";
  }
  const std::string file = folder.write("fit.json", identification_problem());
  const auto identify = [&](const std::string& csv, const std::string& out, const std::string& set) {
    folder.write("swing.csv", csv);
    std::vector<std::string> arguments{"identify", file, "--out", folder.file(out)};
    if (!set.empty()) arguments.insert(arguments.end(), {"--set", set});
    return run_command(arguments);
  };
  const struct {
    std::string csv, warning;
  } cases[] = {{wrapped, "by about a turn"}, {degrees, "is the column in degrees?"}, {still, "never changes"}};
  for (const auto& [csv, warning] : cases) {
    INFO(warning);
    const CommandOutcome outcome = identify(csv, "out", "");
    CHECK(outcome.exit_code == kDone);
    CHECK_THAT(outcome.err, Contains(warning));
    const auto result = json_of(folder.path / "out/result.json");
    CHECK(result.at("parameters").at("k").at("value").is_number());
    CHECK_THAT(result.at("warnings").dump(), Contains(warning));
    const CommandOutcome before = run_command({"validate", file, "--out", folder.file("validated")});
    CHECK(before.exit_code == kDone);
    CHECK_THAT(before.err, Contains(warning));
  }
  const CommandOutcome unwrapped =
      identify(wrapped, "unwrapped", "identification.experiments[0].channels[0].unwrap=true");
  REQUIRE(unwrapped.exit_code == kDone);
  CHECK(json_of(folder.path / "unwrapped/result.json").at("parameters").at("k").at("value").get<double>() ==
        Approx(20).epsilon(1e-4));
}

TEST_CASE("identify: a signal before the first evaluation has ended leaves a report and a journal",
          "[command][resume]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  const std::filesystem::path out = folder.path / "out";
  std::thread signal([&] {
    for (int i = 0; i < 30000 && !std::filesystem::exists(out / kJournalFile); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(::getpid(), SIGTERM);
  });
  const CommandOutcome outcome =
      run_command({"identify", file, "--out", out.string(), "--set", "simulation.integrator.max_step=2e-5"});
  signal.join();
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kInterrupted);
  CHECK(json_of(out / "result.json").at("status") == "interrupted");
  CHECK_THAT(content_of(out / "report.html"), Contains("interrupted"));
}

TEST_CASE("identify: what GNU timeout ends keeps the best values so far", "[command][resume]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  const std::filesystem::path out = folder.path / "out";
  std::thread timeout([&] {
    for (int i = 0; i < 30000 && !(std::filesystem::exists(out / kJournalFile) && journal_lines(out, "iterate") >= 2);
         ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(::getpid(), SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(::getpid(), SIGTERM);  // to its process group, too
  });
  // Simulations that take a while, so that the signal comes within the fit.
  const CommandOutcome outcome =
      run_command({"identify", file, "--out", out.string(), "--set", "simulation.integrator.max_step=2e-4"});
  timeout.join();
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kInterrupted);
  const auto result = json_of(out / "result.json");
  CHECK(result.at("status") == "interrupted");
  const double k = result.at("parameters").at("k").at("value");
  CHECK(std::abs(k - 20) < 5);  // the start is 15
  CHECK(result.at("optimizer").at("objective_final") < result.at("optimizer").at("objective_initial"));
  CHECK_THAT(content_of(out / "optimized.json"), Contains("\"k\""));
  CHECK_THAT(content_of(out / "residuals.csv"), Contains("swing,theta,"));
  REQUIRE(run_command({"resume", out.string()}).exit_code == kDone);
  CHECK(json_of(out / "result.json").at("parameters").at("k").at("value").get<double>() == Approx(20).epsilon(1e-6));
}

TEST_CASE("identify: the first row of the history holds the gradient of the start", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  REQUIRE(run_command({"identify", file, "--out", folder.file("out")}).exit_code == kDone);
  std::istringstream rows(content_of(folder.path / "out/history.csv"));
  std::string row;
  std::getline(rows, row);
  CHECK(row == "iteration,cost,gradient_norm,step_norm,k");
  std::getline(rows, row);
  double iteration = 1, cost = 0, gradient = 0;
  char comma = 0;
  std::istringstream(row) >> iteration >> comma >> cost >> comma >> gradient;
  CHECK(iteration == 0);
  CHECK(gradient > 0.01 * cost);
}

TEST_CASE("identify --preflight does not replace the result of a fit", "[command]") {
  const TemporaryFolder folder;
  folder.write("swing.csv", measured_swing(folder));
  const std::string file = folder.write("fit.json", identification_problem());
  REQUIRE(run_command({"identify", file, "--out", folder.file("out")}).exit_code == kDone);
  const std::string fit = content_of(folder.path / "out/result.json");
  const CommandOutcome refused = run_command({"identify", file, "--preflight", "--out", folder.file("out")});
  CHECK(refused.exit_code == kBadInput);
  CHECK_THAT(refused.err, Contains("holds the outcome of 'identify', which 'preflight' would overwrite"));
  CHECK(content_of(folder.path / "out/result.json") == fit);
  CHECK(run_command({"identify", file, "--out", folder.file("out")}).exit_code == kDone);
}
