#include "optim/solver/optimality.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

NlpPoint at(NonlinearProgram& problem, const Eigen::VectorXd& x) {
  NlpPoint p;
  p.f_x.setZero(x.size()), p.c.setZero(problem.constraints()), p.c_x.setZero(problem.constraints(), x.size());
  problem.evaluate(x, p);
  return p;
}

}  // namespace

TEST_CASE("optimality is the scaled gradient where nothing binds", "[optimality]") {
  Rosenbrock problem;
  problem.f_scale = 0.01;
  const auto x = vector({0.5, 0.5});
  CHECK(optimality(problem, x, at(problem, x)) == Approx(0.01 * problem.f_x(x).cwiseAbs().maxCoeff()).epsilon(1e-12));
  CHECK(optimality(problem, vector({1, 1}), at(problem, vector({1, 1}))) == 0);
}

TEST_CASE("a gradient that points out of a touched bound is optimal, one that points inwards is not", "[optimality]") {
  Rosenbrock problem;
  problem.x_upper << 0.5, 0.25;
  CHECK(optimality(problem, problem.x_upper, at(problem, problem.x_upper)) == 0);
  problem.x_upper << 2, 2, problem.x_lower << 0.5, 0.25;
  CHECK(optimality(problem, problem.x_lower, at(problem, problem.x_lower)) == Approx(1));
}

TEST_CASE("multipliers of the constraints are found: HS071 is optimal at its solution and nowhere near it",
          "[optimality]") {
  Hs071 problem;
  const Eigen::VectorXd x = Hs071::solution();
  CHECK(optimality(problem, x, at(problem, x)) < 1e-6);
  // Along both constraints, from the solution: still feasible to second order.
  const auto moved = vector({1.05, 4.74299963, 3.82114998, 1.37940829});
  CHECK(optimality(problem, moved, at(problem, moved)) > 1e-3);
}

TEST_CASE("multipliers are the prices of constraints: those of HS071 are the published ones", "[optimality]") {
  Hs071 problem;
  const Stationarity found = stationarity(problem, Hs071::solution(), at(problem, Hs071::solution()));
  // Hock and Schittkowski 71: 0.55229366 of the product, at its lower bound, 0.16146857 of the sphere
  CHECK(found.multipliers.cwiseAbs().maxCoeff() == Approx(0.55229366).epsilon(1e-5));
  CHECK(found.multipliers.cwiseAbs().minCoeff() == Approx(0.16146857).epsilon(1e-5));
}

TEST_CASE("a conflict names what keeps a violated constraint from holding, with its price", "[optimality]") {
  // x0 + x1 >= 3 is violated, x0 - x1 <= 0.5 and x1 <= 1 bind: 1 = z_c, 1 = -z_c + z_b
  struct Corner : NonlinearProgram {
    Corner() : NonlinearProgram(2, 2) { c_lower(0) = 3, c_upper(1) = 0.5, x_upper(1) = 1; }
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      p.c << x(0) + x(1), x(0) - x(1);
      p.c_x << 1, 1, 1, -1;
    }
  } problem;
  const auto x = vector({1.5, 1});
  const Conflict found = conflict(problem, x, at(problem, x), 1e-8);
  CHECK(found.of_constraints(0) == -1);
  CHECK(found.of_constraints(1) == Approx(1));
  CHECK(found.of_bounds(0) == 0);
  CHECK(found.of_bounds(1) == Approx(2));
  CHECK(found.residual < 1e-12);
  const auto inside = vector({0, 0});
  CHECK(conflict(problem, inside, at(problem, inside), 1e-8).residual == Approx(1));
}

TEST_CASE("a multiplier of the wrong sign is no excuse", "[optimality]") {
  struct Line : Counted {
    Line() : Counted(1, 1) {}
    double f(const Eigen::VectorXd& x) const override { return x(0); }
    Eigen::VectorXd f_x(const Eigen::VectorXd&) const override { return vector({1}); }
    void constraints_at(const Eigen::VectorXd& x, Eigen::VectorXd& c, Eigen::MatrixXd* c_x) const override {
      c << x(0);
      if (c_x) *c_x << 1;
    }
  } problem;
  problem.c_lower(0) = 2;  // holds x back: optimal
  CHECK(optimality(problem, vector({2}), at(problem, vector({2}))) < 1e-12);
  problem.c_lower(0) = -10, problem.c_upper(0) = 2;  // does not
  CHECK(optimality(problem, vector({2}), at(problem, vector({2}))) == Approx(1));
  problem.c_lower(0) = 2 - 1e-4, problem.c_upper(0) = 10;  // not quite touched
  CHECK(optimality(problem, vector({2}), at(problem, vector({2}))) == Approx(1e-4));
}
