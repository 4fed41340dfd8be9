// Tracked points without prescribed timing: nearest instants, and their gradients.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "optim/design/tracked_squares.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/gauss_newton.hpp"
#include "optim/objective/problem_issues.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;
using Eigen::VectorXd;

namespace {

constexpr double kPi = std::numbers::pi;

TrackTerm term(const std::string& sensor, const std::vector<double>& values, const std::string& file = "points.csv") {
  TrackTerm t;
  t.sensor = sensor, t.file = file, t.timing = Timing::free;
  std::vector<double> rows(values.size());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = static_cast<double>(k);
  t.curve = std::make_shared<const Curve>(Interpolation::linear, rows, values);
  return t;
}

// A driven crank of radius r about (c, 0), through a turn per second from angle 0 to the end time; its tip is to meet
// points.
Problem crank(double end_time, const std::vector<double>& x, const std::vector<double>& y) {
  Problem problem;
  Scene& s = problem.scene;
  s.gravity = {0.0, 0.0, 0.0};
  add_parameters(s, {{"r", 2.0}, {"c", 0.5}, {"w", 3.0}});
  s.bodies = {body("crank", vec("c", "0", "0"), vec("0", "0", "0"), turned("0"))};
  s.bodies[0].points = {{"tip", vec("r", "0", "0")}};
  s.joints = {hinge("A", "ground", vec("c", "0", "0"), "crank", vec("0", "0", "0"))};
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "A", motor.law = f("2*pi*t");
  s.drives = {motor};
  for (const char* component : {"x", "y"})
    s.sensors.push_back(point_sensor(component, "position", "crank", "tip", component));
  s.simulation.end_time = end_time, s.simulation.output_step = 0.05;
  ObjectiveSpec path;
  path.name = "path", path.track = {term("x", x), term("y", y)};
  for (TrackTerm& t : path.track) t.weight = f("w");
  problem.objectives = {path};
  return problem;
}

Evaluation evaluated(const Problem& problem, GradientMethod method) {
  EvaluatorOptions options;
  options.method = method;
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  Evaluation e = evaluator.gradients(evaluator.start());
  INFO(e.message);
  REQUIRE(e.ok);
  return e;
}

std::string issues_in_words(const Problem& problem) {
  std::string words;
  for (const auto& issue : find_issues(problem)) words += issue.path + ": " + issue.message + "\n";
  return words;
}

}  // namespace

TEST_CASE("points of free timing have the distance from the curve, with exact gradients", "[objective]") {
  const std::vector<double> x{3.0, -1.0, 0.7}, y{1.0, 2.5, -0.4};
  const Problem problem = crank(1, x, y);
  const GradientMethod method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint, GradientMethod::differences);
  const double error = method == GradientMethod::differences ? 1e-8 : 1e-11;
  const Evaluation e = evaluated(problem, method);
  double value = 0, in_r = 0, in_c = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double d = std::hypot(x[k] - 0.5, y[k]);  // |point - c|, the distance from the circle is d - r
    value += 3 * (d - 2) * (d - 2), in_r -= 6 * (d - 2), in_c -= 6 * (d - 2) * (x[k] - 0.5) / d;
  }
  CHECK(e.psi(0) == Approx(value).epsilon(1e-12));
  CHECK(e.psi_rho(0, 0) == Approx(in_r).epsilon(error));
  CHECK(e.psi_rho(0, 1) == Approx(in_c).epsilon(error));
  CHECK(e.psi_rho(0, 2) == Approx(value / 3).epsilon(error));
}

TEST_CASE("where the curve ends before a point, its end counts", "[objective]") {
  const Problem problem = crank(0.25, {-1.0, 3.0}, {2.0, -1.0});  // a quarter of a turn: from (2.5, 0) to (0.5, 2)
  const Evaluation e = evaluated(problem, GENERATE(GradientMethod::tlm, GradientMethod::adjoint));
  CHECK(e.psi(0) == Approx(3 * (1.5 * 1.5 + 0.5 * 0.5 + 1)).epsilon(1e-12));
  CHECK(e.psi_rho(0, 0) == Approx(6 * (0.0 - 0.5)).epsilon(1e-9));  // the first end moves along y, the second along x
}

TEST_CASE("each point takes the lowest of its minima along the curve", "[objective]") {
  // x of the tip alone passes -1 twice; the second coordinate decides.
  const double angle = 2 * kPi * 0.7;
  const double x = 0.5 + 2 * std::cos(angle), y = 2 * std::sin(angle);
  const Problem problem = crank(1, {x, x}, {y, y});
  const Objective objective = objectives_of(problem).front();
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  for (const auto& instant : objective.instants_of(objective.samples(), mechanism))
    CHECK(instant.time == Approx(0.7).epsilon(1e-12));
}

TEST_CASE("residuals of free timing: the gradient is that of the sum, the instant is projected out", "[objective]") {
  Problem problem = crank(1, {3.0, -1.0, 0.7}, {1.0, 2.5, -0.4});
  problem.design.emplace();
  problem.design->minimize = "path", problem.design->variables = {"r", "c"};
  problem.design->optimizer.type = OptimizerSpec::kLeastSquares;
  DesignProgram program(problem);
  VectorXd rho(2);
  rho << 2.0, 0.5;
  const VectorXd x = program.scaling().to_x(rho);
  program.start_from(x);
  TrackedSquares squares(program);
  LeastSquaresPoint point;
  point.z.setZero(squares.size), point.z_x.setZero(squares.size, 2);
  squares.evaluate(x, point);
  INFO(point.message);
  REQUIRE(point.ok);
  NlpPoint nlp;
  nlp.f_x.setZero(2), nlp.c.setZero(0), nlp.c_x.setZero(0, 2);
  program.evaluate(x, nlp);
  CHECK(point.z.squaredNorm() == Approx(nlp.f).epsilon(1e-12));
  CHECK((2 * point.z_x.transpose() * point.z - nlp.f_x).norm() < 1e-9 * nlp.f_x.norm());
  // With r the tip moves along the radius: nothing of it is projected out at the three points, w = 3.
  CHECK(point.z_x.col(0).norm() == Approx(program.scaling().rho_x(x)(0) * std::sqrt(3 * 3.0)).epsilon(1e-9));
}

namespace {

// The instants of x, one per row.
std::vector<double> met_at(const Problem& problem) {
  const Objective objective = objectives_of(problem).front();
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  std::vector<double> times;
  for (const auto& instant : objective.instants_of(objective.samples(), mechanism)) times.push_back(instant.time);
  times.resize(problem.objectives[0].track[0].curve->x().size());
  return times;
}

Problem points_in_order(double end_time, const std::vector<double>& turns, double radius = 2.1) {
  std::vector<double> x, y;
  for (const double turn : turns)
    x.push_back(0.5 + radius * std::cos(2 * kPi * turn)), y.push_back(radius * std::sin(2 * kPi * turn));
  Problem problem = crank(end_time, x, y);
  for (TrackTerm& t : problem.objectives[0].track) t.timing = Timing::ordered;
  return problem;
}

void check_exact_gradients(const Problem& problem) {
  const Evaluation tlm = evaluated(problem, GradientMethod::tlm), adjoint = evaluated(problem, GradientMethod::adjoint),
                   differences = evaluated(problem, GradientMethod::differences);
  CHECK((tlm.psi_rho - adjoint.psi_rho).norm() < 1e-12 * tlm.psi_rho.norm());
  CHECK((tlm.psi_rho - differences.psi_rho).norm() < 1e-7 * tlm.psi_rho.norm());
}

}  // namespace

TEST_CASE("ordered points that stand in order are met as free ones", "[objective]") {
  const std::vector<double> turns{0.1, 0.3, 0.4, 0.9};
  const std::vector<double> found = met_at(points_in_order(1, turns));
  for (std::size_t k = 0; k < turns.size(); ++k) CHECK(found[k] == Approx(turns[k]).epsilon(1e-10));
  // A circle may begin with any of them.
  const std::vector<double> turned{0.4, 0.9, 0.1, 0.3}, round = met_at(points_in_order(1, turned));
  for (std::size_t k = 0; k < turned.size(); ++k) CHECK(round[k] == Approx(turned[k]).epsilon(1e-10));
}

TEST_CASE("ordered points in the other order share an instant, with exact gradients", "[objective]") {
  // On an open path the second and third row change places: both are met half way.
  const Problem problem = points_in_order(0.9, {0.1, 0.4, 0.3, 0.6});
  const std::vector<double> found = met_at(problem);
  CHECK(found[0] == Approx(0.1).epsilon(1e-10));
  CHECK(found[1] == Approx(0.35).epsilon(1e-10));
  CHECK(found[2] == found[1]);
  CHECK(found[3] == Approx(0.6).epsilon(1e-10));
  check_exact_gradients(problem);
  check_exact_gradients(points_in_order(1, {0.05, 0.3, 0.25, 0.2, 0.8, 0.7}, 1.5));
}

TEST_CASE("hundreds of points of free timing are met at once", "[objective]") {
  std::vector<double> x, y;
  for (int k = 0; k < 400; ++k) x.push_back(0.5 + 2.1 * std::cos(0.0157 * k)), y.push_back(2.1 * std::sin(0.0157 * k));
  const Evaluation e = evaluated(crank(1, x, y), GradientMethod::tlm);
  CHECK(e.psi(0) == Approx(400 * 3 * 0.01).epsilon(1e-9));
}

TEST_CASE("free timing needs positions and drives, and no Gauss-Newton", "[objective]") {
  Problem problem = crank(1, {3.0, 1.0}, {1.0, 2.0});
  CHECK(issues_in_words(problem) == "");
  problem.scene.sensors[0].quantity = "velocity";
  CHECK_THAT(issues_in_words(problem), Contains("no function of positions alone"));
  problem.scene.sensors[0].quantity = "position";
  problem.scene.drives.clear();
  CHECK_THAT(issues_in_words(problem), Contains("there are no drives"));
  problem = crank(1, {3.0, 1.0}, {1.0, 2.0});
  problem.objectives[0].track[1].timing = Timing::ordered;
  CHECK_THAT(issues_in_words(problem), Contains("track[1].timing: is not that of the first term of its file"));
  problem = crank(1, {3.0, 1.0}, {1.0, 2.0});
  Evaluator evaluator(problem.scene, objectives_of(problem));
  const Evaluation e = evaluator.gradients(evaluator.start());
  CHECK_THROWS_WITH(gauss_newton(evaluator, e), Contains("free timing"));
}
