#include "optim/solver/robust_loss.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "optim/solver/levenberg_marquardt.hpp"

using namespace mbsopt;
using Eigen::VectorXd;

namespace {

constexpr LossType kAll[] = {LossType::squared, LossType::huber, LossType::cauchy, LossType::tukey};

// y_i = m: one unknown, seven values, two of them far off.
struct Mean : LeastSquaresProblem {
  Mean(const Loss& l, Eigen::Index unseen) : LeastSquaresProblem(1, 7) { loss = l, plain = unseen; }
  void evaluate(const VectorXd& x, LeastSquaresPoint& p) override { p.z = y.array() - x(0), p.z_x.setConstant(-1); }
  VectorXd y = (VectorXd(7) << 0.1, -0.4, 0.7, 1.2, 0.3, 6.5, 9.0).finished();
};

// Where the pull of all is zero, by bisection between the middle values.
double mean_by_bisection(const Mean& problem) {
  double low = -0.5, high = 9;
  for (int i = 0; i < 60; ++i) {
    const double m = (low + high) / 2;
    double pull = 0;
    for (Eigen::Index k = 0; k < 7; ++k) {
      const double z = problem.y(k) - m;
      pull += z * (k < 7 - problem.plain ? problem.loss.at(z * z).rho1 : 1.0);
    }
    (pull > 0 ? low : high) = m;
  }
  return low;
}

}  // namespace

TEST_CASE("the losses are those of the problem format", "[loss]") {
  const double s = 1.7;
  for (const double z : {0.0, 0.3, 1.6, 1.8, -4.0, 30.0}) {
    const double z2 = z * z, a = std::abs(z);
    CHECK(Loss{LossType::squared}.at(z2).rho == z2);
    CHECK(Loss{LossType::huber, s}.at(z2).rho == Approx(a <= s ? z2 : 2 * s * a - s * s));
    CHECK(Loss{LossType::cauchy, s}.at(z2).rho == Approx(s * s * std::log(1 + z2 / (s * s))));
    CHECK(Loss{LossType::tukey, s}.at(z2).rho ==
          Approx(a <= s ? s * s / 3 * (1 - std::pow(1 - z2 / (s * s), 3)) : s * s / 3));
  }
}

TEST_CASE("the derivatives of the losses are central differences of them", "[loss]") {
  const double s = 0.8;
  for (const LossType type : kAll)
    for (const double x : {0.01, 0.5, 0.63, 0.65, 2.0, 100.0}) {  // Huber's kink is at 0.64
      const double h = 1e-5 * x;                                  // its square and rounding over h leave ten digits
      const Loss loss{type, s};
      const LossValue v = loss.at(x), up = loss.at(x + h), down = loss.at(x - h);
      CHECK(v.rho1 == Approx((up.rho - down.rho) / (2 * h)).epsilon(1e-8).margin(1e-10));
      CHECK(v.rho2 == Approx((up.rho1 - down.rho1) / (2 * h)).epsilon(1e-8).margin(1e-10));
    }
}

TEST_CASE("a loss without a scale has its usual constant, which costs 5 % of efficiency under normal noise", "[loss]") {
  // Efficiency of an M-estimate: mean(psi_z)^2/mean(psi^2), here by the trapezoidal rule over the normal density.
  for (const LossType type : {LossType::huber, LossType::cauchy, LossType::tukey}) {
    const Loss loss{type};
    double slope = 0, squares = 0;
    constexpr double h = 1e-3;
    for (double z = -9; z <= 9; z += h) {
      const LossValue v = loss.at(z * z);
      const double density = std::exp(-z * z / 2) / std::sqrt(2 * M_PI) * h;
      slope += density * (v.rho1 + 2 * z * z * v.rho2), squares += density * v.rho1 * v.rho1 * z * z;
    }
    CHECK(slope * slope / squares == Approx(0.95).margin(5e-4));
  }
}

TEST_CASE("the solver minimises each loss, not another", "[loss][least_squares]") {
  std::vector<double> found;
  for (const LossType type : kAll) {
    Mean problem({type, 1.0}, 0);
    LeastSquaresOptions options;
    options.tolerance = 1e-14;
    const LeastSquaresResult result = solve_least_squares(problem, VectorXd::Constant(1, 0.5), options);
    REQUIRE(result.status == SolverStatus::converged);
    CHECK(result.x(0) == Approx(mean_by_bisection(problem)).margin(1e-6));
    CHECK(result.cost_final == Approx(problem.cost(problem.y.array() - result.x(0))));
    CHECK(problem.pull(problem.y.array() - result.x(0)).sum() == Approx(0).margin(1e-6));
    for (const double other : found) CHECK(std::abs(result.x(0) - other) > 0.01);
    found.push_back(result.x(0));
  }
}

TEST_CASE("plain residuals are squared whatever the loss", "[loss][least_squares]") {
  for (const LossType type : {LossType::huber, LossType::cauchy, LossType::tukey}) {
    Mean robust({type, 4.0}, 0), mixed({type, 4.0}, 1);  // 9.0 counts in full
    LeastSquaresOptions options;
    options.tolerance = 1e-14;
    const double without = solve_least_squares(robust, VectorXd::Constant(1, 0.5), options).x(0);
    const double with = solve_least_squares(mixed, VectorXd::Constant(1, 0.5), options).x(0);
    CHECK(with == Approx(mean_by_bisection(mixed)).margin(1e-6));
    CHECK(with > without + 0.5);
  }
}
