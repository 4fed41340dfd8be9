// simulation.accuracy: what it is written as, what it chooses, and whether the error it estimates is the true one.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "app/json/read_problem.hpp"
#include "app/terminal/exit_code.hpp"
#include "optim/tradeoff/accuracy.hpp"
#include "optim/tradeoff/tradeoff_reference.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

// The file's problem with an accuracy in place of its integrator.
Problem with_accuracy(const std::string& name, double accuracy) {
  Problem problem = read_problem(file_of(name));
  SimulationSettings& s = problem.scene.simulation;
  s.integrator = {}, s.accuracy = accuracy;
  s.formulation = constrained(s.formulation);  // as the reference: the model error of a penalty is none of integration
  return problem;
}

std::vector<std::string> set_integrator(const nlohmann::json& chosen) {
  return {"--set", "simulation.integrator.type=" + chosen.at("type").get<std::string>(),
          "--set", "simulation.integrator.rtol=" + chosen.at("rtol").dump(),
          "--set", "simulation.integrator.atol=" + chosen.at("atol").dump()};
}

std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// A bar in honey: stiff for explicit methods.
std::string honey(const std::string& simulation) {
  return R"({"format": 1, "name": "honey", "gravity": [0, -9.81, 0],
    "parameters": {"c": {"value": 400, "unit": "N m s"}, "m": {"value": 2, "unit": "kg"}},
    "bodies": [{"name": "bar", "mass": "m", "com": [0.5, 0, 0], "inertia": [0.01, 0.2, 0.2]}],
    "joints": [{"name": "pin", "type": "revolute", "body2": "bar", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
    "forces": [{"name": "honey", "type": "rsda", "joint": "pin", "damping": "c"}],
    "sensors": {"theta": {"quantity": "angle", "joint": "pin"}},
    "simulation": )" +
         simulation + R"(,
    "objectives": {"sunk": {"terminal": "theta"}}})";
}

}  // namespace

TEST_CASE("the estimated error is the true one within a factor of 10", "[accuracy]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  // Two methods agree to this much; nothing smaller can be told from rounding.
  constexpr double kFloor = 1e-11;
  int estimates = 0, files = 0;
  for (const char* name :
       {"double_pendulum/gradient", "five_bar/design_geometry", "joints/gear_train", "joints/welded_hammer",
        "pendulum/driven_torque", "quarter_car/ride", "scotch_yoke/slotted", "bushing/engine_mount",
        "friction/flywheel_brake", "joints/sliding_disc", "governor/spring", "hatch/gas_strut"}) {
    const Problem problem = with_accuracy(name, 1e-5);
    Scene settled = problem.scene;
    settled.simulation.accuracy.reset();
    const TradeoffRuns runs(settled, objectives_of(problem));
    const TradeoffReference reference =
        converged_reference(runs, {.seconds_per_run = std::numeric_limits<double>::infinity(), .gradients = false});
    INFO(name << ": " << reference.message);
    REQUIRE(reference.ok());
    ++files;
    for (const double wanted : {1e-3, 1e-5, 1e-9}) {
      Scene scene = problem.scene;
      scene.simulation.accuracy = wanted;
      const AccuracyChoice choice = choose_accuracy(scene, objectives_of(problem));
      INFO("wanted " << wanted << ", " << choice.settings.integrator.type << " at " << choice.settings.integrator.rtol
                     << " " << choice.message);
      REQUIRE(choice.ok);
      const Eigen::VectorXd errors = reference.errors->of(runs.motion(choice.settings));
      const std::vector<Quantity>& quantities = reference.errors->quantities();
      for (const ErrorEstimate& e : choice.estimates) {
        const auto q = std::find_if(quantities.begin(), quantities.end(), [&](const Quantity& x) {
          return x.name == e.quantity || x.name == "objective " + e.quantity;
        });
        REQUIRE(q != quantities.end());
        if (!e.relative || !q->relative) continue;
        const double error = std::max(errors(q - quantities.begin()), kFloor), estimate = std::max(e.error, kFloor);
        INFO(e.quantity << ": estimated " << estimate << ", true " << error);
        CHECK(estimate < 10 * error);
        CHECK(error < 10 * estimate);
        ++estimates;
      }
      CHECK(choice.reached);
      CHECK(choice.largest_error() <= wanted);
    }
  }
  CHECK(files == 12);
  CHECK(estimates > 60);
}

// A flywheel slows down: theta = w0 J/c (1 - exp(-c t/J)), 560 rad. Its marks are to be right to 1e-5 of a turn.
TEST_CASE("many turns get a high order, not ten times the steps, and few runs to find that", "[accuracy]") {
  Problem problem = read_problem_text(R"({"format": 1, "name": "flywheel", "gravity": [0, 0, 0],
    "bodies": [{"name": "wheel", "mass": 5, "inertia": [0.02, 0.02, 0.03], "points": {"mark": [0.1, 0, 0]}}],
    "joints": [{"name": "shaft", "type": "revolute", "body2": "wheel", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
    "forces": [{"name": "drag", "type": "rsda", "joint": "shaft", "damping": 0.003}],
    "sensors": {"q": {"quantity": "angle", "joint": "shaft"},
                "x": {"quantity": "position", "body": "wheel", "point": "mark", "component": "x"}},
    "initial": {"conditions": [{"sensor": "q", "value": 0, "rate": 90}]},
    "simulation": {"end_time": 9.5, "accuracy": "engineering"},
    "objectives": {"place": {"terminal": "10*x"}}})",
                                      "flywheel.json");
  const AccuracyChoice choice = choose_accuracy(problem.scene, objectives_of(problem));
  REQUIRE(choice.ok);
  CHECK(choice.reached);
  CHECK(choice.settings.integrator.type == "dopri853");
  CHECK(choice.simulations <= 6);
  problem.scene.simulation.accuracy.reset();
  const TradeoffRuns runs(problem.scene, objectives_of(problem));
  const Answer chosen = runs.motion(choice.settings);
  const double theta = 90 * 0.03 / 0.003 * (1 - std::exp(-0.003 * 9.5 / 0.03));
  CHECK(std::abs(chosen.psi(0) - std::cos(theta)) < 1e-5);
}

TEST_CASE("a stiff scene gets an implicit method, one that is not an explicit one", "[accuracy]") {
  const auto chosen = [](const std::string& text, double accuracy) {
    Problem problem = read_problem_text(text, "honey.json");
    problem.scene.simulation.accuracy = accuracy, problem.scene.simulation.integrator = {};
    return choose_accuracy(problem.scene, objectives_of(problem));
  };
  const AccuracyChoice stiff = chosen(honey(R"({"end_time": 20, "accuracy": "draft"})"), 1e-5);
  REQUIRE(stiff.ok);
  CHECK(stiff.settings.integrator.type == "radau5");
  CHECK(stiff.limited_steps > 0.5);
  CHECK(stiff.stiffest_rate == Approx(400 / (0.2 + 2 * 0.25)).epsilon(0.05));
  CHECK_THAT(stiff.why, Contains("stiff"));
  const AccuracyChoice soft = chosen(kPendulum, 1e-5), exact = chosen(kPendulum, 1e-9);
  REQUIRE((soft.ok && exact.ok));
  CHECK(soft.settings.integrator.type == "dopri5");
  CHECK(exact.settings.integrator.type == "dopri853");
  CHECK(exact.settings.integrator.rtol < soft.settings.integrator.rtol);
}

TEST_CASE("where no objective is simulated the motion is what has to be exact", "[accuracy]") {
  Problem problem = read_problem_text(kPendulum, "rod.json");
  problem.scene.simulation.accuracy = 1e-6;
  const AccuracyChoice choice = choose_accuracy(problem.scene, {});
  REQUIRE(choice.ok);
  REQUIRE(choice.estimates.size() == 1);
  CHECK(choice.estimates[0].quantity == "motion");
  CHECK(choice.largest_error() <= 1e-6);
}

TEST_CASE("an accuracy is a word or a number, and nothing else", "[accuracy]") {
  const auto with = [](const std::string& accuracy) {
    return read_problem_text(kPendulum, "rod.json", {"simulation.accuracy=" + accuracy}).scene.simulation.accuracy;
  };
  CHECK(*with("draft") == 1e-3);
  CHECK(*with("engineering") == 1e-5);
  CHECK(*with("reference") == 1e-9);
  CHECK(*with("2e-4") == 2e-4);
  CHECK_FALSE(read_problem_text(kPendulum, "rod.json").scene.simulation.accuracy);
  const auto refused = [&](const std::string& accuracy) -> std::string {
    try {
      with(accuracy);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  CHECK_THAT(refused("enginering"), Contains("simulation.accuracy") && Contains("engineering") && Contains("number"));
  CHECK_THAT(refused("0"), Contains("simulation.accuracy") && Contains("greater than 0"));
  CHECK_THAT(refused("1.5"), Contains("simulation.accuracy") && Contains("below 1"));
  CHECK_THAT(refused("[1]"), Contains("simulation.accuracy"));
}

TEST_CASE("beside an accuracy the integrator may say how far it may go, but not what is chosen", "[accuracy]") {
  for (const char* field : {"type=radau5", "rtol=1e-6", "atol=1e-6", "step=0.01"}) {
    INFO(field);
    const TemporaryFolder folder;
    const CommandOutcome outcome =
        run_command({"simulate", folder.write("rod.json", kPendulum), "--out", folder.file("out"), "--set",
                     "simulation.accuracy=draft", "--set", std::string("simulation.integrator.") + field});
    CHECK(outcome.exit_code == kBadInput);
    const std::string key = std::string(field).substr(0, std::string(field).find('='));
    CHECK_THAT(outcome.err, Contains("simulation.integrator." + key) && Contains("simulation.accuracy"));
  }
  const Problem allowed =
      read_problem_text(kPendulum, "rod.json",
                        {"simulation.accuracy=draft", "simulation.integrator.max_step=0.02",
                         "simulation.integrator.initial_step=0.001", "simulation.integrator.max_steps=5000"});
  const AccuracyChoice choice = choose_accuracy(allowed.scene, objectives_of(allowed));
  REQUIRE(choice.ok);
  CHECK(choice.settings.integrator.max_step == 0.02);
  CHECK(choice.settings.integrator.max_steps == 5000);
  // With --set a file's own integrator is left out.
  CHECK_NOTHROW(read_problem(file_of("five_bar/design"), {"simulation.accuracy=draft", "simulation.integrator={}"}));
}

TEST_CASE("what was chosen is said, stored and in the report", "[accuracy]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_command({"simulate", folder.write("rod.json", kPendulum), "--out",
                                              folder.file("out"), "--set", "simulation.accuracy=engineering"});
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out,
             Contains("accuracy: engineering (1e-05)") && Contains("Estimated error: about") && Contains("in track"));
  const auto result = json_of(folder.path / "out/result.json");
  const auto& accuracy = result.at("accuracy");
  CHECK(accuracy.at("wanted") == 1e-5);
  CHECK(accuracy.at("reached") == true);
  CHECK(accuracy.at("integrator").at("type") == "dopri5");
  CHECK(accuracy.at("estimated_error").get<double>() <= 1e-5);
  CHECK(accuracy.at("errors").contains("track"));
  CHECK(result.at("warnings").empty());
  CHECK_THAT(content_of(folder.path / "out/report.html"),
             Contains("engineering <span class=\"whole\">(1e-05)</span> is wanted"));
}

TEST_CASE("an accuracy that cannot be had is a warning with the error that can", "[accuracy]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_command({"simulate", folder.write("rod.json", kPendulum), "--out",
                                              folder.file("out"), "--set", "simulation.accuracy=1e-17"});
  CHECK(outcome.exit_code == kDone);
  CHECK_THAT(outcome.err, Contains("1e-17 is not reached, the estimated error is"));
  CHECK(json_of(folder.path / "out/result.json").at("accuracy").at("reached") == false);
}

TEST_CASE("every command computes what it would with the chosen integrator written down", "[accuracy]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  for (const char* command : {"simulate", "gradient", "design"}) {
    INFO(command);
    const std::string one = std::string(command) + "1", other = std::string(command) + "2";
    REQUIRE(run_command({command, file, "--quiet", "--out", folder.file(one), "--set", "simulation.accuracy=draft"})
                .exit_code == kDone);
    auto chosen = repeatable(json_of(folder.file(one) + "/result.json"));
    REQUIRE(run_command(std::vector<std::string>{command, file, "--quiet", "--out", folder.file(other)} +
                        set_integrator(chosen.at("accuracy").at("integrator")))
                .exit_code == kDone);
    auto written = repeatable(json_of(folder.file(other) + "/result.json"));
    for (const char* key : {"objectives", "simulation", "parameters", "optimizer"}) {
      INFO(key);
      CHECK(chosen.value(key, nlohmann::json()) == written.value(key, nlohmann::json()));
    }
    CHECK(chosen.at("accuracy").at("integrator").at("rtol") != 1e-6);  // not the default by chance
  }
}

TEST_CASE("a fit takes the integrator that its first experiment needs", "[accuracy]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"identify", file_of("spring_damper/identify").string(), "--quiet", "--out", folder.file("out"),
                   "--set", "simulation.accuracy=1e-6", "--set", "simulation.integrator={}"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("accuracy").at("errors").contains("sensors"));
  CHECK(result.at("accuracy").at("reached") == true);
}

TEST_CASE("a simulation of nothing chosen is refused, not run with some default", "[accuracy]") {
  Problem problem = read_problem_text(kPendulum, "rod.json");
  problem.scene.simulation.accuracy = 1e-3;
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  CHECK_THROWS_WITH(simulate(mechanism, problem.scene.simulation), Contains("simulation.accuracy"));
}

TEST_CASE("an explicit method on a stiff scene gives a warning, and of its gradient a stronger one", "[stiffness]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("honey.json", honey(R"({"end_time": 1, "integrator": {"type": "dopri5"}})"));
  const auto warnings = [&](const char* command, const std::vector<std::string>& sets) {
    static int runs = 0;
    const std::string out = folder.file("out" + std::to_string(++runs));
    const CommandOutcome outcome = run_command(std::vector<std::string>{command, file, "--quiet", "--out", out} + sets);
    INFO(outcome.out << outcome.err);
    CHECK(outcome.exit_code == kDone);
    const auto found = json_of(out + "/result.json").at("warnings");
    std::string all;
    for (const auto& warning : found) all += warning.get<std::string>() + "\n";
    if (!all.empty()) CHECK_THAT(outcome.err, Contains("warning: " + found[0].get<std::string>()));
    return all;
  };
  CHECK_THAT(warnings("simulate", {}), Contains("limited by stability") && Contains("radau5") && !Contains("gradient"));
  CHECK_THAT(warnings("gradient", {}), Contains("limited by stability") && Contains("not to be trusted"));
  CHECK_THAT(warnings("check", {}), Contains("not to be trusted"));
  for (const char* command : {"simulate", "gradient"})
    CHECK(warnings(command, {"--set", "simulation.integrator.type=radau5"}).empty());
  CHECK(warnings("gradient", {"--set", "parameters.c.value=1"}).empty());
}
