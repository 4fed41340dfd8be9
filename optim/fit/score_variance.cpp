#include "optim/fit/score_variance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linear/dense.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// If the fit leaves nothing of the variance of so few records or samples, there is no standard error at all.
constexpr double kLeastLeft = 0.05;

// Calls add(S, weight) for the sum S of the scores in each window [tau, tau + H]. A weight is the share d tau/H of the
// starts tau with these samples.
template <class Add>
void for_windows(const MatrixXd& scores, const SampledRecord& record, double H, Add&& add) {
  const Index n = record.t.size();
  VectorXd S = VectorXd::Zero(scores.cols());
  Index enters = 0, leaves = 0;  // the samples that a later start takes in, at tau = t - H, and drops, at tau = t
  double tau = record.t(0) - H;
  while (leaves < n) {
    const bool in = enters < n && record.t(enters) - H <= record.t(leaves);
    const double next = in ? record.t(enters) - H : record.t(leaves);
    if (next > tau) add(S, (next - tau) / H);
    tau = next;
    if (in)
      S += scores.row(record.first + enters++).transpose();
    else
      S -= scores.row(record.first + leaves++).transpose();
  }
}

// The same over windows, or over whole records.
template <class Add>
void for_sums(const MatrixXd& scores, const std::vector<SampledRecord>& records, bool by_windows, Add&& add) {
  for (const SampledRecord& record : records) {
    if (!by_windows)
      add(VectorXd(scores.middleRows(record.first, record.t.size()).colwise().sum().transpose()), 1.0);
    else if (record.duration() > 0)
      for_windows(scores, record, kLagPart * record.duration(), add);
  }
}

MatrixXd sum_of_squares(const MatrixXd& scores, const std::vector<SampledRecord>& records, bool by_windows) {
  MatrixXd lower = MatrixXd::Zero(scores.cols(), scores.cols());
  for_sums(scores, records, by_windows,
           [&](const VectorXd& S, double weight) { lower.selfadjointView<Eigen::Lower>().rankUpdate(S, weight); });
  return lower.selfadjointView<Eigen::Lower>();
}

}  // namespace

ScoreVariance::ScoreVariance(CovarianceType type, std::vector<SampledRecord> records,
                             std::vector<SampledRecord> motions)
    : type_(type), records_(std::move(records)), motions_(motions.empty() ? records_ : std::move(motions)) {}

MatrixXd ScoreVariance::within(const MatrixXd& scores) const { return sum_of_squares(scores, motions_, true); }

MatrixXd ScoreVariance::between(const MatrixXd& scores) const { return sum_of_squares(scores, records_, false); }

double ScoreVariance::share_left(const VectorXd& a_J, const MatrixXd& q, bool of_one_record) const {
  const double all = a_J.squaredNorm();
  double explained = 0;
  const bool within = !is_between(of_one_record);
  for_sums(a_J.asDiagonal() * q, within ? motions_ : records_, within,
           [&](const VectorXd& S, double weight) { explained += weight * S.squaredNorm(); });
  return all > 0 ? std::max(1 - explained / all, kLeastLeft) : 1;
}

VectorXd ScoreVariance::left_out(VectorXd z, const MatrixXd& J, const MatrixXd& inverse) const {
  for (const SampledRecord& record : records_) {
    const Index n = record.t.size();
    std::vector<Index> acting;
    for (Index k = 0; k < J.cols(); ++k)
      if (!J.col(k).segment(record.first, n).isZero(0)) acting.push_back(k);
    if (acting.empty()) continue;  // nothing is fitted to it
    const MatrixXd J_w = J(Eigen::seqN(record.first, n), acting);
    const MatrixXd R = triangular_factor(J_w), Q = orthogonal_factor(J_w, R.rows());
    const SymmetricEigen S = symmetric_eigen(R * inverse(acting, acting) * R.transpose());
    const VectorXd left = (1 - S.values.array()).max(kLeastLeft);
    auto z_w = z.segment(record.first, n);
    const VectorXd along = S.vectors.transpose() * (Q.transpose() * z_w);
    z_w += Q * (S.vectors * along.cwiseProduct(S.values).cwiseQuotient(left));
  }
  return z;
}

long ScoreVariance::freedom() const {
  const long records = static_cast<long>(records_.size());
  return type_ == CovarianceType::newey_west ? std::lround(1.5 / kLagPart) : std::max(1L, records - 1);
}

}  // namespace mbsopt::inline optim
