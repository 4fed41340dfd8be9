#include "optim/solver/row_blocks.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::vector<Index> all_columns(Index n) {
  std::vector<Index> columns(static_cast<std::size_t>(n));
  std::iota(columns.begin(), columns.end(), Index{0});
  return columns;
}

}  // namespace

RowBlocks::RowBlocks(std::vector<RowBlock> blocks, Index columns)
    : blocks_(std::move(blocks)),
      columns_(columns),
      first_(static_cast<std::size_t>(columns)),
      uses_(static_cast<std::size_t>(columns), 0) {
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    for (const Index k : blocks_[b].columns)
      if (uses_[static_cast<std::size_t>(k)]++ == 0) first_[static_cast<std::size_t>(k)] = b;
}

RowBlocks::RowBlocks(const MatrixXd& A) : RowBlocks({{all_columns(A.cols()), A}}, A.cols()) {}

VectorXd RowBlocks::operator*(const VectorXd& d) const {
  VectorXd product(std::accumulate(blocks_.begin(), blocks_.end(), Index{0},
                                   [](Index rows, const RowBlock& block) { return rows + block.A.rows(); }));
  Index row = 0;
  for (const RowBlock& block : blocks_) {
    product.segment(row, block.A.rows()).noalias() = block.A * d(block.columns);
    row += block.A.rows();
  }
  return product;
}

VectorXd RowBlocks::transposed_times(const VectorXd& b) const {
  VectorXd product = VectorXd::Zero(columns_);
  Index row = 0;
  for (const RowBlock& block : blocks_) {
    product(block.columns) += block.A.transpose() * b.segment(row, block.A.rows());
    row += block.A.rows();
  }
  return product;
}

VectorXd RowBlocks::column_norms() const {
  VectorXd squares = VectorXd::Zero(columns_);
  for (const RowBlock& block : blocks_) squares(block.columns) += block.A.colwise().squaredNorm().transpose();
  return squares.cwiseSqrt();
}

VectorXd RowBlocks::solve(const VectorXd& b, const std::vector<Index>& free) const {
  std::vector<bool> is_free(static_cast<std::size_t>(columns_), false);
  for (const Index k : free) is_free[static_cast<std::size_t>(k)] = true;
  // Shared columns, numbered.
  std::vector<Index> shared, number(static_cast<std::size_t>(columns_), 0);
  for (const Index k : free)
    if (uses_[static_cast<std::size_t>(k)] > 1)
      number[static_cast<std::size_t>(k)] = static_cast<Index>(shared.size()), shared.push_back(k);

  struct Eliminated {
    std::vector<Index> own, shared;
    MatrixXd factors;  // [R S q], of as many rows as columns of its own
  };
  std::vector<Eliminated> eliminated;
  std::vector<MatrixXd> left;  // [T p]
  Index row = 0, rows_left = 0;
  for (const RowBlock& block : blocks_) {
    Eliminated e;
    std::vector<Index> places, shared_places;  // in the block
    for (std::size_t i = 0; i < block.columns.size(); ++i) {
      const std::size_t k = static_cast<std::size_t>(block.columns[i]);
      if (!is_free[k]) continue;
      (uses_[k] > 1 ? e.shared : e.own).push_back(block.columns[i]);
      (uses_[k] > 1 ? shared_places : places).push_back(static_cast<Index>(i));
    }
    places.insert(places.end(), shared_places.begin(), shared_places.end());
    const Index m = static_cast<Index>(e.own.size()), n = static_cast<Index>(places.size()), rows = block.A.rows();
    MatrixXd A(rows, n + 1);
    A.leftCols(n) = block.A(Eigen::all, places);
    A.rightCols(1) = b.segment(row, rows);
    row += rows;
    const Eigen::HouseholderQR<MatrixXd> qr(std::move(A));
    const MatrixXd R = qr.matrixQR().topRows(std::min(rows, n)).triangularView<Eigen::Upper>();
    e.factors = R.topRows(m);
    left.push_back(R.bottomRows(R.rows() - m).rightCols(n - m + 1));
    rows_left += left.back().rows();
    eliminated.push_back(std::move(e));
  }

  VectorXd d = VectorXd::Zero(columns_);
  if (!shared.empty()) {
    MatrixXd T = MatrixXd::Zero(rows_left, static_cast<Index>(shared.size()));
    VectorXd p(rows_left);
    Index at = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const MatrixXd& rest = left[i];
      for (std::size_t c = 0; c < eliminated[i].shared.size(); ++c)
        T.col(number[static_cast<std::size_t>(eliminated[i].shared[c])]).segment(at, rest.rows()) =
            rest.col(static_cast<Index>(c));
      p.segment(at, rest.rows()) = rest.rightCols(1);
      at += rest.rows();
    }
    d(shared) = T.householderQr().solve(p);
  }
  for (const Eliminated& e : eliminated) {
    const Index m = static_cast<Index>(e.own.size()), s = static_cast<Index>(e.shared.size());
    VectorXd q = e.factors.rightCols(1);
    if (s > 0) q -= e.factors.middleCols(m, s) * d(e.shared);
    e.factors.leftCols(m).triangularView<Eigen::Upper>().solveInPlace(q);
    d(e.own) = q;
  }
  return d;
}

std::vector<std::vector<std::size_t>> RowBlocks::damped_places() const {
  std::vector<std::vector<std::size_t>> damped(blocks_.size());  // places within each block
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    for (std::size_t i = 0; i < blocks_[b].columns.size(); ++i)
      if (first_[static_cast<std::size_t>(blocks_[b].columns[i])] == b) damped[b].push_back(i);
  return damped;
}

RowBlocks RowBlocks::scaled_and_damped(const VectorXd& D, double lambda) const {
  const std::vector<std::vector<std::size_t>> damped = damped_places();
  std::vector<RowBlock> blocks;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const RowBlock& block = blocks_[b];
    const Index rows = block.A.rows();
    MatrixXd A = MatrixXd::Zero(rows + static_cast<Index>(damped[b].size()), block.A.cols());
    A.topRows(rows) = block.A * D(block.columns).cwiseInverse().asDiagonal();
    for (std::size_t i = 0; i < damped[b].size(); ++i)
      A(rows + static_cast<Index>(i), static_cast<Index>(damped[b][i])) = std::sqrt(lambda);
    blocks.push_back({block.columns, std::move(A)});
  }
  return {std::move(blocks), columns_};
}

VectorXd RowBlocks::beside_damping(const VectorXd& b) const {
  const std::vector<std::vector<std::size_t>> damped = damped_places();
  VectorXd result = VectorXd::Zero(b.size() + columns_);
  Index from = 0, to = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const Index rows = blocks_[i].A.rows();
    result.segment(to, rows) = b.segment(from, rows);
    from += rows, to += rows + static_cast<Index>(damped[i].size());
  }
  return result;
}

}  // namespace mbsopt
