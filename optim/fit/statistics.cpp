#include "optim/fit/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linear/dense.hpp"
#include "optim/fit/determined_combinations.hpp"
#include "optim/fit/distributions.hpp"

namespace mbsopt::inline optim {
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

// psi = rho1 z and psi_z = rho1 + 2 z^2 rho2 of each residual. For the square psi is z.
struct Influences {
  VectorXd psi, psi_z;
  VectorXd scaled() const { return psi / psi_z.mean(); }
};

Influences influences_of(const FitData& data) {
  Influences all{data.z, VectorXd::Ones(data.z.size())};
  if (data.loss.type == LossType::squared) return all;
  for (Index i = 0; i < data.z.size(); ++i) {
    const double z = data.z(i);
    const LossValue v = data.loss.at(z * z);
    all.psi(i) = v.rho1 * z;
    all.psi_z(i) = v.rho1 + 2 * z * z * v.rho2;
  }
  return all;
}

// v, as in the header.
double variance_of(const FitData& data, long degrees_of_freedom, double s2) {
  if (data.loss.type == LossType::squared) return data.sigma_is_known ? 1 : s2;
  const double N = static_cast<double>(data.z.size()), P = static_cast<double>(data.rho.size() - data.C.rows());
  if (degrees_of_freedom < 1) return s2;
  const Influences of = influences_of(data);
  const double slope = of.psi_z.mean(), slope_squares = of.psi_z.squaredNorm() / N;
  if (!(slope > 0)) return kInfinity;
  const double K = 1 + P / N * (slope_squares - slope * slope) / (slope * slope);
  return K * K * of.psi.squaredNorm() / static_cast<double>(degrees_of_freedom) / (slope * slope);
}

// Orthonormal columns Z with C Z = 0; C: of independent rows.
MatrixXd null_space_of(const MatrixXd& C) {
  return orthogonal_factor(C.transpose(), C.cols()).rightCols(C.cols() - C.rows());
}

// V V' where `held` rows of V stay zero.
MatrixXd inverse_without(const MatrixXd& V, const std::vector<Index>& held) {
  if (held.empty()) return V * V.transpose();
  if (static_cast<Index>(held.size()) >= V.cols()) return MatrixXd::Zero(V.rows(), V.rows());
  const MatrixXd free = V * null_space_of(V(held, Eigen::all));
  return free * free.transpose();
}

// The columns of J and their lengths. Columns of no effect are left out, unless equations tie their parameters to
// others.
struct Columns {
  std::vector<Index> used, unseen;
  VectorXd length;  // of all columns; a tied one of no effect is as long as the largest effect makes it
};

Columns columns_of(const FitData& data, const MatrixXd& J, const VectorXd& size) {
  Columns columns{{}, {}, J.colwise().norm().transpose()};
  const VectorXd& change = data.change.size() == size.size() ? data.change : size;
  const double most_seen = columns.length.cwiseProduct(change.cwiseAbs()).maxCoeff();
  for (Index k = 0; k < size.size(); ++k) {
    const double seen = columns.length(k) * std::abs(change(k));
    const bool tied = data.C.rows() > 0 && !data.C.col(k).isZero(0) && change(k) != 0 && most_seen > 0;
    if (seen > 0 && seen > kNoInfluence * data.record) {
      columns.used.push_back(k);
    } else if (tied) {  // the equations may determine it by what others show
      columns.used.push_back(k);
      columns.length(k) = most_seen / std::abs(change(k));
    } else {
      columns.unseen.push_back(k);
    }
  }
  return columns;
}

// The right singular vectors and values of J in the used columns, scaled to unit length, within C d rho = 0.
struct Directions {
  MatrixXd vectors;  // used x F
  VectorXd sigma;    // F, descending
  Index rank;
  MatrixXd over_sigma() const { return vectors.leftCols(rank) * sigma.head(rank).cwiseInverse().asDiagonal(); }
};

Directions directions_of(const FitData& data, const MatrixXd& scaled, const Columns& columns) {
  const Index U = scaled.cols();
  const MatrixXd Z =
      data.C.rows() > 0
          ? null_space_of(data.C(Eigen::all, columns.used) * columns.length(columns.used).cwiseInverse().asDiagonal())
          : MatrixXd::Identity(U, U);
  // Singular values of the triangular factor, which is as small as the number of parameters.
  MatrixXd triangle = scaled * Z;
  if (scaled.rows() > Z.cols()) triangle = triangular_factor(std::move(triangle));
  const RightSingular svd = right_singular(triangle);
  VectorXd sigma = VectorXd::Zero(Z.cols());
  sigma.head(svd.values.size()) = svd.values;
  const Index rank = (sigma.array() > std::max(kRankTolerance, data.accuracy) * sigma(0)).count();
  return {Z * svd.V, sigma, rank};
}

// The sandwich of the used columns. V V' = (scaled'scaled)^-1 of the determined directions.
MatrixXd sandwich_covariance(const FitData& data, const ScoreVariance& scores_vary, const MatrixXd& scaled,
                             const MatrixXd& V, const std::vector<Index>& used, double variance) {
  const Index N = data.J.rows(), R = data.J_prior.rows(), U = scaled.cols();
  const auto is_set = [&](const std::vector<bool>& marks, Index a) {
    return !marks.empty() && marks[static_cast<std::size_t>(used[static_cast<std::size_t>(a)])];
  };
  const MatrixXd q = scaled * V, inverse = V * V.transpose(), a_J = scaled.topRows(N) * inverse;
  const VectorXd z = influences_of(data).scaled();
  MatrixXd scores = z.asDiagonal() * scaled.topRows(N);
  scores.rowwise() -= scores.colwise().mean().eval();  // zero but for the pull of priors and of bounds
  const MatrixXd within = inverse * scores_vary.within(scores) * inverse;
  VectorXd left_out;
  if (scores_vary.has_windows()) {
    std::vector<Index> held;
    for (Index a = 0; a < U; ++a)
      if (is_set(data.at_bound, a)) held.push_back(a);
    left_out = scores_vary.left_out(z, scaled.topRows(N), inverse_without(V, held));
  }
  VectorXd larger = VectorXd::Ones(U);  // standard errors than those of `within`
  for (Index a = 0; a < U; ++a) {
    const bool alone = is_set(data.of_one_record, a), by_windows = !alone && scores_vary.has_windows();
    VectorXd of_a = scores * inverse.col(a);
    if (by_windows) of_a += a_J.col(a).cwiseProduct(left_out - z);
    const double left = by_windows ? 1 : scores_vary.share_left(a_J.col(a), q.topRows(N), alone);
    const double variance_a =
        (scores_vary.is_between(alone) ? scores_vary.between(of_a) : scores_vary.within(of_a))(0, 0) / left;
    if (within(a, a) > 0) larger(a) = std::sqrt(variance_a / within(a, a));
  }
  MatrixXd covariance = larger.asDiagonal() * within * larger.asDiagonal();
  if (R > 0) {  // v^2 J_prior'J_prior, which the scaled rows have v times
    const MatrixXd prior = std::sqrt(variance) * scaled.bottomRows(R) * inverse;
    covariance += prior.transpose() * prior;
  }
  return covariance;
}

// From the covariance of the used columns, of unit length, and from what it is for white residuals.
void set_covariance(FitStatistics& s, const Columns& columns, const MatrixXd& covariance, const MatrixXd& white) {
  for (Index a = 0; a < covariance.rows(); ++a)
    for (Index b = 0; b < covariance.cols(); ++b) {
      const Index ka = columns.used[static_cast<std::size_t>(a)], kb = columns.used[static_cast<std::size_t>(b)];
      s.covariance(ka, kb) = covariance(a, b) / (columns.length(ka) * columns.length(kb));
      if (a == b && white(a, a) > 0) s.inflation(ka) = covariance(a, a) / white(a, a);
      const double norm = std::sqrt(covariance(a, a) * covariance(b, b));
      if (a != b) s.correlation(ka, kb) = norm > 0 ? covariance(a, b) / norm : 0;
    }
}

}  // namespace

FitStatistics fit_statistics(const FitData& data) {
  const Index N = data.J.rows(), R = data.J_prior.rows(), P = data.rho.size();
  FitStatistics s;
  s.degrees_of_freedom = static_cast<long>(N + R + data.C.rows() - P);
  s.residual_variance =
      s.degrees_of_freedom > 0 ? data.z.squaredNorm() / static_cast<double>(s.degrees_of_freedom) : kNaN;
  s.variance = variance_of(data, s.degrees_of_freedom, s.residual_variance);
  // Without it, the determined combinations are still found.
  const double variance = std::isfinite(s.variance) ? s.variance : 1;
  const bool normal = data.sigma_is_known && data.loss.type == LossType::squared;
  s.quantile = quantile_975(s.degrees_of_freedom, normal);
  s.std_error.setZero(P);
  s.covariance.setZero(P, P);
  s.correlation.setIdentity(P, P);
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

  const VectorXd size = data.rho.unaryExpr([](double x) { return x == 0 ? 1 : std::abs(x); });
  const Columns columns = columns_of(data, J, size);
  std::vector<VectorXd> unseen;  // directions, in changes over sizes
  for (const Index k : columns.unseen) unseen.push_back(VectorXd::Unit(P, k));
  if (!unseen.empty()) s.condition_number = kInfinity;
  if (!columns.used.empty()) {
    const MatrixXd scaled = J(Eigen::all, columns.used) * columns.length(columns.used).cwiseInverse().asDiagonal();
    const Directions directions = directions_of(data, scaled, columns);
    const VectorXd& sigma = directions.sigma;
    const Index F = sigma.size(), rank = directions.rank;
    if (unseen.empty()) s.condition_number = sigma(F - 1) > 0 ? sigma(0) / sigma(F - 1) : kInfinity;
    const MatrixXd V = directions.over_sigma(), white = variance * (V * V.transpose());
    set_covariance(s, columns,
                   sandwich ? sandwich_covariance(data, scores_vary, scaled, V, columns.used, variance) : white, white);
    for (Index c = rank; c < F; ++c) {
      VectorXd direction = VectorXd::Zero(P);
      direction(columns.used) =
          directions.vectors.col(c).cwiseQuotient(columns.length(columns.used).cwiseProduct(size(columns.used)));
      unseen.push_back(direction.normalized());
    }
  }
  MatrixXd null_space(P, static_cast<Index>(unseen.size()));
  for (std::size_t c = 0; c < unseen.size(); ++c) null_space.col(static_cast<Index>(c)) = unseen[c];
  s.unidentifiable = determined_combinations(null_space, data.rho, size, data.names, data.units);
  const std::vector<bool> changed = changed_parameters(null_space);
  for (Index k = 0; k < P; ++k) {
    s.std_error(k) = changed[static_cast<std::size_t>(k)] ? kInfinity : std::sqrt(s.covariance(k, k));
  }
  if (!std::isfinite(s.variance))
    withhold_errors(s,
                    s.degrees_of_freedom < 1
                        ? "as many parameters as samples leave no degree of freedom to tell the noise from"
                        : "so many residuals lie beyond the scale of the loss that its mean curvature is not positive");
  return s;
}

std::string FitStatistics::covariance_in_words() const {
  return covariance_type == CovarianceType::newey_west
             ? "for residuals that are correlated in time (Newey and West), over up to a tenth of each record"
         : covariance_type == CovarianceType::windows ? "for residuals that are independent between experiments only"
                                                      : "for residuals that are white";
}

void withhold_errors(FitStatistics& statistics, std::string why) {
  statistics.none = std::move(why);
  statistics.std_error.setConstant(kNaN);
  statistics.covariance.setConstant(kNaN);
  statistics.correlation.resize(0, 0);
}

}  // namespace mbsopt::inline optim
