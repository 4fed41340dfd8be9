#include "core/linear/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
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

struct SquareFactor::Factors {
  Eigen::PartialPivLU<MatrixXd> lu;
  VectorXd x;
  Eigen::Matrix<double, Eigen::Dynamic, kLanes, Eigen::RowMajor> rows;
};

SquareFactor::SquareFactor() : factors_(std::make_unique<Factors>()) {}
SquareFactor::SquareFactor(SquareFactor&&) noexcept = default;
SquareFactor::~SquareFactor() = default;

bool SquareFactor::compute(const MatrixXd& A) {
  constexpr double kSingular = 1e-14;
  factors_->lu.compute(A);
  const auto pivots = factors_->lu.matrixLU().diagonal().cwiseAbs();
  return A.size() > 0 && pivots.minCoeff() > kSingular * pivots.maxCoeff();
}
void SquareFactor::solve(Eigen::Ref<VectorXd> b) const {
  factors_->x = factors_->lu.solve(b);
  b = factors_->x;
}
void SquareFactor::solve_lanes(Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, kLanes, Eigen::RowMajor>> b) const {
  auto& x = factors_->rows;
  const MatrixXd& LU = factors_->lu.matrixLU();
  x.noalias() = factors_->lu.permutationP() * b;
  const Index n = LU.rows();  // a row of b is a few numbers: Eigen's blocked solution is made for many
  for (Index j = 0; j < n; ++j)
    for (Index i = j + 1; i < n; ++i) x.row(i) -= LU(i, j) * x.row(j);
  for (Index j = n - 1; j >= 0; --j) {
    x.row(j) /= LU(j, j);
    for (Index i = 0; i < j; ++i) x.row(i) -= LU(i, j) * x.row(j);
  }
  b = x;
}
void SquareFactor::solve_transposed(Eigen::Ref<VectorXd> b) const {
  factors_->x = factors_->lu.transpose().solve(b);
  b = factors_->x;
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

MatrixXd orthogonal_factor(const MatrixXd& A) {
  return Eigen::HouseholderQR<MatrixXd>(A).householderQ() * MatrixXd::Identity(A.rows(), A.cols());
}

LeftSingular left_singular(const MatrixXd& A) {
  if (A.size() == 0) return {VectorXd(0), MatrixXd::Identity(A.rows(), A.rows())};
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullU);
  return {svd.singularValues(), svd.matrixU()};
}

LeastSingular least_singular(const MatrixXd& A) {
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
  factors_->rows = A.rows(), factors_->cols = A.cols();
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
MatrixXd OrthogonalDecomposition::left_null_space() const {
  const Index rows = factors_->rows;
  if (factors_->is_empty()) return MatrixXd::Identity(rows, rows);
  return factors_->cod.householderQ() * MatrixXd::Identity(rows, rows).rightCols(rows - rank());
}

}  // namespace mbsopt
