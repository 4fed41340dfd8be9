#include "optim/solver/stationary_point.hpp"

#include <catch2/catch.hpp>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The values of f have an error that the derivatives do not have; x <= 1.
struct Noisy : NonlinearProgram {
  Noisy() : NonlinearProgram(1, 1) { c_upper(0) = 1; }
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    const double a = x(0) - 0.5;
    p.f = 7 + a * a + (a > 0 ? 0 : 1e-7), p.f_x << 2 * a;
    p.c = x, p.c_x << 1;
  }
};

}  // namespace

TEST_CASE("of points as good as the best the most stationary one is the solution", "[stationary_point]") {
  Noisy problem;
  SolverOutcome outcome;
  EvaluatedPoints points(problem, outcome, 1e-8);
  StationaryPoint solution(problem, points, 1e-6, 1e-8);
  const auto look = [&](double x) { return solution.look(points.at(vector({x}), Wanted::derivatives)); };
  CHECK_FALSE(solution.found());
  CHECK(look(0.6) == Approx(0.2));
  CHECK(look(0.4999) == Approx(2e-4));  // stationary within noise, though f is higher than at the next point
  CHECK(look(0.5002) == Approx(4e-4));
  CHECK(look(0.51) > 1);  // f is worse than noise explains
  CHECK(points.best_x()(0) == 0.5002);
  REQUIRE(solution.found());
  CHECK(solution.x()(0) == 0.4999);
  CHECK(solution.distance() == Approx(2e-4));
}
