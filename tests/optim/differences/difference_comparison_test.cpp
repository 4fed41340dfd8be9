#include "optim/differences/difference_comparison.hpp"

#include <catch2/catch.hpp>

#include "optim/design/design.hpp"
#include "optim/fit/identification.hpp"
#include "tests/optim/five_bar.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// f = (a x^2 + b y, sin(y)) at x = 2, y = 0.5, with derivatives of f that may be wrong.
DifferenceComparison comparison(double wrong) {
  DifferenceComparison c;
  c.variables = {{"x", 2}, {"y", 0.5}};
  c.groups = {{"objective 'first'", 0, 1}, {"objective 'second'", 1, 1}};
  const auto f = [](double x, double y) { return Eigen::VectorXd(Eigen::Vector2d(3 * x * x + y, std::sin(y))); };
  c.f = f(2, 0.5);
  c.f_rho = (Eigen::MatrixXd(2, 2) << 12 * (1 + wrong), 1, 0, std::cos(0.5)).finished();
  c.at = [f](std::size_t k, double h) -> std::optional<Eigen::VectorXd> {
    return f(k == 0 ? 2 + h : 2, k == 1 ? 0.5 + h : 0.5);
  };
  return c;
}

// A free five-bar whose spring pulls from t = tp on.
Problem switched(const std::string& switch_law) {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 1;
  testing::add_parameters(problem.scene, {{"tp", 0.4}});
  PointForce pull;
  pull.body = "bar2", pull.point = "to";
  pull.components = {Expression::parse("0"), Expression::parse(switch_law), Expression::parse("0")};
  problem.scene.forces.push_back({"pull", pull});
  problem.design.emplace();
  problem.design->minimize = problem.objectives[0].name, problem.design->variables = {"tp"};
  problem.design->optimizer.max_iterations = 1;
  return problem;
}

std::string joined_lines(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

}  // namespace

TEST_CASE("a derivative that a difference contradicts is named, with both figures", "[design]") {
  CHECK(comparison(0).warnings().empty());
  const std::vector<std::string> said = comparison(0.1).warnings();
  REQUIRE(said.size() == 1);
  CHECK_THAT(said[0], Contains("the derivative of objective 'first' in 'x' is 13.2") && Contains("says 12"));
}

TEST_CASE("variables on their bounds are compared one-sided, those that fail are said", "[design]") {
  DifferenceComparison c = comparison(0.1);
  c.variables[0].below = 0;
  const auto inside = c.at;
  c.at = [inside](std::size_t k, double h) {
    return k == 0 && h < 0 ? std::optional<Eigen::VectorXd>() : inside(k, h);
  };
  CHECK_THAT(joined_lines(c.warnings()), Contains("in 'x' is 13.2"));
  c.variables[0].below = INFINITY;
  CHECK_THAT(joined_lines(c.warnings()), Contains("the derivatives in 'x' were not compared"));
}

TEST_CASE("a design whose variable moves a jump says so by the jump and by a difference", "[design]") {
  Problem jumping = switched("20 + 20*abs(t - tp)/(t - tp)");
  jumping.scene.simulation.follows_kinks = false;
  const DesignResult jumps = run_design(jumping);
  const std::string said = joined_lines(jumps.warnings) + joined_lines(jumps.final_evaluation.warnings);
  CHECK_THAT(said, Contains("the law of force 'pull' jumps by 40") && Contains("depends on 'tp'"));
  CHECK_THAT(said, Contains("design.variables: the derivative of objective") && Contains("in 'tp' is") &&
                       Contains("at the start, but a difference over 0.0004 says -0.0443"));
  const DesignResult smooth = run_design(switched("20 + 20*tanh((t - tp)/0.02)"));
  CHECK_THAT(joined_lines(smooth.warnings), !Contains("difference"));
  CHECK(smooth.final_evaluation.warnings.empty());
}

TEST_CASE("a fit whose unknown moves a jump says so by the jump and by a difference", "[identify]") {
  Problem problem = pendulum::problem(50, 0.5, 2.5, 0);
  testing::add_parameters(problem.scene, {{"tp", 0.4}});
  IdentificationSpec spec;
  spec.experiments = {pendulum::experiment("swing", {})};
  spec.variables = {"w2", "tp"};
  problem.identification = spec;
  problem.scene.simulation.follows_kinks = false;
  const std::vector<CsvTable> data{pendulum::exact_motion(50, 0.5, 2.5, 0, 1)};
  const auto doubts = [&](const std::string& law) {
    Torque torque;
    torque.body = "arm", torque.components = {Expression::parse("0"), Expression::parse("0"), Expression::parse(law)};
    problem.scene.forces.resize(1);
    problem.scene.forces.push_back({"kick", torque});
    return joined_lines(start_of_fit(problem, data).warnings);
  };
  CHECK_THAT(doubts("1e-3*abs(t - tp)/(t - tp)"),
             Contains("the law of force 'kick' jumps by 0.002") && Contains("the derivative of the residuals in 'tp'"));
  CHECK(doubts("1e-3*tanh((t - tp)/0.02)").empty());
}
