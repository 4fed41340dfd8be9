// Least squares within limits: published minima of Hock and Schittkowski, "Test Examples for Nonlinear Programming
// Codes" (1981).
#include "optim/solver/limit_multipliers.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

struct Squares : LeastSquaresProblem {
  using Function = std::function<void(const VectorXd& x, VectorXd& z, MatrixXd& z_x)>;
  Squares(Eigen::Index variables, Eigen::Index rows, Function function)
      : LeastSquaresProblem(variables, rows), f(std::move(function)) {}
  void evaluate(const VectorXd& x, LeastSquaresPoint& p) override { ++calls, f(x, p.z, p.z_x); }
  Function f;
  long calls = 0;
};

// HS22: min (x1 - 2)^2 + (x2 - 1)^2, x1 + x2 <= 2, x2 - x1^2 >= 0.
Squares hs22() {
  return {2, 4, [](const VectorXd& x, VectorXd& z, MatrixXd& J) {
            z << x(0) - 2, x(1) - 1, x(0) + x(1), x(1) - x(0) * x(0);
            J << 1, 0, 0, 1, 1, 1, -2 * x(0), 1;
          }};
}

}  // namespace

TEST_CASE("least squares within limits: a published minimum, from a point beyond them", "[limits]") {
  Squares problem = hs22();
  const LeastSquaresResult found =
      solve_within_limits(problem, vector({-kUnlimited, 0}), vector({2, kUnlimited}), vector({2, 2}));
  INFO(found.message);
  CHECK(found.status == SolverStatus::converged);
  CHECK((found.x - vector({1, 1})).norm() < 1e-6);
  CHECK(2 * found.cost_final == Approx(1).epsilon(1e-6));
  CHECK(found.point.z.tail(2).isApprox(vector({2, 0}), 1e-6));
  CHECK(found.evaluations == problem.calls);
}

TEST_CASE("least squares within limits: limits that do not bind change nothing", "[limits]") {
  Squares problem = hs22();
  const LeastSquaresResult found =
      solve_within_limits(problem, vector({-kUnlimited, -kUnlimited}), vector({9, kUnlimited}), vector({0, 0}));
  CHECK(found.status == SolverStatus::converged);
  CHECK((found.x - vector({2, 1})).norm() < 1e-9);
}

TEST_CASE("least squares within limits: limits against each other are infeasible", "[limits]") {
  Squares problem = hs22();
  LeastSquaresOptions options;
  options.max_iterations = 1000;
  const LeastSquaresResult found =
      solve_within_limits(problem, vector({-kUnlimited, 1}), vector({-3, kUnlimited}), vector({0, 0}), options);
  INFO(found.message);
  CHECK(found.status == SolverStatus::infeasible);
}

TEST_CASE("least squares within limits: rounds end in front of points that fail", "[limits]") {
  struct Walled : LeastSquaresProblem {
    Walled() : LeastSquaresProblem(2, 3) { is_integrated = false; }
    void evaluate(const VectorXd& x, LeastSquaresPoint& p) override {
      if (x(0) < 1) throw std::runtime_error("does not close");
      p.z << x(0), x(1) - x(0) * x(0), x(0) + x(1);
      p.z_x << 1, 0, -2 * x(0), 1, 1, 1;
    }
  } problem;
  LeastSquaresOptions options;
  options.max_iterations = 1000;
  const LeastSquaresResult found =
      solve_within_limits(problem, vector({-kUnlimited}), vector({1e3}), vector({3, 3}), options);
  INFO(found.message);
  CHECK(found.status == SolverStatus::no_progress);
  CHECK(found.x(0) == Approx(1).epsilon(1e-2));
  CHECK(found.message.find("does not close") != std::string::npos);
  CHECK(found.message.find("integrator") == std::string::npos);
  CHECK(found.evaluations < 100);
}
