#include "optim/solver/ipopt_solver.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "optim/solver/optimality.hpp"
#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using mbsopt::testing::vector;

namespace {

struct FreeRosenbrock : NonlinearProgram {
  FreeRosenbrock() : NonlinearProgram(2, 0) {}
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    const double a = 1 - x(0), b = x(1) - x(0) * x(0);
    p.f = a * a + 100 * b * b;
    p.f_x << -2 * a - 400 * x(0) * b, 200 * b;
  }
};

// Hock and Schittkowski, "Test Examples for Nonlinear Programming Codes" (1981), problem 71.
struct FreeHs071 : NonlinearProgram {
  FreeHs071() : NonlinearProgram(4, 2) {
    x_lower.setConstant(1), x_upper.setConstant(5);
    c_lower << 25, 40;
    c_upper(1) = 40;
  }
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    p.f = x(0) * x(3) * (x(0) + x(1) + x(2)) + x(2);
    p.f_x << x(3) * (2 * x(0) + x(1) + x(2)), x(0) * x(3), x(0) * x(3) + 1, x(0) * (x(0) + x(1) + x(2));
    p.c << x.prod(), x.squaredNorm();
    p.c_x.row(0) << x(1) * x(2) * x(3), x(0) * x(2) * x(3), x(0) * x(1) * x(3), x(0) * x(1) * x(2);
    p.c_x.row(1) = 2 * x.transpose();
  }
};

// f = x - log(x), minimum at 1, evaluable for 0.5 <= x only. The first steps from 4 go too far.
struct FreeFragile : NonlinearProgram {
  FreeFragile() : NonlinearProgram(1, 0) {}
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    if (x(0) < 0.5 && throws) throw std::runtime_error("the crank locks");
    if (x(0) < 0.5) {
      p.ok = false, p.message = "the crank locks";
      return;
    }
    p.f = 50 * (x(0) - std::log(x(0)));
    p.f_x << 50 - 50 / x(0);
  }
  bool throws = false;
};

}  // namespace

TEST_CASE("ipopt finds Rosenbrock's minimum and counts what it did", "[ipopt]") {
  FreeRosenbrock problem;
  IpoptOptions options;
  options.tolerance = 1e-8;
  const NlpResult result = solve_with_ipopt(problem, vector({-1.2, 1}), options);
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - vector({1, 1})).norm() < 1e-6);
  CHECK(result.iterations > 5);
  CHECK(result.evaluations >= result.iterations);
  CHECK(result.evaluations < 4 * result.iterations);
  CHECK(result.failed_evaluations == 0);
}

TEST_CASE("ipopt stops at a bound", "[ipopt]") {
  FreeRosenbrock problem;
  problem.x_upper << 0.5, 10;
  const NlpResult result = solve_with_ipopt(problem, vector({-1.2, 1}), {1e-8, 1e-8, 200, 20, {}});
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(0.5).margin(1e-7));
  CHECK(result.x(1) == Approx(0.25).margin(1e-6));
  CHECK(result.x(0) <= 0.5);
}

TEST_CASE("ipopt solves HS071 with an inequality and an equality", "[ipopt]") {
  FreeHs071 problem;
  const NlpResult result = solve_with_ipopt(problem, vector({1, 5, 5, 1}), {1e-8, 1e-8, 100, 20, {}});
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.point.f == Approx(17.0140172891563).epsilon(1e-7));
  CHECK((result.x - vector({1, 4.74299963, 3.82114998, 1.37940829})).norm() < 1e-5);
  CHECK(problem.violation(result.point.c) < 1e-7);
}

TEST_CASE("ipopt recovers from evaluations that fail and reports the first one", "[ipopt]") {
  FreeFragile problem;
  problem.throws = GENERATE(false, true);
  const NlpResult result = solve_with_ipopt(problem, vector({4}), {1e-8, 1e-8, 100, 20, {}});
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(1).epsilon(1e-6));
  CHECK(result.failed_evaluations > 0);
  CHECK(result.first_error == "the crank locks");
}

TEST_CASE("a start point that cannot be evaluated is said in words", "[ipopt]") {
  FreeFragile problem;
  const NlpResult result = solve_with_ipopt(problem, vector({0.1}));
  CHECK(result.status == SolverStatus::failed);
  CHECK(result.message == "the start point cannot be evaluated: the crank locks");
  CHECK(result.x == vector({0.1}));
}

TEST_CASE("ipopt stops on request and keeps the best point", "[ipopt]") {
  FreeRosenbrock problem;
  std::vector<double> seen;
  IpoptOptions options;
  options.progress = [&](const NlpProgress& p) {
    seen.push_back(p.f);
    CHECK(p.x.size() == 2);
    return p.iteration < 5;
  };
  const NlpResult result = solve_with_ipopt(problem, vector({-1.2, 1}), options);
  CHECK(result.status == SolverStatus::stopped);
  REQUIRE(seen.size() == 6);
  CHECK(seen.front() == Approx(24.2));
  CHECK(result.point.f <= seen.back());
  CHECK(result.point.f < 24.2);
}

TEST_CASE("ipopt says when it runs out of iterations", "[ipopt]") {
  FreeRosenbrock problem;
  const NlpResult result = solve_with_ipopt(problem, vector({-1.2, 1}), {1e-8, 1e-8, 3, 20, {}});
  CHECK(result.status == SolverStatus::iteration_limit);
  CHECK(result.message == "stopped at the limit of 3 iterations");
}

TEST_CASE("constraints that contradict each other are infeasible", "[ipopt]") {
  FreeHs071 problem;
  problem.c_lower(0) = 2000;  // the product of four numbers up to 5 is at most 625
  const NlpResult result = solve_with_ipopt(problem, vector({1, 5, 5, 1}), {1e-6, 1e-8, 300, 20, {}});
  CHECK(result.status == SolverStatus::infeasible);
}

// l <= 0.4 keeps both limits from holding. Their sum is least at k = 0.6, where the second one holds; their maximum is
// least at k = 1.12, where the bound does not matter for the sum.
TEST_CASE("an infeasible program ends where the sum of its violations is least, with the bound in conflict",
          "[ipopt]") {
  struct Corner : NonlinearProgram {
    Corner() : NonlinearProgram(2, 2) {
      x_lower.setZero(), x_upper << 5, 0.4;
      c_upper(0) = -1, c_lower(1) = -1;
    }
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      const double k = x(0), l = x(1);
      p.f = k * k, p.f_x << 2 * k, 0;
      p.c << -(l + 0.5 * k) / 2, -(l + k);
      p.c_x << -0.25, -0.5, -1, -1;
    }
  };
  Corner problem;
  const NlpResult result = solve_with_ipopt(problem, vector({2, 0.1}));
  CHECK(result.status == SolverStatus::infeasible);
  CHECK((result.x - vector({0.6, 0.4})).norm() < 1e-3);
  const Conflict found = conflict(problem, result.x, result.point, 1e-8);
  CHECK(found.of_constraints(0) == 1);
  CHECK(found.of_constraints(1) == Approx(-0.25).epsilon(1e-6));
  CHECK(found.of_bounds(1) == Approx(0.25).epsilon(1e-6));
  CHECK(found.residual < 1e-6);
}

TEST_CASE("a start that is optimal already is left as it is", "[ipopt]") {
  FreeRosenbrock problem;
  const NlpResult result = solve_with_ipopt(problem, vector({1, 1}));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x == vector({1, 1}));
  CHECK(result.evaluations == 1);
  problem.x_upper << 0.5, 0.25;  // at the bounds: the objective falls only beyond them
  const NlpResult bounded = solve_with_ipopt(problem, vector({0.5, 0.25}));
  CHECK(bounded.x == vector({0.5, 0.25}));
  CHECK(bounded.evaluations == 1);
}

TEST_CASE("a warm start stays near, at its bounds and limits, and needs fewer iterations", "[ipopt]") {
  FreeHs071 hs071;
  FreeRosenbrock valley;
  valley.x_upper << 0.5, 10;
  const bool of_hs071 = GENERATE(true, false);
  NonlinearProgram& problem = of_hs071 ? static_cast<NonlinearProgram&>(hs071) : valley;
  const Eigen::VectorXd start = of_hs071 ? vector({1, 4.743, 3.821, 1.3794}) : vector({0.5, 0.2502});
  const auto run = [&](bool warm) {
    double farthest = 0;
    IpoptOptions options;
    options.warm_start = warm;
    options.progress = [&](const NlpProgress& p) {
      farthest = std::max(farthest, (p.x - start).cwiseAbs().maxCoeff());
      return true;
    };
    const NlpResult result = solve_with_ipopt(problem, start, options);
    CHECK(result.status == SolverStatus::converged);
    return std::pair{result, farthest};
  };
  const auto [cold, away] = run(false);
  const auto [warm, near] = run(true);
  INFO(cold.iterations << " iterations cold, " << warm.iterations << " warm; " << away << " and " << near << " away");
  CHECK((warm.x - cold.x).norm() < 1e-5);
  CHECK(2 * warm.iterations <= cold.iterations + 1);
  CHECK(near < 1e-3);
  CHECK(away > 1e-2);
}

TEST_CASE("ipopt leaves negative curvature by what the gradients tell", "[ipopt]") {
  // Curves down within 0.2 of 0 along x, 1000 times as strong as it curves up elsewhere.
  struct Ridge : NonlinearProgram {
    Ridge() : NonlinearProgram(2, 0) {}
    static double bump(double x) { return std::exp(-50 * x * x); }
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      p.f = x.squaredNorm() / 2 + 20 * bump(x(0));
      p.f_x = x;
      p.f_x(0) -= 2000 * x(0) * bump(x(0));
    }
    bool hessians(const Eigen::VectorXd& x, std::vector<Eigen::MatrixXd>& H) override {
      H.assign(1, Eigen::MatrixXd::Identity(2, 2));
      H[0](0, 0) += (200000 * x(0) * x(0) - 2000) * bump(x(0));
      return true;
    }
  } ridge;
  ridge.x_lower = Eigen::Vector2d(-3, -3), ridge.x_upper = Eigen::Vector2d(3, 3);
  IpoptOptions options;
  options.second_order = true;
  const NlpResult result = solve_with_ipopt(ridge, Eigen::Vector2d(0.001, 1), options);
  INFO(result.message << " " << result.iterations);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.iterations <= 20);
  CHECK(std::abs(result.x(0)) == Approx(std::sqrt(std::log(2000.0) / 50)).epsilon(1e-6));
  CHECK(result.x(1) == Approx(0).margin(1e-6));
}

TEST_CASE("ipopt says where noise is all that is left", "[ipopt]") {
  // Values and gradients carry noise, as those of simulations do.
  struct Noisy : NonlinearProgram {
    explicit Noisy(double size) : NonlinearProgram(1, 0), noise(size) {}
    double noise;
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      p.f = 1 + x(0) * x(0) / 2 + 1e-4 * noise * std::sin(1e9 * x(0));
      p.f_x = x;
      p.f_x(0) += noise * (2 + std::sin(1e9 * x(0)));
    }
    bool hessians(const Eigen::VectorXd&, std::vector<Eigen::MatrixXd>& H) override {
      H.assign(1, Eigen::MatrixXd::Identity(1, 1));
      return true;
    }
  };
  IpoptOptions options;
  options.second_order = GENERATE(false, true);
  Noisy little(1e-5), much(1e-3);
  const NlpResult in_noise = solve_with_ipopt(little, Eigen::VectorXd::Constant(1, 1.0), options);
  INFO(in_noise.message << " " << in_noise.iterations);
  CHECK(in_noise.status == SolverStatus::converged);
  CHECK(in_noise.iterations < 40);
  const NlpResult lost = solve_with_ipopt(much, Eigen::VectorXd::Constant(1, 1.0), options);
  INFO(lost.message << " " << lost.iterations);
  CHECK(lost.iterations < 60);
}

TEST_CASE("ipopt mends Gauss-Newton's Hessian where residuals stay large", "[ipopt]") {
  // r = (x + 1, lambda x^2 + x - 1), Powell's example (Fletcher, "Practical Methods of Optimization", 2nd ed., section
  // 6.1): J'J is about half of f_xx at the minimum 0, so that its own steps overshoot.
  struct LargeResidual : NonlinearProgram {
    LargeResidual() : NonlinearProgram(1, 0) {}
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      const double a = x(0) + 1, b = lambda * x(0) * x(0) + x(0) - 1, b_x = 2 * lambda * x(0) + 1;
      p.f = (a * a + b * b) / 2;
      p.f_x << a + b * b_x;
    }
    bool hessians(const Eigen::VectorXd& x, std::vector<Eigen::MatrixXd>& H) override {
      const double b_x = 2 * lambda * x(0) + 1;
      H.assign(1, Eigen::MatrixXd::Constant(1, 1, 1 + b_x * b_x));
      return true;
    }
    double lambda = -0.9;  // f_xx(0) = 2 + 1.8
  } problem;
  IpoptOptions options;
  options.second_order = true;
  const NlpResult plain = solve_with_ipopt(problem, vector({0.3}), options);
  options.gauss_newton = true;
  const NlpResult mended = solve_with_ipopt(problem, vector({0.3}), options);
  INFO(plain.iterations << " iterations plain, " << mended.iterations << " mended");
  CHECK(mended.status == SolverStatus::converged);
  CHECK(mended.x(0) == Approx(0).margin(1e-6));
  CHECK(2 * mended.iterations <= plain.iterations);
}

namespace {

// f = exp(x) - x, and its exact Hessian.
struct Convex : NonlinearProgram {
  Convex() : NonlinearProgram(1, 0) {}
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    ++evaluated;
    p.f = std::exp(x(0)) - x(0);
    p.f_x << std::exp(x(0)) - 1;
  }
  bool hessians(const Eigen::VectorXd& x, std::vector<Eigen::MatrixXd>& H) override {
    ++asked;
    H.assign(1, Eigen::MatrixXd::Constant(1, 1, std::exp(x(0))));
    return true;
  }
  int evaluated = 0, asked = 0;
};

int newton_iterations(double x) {
  int count = 0;
  for (; std::abs(std::exp(x) - 1) > 1e-6; ++count) x -= (std::exp(x) - 1) / std::exp(x);
  return count;
}

}  // namespace

TEST_CASE("ipopt: each step with an exact Hessian is an iteration", "[ipopt]") {
  Convex problem;
  const double start = 2;
  const int newton = newton_iterations(start);
  IpoptOptions options;
  options.second_order = true;
  std::vector<double> told, visited;
  options.progress = [&](const NlpProgress& p) {
    return told.push_back(p.optimality), visited.push_back(p.x(0)), true;
  };
  const NlpResult result = solve_with_ipopt(problem, vector({start}), options);
  INFO(result.iterations << " iterations, " << newton << " of Newton's method");
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.iterations <= newton + 1);
  CHECK(problem.asked == result.iterations);
  CHECK(result.evaluations == problem.evaluated);
  REQUIRE(static_cast<int>(told.size()) == result.iterations + 1);
  CHECK(result.evaluations == result.iterations + 1);  // and no other point was
  CHECK(visited.back() == result.x(0));
  CHECK(told.front() == Approx(std::exp(start) - 1));
  CHECK(told.back() == Approx(std::abs(result.point.f_x(0))));
}
