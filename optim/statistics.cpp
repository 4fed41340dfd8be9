#include "optim/statistics.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Singular values below this part of the largest: exact derivatives of a simulation carry errors of about 1e-12, and a
// combination 1e8 times less certain than the best one is of no use.
constexpr double kRankTolerance = 1e-8;
constexpr double kPart = 1e-4;  // entries of a direction smaller than this are zero, and ratios this near are equal

double quantile_975(long degrees_of_freedom, bool sigma_is_known) {
  if (sigma_is_known) return boost::math::quantile(boost::math::normal(), 0.975);
  if (degrees_of_freedom < 1) return kInfinity;
  return boost::math::quantile(boost::math::students_t(static_cast<double>(degrees_of_freedom)), 0.975);
}

// Basis of a null space with as few entries as elimination gives: reduced row echelon form, largest pivots first.
MatrixXd sparse_basis(MatrixXd basis) {  // columns: directions
  MatrixXd rows = basis.transpose();
  std::vector<bool> used(static_cast<std::size_t>(rows.cols()), false);
  for (Index r = 0; r < rows.rows(); ++r) {
    Index pivot_row = r, pivot = -1;
    double largest = 0;
    for (Index i = r; i < rows.rows(); ++i)
      for (Index k = 0; k < rows.cols(); ++k)
        if (!used[static_cast<std::size_t>(k)] && std::abs(rows(i, k)) > largest * (1 + kPart))
          largest = std::abs(rows(i, k)), pivot_row = i, pivot = k;
    if (pivot < 0) break;
    used[static_cast<std::size_t>(pivot)] = true;
    rows.row(r).swap(rows.row(pivot_row));
    rows.row(r) /= rows(r, pivot);
    for (Index i = 0; i < rows.rows(); ++i)
      if (i != r) rows.row(i) -= rows(i, pivot) * rows.row(r);
  }
  return rows.transpose();
}

bool near(double a, double b) { return std::abs(a - b) <= kPart * std::max(std::abs(a), std::abs(b)); }

// d: a direction in rho (pairs of parameter and amount) along which nothing that is measured changes.
std::string direction_in_words(const VectorXd& direction, const VectorXd& rho, const VectorXd& size,
                               const std::vector<std::string>& names) {
  std::vector<Index> in;
  const double largest = direction.cwiseQuotient(size).cwiseAbs().maxCoeff();
  for (Index k = 0; k < direction.size(); ++k)
    if (std::abs(direction(k)) / size(k) > kPart * largest) in.push_back(k);
  auto name = [&](Index k) { return names[static_cast<std::size_t>(k)]; };
  if (in.size() == 1) return fmt::format("{}: does not influence what is measured", name(in[0]));
  if (in.size() == 2) {
    const Index a = in[0], b = in[1];
    const double da = direction(a), db = direction(b);
    if (near(da, -db)) return fmt::format("{0}, {1}: only {0} + {1} is determined", name(a), name(b));
    if (near(da, db)) return fmt::format("{0}, {1}: only {0} - {1} is determined", name(a), name(b));
    if (rho(a) != 0 && rho(b) != 0) {
      const double ra = da / rho(a), rb = db / rho(b);  // relative changes
      if (near(ra, -rb)) return fmt::format("{0}, {1}: only {0}*{1} is determined", name(a), name(b));
      if (near(ra, rb)) return fmt::format("{0}, {1}: only {0}/{1} is determined", name(a), name(b));
    }
    const double ratio = -da / db;  // a + ratio b stays as it is
    return fmt::format("{0}, {1}: only {0} {2} {3:.4g}*{1} is determined", name(a), name(b), ratio < 0 ? '-' : '+',
                       std::abs(ratio));
  }
  const bool relative = std::all_of(in.begin(), in.end(), [&](Index k) { return rho(k) != 0; });
  std::string listed, ratios;
  const double unit = direction(in[0]) / (relative ? rho(in[0]) : 1);
  for (const Index k : in) {
    listed += (listed.empty() ? "" : ", ") + name(k);
    ratios += fmt::format("{}{:.4g}", ratios.empty() ? "" : " : ", direction(k) / (relative ? rho(k) : 1) / unit);
  }
  return fmt::format("{}: {}changes in the ratio {} leave all that is measured as it is", listed,
                     relative ? "relative " : "", ratios);
}

}  // namespace

FitStatistics fit_statistics(const MatrixXd& J, const VectorXd& z, const VectorXd& rho,
                             const std::vector<std::string>& names, bool sigma_is_known) {
  const Index N = J.rows(), P = J.cols();
  FitStatistics s;
  s.degrees_of_freedom = static_cast<long>(N - P);
  s.residual_variance = N > P ? z.squaredNorm() / static_cast<double>(N - P) : std::numeric_limits<double>::quiet_NaN();
  s.std_error.setZero(P), s.ci95.setZero(P, 2);
  s.covariance.setZero(P, P), s.correlation.setIdentity(P, P);
  if (P == 0) return s;

  // Columns of unit length; zero columns are left out.
  VectorXd size = rho.cwiseAbs(), length = J.colwise().norm().transpose();
  for (Index k = 0; k < P; ++k)
    if (size(k) == 0) size(k) = 1;
  std::vector<Index> used;
  VectorXd determined = VectorXd::Ones(P);
  for (Index k = 0; k < P; ++k) {
    if (length(k) > 0) {
      used.push_back(k);
      continue;
    }
    determined(k) = 0;
    s.condition_number = kInfinity;
    s.unidentifiable.push_back(direction_in_words(VectorXd::Unit(P, k), rho, size, names));
  }
  const Index U = static_cast<Index>(used.size());
  if (U > 0) {
    MatrixXd scaled(N, U);
    for (Index c = 0; c < U; ++c)
      scaled.col(c) = J.col(used[static_cast<std::size_t>(c)]) / length(used[static_cast<std::size_t>(c)]);
    // Singular values of the triangular factor, which is as small as the number of parameters.
    MatrixXd R = scaled;
    if (N > U) R = Eigen::HouseholderQR<MatrixXd>(scaled).matrixQR().topRows(U).triangularView<Eigen::Upper>();
    const Eigen::JacobiSVD<MatrixXd> svd(R, Eigen::ComputeFullV);
    VectorXd sigma = VectorXd::Zero(U);
    sigma.head(svd.singularValues().size()) = svd.singularValues();
    const Index rank = (sigma.array() > kRankTolerance * sigma(0)).count();
    if (s.condition_number == 0) s.condition_number = sigma(U - 1) > 0 ? sigma(0) / sigma(U - 1) : kInfinity;

    const double variance = sigma_is_known ? 1 : s.residual_variance;
    const MatrixXd V = svd.matrixV().leftCols(rank) * sigma.head(rank).cwiseInverse().asDiagonal();
    const MatrixXd covariance = variance * (V * V.transpose());
    for (Index a = 0; a < U; ++a)
      for (Index b = 0; b < U; ++b) {
        const Index ka = used[static_cast<std::size_t>(a)], kb = used[static_cast<std::size_t>(b)];
        s.covariance(ka, kb) = covariance(a, b) / (length(ka) * length(kb));
        const double norm = std::sqrt(covariance(a, a) * covariance(b, b));
        if (a != b) s.correlation(ka, kb) = norm > 0 ? covariance(a, b) / norm : 0;
      }
    if (rank < U) {
      MatrixXd null_space = MatrixXd::Zero(P, U - rank);  // relative to the parameters' sizes
      for (Index c = 0; c < U; ++c) {
        const Index k = used[static_cast<std::size_t>(c)];
        null_space.row(k) = svd.matrixV().row(c).tail(U - rank) / (length(k) * size(k));
      }
      null_space = sparse_basis(null_space);
      for (Index c = 0; c < null_space.cols(); ++c) {
        const VectorXd direction = null_space.col(c).cwiseProduct(size);
        const double most = null_space.col(c).cwiseAbs().maxCoeff();
        for (Index k = 0; k < P; ++k)
          if (std::abs(null_space(k, c)) > kPart * most) determined(k) = 0;
        s.unidentifiable.push_back(direction_in_words(direction, rho, size, names));
      }
    }
  }
  const double quantile = quantile_975(s.degrees_of_freedom, sigma_is_known);
  for (Index k = 0; k < P; ++k) {
    s.std_error(k) = determined(k) != 0 ? std::sqrt(s.covariance(k, k)) : kInfinity;
    const double half = s.std_error(k) == 0 ? 0 : quantile * s.std_error(k);
    s.ci95.row(k) << rho(k) - half, rho(k) + half;
  }
  return s;
}

}  // namespace mbsopt
