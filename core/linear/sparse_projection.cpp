#include "core/linear/sparse_projection.hpp"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <vector>

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kAlpha = 1e8;
constexpr int kMostPasses = 60;
constexpr double kRounding = 1e-16;  // of x: the last change by a pass
constexpr double kStagnation = 0.5;  // a pass that changes more than that part of the one before is the last
constexpr int kLeastPasses = 3;

using Sparse = Eigen::SparseMatrix<double>;

}  // namespace

struct SparseProjection::Factor {
  Sparse J;
  VectorXd scale;  // of its rows
  Eigen::SimplicialLDLT<Sparse> S;
};

SparseProjection::SparseProjection(Index rows, Index columns, std::span<const SparseEntry> entries)
    : factor_(std::make_unique<Factor>()) {
  std::vector<Eigen::Triplet<double, int>> triplets;
  for (const SparseEntry& e : entries) triplets.emplace_back(e.row, e.column, e.value);
  Factor& f = *factor_;
  f.J.resize(rows, columns);
  f.J.setFromTriplets(triplets.begin(), triplets.end());
  const VectorXd squares = f.J.cwiseProduct(f.J) * VectorXd::Ones(columns);
  f.scale = (squares.array() > 0).select(squares.array().max(1e-300).sqrt().inverse(), 1.0);
  f.J = f.scale.asDiagonal() * f.J;
  Sparse S = kAlpha * Sparse(f.J.transpose() * f.J);
  Sparse identity(columns, columns);
  identity.setIdentity();
  f.S.compute(S + identity);
}
SparseProjection::~SparseProjection() = default;
SparseProjection::SparseProjection(SparseProjection&&) noexcept = default;

// x + J'nu = g, J x = b, J scaled.
void SparseProjection::solve_system(const MatrixXd& b, const Eigen::Ref<const MatrixXd>& g, MatrixXd& x,
                                    MatrixXd& nu) const {
  const Factor& f = *factor_;
  x = MatrixXd::Zero(f.J.cols(), g.cols());
  nu = MatrixXd::Zero(f.J.rows(), g.cols());
  MatrixXd left = b;  // b - J x
  double before = INFINITY;
  for (int k = 0; k < kMostPasses; ++k) {
    const MatrixXd dx = f.S.solve(g - x - f.J.transpose() * (nu - kAlpha * left));
    x += dx;
    left -= f.J * dx;
    nu -= kAlpha * left;
    const double now = dx.cwiseAbs().maxCoeff();
    if (now <= kRounding * x.cwiseAbs().maxCoeff() || (k >= kLeastPasses && now > kStagnation * before)) return;
    before = now;
  }
}

MatrixXd SparseProjection::solve(const Eigen::Ref<const MatrixXd>& b, const Eigen::Ref<const MatrixXd>& g) const {
  MatrixXd x, nu;
  solve_system(factor_->scale.asDiagonal() * b, g, x, nu);
  return x;
}

const VectorXd& SparseProjection::row_scale() const { return factor_->scale; }
MatrixXd SparseProjection::left(const Eigen::Ref<const MatrixXd>& b, const Eigen::Ref<const MatrixXd>& x) const {
  return factor_->scale.asDiagonal() * b - factor_->J * x;
}

// The system is symmetric: with (x_bar, 0) it gives g_bar = (I - J+ J) x_bar and b_bar = (J+)' x_bar.
void SparseProjection::solve_transposed(const Eigen::Ref<const MatrixXd>& x_bar, MatrixXd& b_bar,
                                        MatrixXd& g_bar) const {
  MatrixXd nu;
  solve_system(MatrixXd::Zero(factor_->J.rows(), x_bar.cols()), x_bar, g_bar, nu);
  b_bar = factor_->scale.asDiagonal() * nu;
}

}  // namespace mbsopt
