#include "optim/fit/statistics.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace mbsopt;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Residuals z = (y - X rho)/sigma of a linear model: J = -X/sigma.
MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(generator); });
}

FitStatistics fit_statistics(const MatrixXd& J, const VectorXd& z, const VectorXd& rho,
                             const std::vector<std::string>& names, bool sigma_is_known = false) {
  FitData data;
  data.J = J, data.z = z, data.rho = rho, data.names = names, data.sigma_is_known = sigma_is_known;
  return mbsopt::fit_statistics(data);
}

}  // namespace

TEST_CASE("a straight line's statistics are those of the textbook", "[statistics]") {
  // y = a + b x; formulas: var b = s^2/Sxx, var a = s^2 (1/n + xm^2/Sxx), cov = -s^2 xm/Sxx.
  const Eigen::Index n = 12;
  const double sigma = 0.3;
  const VectorXd x = VectorXd::LinSpaced(n, 1, 6.5);
  const VectorXd y = 2 + 0.7 * x.array() + sigma * random_matrix(n, 1, 3).col(0).array();
  const double xm = x.mean(), ym = y.mean(), Sxx = (x.array() - xm).square().sum();
  const double b = ((x.array() - xm) * (y.array() - ym)).sum() / Sxx, a = ym - b * xm;
  const VectorXd residual = y.array() - a - b * x.array();
  const double s2 = residual.squaredNorm() / static_cast<double>(n - 2);

  MatrixXd J(n, 2);
  J.col(0).setConstant(-1 / sigma), J.col(1) = -x / sigma;
  const FitStatistics s = fit_statistics(J, residual / sigma, (VectorXd(2) << a, b).finished(), {"a", "b"});
  const double t = 2.2281388519649385;  // t(0.975, 10), tables
  CHECK(s.degrees_of_freedom == 10);
  CHECK(s.residual_variance == Approx(s2 / (sigma * sigma)).epsilon(1e-12));
  CHECK(s.std_error(1) == Approx(std::sqrt(s2 / Sxx)).epsilon(1e-12));
  CHECK(s.std_error(0) == Approx(std::sqrt(s2 * (1. / n + xm * xm / Sxx))).epsilon(1e-12));
  CHECK(s.covariance(0, 1) == Approx(-s2 * xm / Sxx).epsilon(1e-12));
  CHECK(s.correlation(0, 1) == Approx(-xm / std::sqrt(Sxx / n + xm * xm)).epsilon(1e-12));
  CHECK(s.quantile == Approx(t).epsilon(1e-10));
  CHECK(s.unidentifiable.empty());

  const FitStatistics known = fit_statistics(J, residual / sigma, (VectorXd(2) << a, b).finished(), {"a", "b"}, true);
  CHECK(known.std_error(1) == Approx(sigma / std::sqrt(Sxx)).epsilon(1e-12));
  CHECK(known.quantile == Approx(1.959963984540054).epsilon(1e-10));
}

TEST_CASE("a bound that holds the start of a window does not widen the intervals of others",
          "[statistics][covariance]") {
  // Four windows of 50 samples; two parameters act in all of them, one more in each.
  const Eigen::Index n = 50, N = 4 * n;
  FitData data;
  data.J = random_matrix(N, 6, 11), data.covariance = CovarianceType::newey_west;
  const VectorXd y = random_matrix(N, 1, 12), t = VectorXd::LinSpaced(N, 0, 1);
  for (Eigen::Index w = 0; w < 4; ++w) {
    const VectorXd own = data.J.col(2 + w).segment(n * w, n);
    data.J.col(2 + w).setZero(), data.J.col(2 + w).segment(n * w, n) = own;
    data.records.push_back({n * w, t.segment(n * w, n)});
  }
  data.motions = {{0, t}};
  data.names = {"a", "b", "s1", "s2", "s3", "s4"}, data.of_one_record = {false, false, true, true, true, true};
  data.rho = data.J.householderQr().solve(y), data.z = y - data.J * data.rho;
  const FitStatistics free = mbsopt::fit_statistics(data);
  // The bound keeps s1 at a distance of two of its standard errors, the others are fitted again.
  const double held = data.rho(2) + 2 * free.std_error(2);
  const MatrixXd others = data.J(Eigen::all, std::vector<int>{0, 1, 3, 4, 5});
  const VectorXd shifted = y - held * data.J.col(2);
  data.z = shifted - others * others.householderQr().solve(shifted), data.rho(2) = held;
  data.at_bound = {false, false, true, false, false, false};
  const FitStatistics bounded = mbsopt::fit_statistics(data);
  for (Eigen::Index k = 0; k < 2; ++k) CHECK(bounded.std_error(k) == Approx(free.std_error(k)).epsilon(0.15));
  // At least as many held as the data determine: nothing is left out, and nothing breaks.
  data.at_bound.assign(6, true);
  CHECK(mbsopt::fit_statistics(data).std_error.allFinite());
}

TEST_CASE("the covariance of several parameters is s^2 (J'J)^-1, whatever their units", "[statistics]") {
  MatrixXd J = random_matrix(40, 4, 5);
  J.col(2) *= 1e7, J.col(3) *= 1e-6;
  const VectorXd z = random_matrix(40, 1, 6).col(0);
  const FitStatistics s = fit_statistics(J, z, VectorXd::Ones(4), {"a", "b", "c", "d"});
  VectorXd d(4);
  d << 1, 1, 1e-7, 1e6;  // the plain formula needs columns of like size
  const MatrixXd scaled = J * d.asDiagonal();
  const MatrixXd expected =
      s.residual_variance * (d.asDiagonal() * (scaled.transpose() * scaled).inverse() * d.asDiagonal());
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) CHECK(s.covariance(i, k) == Approx(expected(i, k)).epsilon(1e-10));
  CHECK(s.condition_number >= 1);
  CHECK(s.condition_number < 3);
}

TEST_CASE("the condition number of two columns is that of the angle between them", "[statistics]") {
  // Columns of unit length at the angle a: singular values sqrt(1 +- cos a).
  const double a = 0.2, length[] = {3, 500}, rho[] = {4, 0.01};
  MatrixXd J(3, 2);
  J << length[0], length[1] * std::cos(a), 0, length[1] * std::sin(a), 0, 0;
  const FitStatistics s =
      fit_statistics(J, random_matrix(3, 1, 9).col(0), (VectorXd(2) << rho[0], rho[1]).finished(), {"k", "c"});
  CHECK(s.condition_number == Approx(std::sqrt((1 + std::cos(a)) / (1 - std::cos(a)))).epsilon(1e-12));

  J.col(1).setZero();
  const FitStatistics blind =
      fit_statistics(J, random_matrix(3, 1, 9).col(0), (VectorXd(2) << rho[0], rho[1]).finished(), {"k", "c"});
  CHECK(std::isinf(blind.condition_number));
}

TEST_CASE("combinations that data do not determine are named", "[statistics]") {
  const MatrixXd X = random_matrix(30, 3, 9);
  const VectorXd z = random_matrix(30, 1, 10).col(0);
  const std::vector<std::string> names{"m1", "m2", "k", "c"};
  VectorXd rho(4);
  rho << 2, 3, 100, 0.5;
  MatrixXd J(30, 4);
  J.col(2) = X.col(1), J.col(3) = X.col(2);
  J.col(0) = X.col(0);

  SECTION("a sum") {
    J.col(1) = X.col(0);
    const FitStatistics s = fit_statistics(J, z, rho, names);
    CHECK(s.unidentifiable == std::vector<std::string>{"m1, m2: only m1 + m2 is determined"});
    CHECK(std::isinf(s.std_error(0)));
    CHECK(std::isinf(s.std_error(1)));
    CHECK(std::isfinite(s.std_error(2)));
    CHECK(s.condition_number > 1e12);
  }
  SECTION("a difference") {
    J.col(1) = -X.col(0);
    CHECK(fit_statistics(J, z, rho, names).unidentifiable ==
          std::vector<std::string>{"m1, m2: only m1 - m2 is determined"});
  }
  SECTION("a quotient: f(m1/m2) has f_m1 = f'/m2, f_m2 = -f' m1/m2^2") {
    J.col(0) = X.col(0) / 3, J.col(1) = -X.col(0) * 2 / 9;
    CHECK(fit_statistics(J, z, rho, names).unidentifiable ==
          std::vector<std::string>{"m1, m2: only m1/m2 is determined"});
  }
  SECTION("a product") {
    J.col(0) = X.col(0) * 3, J.col(1) = X.col(0) * 2;
    CHECK(fit_statistics(J, z, rho, names).unidentifiable ==
          std::vector<std::string>{"m1, m2: only m1*m2 is determined"});
  }
  SECTION("any other combination of two") {
    J.col(1) = 0.25 * X.col(0);
    CHECK(fit_statistics(J, z, rho, names).unidentifiable ==
          std::vector<std::string>{"m1, m2: only m1 + 0.25*m2 is determined"});
  }
  SECTION("three at once: only m1 k / m2 is seen") {
    J.col(0) = X.col(0) / 2, J.col(1) = -X.col(0) / 3, J.col(2) = X.col(0) / 100;
    const FitStatistics s = fit_statistics(J, z, rho, names);
    CHECK(s.unidentifiable == std::vector<std::string>{"m1, m2, k: only m1*k/m2 is determined"});
    CHECK(std::isfinite(s.std_error(3)));
    for (int i = 0; i < 3; ++i) CHECK(std::isinf(s.std_error(i)));
  }
  SECTION("no influence") {
    J.col(1).setZero();
    const FitStatistics s = fit_statistics(J, z, rho, names);
    CHECK(s.unidentifiable == std::vector<std::string>{"m2: does not influence what is measured"});
    CHECK(std::isinf(s.std_error(1)));
    CHECK(std::isfinite(s.std_error(0)));
    CHECK(std::isinf(s.condition_number));
  }
}

TEST_CASE("equations between parameters determine what its own data do not show", "[statistics]") {
  // b is what a becomes, b = 3 a; a's own samples are missing. The same fit in a alone has the column 3 J_b.
  const MatrixXd X = random_matrix(30, 2, 9);
  FitData whole, tied;
  whole.J.resize(30, 2), whole.J << 3 * X.col(0), X.col(1);
  whole.z = tied.z = random_matrix(30, 1, 10).col(0);
  whole.rho = VectorXd::Ones(2), whole.names = {"a", "k"};
  tied.J.resize(30, 3), tied.J << VectorXd::Zero(30), X;
  tied.C.resize(1, 3), tied.C << 3, -1, 0;
  tied.rho = (VectorXd(3) << 1, 3, 1).finished(), tied.names = {"a", "b", "k"};
  const FitStatistics one = mbsopt::fit_statistics(whole), other = mbsopt::fit_statistics(tied);
  CHECK(other.unidentifiable.empty());
  CHECK(other.std_error(0) == Approx(one.std_error(0)).epsilon(1e-10));
  CHECK(other.std_error(1) == Approx(3 * one.std_error(0)).epsilon(1e-10));
  CHECK(other.std_error(2) == Approx(one.std_error(1)).epsilon(1e-10));
  CHECK(other.condition_number < 10);
  // Where nothing shows b either, a is not determined.
  tied.J.col(1).setZero();
  const FitStatistics unseen = mbsopt::fit_statistics(tied);
  CHECK(std::isinf(unseen.std_error(0)));
  CHECK(std::isfinite(unseen.std_error(2)));
}

TEST_CASE("as many parameters as samples leave no residual variance", "[statistics]") {
  const FitStatistics s = fit_statistics(MatrixXd::Identity(2, 2), VectorXd::Zero(2), VectorXd::Ones(2), {"a", "b"});
  CHECK(s.degrees_of_freedom == 0);
  CHECK(std::isnan(s.residual_variance));
  CHECK_FALSE(std::isfinite(s.std_error(0)));
}

TEST_CASE("a prior adds what it knows: the posterior of a straight line", "[statistics]") {
  // y = a + b x with known sigma, b ~ N(0.5, 0.1): precision X'X/sigma^2 + diag(0, 1/0.1^2).
  const VectorXd x = VectorXd::LinSpaced(9, 0, 2);
  const double sigma = 0.2;
  FitData data;
  data.J.resize(9, 2);
  data.J.col(0).setConstant(-1 / sigma), data.J.col(1) = -x / sigma;
  data.z = random_matrix(9, 1, 4).col(0);
  data.J_prior = (MatrixXd(1, 2) << 0, 1 / 0.1).finished();
  data.rho = VectorXd::Ones(2), data.names = {"a", "b"}, data.sigma_is_known = true;
  MatrixXd precision = data.J.transpose() * data.J;
  precision(1, 1) += 100;
  CHECK((fit_statistics(data).covariance - precision.inverse()).norm() < 1e-12);
  // Where sigma is estimated the data's precision is scaled by it, the prior's is not.
  data.sigma_is_known = false;
  const FitStatistics s = fit_statistics(data);
  CHECK(s.degrees_of_freedom == 8);
  CHECK(s.residual_variance == Approx(data.z.squaredNorm() / 8));
  precision = data.J.transpose() * data.J / s.residual_variance;
  precision(1, 1) += 100;
  CHECK((s.covariance - precision.inverse()).norm() < 1e-12);
  // A parameter that only its prior knows has the prior's standard error.
  data.J.col(1).setZero();
  const FitStatistics alone = fit_statistics(data);
  CHECK(alone.unidentifiable.empty());
  CHECK(alone.std_error(1) == Approx(0.1).epsilon(1e-10));
}

TEST_CASE("standard errors under a robust loss match the scatter of M-estimates of a mean", "[statistics]") {
  // 10 % of the noise is three times as wide. The M-estimate is found here by bisection of sum psi = 0.
  const LossType type = GENERATE(LossType::huber, LossType::cauchy, LossType::tukey);
  const Loss loss{type};
  std::mt19937 generator(21);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  constexpr int kRuns = 400, kSamples = 60;
  double squares = 0, claimed = 0;
  for (int run = 0; run < kRuns; ++run) {
    VectorXd y(kSamples);
    for (double& value : y) value = normal(generator) * (uniform(generator) < 0.1 ? 3 : 1);
    double low = -1, high = 1;
    for (int i = 0; i < 50; ++i) {
      const double middle = (low + high) / 2;
      double sum = 0;
      for (const double value : y) sum += (value - middle) * loss.at((value - middle) * (value - middle)).rho1;
      (sum > 0 ? low : high) = middle;
    }
    FitData data;
    data.J = MatrixXd::Constant(kSamples, 1, -1);
    data.z = y.array() - low;
    data.rho = VectorXd::Constant(1, low), data.names = {"mean"}, data.loss = loss;
    squares += low * low, claimed += fit_statistics(data).covariance(0, 0);
  }
  CHECK(std::sqrt(squares / claimed) == Approx(1).margin(0.1));  // 3 standard deviations of the scatter of 400
}

TEST_CASE("the square is the robust formula's special case", "[statistics]") {
  FitData data;
  data.J = random_matrix(30, 2, 1), data.z = random_matrix(30, 1, 2).col(0);
  data.rho = VectorXd::Ones(2), data.names = {"a", "b"};
  const FitStatistics squared = fit_statistics(data);
  for (const LossType type : {LossType::huber, LossType::cauchy, LossType::tukey}) {
    data.loss = {type, 1e6};  // so wide that nothing is an outlier
    const FitStatistics s = fit_statistics(data);
    CHECK((s.covariance - squared.covariance).norm() < 1e-9 * squared.covariance.norm());
    CHECK(s.variance == Approx(squared.variance).epsilon(1e-9));
    data.loss = {type, 1.0};
    CHECK((fit_statistics(data).covariance - squared.covariance).norm() > 0.01 * squared.covariance.norm());
  }
}

TEST_CASE("a parameter that moves the record by rounding errors only does not influence it", "[statistics]") {
  const MatrixXd X = random_matrix(20, 2, 9);
  FitData data;
  data.J = X, data.z = random_matrix(20, 1, 10).col(0), data.rho = VectorXd::Ones(2), data.names = {"k", "c"};
  data.J.col(1) *= 1e-14;
  data.record = 5;
  const FitStatistics s = fit_statistics(data);
  CHECK(s.unidentifiable == std::vector<std::string>{"c: does not influence what is measured"});
  CHECK(std::isinf(s.std_error(1)));
  CHECK(std::isfinite(s.std_error(0)));
  CHECK(std::isinf(s.condition_number));
  // A tiny parameter has a large derivative, and all the influence of any other.
  data.J = X * 1e14, data.change = VectorXd::Constant(2, 1e-14);
  CHECK(fit_statistics(data).unidentifiable.empty());
}

TEST_CASE("where there is no variance there are no standard errors, and words say why", "[statistics]") {
  FitData data;
  data.J = random_matrix(20, 2, 9), data.z = VectorXd::Constant(20, 1e3), data.rho = VectorXd::Ones(2);
  data.names = {"k", "c"}, data.loss = {LossType::tukey};
  const FitStatistics s = fit_statistics(data);
  CHECK(std::isnan(s.std_error(0)));
  CHECK(s.correlation.size() == 0);
  CHECK_THAT(s.none, Catch::Contains("beyond the scale of the loss"));
  CHECK(s.unidentifiable.empty());
  data.J = MatrixXd::Identity(2, 2), data.z = VectorXd::Zero(2), data.loss = {};
  CHECK_THAT(fit_statistics(data).none, Catch::Contains("no degree of freedom"));
}
