#include "optim/solver/ceres_solver.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

using namespace mbsopt;

namespace {

// Rosenbrock as residuals: z = (1 - x0, 10 (x1 - x0^2)).
struct RosenbrockResiduals : LeastSquaresProblem {
  RosenbrockResiduals() : LeastSquaresProblem(2, 2) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    ++calls;
    p.z << 1 - x(0), 10 * (x(1) - x(0) * x(0));
    p.z_x << -1, 0, -20 * x(0), 10;
  }
  long calls = 0;
};

// One residual, exp(x) - 20, evaluable for x <= 3.5 only; Gauss-Newton from 0 jumps to 19.
struct FragileResidual : LeastSquaresProblem {
  FragileResidual() : LeastSquaresProblem(1, 1) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    if (x(0) > 3.5) throw std::runtime_error("the loop cannot be closed");
    p.z << std::exp(x(0)) - 20;
    p.z_x << std::exp(x(0));
  }
};

// z = 1 + slope x, with a derivative of the wrong sign; the second row keeps the cost off zero.
struct WrongDerivative : LeastSquaresProblem {
  WrongDerivative() : LeastSquaresProblem(1, 2) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    p.z << 1 + x(0), 1;
    p.z_x << -1, 0;
  }
};

// exp(x) - 20 again, evaluable for x <= 2 only: the minimum at 3 lies behind a wall.
struct WalledResidual : LeastSquaresProblem {
  WalledResidual() : LeastSquaresProblem(1, 1) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    if (x(0) > 2) throw std::runtime_error("the loop cannot be closed");
    p.z << std::exp(x(0)) - 20;
    p.z_x << std::exp(x(0));
  }
};

struct OutlyingResidual : LeastSquaresProblem {
  OutlyingResidual() : LeastSquaresProblem(1, 2) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    p.z << x(0), outlier;
    p.z_x << 1, 0;
  }
  double outlier = 0;
};

}  // namespace

TEST_CASE("ceres finds Rosenbrock's minimum with one evaluation per point", "[ceres]") {
  RosenbrockResiduals problem;
  std::vector<LeastSquaresProgress> seen;
  CeresOptions options;
  options.progress = [&](const LeastSquaresProgress& p) {
    seen.push_back(p);
    return true;
  };
  const LeastSquaresResult result = solve_with_ceres(problem, Eigen::Vector2d(-1.2, 1), options);
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - Eigen::Vector2d(1, 1)).norm() < 1e-8);
  CHECK(result.cost_initial == Approx(12.1));
  CHECK(result.evaluations == problem.calls);
  CHECK(result.evaluations <= result.iterations + 4);
  REQUIRE(seen.size() == static_cast<std::size_t>(result.iterations) + 1);
  CHECK(seen.front().x == Eigen::Vector2d(-1.2, 1));
  CHECK(seen.back().cost == Approx(result.cost_final).margin(1e-20));
}

TEST_CASE("ceres keeps within bounds", "[ceres]") {
  RosenbrockResiduals problem;
  problem.x_upper << 0.5, 10;
  const LeastSquaresResult result = solve_with_ceres(problem, Eigen::Vector2d(-1.2, 1));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == 0.5);
  CHECK(result.x(1) == Approx(0.25).margin(1e-6));
}

TEST_CASE("a failed evaluation makes ceres shorten the step", "[ceres]") {
  FragileResidual problem;
  const LeastSquaresResult result = solve_with_ceres(problem, Eigen::VectorXd::Zero(1));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(std::log(20)).epsilon(1e-8));
  CHECK(result.failed_evaluations > 0);
  CHECK(result.first_error == "the loop cannot be closed");
  const LeastSquaresResult bad = solve_with_ceres(problem, Eigen::VectorXd::Constant(1, 5));
  CHECK(bad.status == SolverStatus::failed);
  CHECK(bad.message == "the start point cannot be evaluated: the loop cannot be closed");
}

TEST_CASE("ceres has not converged where no step does what the derivatives promise", "[ceres]") {
  WrongDerivative wrong;
  const LeastSquaresResult first = solve_with_ceres(wrong, Eigen::VectorXd::Zero(1));
  CHECK(first.status == SolverStatus::no_progress);
  CHECK_THAT(first.message, Catch::Contains("promise to lower the cost by 0.5"));
  WalledResidual walled;
  const LeastSquaresResult second = solve_with_ceres(walled, Eigen::VectorXd::Zero(1));
  CHECK(second.status == SolverStatus::no_progress);
  CHECK(second.x(0) <= 2);
  CHECK_THAT(second.message, Catch::Contains("the loop cannot be closed"));
}

TEST_CASE("residuals whose squares are no numbers are refused at the start, in words that speak of the data",
          "[ceres]") {
  OutlyingResidual problem;
  problem.outlier = GENERATE(1e302, 1e200);  // the first is what Ceres takes for a residual not written
  const LeastSquaresResult result = solve_with_ceres(problem, Eigen::VectorXd::Ones(1));
  CHECK(result.status == SolverStatus::failed);
  CHECK_THAT(result.message,
             Catch::Contains("the largest residual is 1e+") && Catch::Contains("in the data, and at sigma"));
}

TEST_CASE("ceres stops on request and at the limit", "[ceres]") {
  RosenbrockResiduals problem;
  CeresOptions options;
  options.progress = [](const LeastSquaresProgress& p) { return p.cost > 10; };
  const LeastSquaresResult stopped = solve_with_ceres(problem, Eigen::Vector2d(-1.2, 1), options);
  CHECK(stopped.status == SolverStatus::stopped);
  CHECK(stopped.cost_final < stopped.cost_initial);
  const LeastSquaresResult limited = solve_with_ceres(problem, Eigen::Vector2d(-1.2, 1), {1e-10, 2, {}});
  CHECK(limited.status == SolverStatus::iteration_limit);
}

TEST_CASE("a refused step is reported with the cost of the point that stays", "[ceres]") {
  FragileResidual problem;
  std::vector<LeastSquaresProgress> seen;
  CeresOptions options;
  options.progress = [&](const LeastSquaresProgress& p) {
    seen.push_back(p);
    return true;
  };
  REQUIRE(solve_with_ceres(problem, Eigen::VectorXd::Zero(1), options).failed_evaluations > 0);
  for (const LeastSquaresProgress& p : seen)
    CHECK(p.cost == Approx(0.5 * std::pow(std::exp(p.x(0)) - 20, 2)).margin(1e-12));
}

TEST_CASE("a loss that is not finite at the start is refused in words", "[ceres]") {
  OutlyingResidual problem;
  problem.outlier = 1, problem.loss = {LossType::cauchy, 1e200};
  const LeastSquaresResult result = solve_with_ceres(problem, Eigen::VectorXd::Ones(1));
  CHECK(result.status == SolverStatus::failed);
  CHECK_THAT(result.message, Catch::Contains("the loss of its residuals is not finite"));
}
