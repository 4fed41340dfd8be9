// Least squares within limits: published minima of Hock and Schittkowski, "Test Examples for Nonlinear Programming
// Codes" (1981), and of More, Garbow and Hillstrom, ACM Transactions on Mathematical Software 7 (1981) 17.
#include "optim/solver/multipliers.hpp"

#include <catch2/catch.hpp>
#include <cmath>
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

// Brown and Dennis: 20 residuals of which 85822.2 is left.
Squares brown_and_dennis() {
  return {4, 20, [](const VectorXd& x, VectorXd& z, MatrixXd& J) {
            for (int i = 0; i < 20; ++i) {
              const double t = (i + 1) / 5.0, a = x(0) + t * x(1) - std::exp(t),
                           b = x(2) + std::sin(t) * x(3) - std::cos(t);
              z(i) = a * a + b * b;
              J.row(i) << 2 * a, 2 * a * t, 2 * b, 2 * b * std::sin(t);
            }
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

TEST_CASE("large residuals: the learnt second-order term takes fewer evaluations to a published minimum", "[limits]") {
  Squares plain = brown_and_dennis(), learnt = brown_and_dennis();
  LeastSquaresOptions options;
  options.tolerance = 1e-14, options.max_iterations = 1000;
  const VectorXd start = vector({25, 5, -5, -1});
  const LeastSquaresResult by_squares = solve_least_squares(plain, start, options);
  options.large_residuals = true;
  const LeastSquaresResult by_both = solve_least_squares(learnt, start, options);
  CHECK(2 * by_both.cost_final == Approx(85822.2016).epsilon(1e-8));
  const VectorXd gradient = by_both.point.z_x.transpose() * by_both.point.z;
  CHECK(gradient.norm() < 1e-4 * by_both.point.z_x.norm() * by_both.point.z.norm());
  INFO(learnt.calls << " of " << plain.calls);
  CHECK(learnt.calls < plain.calls);
  CHECK(by_squares.cost_final >= by_both.cost_final * (1 - 1e-10));
}

TEST_CASE("large residuals: what one search has learnt shortens the next", "[limits]") {
  Squares problem = brown_and_dennis();
  LearntCurvature learnt(4);
  LeastSquaresOptions options;
  options.large_residuals = true, options.tolerance = 1e-6, options.max_iterations = 1000;
  options.learnt = &learnt;
  const VectorXd reached = solve_least_squares(problem, vector({25, 5, -5, -1}), options).x;
  options.tolerance = 1e-14;
  const LeastSquaresResult next = solve_least_squares(problem, reached, options);
  CHECK(2 * next.cost_final == Approx(85822.2016).epsilon(1e-8));
  options.learnt = nullptr;
  const LeastSquaresResult anew = solve_least_squares(problem, reached, options);
  INFO(next.evaluations << " of " << anew.evaluations);
  CHECK(next.evaluations < anew.evaluations);
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
