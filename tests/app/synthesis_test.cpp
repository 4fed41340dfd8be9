// Dimensional synthesis as commands: least squares, every assembly mode.
#include <catch2/catch.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "app/json/read_problem.hpp"
#include "app/starts/point_records.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/start/nearest_approach.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/design_issues.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

using Arguments = std::vector<std::string>;

struct Designed {
  CommandOutcome outcome;
  nlohmann::json result;
};

Designed designed_points(const TemporaryFolder& folder, const Arguments& more) {
  Arguments arguments{"design", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points.json"), "--out",
                      folder.file("out")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  Designed done{run_command(arguments), {}};
  if (std::filesystem::exists(folder.path / "out/result.json")) done.result = json_of(folder.path / "out/result.json");
  return done;
}

const Arguments kLeastSquares{"--set", "design.optimizer={\"type\": \"least_squares\"}"};

Arguments and_also(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Problem eighteen_points() {
  Problem problem = read_problem(MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points.json"));
  problem.design->optimizer = {};
  problem.design->optimizer.type = OptimizerSpec::kLeastSquares;
  return problem;
}

DesignOptions without_comparison() {
  DesignOptions options;
  options.compare_differences = false;
  return options;
}

}  // namespace

TEST_CASE("least squares that is interrupted keeps its best design, and goes on from its records", "[synthesis]") {
  const Problem problem = eighteen_points();
  long calls = 0, allowed = std::numeric_limits<long>::max();
  DesignOptions options = without_comparison();
  options.simulation_progress = [&](double) { return ++calls <= allowed; };
  const DesignResult whole = run_design(problem, options);
  REQUIRE(whole.status == SolverStatus::converged);
  std::vector<Json> points;
  const auto keep = [&](const char*, const Json& point) { points.push_back(point); };
  JsonPointRecords none({}, {}, keep);
  options.records = &none;
  allowed = calls / 2, calls = 0;
  const DesignResult part = run_design(problem, options);
  CHECK(part.status == SolverStatus::stopped);
  REQUIRE(!part.history.empty());
  CHECK(part.objective_final < 0.9 * part.objective_initial);
  CHECK(part.objective_final == Approx(part.history.back().objective));
  CHECK(part.variables[0].value != part.variables[0].initial);
  CHECK(part.evaluations < whole.evaluations);
  REQUIRE(static_cast<long>(points.size()) == part.evaluations);
  JsonPointRecords known(std::exchange(points, {}), {}, keep);
  options.records = &known, allowed = std::numeric_limits<long>::max();
  const DesignResult rest = run_design(problem, options);
  CHECK(rest.rho == whole.rho);
  CHECK(rest.evaluations == whole.evaluations);
  CHECK(rest.simulations == whole.simulations - part.evaluations);
}

TEST_CASE("least squares keeps to max_evaluations and to the tolerance", "[synthesis]") {
  Problem problem = eighteen_points();
  problem.design->optimizer.max_evaluations = 3;
  const DesignResult limited = run_design(problem, without_comparison());
  CHECK(limited.status == SolverStatus::iteration_limit);
  CHECK(limited.evaluations == 3);
  CHECK_THAT(limited.message, Contains("3 evaluations"));
  problem.design->optimizer.max_evaluations.reset();
  const DesignResult fine = run_design(problem, without_comparison());
  problem.design->optimizer.tolerance = 10;  // of the sum of squares: 1e-3
  const DesignResult coarse = run_design(problem, without_comparison());
  CHECK(coarse.ok());
  CHECK(coarse.evaluations < fine.evaluations);
}

TEST_CASE("least squares whose steps end where a weight is negative has not converged", "[synthesis]") {
  Problem problem = eighteen_points();
  for (ObjectiveSpec& objective : problem.objectives)
    for (TrackTerm& term : objective.track) term.weight = Expression::parse("coupler - 1.4");
  const DesignResult result = run_design(problem, without_comparison());
  INFO(result.message);
  CHECK(result.status == SolverStatus::no_progress);
  CHECK_THAT(result.message, Contains("a tracked weight is negative"));
}

TEST_CASE("assembly modes are refused where they mean nothing, and their search can be stopped", "[synthesis]") {
  Problem problem = eighteen_points();
  problem.design->multistart.emplace();
  problem.design->multistart->all_branches = true;
  CHECK(optimizer_issues(*problem.design, problem.scene).empty());
  problem.scene.joints.emplace_back().type = "rack_pinion";
  const std::vector<DesignIssue> issues = optimizer_issues(*problem.design, problem.scene);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].path == "joints[4]");
  CHECK_THAT(issues[0].message, Contains("design.multistart.branches"));

  const TemporaryFolder folder;
  const CommandOutcome fit =
      run_command({"validate", MBSOPT_SOURCE_DIR + std::string("/problems/double_pendulum/identify_tumbling.json"),
                   "--set", "identification.multistart={\"starts\": 2, \"branches\": \"all\"}"});
  CHECK(fit.exit_code == kBadInput);
  CHECK_THAT(fit.err, Contains("identification.multistart.branches") && Contains("design.multistart only"));

  DesignOptions options = without_comparison();
  options.mode = 1, options.simulation_progress = [](double) { return false; };
  CHECK(run_design(eighteen_points(), options).status == SolverStatus::stopped);
}

TEST_CASE("eighteen points: least squares ends where the literature does", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed d = designed_points(folder, kLeastSquares);
  INFO(d.outcome.err);
  REQUIRE(d.outcome.exit_code == kDone);
  CHECK(d.result["optimizer"]["status"] == "converged");
  CHECK(d.result["optimizer"]["objective_final"].get<double>() < 0.0099120);
}

TEST_CASE("least squares is refused where there are no squares, or limits", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed limits =
      designed_points(folder, and_also(kLeastSquares, {"--set",
                                                       "design.subject_to=[{\"objective\": \"transmission\", "
                                                       "\"lower\": 0.5}]"}));
  CHECK(limits.outcome.exit_code == kBadInput);
  CHECK_THAT(limits.outcome.err, Contains("design.optimizer.type") && Contains("bounds of variables alone"));
  const Designed squares = designed_points(folder, and_also(kLeastSquares, {"--set", "design.minimize=transmission"}));
  CHECK(squares.outcome.exit_code == kBadInput);
  CHECK_THAT(squares.outcome.err, Contains("is not a sum of squares"));
}

TEST_CASE("eighteen points: all branches start in both assembly modes, and the result is that of its mode",
          "[synthesis]") {
  const TemporaryFolder folder;
  const Designed d = designed_points(
      folder,
      and_also(kLeastSquares, {"--set", "design.multistart={\"starts\": 3, \"seed\": 1, \"branches\": \"all\"}"}));
  INFO(d.outcome.err);
  REQUIRE(d.outcome.exit_code == kDone);
  const nlohmann::json& waterfall = d.result["multistart"]["waterfall"];
  REQUIRE(waterfall.size() == 6);
  for (const nlohmann::json& record : waterfall) {
    INFO(record.dump());
    CHECK(record["assembly_mode"]["mode"] == record["start"].get<int>() % 2);
  }
  CHECK(d.result["optimizer"]["assembly_mode"]["mode"] == waterfall[0]["assembly_mode"]["mode"]);
  // The written problem has the same value.
  const CommandOutcome again = run_command({"gradient", folder.file("out/optimized.json"), "--out", folder.file("g")});
  INFO(again.err);
  REQUIRE(again.exit_code == kDone);
  CHECK(json_of(folder.path / "g/result.json")["objectives"]["path"]["value"].get<double>() ==
        Approx(d.result["optimizer"]["objective_final"].get<double>()).epsilon(1e-9));
}  // The file's four-bar with a coupler that is too short to reach all points.
Problem open_four_bar() {
  Problem problem = eighteen_points();
  for (Parameter& p : problem.scene.parameters)
    if (p.name == "coupler") p.value = 0.3;
  problem.design->multistart.reset();
  problem.design->optimizer = {};
  problem.design->optimizer.type = "least_squares";
  return problem;
}

TEST_CASE("nearest approach: gradients of defects equal differences where the linkage is open", "[synthesis]") {
  const Problem problem = open_four_bar();
  const auto defects = [&](const Eigen::VectorXd& rho, Eigen::MatrixXd& e_rho) {
    NearestApproach approach(Mechanism(problem.scene, rho), 0);
    Eigen::VectorXd e(18), gradient(rho.size());
    e_rho.resize(18, rho.size());
    for (int k = 0; k < 18; ++k) {
      e(k) = approach.defect(k, gradient);
      e_rho.row(k) = gradient.transpose();
    }
    return e;
  };
  const Eigen::VectorXd rho = parameter_values(problem.scene);
  Eigen::MatrixXd e_rho, unused;
  const Eigen::VectorXd e = defects(rho, e_rho);
  CHECK(e.maxCoeff() > 0.01);
  CHECK(e.minCoeff() == 0);
  const double h = 1e-6;
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const Eigen::VectorXd d = h * Eigen::VectorXd::Unit(rho.size(), k);
    const Eigen::VectorXd difference = (defects(rho + d, unused) - defects(rho - d, unused)) / (2 * h);
    CHECK((difference - e_rho.col(k)).lpNorm<Eigen::Infinity>() < 1e-5);
  }
}

TEST_CASE("a start that does not close is led to one that does, by its closure defects", "[synthesis]") {
  DesignOptions options;
  const Problem problem = open_four_bar();
  const DesignResult result = run_design(problem, options);
  CHECK(result.closing_steps > 0);
  CHECK(result.ok());
  CHECK(result.objective_final < result.objective_initial);
  CHECK(result.variables[1].initial == 0.3);
  CHECK(run_design(eighteen_points(), options).closing_steps == 0);
}
