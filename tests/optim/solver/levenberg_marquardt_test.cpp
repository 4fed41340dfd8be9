#include "optim/solver/levenberg_marquardt.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <stdexcept>

#include "tests/optim/solver/test_functions.hpp"

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

// Smooth residuals with jumps, as of a simulation whose sequence of steps changes.
struct JumpingResiduals : LeastSquaresProblem {
  explicit JumpingResiduals(double of_size) : LeastSquaresProblem(2, 3), jump(of_size) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    const double at = 1e12 * (x(0) + x(1));
    p.z << 10 * (x(1) - x(0) * x(0)), 3 + x(0) * x(1), 2 + x(1) * x(1);
    for (Eigen::Index i = 0; i < 3; ++i) p.z(i) += jump * std::sin(std::floor(at) * (1 + static_cast<double>(i)));
    p.z_x << -20 * x(0), 10, x(1), x(0), 0, 2 * x(1);
  }
  double jump;
};

// Of the same function in variables of other units: y = scale x.
struct Rescaled : LeastSquaresProblem {
  Rescaled(testing::TestFunction& function, Eigen::VectorXd y_x)
      : LeastSquaresProblem(function.variables(), function.size), inner(function), scale(std::move(y_x)) {
    x_lower = scale.cwiseProduct(inner.x_lower), x_upper = scale.cwiseProduct(inner.x_upper);
  }
  void evaluate(const Eigen::VectorXd& y, LeastSquaresPoint& p) override {
    inner.evaluate(y.cwiseQuotient(scale), p);
    p.z_x = p.z_x * scale.cwiseInverse().asDiagonal();
  }
  testing::TestFunction& inner;
  Eigen::VectorXd scale;
};

// The cosine between the residuals and a column, zero at a minimum; where a bound holds the variable, 0 if it must.
double uphill(const LeastSquaresProblem& problem, const LeastSquaresResult& result) {
  const Eigen::VectorXd g = result.point.z_x.transpose() * result.point.z;
  double most = 0;
  for (Eigen::Index k = 0; k < g.size(); ++k) {
    const bool held =
        (result.x(k) == problem.x_lower(k) && g(k) >= 0) || (result.x(k) == problem.x_upper(k) && g(k) <= 0);
    const double lengths = result.point.z_x.col(k).norm() * result.point.z.norm();
    if (!held && lengths > 0) most = std::max(most, std::abs(g(k)) / lengths);
  }
  return most;
}

Eigen::Index active_bounds(const LeastSquaresProblem& problem, const Eigen::VectorXd& x) {
  return (x.array() == problem.x_lower.array() || x.array() == problem.x_upper.array()).count();
}

struct OutlyingResidual : LeastSquaresProblem {
  OutlyingResidual() : LeastSquaresProblem(1, 2) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override {
    p.z << x(0), outlier;
    p.z_x << 1, 0;
  }
  double outlier = 0;
};

// The same of residuals with weights.
double uphill_of_pull(const LeastSquaresProblem& problem, const LeastSquaresResult& result) {
  const Eigen::VectorXd w = problem.weights(result.point.z).cwiseSqrt(), z = w.cwiseProduct(result.point.z);
  const Eigen::MatrixXd J = w.asDiagonal() * result.point.z_x;
  return (J.transpose() * z).cwiseQuotient(J.colwise().norm().transpose()).lpNorm<Eigen::Infinity>() / z.norm();
}

}  // namespace

TEST_CASE("the search finds Rosenbrock's minimum with one evaluation per point", "[least_squares]") {
  RosenbrockResiduals problem;
  std::vector<LeastSquaresProgress> seen;
  LeastSquaresOptions options;
  options.progress = [&](const LeastSquaresProgress& p) {
    seen.push_back(p);
    return true;
  };
  const LeastSquaresResult result = solve_least_squares(problem, Eigen::Vector2d(-1.2, 1), options);
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - Eigen::Vector2d(1, 1)).norm() < 1e-8);
  CHECK(result.cost_initial == Approx(12.1));
  CHECK(result.evaluations == problem.calls);
  CHECK(result.evaluations <= result.iterations + 4);
  REQUIRE(seen.size() == static_cast<std::size_t>(result.iterations) + 1);
  CHECK(seen.front().x == Eigen::Vector2d(-1.2, 1));
  CHECK(seen.back().cost == Approx(result.cost_final).margin(1e-20));
}

TEST_CASE("the search keeps within bounds", "[least_squares]") {
  RosenbrockResiduals problem;
  problem.x_upper << 0.5, 10;
  const LeastSquaresResult result = solve_least_squares(problem, Eigen::Vector2d(-1.2, 1));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == 0.5);
  CHECK(result.x(1) == Approx(0.25).margin(1e-6));
}

TEST_CASE("a failed evaluation makes the search shorten the step", "[least_squares]") {
  FragileResidual problem;
  const LeastSquaresResult result = solve_least_squares(problem, Eigen::VectorXd::Zero(1));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(std::log(20)).epsilon(1e-8));
  CHECK(result.failed_evaluations > 0);
  CHECK(result.first_error == "the loop cannot be closed");
  const LeastSquaresResult bad = solve_least_squares(problem, Eigen::VectorXd::Constant(1, 5));
  CHECK(bad.status == SolverStatus::failed);
  CHECK(bad.message == "the start point cannot be evaluated: the loop cannot be closed");
}

TEST_CASE("the search has not converged where no step does what the derivatives promise", "[least_squares]") {
  WrongDerivative wrong;
  const LeastSquaresResult first = solve_least_squares(wrong, Eigen::VectorXd::Zero(1));
  CHECK(first.status == SolverStatus::no_progress);
  CHECK_THAT(first.message, Catch::Contains("promise to lower the cost by 0.5"));
  WalledResidual walled;
  const LeastSquaresResult second = solve_least_squares(walled, Eigen::VectorXd::Zero(1));
  CHECK(second.status == SolverStatus::no_progress);
  CHECK(second.x(0) <= 2);
  CHECK_THAT(second.message, Catch::Contains("the loop cannot be closed"));
}

TEST_CASE("the search ends where jumps of the cost hide what the derivatives promise", "[least_squares]") {
  JumpingResiduals smooth(0);
  const LeastSquaresResult exact = solve_least_squares(smooth, Eigen::Vector2d(3, 2));
  REQUIRE(exact.status == SolverStatus::converged);
  for (const double jump : {1e-9, 1e-7, 1e-5}) {
    JumpingResiduals problem(jump);
    const LeastSquaresResult result = solve_least_squares(problem, Eigen::Vector2d(3, 2));
    INFO(jump << ": " << result.message << ", " << result.evaluations << " against " << exact.evaluations);
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.cost_final == Approx(exact.cost_final).epsilon(10 * jump));
    CHECK(result.evaluations <= exact.evaluations + 5);
  }
}

TEST_CASE("residuals whose squares are no numbers are refused at the start, in words that speak of the data",
          "[least_squares]") {
  OutlyingResidual problem;
  problem.outlier = GENERATE(1e302, 1e200);
  const LeastSquaresResult result = solve_least_squares(problem, Eigen::VectorXd::Ones(1));
  CHECK(result.status == SolverStatus::failed);
  CHECK_THAT(result.message,
             Catch::Contains("the largest residual is 1e+") && Catch::Contains("in the data, and check sigma"));
}

TEST_CASE("the search stops on request and at the limit", "[least_squares]") {
  RosenbrockResiduals problem;
  LeastSquaresOptions options;
  options.progress = [](const LeastSquaresProgress& p) { return p.cost > 10; };
  const LeastSquaresResult stopped = solve_least_squares(problem, Eigen::Vector2d(-1.2, 1), options);
  CHECK(stopped.status == SolverStatus::stopped);
  CHECK(stopped.cost_final < stopped.cost_initial);
  const LeastSquaresResult limited = solve_least_squares(problem, Eigen::Vector2d(-1.2, 1), {1e-10, 2, {}});
  CHECK(limited.status == SolverStatus::iteration_limit);
}

TEST_CASE("a refused step is reported with the cost of the point that stays", "[least_squares]") {
  FragileResidual problem;
  std::vector<LeastSquaresProgress> seen;
  LeastSquaresOptions options;
  options.progress = [&](const LeastSquaresProgress& p) {
    seen.push_back(p);
    return true;
  };
  REQUIRE(solve_least_squares(problem, Eigen::VectorXd::Zero(1), options).failed_evaluations > 0);
  for (const LeastSquaresProgress& p : seen)
    CHECK(p.cost == Approx(0.5 * std::pow(std::exp(p.x(0)) - 20, 2)).margin(1e-12));
}

TEST_CASE("a loss that is not finite at the start is refused in words", "[least_squares]") {
  OutlyingResidual problem;
  problem.outlier = 1, problem.loss = {LossType::cauchy, 1e200};
  const LeastSquaresResult result = solve_least_squares(problem, Eigen::VectorXd::Ones(1));
  CHECK(result.status == SolverStatus::failed);
  CHECK_THAT(result.message, Catch::Contains("the loss of its residuals is not finite"));
}

TEST_CASE("the published minima are found from the published starts", "[least_squares][published]") {
  for (const auto function : testing::test_functions()) {
    testing::TestFunction problem = function();
    LeastSquaresOptions options;
    options.max_iterations = 200;
    const LeastSquaresResult result = solve_least_squares(problem, problem.x0, options);
    INFO(problem.name << ": " << result.message << ", " << result.evaluations << " evaluations");
    CHECK(result.status == SolverStatus::converged);
    // Six digits are published. Brown's and Powell's functions have terms of 1e6 and 1e4.
    CHECK(2 * result.cost_final == Approx(problem.minimum).epsilon(2e-6).margin(1e-11));
  }
}

TEST_CASE("Rosenbrock's and Wood's functions between the bounds of Hock and Schittkowski",
          "[least_squares][published]") {
  testing::TestFunction first = testing::rosenbrock(), second = testing::rosenbrock(), wood = testing::wood();
  first.x_lower(1) = -1.5, second.x_lower(1) = 1.5;             // problems 1 and 2, both from (-2, 1)
  wood.x_lower.setConstant(-10), wood.x_upper.setConstant(10);  // problem 38
  const LeastSquaresResult inside = solve_least_squares(first, Eigen::Vector2d(-2, 1));
  CHECK((inside.x - Eigen::Vector2d(1, 1)).norm() < 1e-8);
  // x1 is a minimum of 100 (1.5 - x1^2)^2 + (1 - x1)^2: 400 x1^3 - 598 x1 - 2 = 0, twice on this side of its saddle.
  const LeastSquaresResult at = solve_least_squares(second, Eigen::Vector2d(-2, 1));
  CHECK(at.status == SolverStatus::converged);
  CHECK(at.x(1) == 1.5);
  CHECK(400 * std::pow(at.x(0), 3) - 598 * at.x(0) - 2 == Approx(0).margin(1e-6));
  const LeastSquaresResult right = solve_least_squares(second, Eigen::Vector2d(2, 3));
  CHECK(2 * right.cost_final == Approx(0.0504261879).epsilon(1e-8));
  CHECK(2 * solve_least_squares(wood, wood.x0).cost_final == Approx(0).margin(1e-12));
}

TEST_CASE("an active bound costs at most as many evaluations again, and one for itself", "[least_squares][bounds]") {
  for (const auto function : testing::test_functions()) {
    testing::TestFunction problem = function();
    LeastSquaresOptions options;
    options.max_iterations = 200;
    const LeastSquaresResult free = solve_least_squares(problem, problem.x0, options);
    for (Eigen::Index k = 0; k < problem.variables(); ++k) {
      // Behind this bound two functions have no minimum, but a valley that falls for ever.
      if (k == 0 && (problem.name == "Powell badly scaled" || problem.name == "Osborne 1")) continue;
      testing::TestFunction bounded = function();
      const double half = 0.5 * (problem.x0(k) + free.x(k));
      (free.x(k) > problem.x0(k) ? bounded.x_upper : bounded.x_lower)(k) = half;
      const LeastSquaresResult result = solve_least_squares(bounded, problem.x0, options);
      INFO(problem.name << ", variable " << k << ": " << result.evaluations << " evaluations against "
                        << free.evaluations << ", " << result.message);
      CHECK(result.status == SolverStatus::converged);
      // Its square is the part of the cost to gain, of which the last step gained 1e-10.
      CHECK(uphill(bounded, result) < 1e-4);
      CHECK(result.evaluations <= 2 * free.evaluations + active_bounds(bounded, result.x));
    }
  }
}

TEST_CASE("starts within and on the bounds of random boxes end at a minimum within them", "[least_squares][bounds]") {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform;
  for (const auto function : {testing::rosenbrock, testing::freudenstein_roth, testing::kowalik_osborne, testing::wood,
                              testing::powell_singular, testing::beale})
    for (int trial = 0; trial < 30; ++trial) {
      testing::TestFunction problem = function();
      Eigen::VectorXd start = problem.x0;
      for (Eigen::Index k = 0; k < start.size(); ++k) {
        const double size = std::max(1.0, std::abs(problem.x0(k)));
        problem.x_lower(k) = problem.x0(k) + size * (2 * uniform(generator) - 2);
        problem.x_upper(k) = problem.x0(k) + size * 2 * uniform(generator);
        const double part = trial % 3 == 0 ? std::round(uniform(generator)) : uniform(generator);
        start(k) = (1 - part) * problem.x_lower(k) + part * problem.x_upper(k);
      }
      LeastSquaresOptions options;
      options.max_iterations = 500;
      const LeastSquaresResult result = solve_least_squares(problem, start, options);
      INFO(problem.name << ", trial " << trial << ": " << result.message);
      CHECK(result.status == SolverStatus::converged);
      CHECK((result.point.z.norm() < 1e-6 || uphill(problem, result) < 1e-4));
    }
}

TEST_CASE("a bound at the minimum itself, whose multiplier is zero, does not slow the search",
          "[least_squares][bounds]") {
  testing::TestFunction problem = testing::rosenbrock();
  const long free = solve_least_squares(problem, problem.x0).evaluations;
  problem.x_upper << 1, 1;
  const LeastSquaresResult result = solve_least_squares(problem, problem.x0);
  CHECK((result.x - Eigen::Vector2d(1, 1)).norm() < 1e-8);
  CHECK(result.evaluations <= free + 2);
}

TEST_CASE("a start outside the bounds is taken to the nearest point within", "[least_squares][bounds]") {
  testing::TestFunction problem = testing::rosenbrock();
  problem.x_lower << 0, 0;
  const LeastSquaresResult result = solve_least_squares(problem, problem.x0);
  CHECK(2 * result.cost_initial == Approx(101));  // at (0, 1)
  CHECK((result.x - Eigen::Vector2d(1, 1)).norm() < 1e-8);
}

TEST_CASE("units of the variables do not matter", "[least_squares]") {
  testing::TestFunction problem = testing::kowalik_osborne();
  problem.x_upper(0) = 0.18;  // active: the free minimum is at 0.1928
  const LeastSquaresResult one = solve_least_squares(problem, problem.x0);
  Rescaled scaled(problem, testing::vector({1e8, 1e-8, 3, 1e-3}));
  const LeastSquaresResult other = solve_least_squares(scaled, scaled.scale.cwiseProduct(problem.x0));
  CHECK(one.x(0) == 0.18);
  CHECK(other.evaluations == one.evaluations);
  CHECK(other.cost_final == Approx(one.cost_final).epsilon(1e-8));
}

TEST_CASE("variables that the residuals cannot tell apart, or do not see, leave the search as it is",
          "[least_squares]") {
  testing::TestFunction inner = testing::rosenbrock();
  testing::TestFunction problem("sum", testing::vector({-2, 1, 0.8, 7}), 2, 0, [&](const auto& x, auto& z, auto& J) {
    Eigen::MatrixXd J_inner(2, 2);
    inner.f(Eigen::Vector2d(x(0) + x(2), x(1)), z, J_inner);
    J << J_inner, J_inner.col(0), Eigen::Vector2d::Zero();
  });
  const LeastSquaresResult result = solve_least_squares(problem, problem.x0);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) + result.x(2) == Approx(1).margin(1e-7));
  CHECK(result.x(3) == 7);
}

TEST_CASE("eliminated scales: their weights are the derivatives of the cost, their fit weighs the groups as its own",
          "[least_squares][sigma]") {
  // Two groups of measurements of one number, the second ten times as scattered.
  const Eigen::VectorXd y = testing::vector({1.1, 0.9, 1.05, 0.97, 3, -2, 5, 1.5});
  testing::TestFunction problem("mean", testing::vector({0}), 8, 0, [&](const auto& x, auto& z, auto& J) {
    z = y.array() - x(0);
    J.setConstant(-1);
  });
  problem.groups = {{{0, 1, 2, 3}, 4, 1e-20}, {{4, 5, 6, 7}, 3.5, 1e-20}};
  const Eigen::VectorXd z = y.array() - 0.3;
  for (Eigen::Index i = 0; i < 8; ++i) {
    Eigen::VectorXd up = z, down = z;
    up(i) += 1e-5, down(i) -= 1e-5;
    CHECK(problem.pull(z)(i) == Approx((problem.cost(up) - problem.cost(down)) / 2e-5).epsilon(1e-6));
  }
  const LeastSquaresResult result = solve_least_squares(problem, problem.x0);
  CHECK(result.status == SolverStatus::converged);
  // The weighted mean, with the weights of its own residuals.
  const Eigen::VectorXd w = problem.weights(result.point.z);
  CHECK(result.x(0) == Approx(w.dot(y) / w.sum()).epsilon(1e-8));
  CHECK(w(0) / w(4) > 100);
  CHECK(w(0) == Approx(4 / result.point.z.head(4).squaredNorm()));
}

TEST_CASE("eliminated scales of linear residuals, and a loss of them, are found in a step or two",
          "[least_squares][sigma]") {
  // Two groups that disagree about a line: the cost falls in one direction far beyond what its curvature at the start
  // says.
  constexpr Eigen::Index n = 20;
  Eigen::MatrixXd A(2 * n, 2);
  Eigen::VectorXd y(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / n, noise = 0.1 * std::sin(37.0 * static_cast<double>(i));
    A.row(i) << 1, t;
    A.row(n + i) << t, -1;
    y(i) = 1 + 2 * t + noise, y(n + i) = 3 * t + 1 + 0.3 * noise;
  }
  for (const bool by_groups : {true, false}) {
    testing::TestFunction line("line", testing::vector({50, -20}), 2 * n, 0, [&](const auto& x, auto& z, auto& J) {
      z = A * x - y;
      J = A;
    });
    std::vector<Eigen::Index> first(n), second(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      first[k] = i, second[k] = n + i;
    }
    if (by_groups)
      line.groups = {{first, n, 1e-20}, {second, n, 1e-20}};
    else
      line.loss = {LossType::huber, 0.2};
    const LeastSquaresResult result = solve_least_squares(line, line.x0);
    INFO(result.message << ", " << result.evaluations << " evaluations");
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.evaluations <= 8);
    CHECK(uphill_of_pull(line, result) < 1e-5);
  }
}
