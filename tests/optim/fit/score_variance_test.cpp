#include "optim/fit/score_variance.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace mbsopt;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd normal_matrix(Index rows, Index columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  MatrixXd m(rows, columns);
  for (double& x : m.reshaped()) x = normal(generator);
  return m;
}

VectorXd random_times(Index n, unsigned seed) {
  VectorXd t = normal_matrix(n, 1, seed).cwiseAbs();
  std::sort(t.begin(), t.end());
  t(n / 2) = t(n / 2 - 1);  // two samples at one time
  return t;
}

}  // namespace

TEST_CASE("Newey and West's variance is the double sum with falling weights, for times as they come", "[covariance]") {
  const Index n = 60;
  const MatrixXd s = normal_matrix(2 * n, 3, 1);
  const std::vector<SampledRecord> records{{0, random_times(n, 2)}, {n, random_times(n, 3)}};
  MatrixXd expected = MatrixXd::Zero(3, 3);
  for (const SampledRecord& r : records)
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j) {
        const double weight = 1 - std::abs(r.t(i) - r.t(j)) / (kLagPart * r.duration());
        if (weight > 0) expected += weight * s.row(r.first + i).transpose() * s.row(r.first + j);
      }
  const MatrixXd B = ScoreVariance(CovarianceType::newey_west, records).within(s);
  CHECK((B - expected).norm() < 1e-11 * expected.norm());
}

TEST_CASE("between records the sum of each counts", "[covariance]") {
  const MatrixXd s = normal_matrix(9, 2, 4);
  const VectorXd t = VectorXd::LinSpaced(3, 0, 1);
  const std::vector<SampledRecord> records{{0, t}, {3, t}, {6, t}};
  const ScoreVariance variance(CovarianceType::windows, records);
  MatrixXd sums(3, 2);
  for (Index e = 0; e < 3; ++e) sums.row(e) = s.middleRows(3 * e, 3).colwise().sum();
  CHECK((variance.between(s) - sums.transpose() * sums).norm() < 1e-12);
  CHECK((variance.within(s) - s.transpose() * s).norm() < 1e-12);  // a tenth of a record holds one sample
  CHECK(variance.freedom() == 2);
}

TEST_CASE("residuals of a window are what a fit to the other windows leaves", "[covariance]") {
  // Windows of 15, 9 and 30 samples; two parameters act in all of them, one more in each.
  const std::vector<Index> lengths{15, 9, 30};
  const Index N = 54, P = 5;
  MatrixXd J = normal_matrix(N, P, 5);
  const VectorXd y = normal_matrix(N, 1, 6), t = VectorXd::LinSpaced(N, 0, 1);
  std::vector<SampledRecord> windows;
  for (Index first = 0, w = 0; w < 3; first += lengths[static_cast<std::size_t>(w++)]) {
    const Index n = lengths[static_cast<std::size_t>(w)];
    windows.push_back({first, t.segment(first, n)});
    const VectorXd own = J.col(2 + w).segment(first, n);
    J.col(2 + w).setZero(), J.col(2 + w).segment(first, n) = own;
  }
  const ScoreVariance variance(CovarianceType::newey_west, windows, {{0, t}});
  REQUIRE(variance.has_windows());
  CHECK_FALSE(ScoreVariance(CovarianceType::newey_west, windows).has_windows());
  const VectorXd fit = y - J * J.householderQr().solve(y);
  const VectorXd z = variance.left_out(fit, J, (J.transpose() * J).inverse());
  for (std::size_t w = 0; w < 3; ++w) {  // the shared two are those of the others, its own one the best for these
    const Index first = windows[w].first, n = lengths[w];
    MatrixXd others = J;
    VectorXd seen = y;
    others.middleRows(first, n).setZero(), seen.segment(first, n).setZero();
    const VectorXd shared = others.completeOrthogonalDecomposition().solve(seen).head(2);
    const VectorXd own = J.col(2 + static_cast<Index>(w)).segment(first, n).normalized();
    const VectorXd left = y.segment(first, n) - J.block(first, 0, n, 2) * shared;
    CHECK((z.segment(first, n) - (left - own * own.dot(left))).norm() < 1e-10);
  }
}

TEST_CASE("a record that no parameter moves keeps its residuals", "[covariance]") {
  const VectorXd t = VectorXd::LinSpaced(6, 0, 1), z = normal_matrix(18, 1, 7);
  MatrixXd J = normal_matrix(18, 1, 8);
  J.middleRows(6, 6).setZero();
  const ScoreVariance variance(CovarianceType::newey_west, {{0, t}, {6, t}, {12, t}},
                               {{0, VectorXd::LinSpaced(18, 0, 3)}});
  const VectorXd left = variance.left_out(z, J, (J.transpose() * J).inverse());
  CHECK(left.segment(6, 6) == z.segment(6, 6));
  CHECK(left.head(6).norm() > z.head(6).norm());
}

TEST_CASE("what the fit leaves of the variance is that of white noise", "[covariance]") {
  // Residuals M e of white e: the mean of a'B a over many e, against that of the whole noise.
  const Index n = 80;
  MatrixXd J(n, 3);
  const VectorXd t = VectorXd::LinSpaced(n, 0, 1);
  J << VectorXd::Ones(n), t, (9 * t.array()).sin().matrix();
  const MatrixXd q = J.householderQr().householderQ() * MatrixXd::Identity(n, 3);
  const VectorXd a_J = J * Eigen::Vector3d(0.3, -0.5, 1);
  for (const CovarianceType type : {CovarianceType::newey_west, CovarianceType::windows}) {
    std::vector<SampledRecord> records{{0, t}};
    if (type == CovarianceType::windows) {
      records.clear();
      for (Index e = 0; e < 8; ++e) records.push_back({10 * e, t.segment(10 * e, 10)});
    }
    const ScoreVariance variance(type, records);
    const MatrixXd noise = normal_matrix(n, 4000, 7);
    double sum = 0;
    for (Index i = 0; i < noise.cols(); ++i) {
      const VectorXd z = noise.col(i) - q * (q.transpose() * noise.col(i));
      const VectorXd score = a_J.cwiseProduct(z);
      sum += (type == CovarianceType::windows ? variance.between(score) : variance.within(score))(0, 0);
    }
    const double kept = sum / static_cast<double>(noise.cols()) / a_J.squaredNorm();
    // 4000 values of a chi^2 of 7 to 15 degrees of freedom: one standard error is 0.008.
    CHECK(variance.share_left(a_J, q, false) == Approx(kept).margin(0.025));
    CHECK(kept < 0.9);
  }
}

TEST_CASE("of a mean, the part of the variance that is left is 1 - b + b^2/3", "[covariance]") {
  const Index n = 4000;  // the sums are integrals to 1/n
  const VectorXd t = VectorXd::LinSpaced(n, 0, 1), ones = VectorXd::Ones(n);
  const ScoreVariance variance(CovarianceType::newey_west, {{0, t}});
  const double b = kLagPart;
  CHECK(variance.share_left(ones, ones / std::sqrt(static_cast<double>(n)), false) ==
        Approx(1 - b + b * b / 3).margin(1e-3));
}
