// Signals of problem files: the gallery's, a measured torque, a million rows, and what is refused.
#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>

#include "app/terminal/exit_code.hpp"
#include "optim/problem/csv_table.hpp"
#include "source_folder.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

// A motor arm; `torque` is the z component, `more` further sections.
std::string arm(const std::string& torque, const std::string& more, const std::string& bodies = "",
                const std::string& joints = "", const std::string& sensors = "") {
  return R"({"format": 1, "name": "arm", "gravity": [0, -9.81, 0],
  "bodies": [{"name": "arm", "mass": 0.6, "com": [0.12, 0, 0], "inertia": {"xx": 1e-3, "yy": 0.02, "zz": 0.02},
              "orientation": {"axis": [0, 0, 1], "angle": "-90 [deg]"}})" +
         bodies + R"(],
  "joints": [{"name": "shaft", "type": "revolute", "body2": "arm", "axis1": [0, 0, 1], "axis2": [0, 0, 1]})" +
         joints +
         R"(],
  "forces": [{"name": "motor", "type": "torque", "body": "arm", "components": [0, 0, ")" +
         torque + R"("]}],
  "sensors": {"theta": {"quantity": "angle", "joint": "shaft"})" +
         sensors + R"(},
  "simulation": {"end_time": 2, "output_step": 0.1, "integrator": {"type": "dopri5", "rtol": 1e-12, "atol": 1e-13}},
  )" + more +
         "}";
}

CommandOutcome run_text(const TemporaryFolder& folder, const std::string& text, const std::string& out,
                        const std::string& end_time = "2", const std::string& command = "simulate") {
  std::ofstream(folder.file(out + ".json")) << text;
  return run_command({command, folder.file(out + ".json"), "--out", folder.file(out), "--quiet", "--set",
                      "simulation.end_time=" + end_time});
}

std::string signal_of(const std::string& file, const std::string& more) {
  return "\"signals\": {\"tau\": {\"file\": \"" + file + "\", " + more + "}}";
}

}  // namespace

// The torque is the displacement of a slider without mass that a drive moves along the same spline.
TEST_CASE("a measured torque as a signal equals the displacement of a driven slider to 1e-9", "[signals]") {
  const fs::path file = fs::path(MBSOPT_SOURCE_DIR) / "../shared/data/measured/dfki_double_pendulum_torque/record.csv";
  if (!fs::exists(file)) {
    WARN("skipped: there is no " << file.string());
    return;
  }
  const TemporaryFolder folder;
  const std::string signal =
      signal_of(file.string(), R"("column": "tau_meas2", "time": "time", "interpolation": "spline")");
  const std::string trick =
      R"("drives": [{"name": "play", "type": "displacement", "joint": "slide", "law": {"csv": ")" + file.string() +
      R"(", "time": "time", "column": "tau_meas2"}}])";
  // Both are the same function, and steps end at its knots. They differ by 2e-13 at rtol 1e-12, and differed by 4e-7
  // where steps crossed knots: the estimate of dopri853 supposes a smooth function.
  const auto by_dopri853 = [](std::string text) {
    text.replace(text.find("dopri5"), 6, "dopri853");
    return text;
  };
  const CommandOutcome named = run_text(folder, by_dopri853(arm("tau", signal)), "named");
  INFO(named.out << named.err);
  REQUIRE(named.exit_code == kDone);
  const CommandOutcome slid = run_text(
      folder,
      by_dopri853(arm(
          "u", trick, R"(, {"name": "cart", "mass": 0, "inertia": [0, 0, 0]})",
          R"(, {"name": "slide", "type": "translational", "body2": "cart", "axis1": [1, 0, 0], "axis2": [1, 0, 0]})",
          R"(, "u": {"quantity": "displacement", "joint": "slide"})")),
      "slid");
  INFO(slid.out << slid.err);
  REQUIRE(slid.exit_code == kDone);
  const CsvTable a = read_csv(folder.file("named/trajectory.csv")), b = read_csv(folder.file("slid/trajectory.csv"));
  double apart = 0, swing = 0;
  for (std::size_t row = 0; row < a.rows(); ++row) {
    apart = std::max(apart, std::abs(a.column("theta")[row] - b.column("theta")[row]));
    swing = std::max(swing, std::abs(a.column("theta")[row]));
  }
  CHECK(swing > 0.01);
  CHECK(apart < 1e-11);
}

TEST_CASE("delays that cases and experiments move are judged at the place that moves them", "[signals][cases]") {
  const TemporaryFolder folder;
  std::ofstream(folder.file("log.csv")) << "t,tau\n0,1\n1,2\n2,3\n";
  std::ofstream(folder.file("angle.csv")) << "t,theta\n0,0\n0.5,0.1\n1,0.2\n";
  const auto error = [&](const std::string& how, const std::string& more, const std::string& command) {
    const std::string problem =
        R"("parameters": {"d": 0.1, "late": 0}, "objectives": {"o": {"running": "theta^2"}}, )" + more + ", " +
        signal_of("log.csv", R"("column": "tau", "delay": "late", "interpolation": ")" + how + "\"");
    const CommandOutcome outcome = run_text(folder, arm("d*tau", problem), "wrong", "2", command);
    CHECK(outcome.exit_code == kBadInput);
    return outcome.err;
  };
  const std::string design = R"("design": {"minimize": "o", "variables": ["d"]}, )";
  CHECK_THAT(
      error("hold", design + R"("cases": [{"name": "later", "overrides": {"late": "2*d"}}])", "design"),
      Contains("wrong.json:") && Contains("cases[0].overrides.late: the delay of the signal 'tau' depends on 'd', "
                                          "which is varied in the case 'later', and hold jumps"));
  CHECK_THAT(
      error("linear", design + R"("cases": [{"name": "later", "overrides": {"late": 0.5}}])", "design"),
      Contains("cases[0].overrides.late: signal 'tau': its samples cover 0.5 s to 2.5 s, the simulation 0 s to 2 s"));
  CHECK_THAT(
      error("hold", R"("identification": {"variables": ["d"], "experiments": [{"name": "run", "data": "angle.csv",
                   "end_time": 1, "channels": [{"column": "theta", "sensor": "theta"}], "free": ["late"]}]})",
            "identify"),
      Contains("signals.tau.delay: depends on 'late', which is varied in the experiment 'run', and hold jumps"));
}

TEST_CASE("a pendulum's motor: torque sensor, friction curve and inertia come from two logged runs",
          "[gallery][identification]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"identify", file_of("pendulum/motor").string(), "--out", folder.file("out")});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json");
  const std::map<std::string, double> truth{{"J", 0.021},    {"gain", 1.06},  {"offset", 0.012},
                                            {"late", 0.015}, {"slow", 0.024}, {"fast", 0.168}};
  for (const auto& [name, value] : truth) {
    const auto& p = result.at("parameters").at(name);
    INFO(name << ": " << p.at("value") << " +- " << p.at("std_error"));
    CHECK(std::abs(p.at("value").get<double>() - value) < 3.5 * p.at("std_error").get<double>());
  }
  CHECK_THAT(outcome.err, Contains("column 'angle [deg]' converted from deg to rad"));
  CHECK(result.at("columns").size() >= 4);
  // What it wrote runs where it is.
  CHECK(run_command({"validate", folder.file("out/optimized.json"), "--out", folder.file("again")}).exit_code == kDone);
}

TEST_CASE("a million rows cost memory of the order of the file", "[signals]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // which has memory of its own
#endif
  const TemporaryFolder folder;
  {
    std::ofstream file(folder.file("long.csv"));
    file << "t [ms],tau [mN m]\n";
    file << std::fixed << std::setprecision(3);
    for (int i = 0; i <= 1000000; ++i) file << i * 0.002 << ',' << 100 * std::sin(0.00001 * i) << '\n';
  }
  const double size = static_cast<double>(fs::file_size(folder.file("long.csv")));
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  const CommandOutcome outcome =
      run_text(folder, arm("tau", signal_of("long.csv", R"("column": "tau", "time": "t")")), "long");
  getrusage(RUSAGE_SELF, &after);
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const double grown = 1024.0 * static_cast<double>(after.ru_maxrss - before.ru_maxrss);
  INFO(grown / size << " times the file of " << size / 1e6 << " MB");
  CHECK(grown < 6 * size);  // its text, the columns of doubles while they grow, the curve
}

TEST_CASE("what is wrong with a signal is said at its place", "[signals]") {
  const TemporaryFolder folder;
  std::ofstream(folder.file("log.csv")) << "t,tau [N m],odd [zz]\n0,1,1\n1,,2\n2,3,3\n";
  const auto error = [&](const std::string& more) {
    const CommandOutcome outcome = run_text(folder, arm("tau", "\"signals\": {\"tau\": {" + more + "}}"), "wrong");
    CHECK(outcome.exit_code == kBadInput);
    return outcome.err;
  };
  CHECK_THAT(error(R"("file": "no.csv", "column": "tau")"), Contains("signals.tau.file") && Contains("no.csv"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "taw")"),
             Contains("has no column 'taw'") && Contains("did you mean"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "tau")"), Contains("log.csv:3: column 'tau' has no number here"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "odd")"), Contains("'zz' is not a known unit"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "tau", "unit": "zz")"), Contains("'zz' is not a known unit"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "odd", "unit": "1", "time_unit": "min", "time_zero": "last")"),
             Contains("signals.tau.time_zero"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "odd", "unit": "1", "time_zero": 1)"),
             Contains("signals.tau: its samples cover -1 s to 1 s"));
  CHECK_THAT(error(R"("file": "log.csv", "column": "odd", "unit": "1", "interpolation": "cubic")"),
             Contains("hold, linear, spline"));
  const auto design_error = [&](const std::string& signal_more, const std::string& more, const std::string& objective) {
    const std::string problem = R"("parameters": {"d": 0.1}, "objectives": {"o": )" + objective +
                                R"(}, "design": {"minimize": "o", "variables": ["d"]}, )" + more +
                                signal_of("log.csv", R"("column": "odd", "unit": "1", )" + signal_more);
    const CommandOutcome outcome = run_text(folder, arm("d*tau", problem), "wrong", "2", "design");
    CHECK(outcome.exit_code == kBadInput);
    return outcome.err;
  };
  CHECK_THAT(design_error(R"("interpolation": "hold", "delay": "d")", "", R"({"running": "theta^2"})"),
             Contains("signals.tau.delay: depends on 'd', which is varied"));
  CHECK_THAT(design_error(R"("interpolation": "linear")", R"("cases": [{"name": "long", "end_time": 3}], )",
                          R"({"running": "theta^2"})"),
             Contains("cases[0].end_time: signal 'tau': its samples cover 0 s to 2 s, the simulation 0 s to 3 s"));
  CHECK_THAT(design_error(
                 R"("interpolation": "linear")", "",
                 R"({"track": [{"sensor": "theta", "file": "log.csv", "column": "odd", "unit": "1", "weight": -1}]})"),
             Contains("objectives.o.track[0].weight: is -1, the weight of a square must not be negative"));
}
