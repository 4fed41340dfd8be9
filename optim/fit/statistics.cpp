#include "optim/fit/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linear/dense.hpp"
#include "optim/fit/determined_combinations.hpp"
#include "optim/fit/distributions.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity(), kNaN = std::numeric_limits<double>::quiet_NaN();
// Smaller singular values, relative to the largest, count as zero. Exact derivatives of a simulation carry errors of
// about 1e-12, and a combination 1e8 times less certain than the best one is of no use.
constexpr double kRankTolerance = 1e-8;
// Smaller effects, relative to the record, count as none. Exact derivatives carry rounding errors of about 1e-12 of the
// record; the margin is 100.
constexpr double kNoInfluence = 1e-10;

double quantile_975(long degrees_of_freedom, bool sigma_is_known) {
  if (sigma_is_known) return normal_quantile(0.975);
  if (degrees_of_freedom < 1) return kInfinity;
  return student_quantile(static_cast<double>(degrees_of_freedom), 0.975);
}

struct Variances {
  double variance, likelihood_scale;
};

// psi = rho1 z, psi_z = rho1 + 2 z^2 rho2. The likelihood's scale is mean(psi^2)/mean(psi_z), by which twice the rise
// of the cost is about chi^2: Hampel, Ronchetti, Rousseeuw and Stahel, "Robust Statistics" (1986), section 7.2. For the
// square both are s^2.
Variances variances(const FitData& data, long degrees_of_freedom, double s2) {
  if (data.loss.type == LossType::squared) return {data.sigma_is_known ? 1 : s2, data.sigma_is_known ? 1 : s2};
  const double N = static_cast<double>(data.z.size()), P = static_cast<double>(data.rho.size() - data.C.rows());
  if (degrees_of_freedom < 1) return {s2, s2};
  double squares = 0, slope = 0, slope_squares = 0;
  for (const double z : data.z) {
    const LossValue v = data.loss.at(z * z);
    const double psi_z = v.rho1 + 2 * z * z * v.rho2;
    squares += v.rho1 * v.rho1 * z * z, slope += psi_z, slope_squares += psi_z * psi_z;
  }
  slope /= N;
  if (!(slope > 0)) return {kInfinity, kInfinity};
  const double K = 1 + P / N * (slope_squares / N - slope * slope) / (slope * slope);
  const double mean_square = squares / static_cast<double>(degrees_of_freedom);
  return {K * K * mean_square / (slope * slope), mean_square / slope};
}

// psi/mean(psi_z), which is z where the loss is the square.
VectorXd influences(const FitData& data) {
  VectorXd psi = data.z;
  if (data.loss.type == LossType::squared) return psi;
  double slope = 0;
  for (Index i = 0; i < psi.size(); ++i) {
    const double z = data.z(i);
    const LossValue v = data.loss.at(z * z);
    psi(i) = v.rho1 * z, slope += v.rho1 + 2 * z * z * v.rho2;
  }
  return psi * (static_cast<double>(psi.size()) / slope);
}

// Orthonormal columns Z with C Z = 0; C: of independent rows.
MatrixXd null_space_of(const MatrixXd& C) {
  return orthogonal_factor(C.transpose(), C.cols()).rightCols(C.cols() - C.rows());
}

MatrixXd scores_of(const VectorXd& z, const MatrixXd& J) {
  MatrixXd scores = z.asDiagonal() * J;
  scores.rowwise() -= scores.colwise().mean().eval();  // zero but for the pull of priors and of bounds
  return scores;
}

// V V' where `held` rows of V stay zero.
MatrixXd inverse_without(const MatrixXd& V, const std::vector<Index>& held) {
  if (held.empty()) return V * V.transpose();
  if (static_cast<Index>(held.size()) >= V.cols()) return MatrixXd::Zero(V.rows(), V.rows());
  const MatrixXd free = V * null_space_of(V(held, Eigen::all));
  return free * free.transpose();
}

}  // namespace

FitStatistics fit_statistics(const FitData& data) {
  const Index N = data.J.rows(), R = data.J_prior.rows(), P = data.rho.size(), M = data.C.rows();
  const VectorXd& rho = data.rho;
  FitStatistics s;
  s.degrees_of_freedom = static_cast<long>(N + R + M - P);
  s.residual_variance =
      s.degrees_of_freedom > 0 ? data.z.squaredNorm() / static_cast<double>(s.degrees_of_freedom) : kNaN;
  const Variances v = variances(data, s.degrees_of_freedom, s.residual_variance);
  s.variance = v.variance, s.likelihood_scale = v.likelihood_scale;
  // Without it, the determined combinations are still found.
  const double variance = std::isfinite(s.variance) ? s.variance : 1;
  const bool normal = data.sigma_is_known && data.loss.type == LossType::squared;
  s.quantile = quantile_975(s.degrees_of_freedom, normal);
  s.std_error.setZero(P), s.ci95.setZero(P, 2);
  s.covariance.setZero(P, P), s.correlation.setIdentity(P, P);
  if (P == 0) return s;

  MatrixXd J(N + R, P);  // v (J'J)^-1 is the covariance
  J.topRows(N) = data.J;
  if (R > 0) J.bottomRows(R) = data.J_prior * std::sqrt(variance);
  const bool sandwich = data.covariance != CovarianceType::white && std::isfinite(s.variance);
  const ScoreVariance scores_vary(data.covariance, data.records, data.motions);
  if (sandwich) {
    s.quantile = quantile_975(std::min(scores_vary.freedom(), s.degrees_of_freedom), false);
    s.covariance_type = data.covariance;
  }
  s.inflation.setOnes(P);

  // Columns of unit length; zero columns are left out, unless equations tie their parameters to others.
  VectorXd size = rho.cwiseAbs(), length = J.colwise().norm().transpose();
  for (Index k = 0; k < P; ++k)
    if (size(k) == 0) size(k) = 1;
  const VectorXd& change = data.change.size() == P ? data.change : size;
  const double most_seen = length.cwiseProduct(change.cwiseAbs()).maxCoeff();
  std::vector<Index> used;
  std::vector<VectorXd> unseen;  // directions, in changes over sizes
  for (Index k = 0; k < P; ++k) {
    const double seen = length(k) * std::abs(change(k));
    const bool tied = M > 0 && !data.C.col(k).isZero(0) && change(k) != 0 && most_seen > 0;
    if (seen > 0 && seen > kNoInfluence * data.record) {
      used.push_back(k);
    } else if (tied) {  // the equations may determine it by what others show
      used.push_back(k), length(k) = most_seen / std::abs(change(k));
    } else {
      unseen.push_back(VectorXd::Unit(P, k));
    }
  }
  if (!unseen.empty()) s.condition_number = kInfinity;
  const Index U = static_cast<Index>(used.size());
  s.singular_values.setZero(static_cast<Index>(unseen.size()));
  if (U > 0) {
    MatrixXd scaled(N + R, U);
    for (Index c = 0; c < U; ++c)
      scaled.col(c) = J.col(used[static_cast<std::size_t>(c)]) / length(used[static_cast<std::size_t>(c)]);
    const MatrixXd Z = M > 0 ? null_space_of(data.C(Eigen::all, used) * length(used).cwiseInverse().asDiagonal())
                             : MatrixXd::Identity(U, U);
    const Index F = Z.cols();
    // Singular values of the triangular factor, which is as small as the number of parameters.
    MatrixXd triangle = scaled * Z;
    if (N + R > F) triangle = triangular_factor(std::move(triangle));
    const RightSingular svd = right_singular(triangle);
    VectorXd sigma = VectorXd::Zero(F);
    sigma.head(svd.values.size()) = svd.values;
    const Index rank = (sigma.array() > std::max(kRankTolerance, data.accuracy) * sigma(0)).count();
    if (unseen.empty()) s.condition_number = sigma(F - 1) > 0 ? sigma(0) / sigma(F - 1) : kInfinity;
    const MatrixXd directions = Z * svd.V;
    s.singular_values.setZero(F + static_cast<Index>(unseen.size()));
    s.singular_values.head(F) = sigma, s.rank = static_cast<long>(rank);
    if (rank > 1) {
      s.weakest.setZero(P);
      for (Index a = 0; a < U; ++a) s.weakest(used[static_cast<std::size_t>(a)]) = directions(a, rank - 1);
    }

    const MatrixXd V = directions.leftCols(rank) * sigma.head(rank).cwiseInverse().asDiagonal();
    const MatrixXd white = variance * (V * V.transpose());
    MatrixXd covariance = white;
    if (sandwich) {
      const MatrixXd q = scaled * V, inverse = V * V.transpose(), a_J = scaled.topRows(N) * inverse;
      const VectorXd z = influences(data);
      const MatrixXd scores = scores_of(z, scaled.topRows(N));
      const MatrixXd within = inverse * scores_vary.within(scores) * inverse;
      VectorXd left_out;
      if (scores_vary.has_windows()) {
        std::vector<Index> held;
        for (Index a = 0; a < U && !data.at_bound.empty(); ++a)
          if (data.at_bound[static_cast<std::size_t>(used[static_cast<std::size_t>(a)])]) held.push_back(a);
        left_out = scores_vary.left_out(z, scaled.topRows(N), inverse_without(V, held));
      }
      VectorXd larger = VectorXd::Ones(U);  // standard errors than those of `within`
      for (Index a = 0; a < U; ++a) {
        const Index k = used[static_cast<std::size_t>(a)];
        const bool alone = !data.of_one_record.empty() && data.of_one_record[static_cast<std::size_t>(k)];
        const bool by_windows = !alone && scores_vary.has_windows();
        VectorXd of_k = scores * inverse.col(a);
        if (by_windows) of_k += a_J.col(a).cwiseProduct(left_out - z);
        const double kept = by_windows ? 1 : scores_vary.kept(a_J.col(a), q.topRows(N), alone);
        const double variance_k =
            (scores_vary.is_between(alone) ? scores_vary.between(of_k) : scores_vary.within(of_k))(0, 0) / kept;
        if (within(a, a) > 0) larger(a) = std::sqrt(variance_k / within(a, a));
      }
      covariance = larger.asDiagonal() * within * larger.asDiagonal();
      if (R > 0) {  // v^2 J_prior'J_prior, which the scaled rows have v times
        const MatrixXd prior = std::sqrt(variance) * scaled.bottomRows(R) * inverse;
        covariance += prior.transpose() * prior;
      }
    }
    for (Index a = 0; a < U; ++a)
      for (Index b = 0; b < U; ++b) {
        const Index ka = used[static_cast<std::size_t>(a)], kb = used[static_cast<std::size_t>(b)];
        s.covariance(ka, kb) = covariance(a, b) / (length(ka) * length(kb));
        if (a == b && white(a, a) > 0) s.inflation(ka) = covariance(a, a) / white(a, a);
        const double norm = std::sqrt(covariance(a, a) * covariance(b, b));
        if (a != b) s.correlation(ka, kb) = norm > 0 ? covariance(a, b) / norm : 0;
      }
    for (Index c = rank; c < F; ++c) {
      VectorXd direction = VectorXd::Zero(P);
      for (Index a = 0; a < U; ++a) {
        const Index k = used[static_cast<std::size_t>(a)];
        direction(k) = directions(a, c) / (length(k) * size(k));
      }
      unseen.push_back(direction.normalized());
    }
  }
  MatrixXd null_space(P, static_cast<Index>(unseen.size()));
  for (std::size_t c = 0; c < unseen.size(); ++c) null_space.col(static_cast<Index>(c)) = unseen[c];
  s.unidentifiable = determined_combinations(null_space, rho, size, data.names, data.units);
  const std::vector<bool> changed = changed_parameters(null_space);
  for (Index k = 0; k < P; ++k) {
    s.std_error(k) = changed[static_cast<std::size_t>(k)] ? kInfinity : std::sqrt(s.covariance(k, k));
    const double half = s.std_error(k) == 0 ? 0 : s.quantile * s.std_error(k);
    s.ci95.row(k) << rho(k) - half, rho(k) + half;
  }
  if (!std::isfinite(s.variance))
    withhold_errors(s,
                    s.degrees_of_freedom < 1
                        ? "as many parameters as samples leave no degree of freedom to tell the noise from"
                        : "so many residuals lie beyond the scale of the loss that its mean curvature is not positive");
  return s;
}

std::string FitStatistics::covariance_in_words() const {
  switch (covariance_type) {
    case CovarianceType::newey_west:
      return "for residuals that are correlated in time (Newey and West), over up to a tenth of each record";
    case CovarianceType::windows:
      return "for residuals that are independent between experiments only";
    case CovarianceType::white:
    case CovarianceType::automatic:
      break;
  }
  return "for residuals that are white";
}

void withhold_errors(FitStatistics& statistics, std::string why) {
  statistics.none = std::move(why);
  statistics.std_error.setConstant(kNaN), statistics.ci95.setConstant(kNaN), statistics.covariance.setConstant(kNaN);
  statistics.correlation.resize(0, 0);
}

}  // namespace mbsopt
