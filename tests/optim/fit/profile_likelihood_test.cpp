#include "optim/fit/profile_likelihood.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>

#include "optim/fit/statistics.hpp"

using namespace mbsopt;
using Catch::Contains;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Line : LeastSquaresProblem {
  Line() : LeastSquaresProblem(2, 6) {
    X.col(0).setOnes();
    X.col(1) << 0, 1, 2, 3, 4, 5;
  }
  void evaluate(const VectorXd& x, LeastSquaresPoint& p) override { p.z = y - X * x, p.z_x = -X; }
  VectorXd solution() const { return (X.transpose() * X).inverse() * X.transpose() * y; }
  MatrixXd X = MatrixXd(6, 2);
  VectorXd y = (VectorXd(6) << 1.1, 1.4, 2.3, 2.4, 3.1, 3.3).finished();
};

// y = exp(-k t) of one unknown, k >= 0, sampled coarsely: for large k only y(0) and a tail of zeros are left.
struct Decay : LeastSquaresProblem {
  explicit Decay(const VectorXd& measured) : LeastSquaresProblem(1, measured.size()), y(measured) { x_lower(0) = 0; }
  void evaluate(const VectorXd& x, LeastSquaresPoint& p) override {
    for (Eigen::Index i = 0; i < size; ++i) {
      const double t = 1 + static_cast<double>(i), model = std::exp(-x(0) * t);
      p.z(i) = (y(i) - model) / 0.1, p.z_x(i, 0) = t * model / 0.1;
    }
  }
  double cost_at(double k) {
    LeastSquaresPoint p;
    p.z.setZero(size), p.z_x.setZero(size, 1);
    evaluate(VectorXd::Constant(1, k), p);
    return cost(p.z);
  }
  VectorXd y;
};

}  // namespace

TEST_CASE("the profile of a linear model is a straight line, its interval that of the textbook", "[profile]") {
  Line line;
  const VectorXd x = line.solution();
  FitData data;
  data.J = -line.X, data.z = line.y - line.X * x, data.rho = x, data.names = {"a", "b"};
  const FitStatistics s = fit_statistics(data);
  for (const Eigen::Index k : {0, 1}) {
    ProfileOptions options;
    options.variable = k, options.first_step = 0.5 * s.std_error(k);
    options.likelihood_scale = s.residual_variance, options.quantile = s.quantile;
    const ParameterProfile profile = profile_likelihood(line, x, options);
    REQUIRE(profile.points.size() > 8);
    for (const ParameterProfile::Point& p : profile.points) {
      CHECK(p.tau == Approx((p.value - x(k)) / s.std_error(k)).margin(1e-6));
      CHECK(p.parameters(k) == p.value);
    }
    REQUIRE(profile.lower);
    REQUIRE(profile.upper);
    CHECK(*profile.lower == Approx(s.ci95(k, 0)).epsilon(1e-4));
    CHECK(*profile.upper == Approx(s.ci95(k, 1)).epsilon(1e-4));
    CHECK(profile.points.front().value < *profile.lower);
    CHECK(profile.points.back().value > *profile.upper);
  }
}

TEST_CASE("the profile of a nonlinear model is not symmetric, and its ends are where the cost says", "[profile]") {
  Decay decay((VectorXd(3) << 0.40, 0.10, 0.05).finished());
  const LeastSquaresResult fit = solve_least_squares(decay, VectorXd::Constant(1, 1));
  ProfileOptions options;
  options.first_step = 0.1;
  const ParameterProfile profile = profile_likelihood(decay, fit.x, options);
  REQUIRE(profile.lower);
  REQUIRE(profile.upper);
  const double rise = 0.5 * 1.96 * 1.96;
  CHECK(decay.cost_at(*profile.lower) - fit.cost_final == Approx(rise).epsilon(3e-3));
  CHECK(decay.cost_at(*profile.upper) - fit.cost_final == Approx(rise).epsilon(3e-3));
  CHECK(*profile.upper - fit.x(0) > 1.3 * (fit.x(0) - *profile.lower));
}

TEST_CASE("where the data do not bound a parameter, the profile says so", "[profile]") {
  // Measured zeros: any fast decay explains them.
  Decay fast((VectorXd(2) << 0.01, 0.0).finished());
  const LeastSquaresResult fit = solve_least_squares(fast, VectorXd::Constant(1, 3));
  ProfileOptions options;
  options.first_step = 0.2;
  const ParameterProfile open = profile_likelihood(fast, fit.x, options);
  CHECK(open.lower);
  CHECK_FALSE(open.upper);
  CHECK_THAT(open.above, Contains("do not bound it"));
  // A bound is where the walk ends.
  fast.x_upper(0) = fit.x(0) + 1;
  CHECK_THAT(profile_likelihood(fast, fit.x, options).above, Contains("do not exclude its bound"));
  fast.x_upper(0) = fit.x(0);
  CHECK_THAT(profile_likelihood(fast, fit.x, options).above, Contains("the estimate is at its bound"));
}

TEST_CASE("a profile that meets a better fit says so", "[profile]") {
  Decay decay((VectorXd(3) << 0.40, 0.10, 0.05).finished());
  ProfileOptions options;
  options.first_step = 0.2;
  const ParameterProfile profile = profile_likelihood(decay, VectorXd::Constant(1, 3), options);  // no fit at all
  CHECK_THAT(profile.below, Contains("a better fit was met on the way"));
}
