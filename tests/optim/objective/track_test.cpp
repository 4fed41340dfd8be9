// Objectives that follow the samples of a file, or have a table of time.
#include <catch2/catch.hpp>
#include <cmath>

#include "optim/objective/evaluator.hpp"
#include "optim/objective/gauss_newton.hpp"
#include "optim/objective/problem_issues.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;
using Eigen::VectorXd;

namespace {

// A mass on a slide along x under a constant force: x = p t^2/2.
Problem slide() {
  Problem problem;
  problem.scene = pushed_cart("p", 1, 1e-10);
  Scene& s = problem.scene;
  add_parameters(s, {{"p", 3.0}, {"w", 2.0}});
  Sensor x;
  x.name = "x", x.quantity = "displacement", x.joint = "slide";
  s.sensors = {x};
  TrackTerm term;
  term.sensor = "x", term.weight = f("w^2");
  term.curve = std::make_shared<const Curve>(Interpolation::linear, std::vector{0.2, 0.5, 1.0, 1.5},
                                             std::vector{0.1, 0.3, 1.2, 9.0});
  ObjectiveSpec track;
  track.name = "path", track.track = {term};
  problem.objectives = {track};
  return problem;
}

}  // namespace

TEST_CASE("track is the sum of weighted squares at the rows within the run, with exact gradients", "[objective]") {
  const Problem problem = slide();
  EvaluatorOptions options;
  options.method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint, GradientMethod::differences);
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  const VectorXd start = evaluator.start();
  const Evaluation& e = evaluator.gradients(start);
  INFO(e.message);
  REQUIRE(e.ok);
  double value = 0, slope = 0;
  for (const auto& [t, d] : {std::pair{0.2, 0.1}, {0.5, 0.3}, {1.0, 1.2}}) {
    const double off = 3 * t * t / 2 - d;
    value += 4 * off * off, slope += 8 * off * t * t / 2;
  }
  CHECK(e.psi(0) == Approx(value));
  CHECK(e.psi_rho(0, 0) == Approx(slope));
  CHECK(e.psi_rho(0, 1) == Approx(value));  // 2 w/w^2 of the value, w = 2
}

TEST_CASE("the integral of a table of time is exact: steps end at its kinks", "[objective]") {
  Problem problem = slide();
  ObjectiveSpec area;
  area.name = "area", area.running = f("0*x + table(t, [0, 0.3, 0.7, 1], [p, 5, -1, w])");
  problem.objectives = {area};
  EvaluatorOptions options;
  options.method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint);
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  const Evaluation& e = evaluator.gradients(evaluator.start());
  INFO(e.message);
  REQUIRE(e.ok);
  CHECK(e.psi(0) == Approx(0.15 * (3 + 5) + 0.2 * (5 - 1) + 0.15 * (-1 + 2)).epsilon(1e-13));
  CHECK(e.psi_rho(0, 0) == Approx(0.15).epsilon(1e-13));
  CHECK(e.psi_rho(0, 1) == Approx(0.15).epsilon(1e-13));
}

TEST_CASE("Gauss-Newton's matrix of a track is that of its residuals", "[objective]") {
  const Problem problem = slide();
  Evaluator evaluator(problem.scene, objectives_of(problem));
  const Evaluation e = evaluator.gradients(evaluator.start());
  const Hessians found = gauss_newton(evaluator, e);
  INFO(found.message);
  REQUIRE(found.ok);
  double expected = 0;
  for (const double t : {0.2, 0.5, 1.0}) expected += 2 * 4 * std::pow(t * t / 2, 2);
  CHECK(found.of[0].value(0, 0) == Approx(expected));
}

TEST_CASE("rows of a track outside the run are named", "[objective]") {
  Problem problem = slide();
  const auto issues = find_issues(problem);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].is_warning);
  CHECK(issues[0].path == "objectives.path.track[0].file");
  CHECK_THAT(issues[0].message, Contains("only 3 of its 4 rows"));
  problem.scene.simulation.start_time = 0.1, problem.scene.simulation.end_time = 0.15;
  CHECK_THAT(find_issues(problem).at(0).message, Contains("has no row within the run"));
  problem.objectives[0].track[0].unit = "rad";
  CHECK_THAT(find_issues(problem).at(0).message, Contains("is in rad, the sensor 'x' in m"));
}
