// Dimensional synthesis as commands: least squares, every assembly mode.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/json/read_problem.hpp"
#include "app/report/motion_scene.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/start/assembly_equations.hpp"
#include "core/start/nearest_approach.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/problem/start_points.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

constexpr double kPi = std::numbers::pi;

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

Problem synthesis(const std::string& name) {
  return read_problem(MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/") + name + ".json");
}

// From a start of the multistart in the file or values near, and in a mode.
DesignResult designed_from(const std::string& name, int start = 0, std::optional<int> mode = {},
                           const std::map<std::string, double>& near = {}) {
  Problem problem = synthesis(name);
  if (problem.design->multistart) {
    std::vector<Parameter*> designed;
    std::vector<Parameter> parameters;
    for (const std::string& variable : problem.design->variables)
      designed.push_back(&*std::ranges::find(problem.scene.parameters, variable, &Parameter::name));
    for (const Parameter* const p : designed) parameters.push_back(*p);
    const MultistartSpec& spec = *problem.design->multistart;
    const Eigen::VectorXd values = start_values(parameters, spec, *spec.seed)[static_cast<std::size_t>(start)];
    for (std::size_t k = 0; k < designed.size(); ++k) designed[k]->value = values(static_cast<Eigen::Index>(k));
    problem.design->multistart.reset();
  }
  for (const auto& [parameter, value] : near)
    std::ranges::find(problem.scene.parameters, parameter, &Parameter::name)->value = value;
  DesignOptions options = without_comparison();
  options.mode = mode;
  return run_design(problem, options);
}

using Values = std::map<std::string, double>;

Values values_of(const DesignResult& design) {
  Values values;
  for (const DesignVariable& v : design.variables) values[v.name] = v.value;
  return values;
}

void check_values(const DesignResult& design, const Values& expected) {
  const Values found = values_of(design);
  for (const auto& [name, value] : expected) {
    INFO(name << " " << found.at(name));
    CHECK(std::abs(found.at(name) - value) < 1e-9);
  }
}

// The linkage of which nine_points.csv and five_poses.csv are points and poses.
const Values kKnown{{"Ax", 0},      {"Ay", 0},     {"Bx", 3},   {"By", 0.5}, {"crank", 1},
                    {"spare", 1.2}, {"skew", 0.2}, {"Px", 1.5}, {"Py", 1.3}};

}  // namespace

TEST_CASE("nine points, free timing: the known linkage is recovered, and its cognate by Roberts", "[synthesis]") {
  const DesignResult design = designed_from("nine_points");
  CHECK(design.status == SolverStatus::converged);
  CHECK(design.objective_final < 1e-22);
  check_values(design, kKnown);
  // The cognate turns about the third pivot, A + (B - A) p/coupler with p = Px + i Py.
  const std::complex<double> A{0, 0}, B{3, 0.5}, p{1.5, 1.3};
  const double g = std::abs(B - A), coupler = (g + 1 + 1.2 + 0.2 * (g - 1)) / 2;
  const std::complex<double> third = A + (B - A) * p / coupler;
  const DesignResult other = designed_from("nine_points", 25, 1);
  CHECK(other.objective_final < 1e-22);
  check_values(other, {{"Ax", third.real()}, {"Ay", third.imag()}, {"Bx", 3}, {"By", 0.5}});
}

// exp(-100 sin(mu)) is of the size of 1e-33, far below any atol.
TEST_CASE("a solved run integrates the exponential of a smooth minimum to rtol", "[synthesis]") {
  const TemporaryFolder folder;
  const CommandOutcome run =
      run_command({"simulate", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points.json"), "--out",
                   folder.file("run")});
  INFO(run.err);
  REQUIRE(run.exit_code == kDone);
  CHECK_THAT(run.err, !Contains("do not resolve"));
  const nlohmann::json simulation = json_of(folder.path / "run/result.json")["simulation"];
  CHECK(simulation["solve"] == "kinematics");
  CHECK(simulation["extreme_quadrature_error"].get<double>() < 1e-5);
}

TEST_CASE("the instants of free timing are stored; a motion that ends is shown up to there", "[synthesis]") {
  const TemporaryFolder folder;
  Arguments arguments{"simulate", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/nine_points.json"), "--out",
                      folder.file("known")};
  for (const auto& [name, value] : kKnown) {
    arguments.push_back("--set");
    arguments.push_back("parameters." + name + ".value=" + std::to_string(value));
  }
  const CommandOutcome known = run_command(arguments);
  INFO(known.err);
  REQUIRE(known.exit_code == kDone);
  const nlohmann::json path = json_of(folder.path / "known/result.json")["objectives"]["path"];
  REQUIRE(path["instants"].size() == 9);
  for (std::size_t k = 0; k < 9; ++k)
    CHECK(path["instants"][k].get<double>() == Approx(0.3 / (2 * kPi) + 0.1 * static_cast<double>(k)).epsilon(1e-9));

  const std::string term = "\"file\": \"../../data/synthesis/eighteen_points.csv\", \"timing\": \"free\"}";
  const CommandOutcome ends =
      run_command({"simulate", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points.json"), "--out",
                   folder.file("ends"), "--set",
                   "objectives.path={\"track\": [{\"sensor\": \"x\", \"column\": \"x\", " + term + "]}", "--set",
                   "parameters.crank.value=1.2", "--set", "design.optimizer.hessian=\"lbfgs\""});
  CHECK(ends.exit_code == kNumericalFailure);
  CHECK_THAT(ends.err, Contains("the positions cannot be continued beyond"));
  CHECK(std::filesystem::exists(folder.path / "ends/trajectory.csv"));
}

TEST_CASE("a report shows points of free timing at their instants", "[synthesis]") {
  const Problem problem = synthesis("nine_points");
  std::vector<double> backwards;
  for (int k = 0; k < 9; ++k) backwards.push_back(0.9 - 0.1 * k);
  const std::vector<PointTarget> targets = prescribed_points(problem, {backwards});
  REQUIRE(targets.size() == 1);
  const std::vector<double>& x = problem.objectives[0].track[0].curve->y();
  for (std::size_t k = 0; k < 9; ++k) {
    CHECK(targets[0].t[k] == backwards[8 - k]);
    CHECK(targets[0].place[0][k] == x[8 - k]);
  }
  CHECK(prescribed_points(problem).empty());
}

TEST_CASE("five poses, free timing: the known linkage is recovered", "[synthesis]") {
  const DesignResult design = designed_from("five_poses");
  CHECK(design.objective_final < 1e-20);
  check_values(design, kKnown);
  check_values(design, {{"tilt", 0.4}});
}

TEST_CASE("a spatial function generator is recovered from its displacement equation", "[synthesis]") {
  const DesignResult design = designed_from("rssr");
  CHECK(design.objective_final < 1e-22);
  check_values(design,
               {{"crank", 0.6}, {"rocker", 1.1}, {"s1", 0.3}, {"s4", 0.4}, {"twist", 0.5}, {"phi", 0.4}, {"psi", 1.2}});
}

TEST_CASE("five points with timing: the optimum is that of the closed form", "[synthesis]") {
  const DesignResult design = designed_from("five_points");
  CHECK(design.status == SolverStatus::converged);
  // The least that searches on the displacement equation found, outside this project.
  CHECK(design.objective_final == Approx(7.4157513e-7).epsilon(1e-6));
}

TEST_CASE("a function generator beats the three exact points of Freudenstein's equation", "[synthesis]") {
  const DesignResult design = designed_from("logarithm");
  CHECK(design.status == SolverStatus::converged);
  CHECK(design.objective_final < 1.259e-6);
  // K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi)
  const Values v = values_of(design);
  const double a = v.at("crank"), c = v.at("rocker"), phi0 = v.at("phi"), psi0 = v.at("psi");
  const double b2 =
      std::pow(1 + c * std::cos(psi0) - a * std::cos(phi0), 2) + std::pow(c * std::sin(psi0) - a * std::sin(phi0), 2);
  const double K1 = 1 / a, K2 = 1 / c, K3 = (a * a - b2 + c * c + 1) / (2 * a * c);
  double squares = 0, psi = psi0;
  for (int k = 0; k <= 20; ++k) {
    const double phi = phi0 + kPi / 3 * k / 20;
    for (int newton = 0; newton < 20; ++newton) {
      const double off = K1 * std::cos(psi) - K2 * std::cos(phi) + K3 - std::cos(phi - psi);
      psi -= off / (-K1 * std::sin(psi) - std::sin(phi - psi));
    }
    squares += std::pow(psi - psi0 + v.at("zero") - kPi / 2 * std::log2(1 + k / 20.), 2);
  }
  CHECK(design.objective_final == Approx(squares).epsilon(1e-8));
}

TEST_CASE("a six-bar rests within 0.1 degrees while its crank turns by 108", "[synthesis]") {
  const DesignResult design = designed_from("dwell");
  CHECK(design.status == SolverStatus::converged);
  CHECK(std::sqrt(design.objective_final) < 0.1 * kPi / 180);  // no row is further off than the root of the sum
  // The second rocker by intersections of circles.
  using Point = std::complex<double>;
  const Values v = values_of(design);
  const auto meet = [](Point p, double r, Point q, double s, double side) {
    const double d = std::abs(q - p), x = (d * d + r * r - s * s) / (2 * d);
    return p + (q - p) / d * Point(x, side * std::sqrt(r * r - x * x));
  };
  const auto side = [](Point p, Point q, Point z) { return std::imag((z - p) / (q - p)) > 0 ? 1. : -1.; };
  const Point B(v.at("Bx"), v.at("By")), P(v.at("Px"), v.at("Py")), F(v.at("Fx"), v.at("Fy"));
  const Point C0 = std::polar(v.at("crank"), v.at("phase")), D0 = C0 + std::polar(v.at("coupler"), v.at("rise"));
  const Point Q0 = C0 + P * std::polar(1., v.at("rise")), E0(v.at("Ex"), v.at("Ey"));
  double squares = 0;
  for (int k = 0; k <= 16; ++k) {
    const double t = k < 16 ? 0.02 * k : 0.65, target = k < 16 ? 0 : -kPi / 6;
    const Point C = std::polar(v.at("crank"), v.at("phase") + 2 * kPi * t);
    const Point D = meet(C, v.at("coupler"), B, std::abs(D0 - B), side(C0, B, D0));
    const Point Q = C + P * (D - C) / v.at("coupler");
    const Point E = meet(Q, std::abs(E0 - Q0), F, std::abs(E0 - F), side(Q0, F, E0));
    squares += std::pow(std::arg((E - F) / (E0 - F)) + v.at("rest") - target, 2);
  }
  CHECK(design.objective_final == Approx(squares).epsilon(1e-8));
}

TEST_CASE("six points on a line are met exactly, ten on an ellipse within 10 mm of 20 m", "[synthesis]") {
  const DesignResult line = designed_from("six_points", 20, 0);
  CHECK(line.status == SolverStatus::converged);
  CHECK(line.objective_final < 1e-18);
  const DesignResult ellipse = designed_from("ten_points", 0, 1,
                                             {{"Ax", 21.7},
                                              {"Ay", 15.3},
                                              {"Bx", -80},
                                              {"By", -80},
                                              {"crank", 9.7},
                                              {"spare", 11.9},
                                              {"skew", -0.12},
                                              {"Px", 12.5},
                                              {"Py", 3.2}});
  CHECK(ellipse.status == SolverStatus::converged);
  CHECK(ellipse.objective_final < 9.927e-5);
}

TEST_CASE("least squares that is interrupted keeps its best design", "[synthesis]") {
  Problem problem = eighteen_points();
  problem.scene.simulation.solve = Solve::dynamics;
  long calls = 0, allowed = std::numeric_limits<long>::max();
  DesignOptions options = without_comparison();
  options.simulation_progress = [&](double) { return ++calls <= allowed; };
  const DesignResult whole = run_design(problem, options);
  REQUIRE(whole.status == SolverStatus::converged);
  allowed = calls / 2, calls = 0;
  const DesignResult part = run_design(problem, options);
  CHECK(part.status == SolverStatus::stopped);
  REQUIRE(!part.history.empty());
  CHECK(part.objective_final < 0.9 * part.objective_initial);
  CHECK(part.objective_final == Approx(part.history.back().objective));
  CHECK(part.variables[0].value != part.variables[0].initial);
  CHECK(part.evaluations < whole.evaluations);
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

TEST_CASE("least squares stalls where a weight is negative; sqp takes the sum as it is written", "[synthesis]") {
  Problem problem = eighteen_points();
  for (ObjectiveSpec& objective : problem.objectives)
    for (TrackTerm& term : objective.track) term.weight = Expression::parse("coupler - 1.4");
  const DesignResult result = run_design(problem, without_comparison());
  INFO(result.message);
  CHECK_THAT(result.decisions.at(0), Contains("no_progress") && Contains("a tracked weight is negative"));
  CHECK(result.optimizer == "sqp");
  CHECK(result.objective_final < 0);
}

TEST_CASE("assembly modes are refused where they mean nothing, and their search can be stopped", "[synthesis]") {
  Problem problem = eighteen_points();
  problem.design->multistart.emplace();
  problem.design->multistart->all_branches = true;
  CHECK(optimizer_issues(*problem.design, problem.scene).empty());
  problem.scene.joints.emplace_back().type = "rack_pinion";
  const std::vector<SceneIssue> issues = optimizer_issues(*problem.design, problem.scene);
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

TEST_CASE("limits on objectives of any kind hand least squares over to sqp", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed d =
      designed_points(folder, and_also(kLeastSquares, {"--set",
                                                       "design.subject_to=[{\"objective\": \"transmission\", "
                                                       "\"lower\": 0.5}]"}));
  INFO(d.outcome.err);
  REQUIRE(d.outcome.exit_code == kDone);
  const auto& optimizer = d.result["optimizer"];
  CHECK(optimizer["type"] == "sqp");
  CHECK(optimizer["status"] == "converged");
  CHECK(optimizer["objective_final"].get<double>() < 0.00994);
}

TEST_CASE("least squares is refused where there are no squares", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed squares = designed_points(folder, and_also(kLeastSquares, {"--set", "design.minimize=transmission"}));
  CHECK(squares.outcome.exit_code == kBadInput);
  CHECK_THAT(squares.outcome.err, Contains("is not a sum of squares"));
}

TEST_CASE("eighteen points: least squares holds limits of samples, and says their prices", "[synthesis]") {
  Problem problem = eighteen_points();
  ObjectiveBound& sines = problem.design->subject_to.emplace_back();
  sines.sampled = Expression::parse("sin(mu)"), sines.every = 0.5, sines.lower = 0.6;
  const DesignResult result = run_design(problem, without_comparison());
  INFO(result.message);
  REQUIRE(result.constraints.size() == 35);
  CHECK(result.constraints[1].objective == "sin(mu) at 0.5 s");
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.optimality < 1e-4);
  CHECK(result.violation < 1e-6);
  CHECK(result.objective_final > 0.0099120);
  double least = 1, dearest = 0;
  for (const DesignConstraint& c : result.constraints)
    least = std::min(least, c.value), dearest = std::max(dearest, c.price);
  CHECK(least == Approx(0.6).epsilon(1e-5));
  CHECK(dearest > 1e-4);
}

TEST_CASE("eighteen points: nine of ten searches from anywhere end in an optimum", "[synthesis]") {
  long optima = 0, all = 0;
  double least = 1;
  for (int start = 0; start < 10; ++start)
    for (const int mode : {0, 1}) {
      const DesignResult result = designed_from("eighteen_points_starts", start, mode);
      INFO(start << ' ' << mode << ' ' << result.message);
      CHECK((result.status != SolverStatus::converged || result.optimality < 1e-3));
      ++all, optima += result.status == SolverStatus::converged;
      if (result.ok()) least = std::min(least, result.objective_final);
    }
  CHECK(10 * optima >= 9 * all);
  CHECK(least < 0.0099120);
}

TEST_CASE("gradients of limits at instants agree", "[synthesis]") {
  const TemporaryFolder folder;
  const CommandOutcome checked = run_command(
      {"check", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points_starts.json"), "--out",
       folder.file("out"), "--set", "design.subject_to=[{\"sampled\": \"sin(mu)\", \"every\": 6, \"lower\": 0.1}]"});
  INFO(checked.out << checked.err);
  CHECK(checked.exit_code == kDone);
  CHECK_THAT(checked.out, Contains("sin(mu) at 6 s"));
}

TEST_CASE("limits on lengths make a crank turn fully", "[synthesis]") {
  Problem problem = eighteen_points();
  problem.scene.definitions.push_back({"ground", Expression::parse("sqrt((Bx - Ax)^2 + (By - Ay)^2)")});
  for (const char* margin : {"coupler + rocker - ground - crank", "ground + coupler - rocker - crank",
                             "ground + rocker - coupler - crank"}) {
    ObjectiveBound& limit = problem.design->subject_to.emplace_back();
    limit.sampled = Expression::parse(margin), limit.every = 100, limit.lower = 0.05;
  }
  const DesignResult result = run_design(problem, without_comparison());
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  REQUIRE(result.constraints.size() == 3);
  for (const DesignConstraint& c : result.constraints) CHECK(c.value > 0.05 - 1e-6);
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
}

// The file's four-bar with a coupler that is too short to reach all points.
Problem open_four_bar() {
  Problem problem = eighteen_points();
  for (Parameter& p : problem.scene.parameters)
    if (p.name == "coupler") p.value = 0.3;
  problem.design->multistart.reset();
  problem.design->optimizer = {};
  problem.design->optimizer.type = "least_squares";
  return problem;
}

// The spatial function generator with a rod that is too short to let its crank turn.
Problem open_rssr() {
  Problem problem = read_problem(MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/rssr.json"));
  for (Definition& d : problem.scene.definitions)
    if (d.name == "rod") d.value = Expression::parse("0.7*rocker");
  return problem;
}

TEST_CASE("nearest approach: gradients of defects equal differences where the linkage is open", "[synthesis]") {
  const auto [problem, step] = GENERATE(std::pair(open_four_bar(), 1), std::pair(open_rssr(), 2));
  constexpr int kInstants = 18;
  const Eigen::VectorXd rho = parameter_values(problem.scene);
  // tangent: de = Phi'Phi_rho/(|Phi| sqrt(m)) of all equations of the assembly, column by column, at the same
  // positions.
  const auto defects = [&](const Eigen::VectorXd& at, Eigen::MatrixXd* e_rho, Eigen::MatrixXd* tangent) {
    const Mechanism mechanism(problem.scene, at, std::vector<bool>(static_cast<std::size_t>(at.size()), true));
    NearestApproach approach(mechanism, 0);
    Eigen::VectorXd e(kInstants), gradient(at.size());
    for (int k = 0; k < kInstants; ++k) {
      e(k) = approach.defect(step * k, gradient);
      if (!e_rho) continue;
      e_rho->row(k) = gradient.transpose();
      AssemblyEquations equations(mechanism.data(), AssemblyLevel::position, step * k);
      equations.set_angles(approach.angles());
      const Eigen::Index m = mechanism.data().m;
      const Eigen::VectorXd Phi = equations.values_at(approach.y()).head(m);
      const Eigen::MatrixXd Phi_rho = equations.gradients(approach.y()).rho.topRows(m);
      tangent->row(k) = e(k) == 0 ? Eigen::RowVectorXd(Eigen::RowVectorXd::Zero(at.size()))
                                  : Phi.normalized().transpose() * Phi_rho / std::sqrt(static_cast<double>(m));
    }
    return e;
  };
  Eigen::MatrixXd e_rho(kInstants, rho.size()), tangent(kInstants, rho.size());
  const Eigen::VectorXd e = defects(rho, &e_rho, &tangent);
  CHECK(e.maxCoeff() > 0.01);
  CHECK(e.minCoeff() == 0);
  CHECK((e_rho - tangent).lpNorm<Eigen::Infinity>() < 1e-10);
  constexpr double kStationary = 1e-4;  // an approach ends where |Phi| falls by 1e-12, which leaves a root in J'Phi
  const double h = 1e-6;
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const Eigen::VectorXd d = h * Eigen::VectorXd::Unit(rho.size(), k);
    const Eigen::VectorXd difference =
        (defects(rho + d, nullptr, nullptr) - defects(rho - d, nullptr, nullptr)) / (2 * h);
    CHECK((difference - e_rho.col(k)).lpNorm<Eigen::Infinity>() < kStationary);
  }
}

TEST_CASE("a start that does not close is led to one that does, by its closure defects", "[synthesis]") {
  DesignOptions options;
  const Problem problem = open_four_bar();
  const DesignResult result = run_design(problem, options);
  CHECK(result.closing_steps > 0);
  CHECK(result.final_evaluation.ok);
  CHECK(result.objective_final < result.objective_initial);
  CHECK(result.variables[1].initial == 0.3);
  CHECK(run_design(eighteen_points(), options).closing_steps == 0);
}

TEST_CASE("design: values of the file that do not close are led to some that do, with a warning", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed d = designed_points(folder, and_also(kLeastSquares, {"--set", "parameters.crank.value=2"}));
  INFO(d.outcome.out << d.outcome.err);  // the search may be long: it is enough that it has begun
  CHECK_THAT(d.outcome.err, Contains("does not close at the values of the file") && Contains("the design starts at"));
  REQUIRE(d.result.contains("optimizer"));
  CHECK(d.result.at("optimizer").at("objective_final") < d.result.at("optimizer").at("objective_initial"));
  CHECK(d.result.at("parameters").at("crank").at("initial") != 2);
}

TEST_CASE("least squares on a column that is not there: the column is named", "[synthesis]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"validate", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points_starts.json"),
                   "--out", folder.file("out"), "--set", "objectives.path.track[0].column=zz"});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("track[0]") && Contains("has no column 'zz'"));
}
