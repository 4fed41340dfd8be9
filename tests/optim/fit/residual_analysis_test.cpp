#include "optim/fit/residual_analysis.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace mbsopt;
using Eigen::VectorXd;

namespace {

// e_i = phi e_{i-1} + noise
VectorXd autoregressive(Eigen::Index n, double phi, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  VectorXd e(n);
  e(0) = normal(generator);
  for (Eigen::Index i = 1; i < n; ++i) e(i) = phi * e(i - 1) + normal(generator);
  return e;
}

}  // namespace

TEST_CASE("autocorrelation, Ljung-Box and runs of a short record by hand", "[residuals]") {
  VectorXd z(10);
  z << 1, 2, -1, -2, 1, 1, 2, -1, -2, -1;  // mean 0, sum of squares 22
  const ResidualAnalysis a = analyse_residuals(z);
  CHECK(a.samples == 10);
  CHECK(a.mean == 0);
  CHECK(a.lags == 2);
  CHECK(a.autocorrelation == Approx(5. / 22));
  const double r2 = -10. / 22;
  CHECK(a.ljung_box == Approx(120 * (25. / 484 / 9 + r2 * r2 / 8)));
  CHECK(a.ljung_box_p == Approx(std::exp(-a.ljung_box / 2)));  // chi^2 of two degrees of freedom
  CHECK(a.runs == 4);                                          // five of each sign: m = 6, variance 20/9
  CHECK(a.runs_z == Approx(-2 / std::sqrt(20. / 9)));
  CHECK(a.runs_p == Approx(std::erfc(2 / std::sqrt(20. / 9) / std::sqrt(2.))));
}

TEST_CASE("white noise is rejected as often as the level says, correlated noise nearly always", "[residuals]") {
  int box = 0, runs = 0, correlated = 0;
  constexpr int kRuns = 600;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const ResidualAnalysis a = analyse_residuals(autoregressive(200, 0, seed));
    box += a.ljung_box_p < 0.05, runs += a.runs_p < 0.05;
    correlated += analyse_residuals(autoregressive(200, 0.5, seed)).ljung_box_p < 0.05;
  }
  // 5 % of 600 are 30, give or take 3 standard deviations of 5.3.
  CHECK(std::abs(box - 30) < 16);
  CHECK(std::abs(runs - 30) < 16);
  CHECK(correlated > 595);
  CHECK(analyse_residuals(autoregressive(4000, 0.5, 3)).autocorrelation == Approx(0.5).margin(0.05));
}

TEST_CASE("residuals are judged in words", "[residuals]") {
  CHECK(analyse_residuals(autoregressive(300, 0, 2)).in_words() == "white");
  CHECK_THAT(analyse_residuals(autoregressive(300, 0.9, 2)).in_words(),
             Catch::Contains("correlated in time (lag 1: 0."));
  CHECK(analyse_residuals(VectorXd::Ones(5)).in_words() == "too few to say");
  CHECK(analyse_residuals(VectorXd()).samples == 0);
  VectorXd beyond = VectorXd::Zero(30);
  beyond(7) = 1e300;  // its square is no number
  CHECK_NOTHROW(analyse_residuals(beyond));
  // A constant offset that autocorrelation, which takes the mean off, does not see.
  const VectorXd offset = autoregressive(300, 0, 2).array() + 10;
  CHECK(analyse_residuals(offset).runs_p == 0);
  CHECK_FALSE(analyse_residuals(offset).white());
}
