#include "core/linear/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

SymmetricEigen symmetric_eigen(const MatrixXd& A) {
  if (A.size() == 0) return {};
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(A);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& A) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

GeneralEigen general_eigen(const MatrixXd& A) {
  const Eigen::EigenSolver<MatrixXd> eigen(A);
  GeneralEigen x{eigen.eigenvalues(), eigen.eigenvectors(), VectorXd(A.rows())};
  x.vectors.colwise().normalize();
  const Eigen::MatrixXcd left = x.vectors.partialPivLu().inverse();  // whose rows have w'v = 1
  x.conditions = left.rowwise().norm();
  return x;
}

Eigen::VectorXcd left_eigenvector(const MatrixXd& A, std::complex<double> lambda) {
  // w'A = lambda w' is A'w = conj(lambda) w. The shift keeps the matrix regular; two iterations reach rounding.
  const std::complex<double> shifted = std::conj(lambda) + A.norm() * std::numeric_limits<double>::epsilon();
  Eigen::MatrixXcd M = A.transpose();
  M.diagonal().array() -= shifted;
  const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(M);
  Eigen::VectorXcd w = Eigen::VectorXcd::Ones(A.rows());
  for (int k = 0; k < 3; ++k) w = lu.solve(w).normalized();
  return w;
}

MatrixXd cholesky_factor(const MatrixXd& A) {
  const Eigen::LLT<MatrixXd> factor(A);
  return factor.info() == Eigen::Success ? MatrixXd(factor.matrixL()) : MatrixXd();
}

VectorXd cholesky_solve(const MatrixXd& A, const VectorXd& b) { return A.llt().solve(b); }

VectorXd definite_solve(const MatrixXd& A, const VectorXd& b, double threshold) {
  const Eigen::LLT<MatrixXd> factor(A);
  if (factor.info() != Eigen::Success || A.size() == 0) return {};
  const VectorXd pivots = factor.matrixLLT().diagonal().cwiseAbs2();
  if (!(pivots.minCoeff() >= threshold * pivots.maxCoeff())) return {};
  return factor.solve(b);
}

Eigen::MatrixXcd regular_solve(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& b) {
  return A.partialPivLu().solve(b);
}
MatrixXd inverse(const MatrixXd& A) { return A.partialPivLu().inverse(); }

VectorXd least_squares(const MatrixXd& A, const VectorXd& b) { return A.colPivHouseholderQr().solve(b); }

// For single numbers or lanes.
template <class X>
void SquareFactor::solve_permuted(X& x) const {
  const Index n = LU_.rows();
  for (Index i = 1; i < n; ++i)
    for (Index j = 0; j < i; ++j)
      if (LU_(i, j) != 0) x.row(i) -= LU_(i, j) * x.row(j);
  for (Index i = n - 1; i >= 0; --i) {
    for (Index j = i + 1; j < n; ++j)
      if (LU_(i, j) != 0) x.row(i) -= LU_(i, j) * x.row(j);
    x.row(i) *= inverse_pivots_(i);
  }
}

bool SquareFactor::compute(const MatrixXd& A) {
  constexpr double kSingular = 1e-14;
  const Index n = A.rows();
  LU_ = A;
  order_.setLinSpaced(n, 0, n - 1);
  inverse_pivots_.resize(n);
  double largest = 0, least = std::numeric_limits<double>::infinity();
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i)
      if (std::abs(LU_(i, k)) > std::abs(LU_(pivot, k))) pivot = i;
    if (pivot != k) LU_.row(k).swap(LU_.row(pivot)), std::swap(order_(k), order_(pivot));
    const double size = std::abs(LU_(k, k));
    largest = std::max(largest, size);
    least = std::min(least, size);
    if (!(size > 0)) return false;
    inverse_pivots_(k) = 1 / LU_(k, k);
    const double* const from = &LU_(k, 0);
    for (Index i = k + 1; i < n; ++i) {
      double* const to = &LU_(i, 0);
      if (to[k] == 0) continue;
      const double factor = to[k] *= inverse_pivots_(k);
      for (Index j = k + 1; j < n; ++j) to[j] -= factor * from[j];
    }
  }
  return n > 0 && least > kSingular * largest;
}
void SquareFactor::solve(Eigen::Ref<VectorXd> b) {
  x_.resize(b.size());
  for (Index i = 0; i < b.size(); ++i) x_(i) = b(order_(i));  // Eigen's b(order_) copies the order
  solve_permuted(x_);
  b = x_;
}
void SquareFactor::solve_lanes(Eigen::Ref<LaneRows> b) {
  lanes_.resize(b.rows(), b.cols());
  for (Index i = 0; i < b.rows(); ++i) lanes_.row(i) = b.row(order_(i));
  solve_permuted(lanes_);
  b = lanes_;
}
void SquareFactor::solve_transposed(Eigen::Ref<VectorXd> b) {  // U'L'(P x) = b
  x_ = b;
  for (Index i = 0; i < x_.size(); ++i) {
    x_(i) *= inverse_pivots_(i);
    for (Index j = i + 1; j < x_.size(); ++j) x_(j) -= LU_(i, j) * x_(i);
  }
  for (Index i = x_.size() - 1; i > 0; --i)
    for (Index j = 0; j < i; ++j) x_(j) -= LU_(i, j) * x_(i);
  for (Index i = 0; i < x_.size(); ++i) b(order_(i)) = x_(i);
}

MatrixXd null_space(const MatrixXd& A, double threshold) {
  if (A.rows() == 0) return MatrixXd::Identity(A.cols(), A.cols());
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(threshold);
  qr.compute(A.transpose());
  return qr.householderQ() * MatrixXd::Identity(A.cols(), A.cols()).rightCols(A.cols() - qr.rank());
}

MatrixXd orthonormal_columns(const MatrixXd& A) {
  if (A.cols() == 0) return A;
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  const MatrixXd AP = A * qr.colsPermutation(), R = qr.matrixR().topRows(A.cols());
  return R.triangularView<Eigen::Upper>().solve<Eigen::OnTheRight>(AP);
}

MatrixXd triangular_factor(MatrixXd A) {
  const Index rows = std::min(A.rows(), A.cols());
  return Eigen::HouseholderQR<MatrixXd>(std::move(A)).matrixQR().topRows(rows).triangularView<Eigen::Upper>();
}

MatrixXd orthogonal_factor(const MatrixXd& A, Index columns) {
  return Eigen::HouseholderQR<MatrixXd>(A).householderQ() * MatrixXd::Identity(A.rows(), columns);
}

LeftSingular left_singular(const MatrixXd& A) {
  if (A.size() == 0) return {VectorXd(0), MatrixXd::Identity(A.rows(), A.rows())};
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullU);
  return {svd.singularValues(), svd.matrixU()};
}

RightSingular right_singular(const MatrixXd& A) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

namespace {

constexpr Index kSmall = 32;  // columns: plain loops then take a third of the time of Eigen's blocks

// Replaces the lower triangle of a symmetric G by L, G = L L'. Returns false if G is not positive definite.
bool cholesky_in_place(MatrixXd& G) {
  if (G.rows() > kSmall) return Eigen::LLT<Eigen::Ref<MatrixXd>>(G).info() == Eigen::Success;
  for (Index k = 0; k < G.rows(); ++k) {
    if (!(G(k, k) > 0)) return false;
    auto column = G.col(k).tail(G.rows() - k);
    column /= std::sqrt(G(k, k));
    for (Index j = k + 1; j < G.rows(); ++j)
      G.col(j).tail(G.rows() - j).noalias() -= G(j, k) * column.tail(G.rows() - j);
  }
  return true;
}
void solve_with_cholesky(const MatrixXd& L, VectorXd& b) {
  const Index n = L.rows();
  for (Index k = 0; k < n; ++k) {
    b(k) /= L(k, k);
    b.tail(n - k - 1) -= b(k) * L.col(k).tail(n - k - 1);
  }
  for (Index k = n - 1; k >= 0; --k) b(k) = (b(k) - L.col(k).tail(n - k - 1).dot(b.tail(n - k - 1))) / L(k, k);
}

}  // namespace

// Takes the least eigenvalue of G = A'A, or AA' if that is smaller, and its vector x by inverse iteration. With the
// Rayleigh quotient theta and the residual r of x, an eigenvalue is within r of theta, and the least one is below
// theta. If G - (theta - 2 r) I has a Cholesky factor, none is below the shift, which then speeds up the iteration. As
// long as the singular value is far above the root of rounding, this has no fewer digits than the decomposition of A.
LeastSingular least_singular(const MatrixXd& A) {
  constexpr double kFarAboveRounding = 1e-5;  // of the largest
  constexpr double kShift = 1e-10;            // of the largest eigenvalue, so that the matrix has an inverse
  constexpr double kNearer = 0.1;             // what a factor has to gain: it costs as much as three steps
  constexpr int kMost = 30;                   // eight to ten are usual
  const bool is_wide = A.rows() < A.cols();
  const MatrixXd tall = is_wide ? MatrixXd(A.transpose()) : A;
  const MatrixXd G =
      tall.cols() <= kSmall ? MatrixXd(tall.transpose().lazyProduct(tall)) : MatrixXd(tall.transpose() * tall);
  const double largest = G.trace();  // not below the largest eigenvalue
  MatrixXd L = G, nearer;
  const bool has_inverse = cholesky_in_place(L);
  double shift = 0;
  VectorXd inner = VectorXd::LinSpaced(G.rows(), 1, 2).normalized(), before;  // of no symmetry of mechanisms
  for (int k = 0; has_inverse && k < kMost; ++k) {
    before = inner;
    solve_with_cholesky(L, inner);
    inner.normalize();
    const VectorXd image = G * inner;
    const double theta = inner.dot(image);
    if (!(theta > kFarAboveRounding * kFarAboveRounding * largest)) break;
    if (shift > 0 && (inner - before).norm() <= 1e-14) {
      VectorXd outer = tall * inner;
      const double value = outer.norm();
      outer /= value;
      if (is_wide) inner.swap(outer);
      return {value, outer, inner};
    }
    const double lower = theta - 2 * (image - theta * inner).norm() - kShift * largest;
    if (theta - lower > kNearer * (theta - shift)) continue;
    nearer = G;
    nearer.diagonal().array() -= lower;
    if (!cholesky_in_place(nearer)) continue;
    L.swap(nearer);
    shift = lower;
  }
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Index last = svd.singularValues().size() - 1;
  return {svd.singularValues()(last), svd.matrixU().col(last), svd.matrixV().col(last)};
}

struct OrthogonalDecomposition::Factors {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> cod;  // Eigen reads beyond matrices without entries
  Index rows = 0, cols = 0;
  bool is_empty() const { return rows == 0 || cols == 0; }
};

OrthogonalDecomposition::OrthogonalDecomposition() : factors_(std::make_unique<Factors>()) {}
OrthogonalDecomposition::OrthogonalDecomposition(const MatrixXd& A, double threshold) : OrthogonalDecomposition() {
  compute(A, threshold);
}
OrthogonalDecomposition::OrthogonalDecomposition(const OrthogonalDecomposition& other)
    : factors_(std::make_unique<Factors>(*other.factors_)) {}
OrthogonalDecomposition::OrthogonalDecomposition(OrthogonalDecomposition&&) noexcept = default;
OrthogonalDecomposition& OrthogonalDecomposition::operator=(OrthogonalDecomposition other) noexcept {
  factors_ = std::move(other.factors_);
  return *this;
}
OrthogonalDecomposition::~OrthogonalDecomposition() = default;

void OrthogonalDecomposition::compute(const MatrixXd& A, double threshold) {
  factors_->rows = A.rows();
  factors_->cols = A.cols();
  if (factors_->is_empty()) return;
  threshold < 0 ? factors_->cod.setThreshold(Eigen::Default) : factors_->cod.setThreshold(threshold);
  factors_->cod.compute(A);
}

Index OrthogonalDecomposition::rank() const { return factors_->is_empty() ? 0 : factors_->cod.rank(); }
MatrixXd OrthogonalDecomposition::solve(const MatrixXd& b) const {
  if (factors_->is_empty()) return MatrixXd::Zero(factors_->cols, b.cols());
  return factors_->cod.solve(b);
}
MatrixXd OrthogonalDecomposition::solve_transposed(const MatrixXd& b) const {
  if (factors_->is_empty()) return MatrixXd::Zero(factors_->rows, b.cols());
  return factors_->cod.transpose().solve(b);
}
MatrixXd OrthogonalDecomposition::null_space() const {
  const Index cols = factors_->cols;
  if (factors_->is_empty()) return MatrixXd::Identity(cols, cols);
  return factors_->cod.colsPermutation() * factors_->cod.matrixZ().transpose().rightCols(cols - rank());
}
MatrixXd OrthogonalDecomposition::left_null_space() const {
  const Index rows = factors_->rows;
  if (factors_->is_empty()) return MatrixXd::Identity(rows, rows);
  return factors_->cod.householderQ() * MatrixXd::Identity(rows, rows).rightCols(rows - rank());
}

}  // namespace mbsopt
