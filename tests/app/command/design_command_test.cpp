#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"
#include "tests/app/signal_handler.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

const std::vector<std::string> kBounds{"--set", "parameters.k.lower=1", "--set", "parameters.k.upper=100"};

CommandOutcome run_design_command(const std::string& file, const std::string& out,
                                  const std::vector<std::string>& more = kBounds) {
  std::vector<std::string> arguments{"design", file, "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_command(arguments);
}

}  // namespace

TEST_CASE("design: a minimum inside the bounds, told in a table, a history and a result", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_design_command(folder.write("rod.json", kPendulum), folder.file("out"));
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("optimum") && Contains("N/m") && Contains("track"));
  CHECK_THAT(outcome.err, Contains("iteration   0"));  // a line per iteration: no terminal here

  const auto result = json_of(folder.path / "out/result.json");
  const auto& k = result.at("parameters").at("k");
  CHECK(k.at("initial") == 20);
  const double optimum = k.at("value");
  CHECK((optimum > 1 && optimum < 100));
  const auto& optimizer = result.at("optimizer");
  CHECK(optimizer.at("status") == "converged");
  CHECK(optimizer.at("objective_final") < optimizer.at("objective_initial"));
  const std::string report = content_of(folder.path / "out/report.html");
  CHECK_THAT(report, Contains("At the start, seen in the x-y plane") && Contains("converged: the optimality"));
  CHECK(report.find("class=\"banner\"") == std::string::npos);
  const std::string history = content_of(folder.path / "out/history.csv");
  CHECK_THAT(history, Catch::StartsWith("iteration,objective,infeasibility,optimality,k\n0,"));
  CHECK(std::count(history.begin(), history.end(), '\n') == optimizer.at("iterations").get<int>() + 2);
}

// k >= 50 and 2 k <= 80 cannot both hold. The sum of relative violations, (50 - k)/50 + max(0, 2 k - 80)/80, is least
// at k = 40. Eased by 1, the limits lower it by 1/50 and 1/100.
TEST_CASE("design: limits in conflict stand in the terminal with their prices", "[command]") {
  const TemporaryFolder folder;
  std::vector<std::string> sets = kBounds;
  for (const char* set :
       {"forces[0].point1=[0, 3, 0]", R"(objectives.stiff={"parameters_only": "k"})",
        R"(objectives.twice={"parameters_only": "2*k"})",
        R"(design.subject_to=[{"objective": "stiff", "lower": 50}, {"objective": "twice", "upper": 80}])"})
    sets.insert(sets.end(), {"--set", set});
  const CommandOutcome outcome = run_design_command(folder.write("rod.json", kPendulum), folder.file("out"), sets);
  CHECK(outcome.exit_code == kNumericalFailure);
  CHECK_THAT(outcome.out, Contains("limit in conflict") && Contains("missed by") && Contains("price") &&
                              Contains("stiff >= 50") && Contains("twice <= 80") && Contains("0.01"));
  const auto conflicts = json_of(folder.path / "out/result.json").at("conflicts");
  REQUIRE(conflicts.size() == 2);
  CHECK(conflicts[0].at("missed").get<double>() == Approx(10).epsilon(2e-3));
  CHECK(conflicts[0].at("price").get<double>() == Approx(1.0 / 50));
  CHECK(conflicts[1].at("price").get<double>() == Approx(1.0 / 100));
}

TEST_CASE("design: the report's headline has the violation of true extremes", "[command][report]") {
  const TemporaryFolder folder;
  // The swing begins at 0.
  const CommandOutcome outcome =
      run_command({"design", folder.write("rod.json", kPendulum), "--out", folder.file("out"), "--quiet", "--set",
                   R"(design.subject_to=[{"maximum_of": "swing", "upper": -0.5, "sharpness": 5}])", "--set",
                   "design.optimizer.type=ipopt", "--set", "parameters.k.lower=1", "--set", "parameters.k.upper=100"});
  INFO(outcome.out << outcome.err);
  const auto optimizer = json_of(folder.path / "out/result.json").at("optimizer");
  const double smooth = optimizer.at("infeasibility"), exact = optimizer.at("true_infeasibility");
  REQUIRE(exact > 1.1 * smooth);
  CHECK_THAT(content_of(folder.path / "out/report.html"),
             Contains(fmt::format("the largest relative violation of a limit is {:.2g};", exact)));
}

TEST_CASE("design: optimized.json is a problem whose objective is the optimum's", "[command]") {
  const TemporaryFolder folder;
  REQUIRE(run_design_command(folder.write("rod.json", kPendulum), folder.file("out")).exit_code == kDone);
  const double found = json_of(folder.path / "out/result.json").at("optimizer").at("objective_final");
  REQUIRE(run_command({"simulate", folder.file("out/optimized.json"), "--out", folder.file("again")}).exit_code ==
          kDone);
  const double again = json_of(folder.path / "again/result.json").at("objectives").at("track").at("value");
  CHECK(again == Approx(found).epsilon(1e-12));
}

namespace {

// Two masses, of 1 and 2 kg, each on a spring of its own along x.
constexpr const char* kTwoMasses = R"({
  "gravity": [0, 0, 0],
  "parameters": {"k1": {"value": 100, "lower": 50, "upper": 400}, "k2": {"value": 400, "lower": 50, "upper": 900}},
  "bodies": [{"name": "a", "mass": 1, "inertia": [1, 1, 1], "position": [1, 0, 0]},
             {"name": "b", "mass": 2, "inertia": [1, 1, 1], "position": [1, 1, 0]}],
  "joints": [{"name": "A", "type": "translational", "body2": "a", "axis1": [1, 0, 0], "axis2": [1, 0, 0]},
             {"name": "B", "type": "translational", "body2": "b", "point1": [0, 1, 0], "axis1": [1, 0, 0],
              "axis2": [1, 0, 0]}],
  "forces": [{"name": "s1", "type": "tsda", "body2": "a", "stiffness": "k1", "free_length": 1},
             {"name": "s2", "type": "tsda", "body2": "b", "point1": [0, 1, 0], "stiffness": "k2", "free_length": 1}],
  "simulation": {"end_time": 1},
  "objectives": {"first": {"eigenvalue": {"mode": 1}}, "all": {"eigenvalue": {"value": "least_frequency"}},
                 "cost": {"parameters_only": "k1 + k2"}},
  "design": {"maximize": "first", "variables": ["k1"]}
})";

}  // namespace

TEST_CASE("design: modes have their numbers at the values of optimized.json", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_design_command(folder.write("masses.json", kTwoMasses), folder.file("out"), {});
  CHECK(outcome.exit_code == kDone);  // k1 = 400: the first mode passes the second, sqrt(400/2)
  CHECK_THAT(outcome.err, Contains("modes change their numbers") && Contains("that of 'first' from 1 to 2"));
  const double found = json_of(folder.path / "out/result.json").at("optimizer").at("objective_final");
  CHECK(found == Approx(20 / (2 * 3.14159265358979)).epsilon(1e-9));
  REQUIRE(run_command({"simulate", folder.file("out/optimized.json"), "--out", folder.file("again")}).exit_code ==
          kDone);
  CHECK(json_of(folder.path / "again/result.json").at("objectives").at("first").at("value").get<double>() ==
        Approx(found).epsilon(1e-9));
}

TEST_CASE("design: the least of all frequencies is highest where they meet", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_design_command(folder.write("masses.json", kTwoMasses), folder.file("out"),
                         {"--set", "design.maximize=all", "--set", R"(design.variables=["k1", "k2"])", "--set",
                          R"(design.subject_to=[{"objective": "cost", "upper": 600}])"});
  INFO(outcome.out << outcome.err);
  CHECK(outcome.exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("optimizer").at("status") == "converged");
  CHECK(result.at("parameters").at("k1").at("value").get<double>() == Approx(200).epsilon(1e-5));
  CHECK(result.at("optimizer").at("objective_final").get<double>() ==
        Approx(std::sqrt(200) / (2 * 3.14159265358979)).epsilon(1e-6));
}

// Hoeken's straight-line linkage, from a start with a variable of 0. Its best line of four cranks is 7.2985e-4 m high
// by SLSQP in a closed model of the linkage.
TEST_CASE("design: a variable that is 0 at the start moves as others do", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("line.json", R"({
    "gravity": [0, 0, 0],
    "parameters": {
      "d": {"value": 0.3, "lower": 0.15, "upper": 1.5}, "b": {"value": 0.375, "lower": 0.15, "upper": 1.5},
      "c": {"value": 0.375, "lower": 0.15, "upper": 1.5}, "e": {"value": 0.75, "lower": 0, "upper": 3},
      "f": {"value": 0, "lower": -0.75, "upper": 0.75}},
    "definitions": {"a": 0.15},
    "bodies": [
      {"name": "crank", "mass": 1, "inertia": [1, 1, 1], "orientation": {"axis": [0, 0, 1], "angle": "pi/2"},
       "points": {"end": ["a", 0, 0]}},
      {"name": "coupler", "mass": 1, "inertia": [1, 1, 1], "position": [0, "a", 0],
       "orientation": {"axis": [0, 0, 1], "angle": "30 [deg]"}, "points": {"end": ["b", 0, 0], "P": ["e", "f", 0]}},
      {"name": "rocker", "mass": 1, "inertia": [1, 1, 1], "position": ["d", 0, 0],
       "orientation": {"axis": [0, 0, 1], "angle": "pi/2"}, "points": {"end": ["c", 0, 0]}}],
    "joints": [
      {"name": "A", "type": "revolute", "body2": "crank", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
      {"name": "B", "type": "revolute", "body1": "crank", "body2": "coupler", "point1": "end", "axis1": [0, 0, 1],
       "axis2": [0, 0, 1]},
      {"name": "C", "type": "revolute", "body1": "coupler", "body2": "rocker", "point1": "end", "point2": "end",
       "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
      {"name": "D", "type": "revolute", "body2": "rocker", "point1": ["d", 0, 0], "axis1": [0, 0, 1],
       "axis2": [0, 0, 1]}],
    "drives": [{"name": "motor", "type": "angle", "joint": "A", "law": "pi/2 + pi*t"}],
    "sensors": {"x": {"quantity": "position", "body": "coupler", "point": "P", "component": "x"},
                "y": {"quantity": "position", "body": "coupler", "point": "P", "component": "y"}},
    "simulation": {"end_time": 1},
    "objectives": {"band": {"peak_to_peak_of": "y"}},
    "design": {"minimize": "band", "variables": ["d", "b", "c", "e", "f"],
               "subject_to": [{"peak_to_peak_of": "x", "lower": 0.6, "upper": 0.6}]}
  })");
  const CommandOutcome outcome = run_design_command(file, folder.file("out"), {});
  INFO(outcome.out << outcome.err);
  CHECK(outcome.exit_code == kDone);
  const auto optimizer = json_of(folder.path / "out/result.json").at("optimizer");
  CHECK(optimizer.at("status") == "converged");
  CHECK(optimizer.at("objective_final").get<double>() == Approx(7.29853e-4).epsilon(1e-4));
}

TEST_CASE("design: a bound that holds the optimum back is named", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_design_command(folder.write("rod.json", kPendulum), folder.file("out"),
                         {"--set", "parameters.k.lower=18", "--set", "parameters.k.upper=22"});
  REQUIRE(outcome.exit_code == kDone);
  const auto k = json_of(folder.path / "out/result.json").at("parameters").at("k");
  REQUIRE(k.at("at_bound").is_string());
  CHECK(k.at("value").get<double>() == Approx(k.at(k.at("at_bound").get<std::string>()).get<double>()).epsilon(1e-6));
}

TEST_CASE("design: too few iterations is a failure in words that keeps the best so far", "[command]") {
  const TemporaryFolder folder;
  std::vector<std::string> more = kBounds;
  more.insert(more.end(), {"--set", "design.optimizer.max_iterations=1"});
  const CommandOutcome outcome = run_design_command(folder.write("rod.json", kPendulum), folder.file("out"), more);
  CHECK(outcome.exit_code == kNumericalFailure);
  const std::string advice =
      "raise design.optimizer.max_iterations or max_evaluations, or go on from the best point: "
      "'mbsopt design " +
      folder.file("out/optimized.json");
  CHECK_THAT(outcome.err, Contains("design failed: stopped at the limit of 1 iteration; ") && Contains(advice));
  CHECK_THAT(outcome.out, Contains("best point") && !Contains("optimum"));
  const CommandOutcome resumed = run_command({"resume", folder.file("out")});
  CHECK_THAT(resumed.out, Contains("there is nothing to resume: ") && Contains(advice));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "failed");
  CHECK(result.at("optimizer").at("objective_final") <= result.at("optimizer").at("objective_initial"));
  CHECK(fs::exists(folder.path / "out/optimized.json"));
  CHECK_THAT(content_of(folder.path / "out/report.html"),
             Contains("class=\"banner\"") && Contains("This run failed: stopped at the limit of 1 iteration"));
}

TEST_CASE("design says of the start what simulate says of it", "[command]") {
  const TemporaryFolder folder;
  std::vector<std::string> more = kBounds;
  more.insert(more.end(), {"--set", "joints[0].point2=[0.3, 0, 0]"});
  const std::string file = folder.write("rod.json", kPendulum);
  std::vector<std::string> simulate{"simulate", file, "--out", folder.file("run")};
  simulate.insert(simulate.end(), more.begin(), more.end());
  const auto apart = Contains("leaves the points of joint 'pin' 0.3 m apart");
  CHECK_THAT(run_command(simulate).err, apart);
  CHECK_THAT(run_design_command(file, folder.file("out"), more).err, apart);
  CHECK_THAT(json_of(folder.path / "out/result.json").at("warnings").dump(), apart);
}

TEST_CASE("design and gradient warn of rounding in the derivatives of a tiny mechanism's start", "[command]") {
  const TemporaryFolder folder;
  const std::string file = MBSOPT_SOURCE_DIR "/tests/soak/kept/117308.json";
  const auto rounding = Contains("the derivatives of the initial state carry rounding of about 2e-05");
  CHECK_THAT(run_command({"gradient", file, "--out", folder.file("gradient")}).err, rounding);
  const CommandOutcome designed =
      run_design_command(file, folder.file("out"), {"--set", R"(design={"minimize": "J1", "variables": ["p3"]})"});
  CHECK(designed.exit_code == kDone);
  CHECK_THAT(designed.err, rounding);
}

// A bob of 3 kg on an arm of length r. The bounds are too wide to tell the size of r and of the shift z, which begins
// at 0.
TEST_CASE("design: loose bounds lead to the optimum of near ones, by every method", "[command]") {
  const TemporaryFolder folder;
  const auto problem = [&](double wide) {
    return fmt::format(R"({{"format": 1, "name": "bob", "gravity": [0, -9.81, 0],
      "parameters": {{"r": {{"value": 0.9, "lower": 0.02, "upper": {0}}},
                     "z": {{"value": 0, "lower": -{0}, "upper": {0}}}}},
      "bodies": [{{"name": "arm", "mass": 3, "com": ["r", 0, 0], "inertia": [0.01, 0.01, 0.01]}}],
      "joints": [{{"name": "pin", "type": "revolute", "body2": "arm", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}}],
      "forces": [{{"name": "drag", "type": "rsda", "joint": "pin", "damping": 0.2}}],
      "sensors": {{"q": {{"quantity": "angle", "joint": "pin"}}}},
      "initial": {{"conditions": [{{"sensor": "q", "value": -0.5, "rate": 0}}]}}, "simulation": {{"end_time": 1.2}},
      "objectives": {{"o": {{"running": "(q + 0.5 - z + 2.1*sin(2.2*t)^2)^2"}}}},
      "design": {{"minimize": "o", "variables": ["r", "z"]}}}})",
                       wide);
  };
  const auto solved = [&](double wide, const std::string& type) {
    const std::string out = folder.file(fmt::format("{}{}", type, wide));
    const CommandOutcome outcome = run_command({"design", folder.write("bob.json", problem(wide)), "--out", out,
                                                "--set", "design.optimizer.type=\"" + type + "\""});
    INFO(type << " " << wide << " " << outcome.err << outcome.out);
    CHECK(outcome.exit_code == kDone);
    return json_of(out + "/result.json");
  };
  const double best = solved(10, "ipopt").at("optimizer").at("objective_final");
  for (const std::string type : {"ipopt", "slsqp", "mma", "ccsaq", "lbfgs"}) {
    for (const double wide : {1e5, 1e12}) {
      const auto result = solved(wide, type);
      INFO(type << " " << wide);
      CHECK(result.at("optimizer").at("status") == "converged");
      CHECK(result.at("optimizer").at("objective_final").get<double>() == Approx(best).epsilon(1e-5));
      for (const char* name : {"r", "z"}) CHECK(result.at("parameters").at(name).at("at_bound").is_null());
    }
  }
}

TEST_CASE("design: SIGTERM keeps the best so far", "[command]") {
  const TemporaryFolder folder;
  std::thread killer([] {
    wait_for_handler(SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    ::kill(::getpid(), SIGTERM);
  });
  std::vector<std::string> more = kBounds;  // simulations that take seconds, so that the signal comes within one
  more.insert(more.end(), {"--set", "simulation.integrator.rtol=1e-13", "--set", "simulation.integrator.atol=1e-15",
                           "--set", "simulation.integrator.max_step=1e-5", "--set", "simulation.output_step=0.1"});
  const CommandOutcome outcome = run_design_command(folder.write("rod.json", kPendulum), folder.file("out"), more);
  killer.join();
  CHECK(outcome.exit_code == kInterrupted);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "interrupted");
  const std::string kept = result.at("message");
  // Only what is there: the design, unless the signal came before it began.
  CHECK_THAT(kept, Contains("optimized.json") || Contains("nothing was designed yet"));
  CHECK(fs::exists(folder.path / "out/optimized.json") == (kept.find("optimized.json") != std::string::npos));
}

TEST_CASE("design and identify of a file that does not ask for them are bad input", "[command]") {
  const TemporaryFolder folder;
  std::string text = kPendulum;
  text.erase(text.find(",\n  \"design\""));
  const std::string file = folder.write("bare.json", text + "}");
  for (const std::string command : {"design", "identify"}) {
    const CommandOutcome outcome = run_command({command, file, "--out", folder.file("out")});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains(command == "design" ? "design: missing" : "identification: missing"));
  }
}

TEST_CASE("a limit on a maximum holds for the true one, and its price is printed", "[design]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("peak.json", R"({
    "format": 1, "name": "peak", "gravity": [0, -9.81, 0],
    "parameters": {"k": {"value": 20, "lower": 1, "upper": 200}},
    "bodies": [{"name": "rod", "mass": 2, "com": [0.5, 0, 0], "inertia": [1e-3, 0.1666, 0.1666],
                "points": {"tip": [1, 0, 0]}}],
    "joints": [{"name": "pin", "type": "revolute", "body1": "ground", "body2": "rod",
                "point1": [0, 0, 0], "point2": "O", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
    "forces": [{"name": "spring", "type": "tsda", "body1": "ground", "body2": "rod",
                "point1": [0, 1, 0], "point2": "tip", "stiffness": "k", "free_length": 0.5}],
    "sensors": {"F": {"quantity": "force", "force": "spring"},
                "tip_y": {"quantity": "position", "body": "rod", "point": "tip", "component": "y"}},
    "simulation": {"end_time": 2, "output_step": 0.25},
    "objectives": {"track": {"running": "(tip_y - 0.3)^2"}, "peak": {"maximum_of": "F", "sharpness": 1}},
    "design": {"minimize": "track", "variables": ["k"], "subject_to": [{"objective": "peak", "upper": 12}]}
  })");
  const CommandOutcome outcome = run_command({"design", file, "--out", folder.file("out"), "--quiet"});
  INFO(outcome.out << outcome.err);
  CHECK(outcome.exit_code == kDone);
  CHECK(outcome.out.find("sqp converged:") != std::string::npos);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("optimizer").at("status") == "converged");
  CHECK(result.at("optimizer").at("true_infeasibility") == 0);
  CHECK(
      result.at("optimizer").at("decisions").back().get<std::string>().starts_with("sqp on 1 variable within 1 limit"));
  const auto& peak = result.at("objectives").at("peak");
  CHECK(peak.at("true_value").get<double>() <= 12);
  CHECK(peak.at("true_value").get<double>() > 12 - 1e-4);
  CHECK(peak.at("true_violation") == 0);
  CHECK(peak.at("price").get<double>() > 0);
}

TEST_CASE("a parameter that moves a jump is named by gradient, check and design", "[design]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("jump.json", R"json({
    "format": 1, "name": "jump", "gravity": [0, -9.81, 0],
    "parameters": {"tp": {"value": 0.4, "lower": 0.1, "upper": 0.9}},
    "bodies": [{"name": "rod", "mass": 2, "com": [0.5, 0, 0], "inertia": [1e-3, 0.1666, 0.1666],
                "points": {"tip": [1, 0, 0]}}],
    "joints": [{"name": "pin", "type": "revolute", "body1": "ground", "body2": "rod",
                "point1": [0, 0, 0], "point2": "O", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
    "forces": [{"name": "push", "type": "force", "body": "rod", "point": "tip",
                "components": [0, "10 + 20*atan(1/(t - tp))/pi", 0]}],
    "sensors": {"tip_y": {"quantity": "position", "body": "rod", "point": "tip", "component": "y"}},
    "simulation": {"end_time": 1, "output_step": 0.25},
    "objectives": {"track": {"running": "(tip_y + 0.5)^2"}},
    "design": {"minimize": "track", "variables": ["tp"]}
  })json");
  for (const std::string command : {"gradient", "check", "design"}) {
    const CommandOutcome outcome = run_command({command, file, "--out", folder.file(command), "--quiet"});
    INFO(command << outcome.out << outcome.err);
    std::string said;
    const auto result = json_of(folder.path / command / "result.json");
    for (const auto& warning : result.at("warnings")) said += warning.get<std::string>() + "\n";
    INFO(said);
    CHECK(said.find("the law of force 'push' jumps by 20 at t = 0.4 s, an instant that depends on 'tp'") !=
          std::string::npos);
    if (command == "design") CHECK(said.find("the derivative of objective 'track' in 'tp' is ") != std::string::npos);
  }
}
