// Least squares with equations between the variables: published minima of Hock and Schittkowski, "Test Examples for
// Nonlinear Programming Codes" (1981).
#include "optim/solver/multipliers.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Constrained : LeastSquaresProblem {
  using Function = std::function<void(const VectorXd& x, VectorXd& z, MatrixXd& z_x)>;
  Constrained(VectorXd start, Eigen::Index residuals, Eigen::Index equations, Function function)
      : LeastSquaresProblem(start.size(), residuals + equations), x0(std::move(start)), f(std::move(function)) {
    equalities = equations;
  }
  void evaluate(const VectorXd& x, LeastSquaresPoint& p) override { ++calls, f(x, p.z, p.z_x); }
  VectorXd x0;
  Function f;
  long calls = 0;
};

// HS6: min (1 - x1)^2, 10 (x2 - x1^2) = 0.
Constrained hs6() {
  return {vector({-1.2, 1}), 1, 1, [](const VectorXd& x, VectorXd& z, MatrixXd& J) {
            z << 1 - x(0), 10 * (x(1) - x(0) * x(0));
            J << -1, 0, -20 * x(0), 10;
          }};
}

// HS42: min |x - (1, 2, 3, 4)|^2, x1 = 2, x3^2 + x4^2 = 2.
Constrained hs42() {
  return {vector({1, 1, 1, 1}), 4, 2, [](const VectorXd& x, VectorXd& z, MatrixXd& J) {
            z << x(0) - 1, x(1) - 2, x(2) - 3, x(3) - 4, x(0) - 2, x(2) * x(2) + x(3) * x(3) - 2;
            J.topRows(4).setIdentity();
            J.row(4) << 1, 0, 0, 0;
            J.row(5) << 0, 0, 2 * x(2), 2 * x(3);
          }};
}

// HS27 with its square root: min 0.01 (x1 - 1)^2 + (x2 - x1^2)^2, x1 + x3^2 + 1 = 0.
Constrained hs27() {
  return {vector({2, 2, 2}), 2, 1, [](const VectorXd& x, VectorXd& z, MatrixXd& J) {
            z << 0.1 * (x(0) - 1), x(1) - x(0) * x(0), x(0) + x(2) * x(2) + 1;
            J << 0.1, 0, 0, -2 * x(0), 1, 0, 1, 0, 2 * x(2);
          }};
}

}  // namespace

TEST_CASE("least squares with equations: published minima", "[equalities]") {
  struct Case {
    Constrained problem;
    double minimum;  // of the sum of squares
  };
  Case cases[] = {{hs6(), 0}, {hs42(), 28 - 10 * std::sqrt(2)}, {hs27(), 0.04}};
  for (Case& c : cases) {
    const LeastSquaresResult result = solve_with_equalities(c.problem, c.problem.x0);
    INFO(result.message << ", " << result.evaluations << " evaluations");
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.point.z.tail(c.problem.equalities).norm() < 1e-5);
    CHECK(2 * result.cost_final == Approx(c.minimum).margin(1e-5));
    CHECK(result.evaluations == c.problem.calls);
    CHECK(result.evaluations < 80);
    VectorXd z(c.problem.size);  // that of x
    MatrixXd z_x(c.problem.size, c.problem.variables());
    c.problem.f(result.x, z, z_x);
    CHECK((z - result.point.z).norm() < 1e-10);
    CHECK((z_x - result.point.z_x).norm() < 1e-10);
  }
}

TEST_CASE("least squares with equations: bounds hold, too", "[equalities]") {
  Constrained problem = hs42();
  problem.x_upper(3) = 1;
  const LeastSquaresResult result = solve_with_equalities(problem, problem.x0);
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - vector({2, 2, 1, 1})).norm() < 1e-5);
}

TEST_CASE("least squares with equations: units of the equations do not matter", "[equalities]") {
  Constrained problem = hs42(), in_other_units = hs42();
  in_other_units.f = [f = problem.f](const VectorXd& x, VectorXd& z, MatrixXd& J) {
    f(x, z, J);
    z(5) *= 1e6, J.row(5) *= 1e6;
  };
  const LeastSquaresResult a = solve_with_equalities(problem, problem.x0),
                           b = solve_with_equalities(in_other_units, problem.x0);
  CHECK(a.evaluations == b.evaluations);
  CHECK((a.x - b.x).norm() < 1e-9);
}
