#include "optim/solver/row_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "core/linear/dense.hpp"

namespace mbsopt::inline optim {

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
    : blocks_(std::move(blocks)), columns_(columns), places_(static_cast<std::size_t>(columns)) {
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    for (const Index k : blocks_[b].columns) places_[static_cast<std::size_t>(k)].push_back(b);
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

namespace {

// The remaining rows of some blocks: [A | b] with these columns.
struct Remainder {
  std::vector<Index> columns;
  MatrixXd A_b;
};

// Gives d_own from R d_own = q - S d_others.
struct Eliminated {
  std::vector<Index> own, others;
  MatrixXd factors;  // [R S q]
};

// Eliminates the columns `own` from these rows.
Eliminated eliminate(std::vector<Index> own, const std::vector<Remainder>& parts, Remainder& left) {
  std::set<Index> others;
  Index rows = 0;
  for (const Remainder& part : parts) {
    rows += part.A_b.rows();
    others.insert(part.columns.begin(), part.columns.end());
  }
  for (const Index k : own) others.erase(k);
  std::vector<Index> order = own;
  order.insert(order.end(), others.begin(), others.end());
  std::map<Index, Index> place;
  for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<Index>(i);
  const Index m = static_cast<Index>(own.size()), n = static_cast<Index>(order.size());
  MatrixXd A_b = MatrixXd::Zero(rows, n + 1);
  rows = 0;
  for (const Remainder& part : parts) {
    for (std::size_t i = 0; i < part.columns.size(); ++i)
      A_b.col(place[part.columns[i]]).segment(rows, part.A_b.rows()) = part.A_b.col(static_cast<Index>(i));
    A_b.rightCols(1).middleRows(rows, part.A_b.rows()) = part.A_b.rightCols(1);
    rows += part.A_b.rows();
  }
  const MatrixXd R = triangular_factor(std::move(A_b)).topRows(std::min(rows, n));
  left = {{others.begin(), others.end()}, R.bottomRows(R.rows() - m).rightCols(n - m + 1)};
  return {std::move(own), left.columns, R.topRows(m)};
}

}  // namespace

VectorXd RowBlocks::solve(const VectorXd& b, const std::vector<Index>& free) const {
  using Places = std::vector<std::size_t>;
  std::map<std::pair<std::size_t, Places>, std::vector<Index>> groups;  // by the number of blocks, then their order
  for (const Index k : free)
    if (const Places& places = places_[static_cast<std::size_t>(k)]; !places.empty())
      groups[{places.size(), places}].push_back(k);

  std::vector<bool> is_free(static_cast<std::size_t>(columns_), false);
  for (const Index k : free) is_free[static_cast<std::size_t>(k)] = true;
  std::vector<Remainder> remainders;
  Index row = 0;
  for (const RowBlock& block : blocks_) {
    Remainder rest;
    std::vector<Index> taken;  // columns of the block
    for (std::size_t i = 0; i < block.columns.size(); ++i)
      if (is_free[static_cast<std::size_t>(block.columns[i])])
        rest.columns.push_back(block.columns[i]), taken.push_back(static_cast<Index>(i));
    rest.A_b.resize(block.A.rows(), static_cast<Index>(taken.size()) + 1);
    rest.A_b.leftCols(static_cast<Index>(taken.size())) = block.A(Eigen::all, taken);
    rest.A_b.rightCols(1) = b.segment(row, block.A.rows());
    row += block.A.rows();
    remainders.push_back(std::move(rest));
  }

  // The present place of each block's rows.
  std::vector<std::size_t> moved(blocks_.size());
  std::iota(moved.begin(), moved.end(), std::size_t{0});
  const auto where = [&](std::size_t block) {
    while (moved[block] != block) block = moved[block] = moved[moved[block]];
    return block;
  };
  std::vector<Eliminated> eliminated;
  for (auto& [places, own] : groups) {
    std::set<std::size_t> touched;
    for (const std::size_t block : places.second) touched.insert(where(block));
    std::vector<Remainder> parts;
    for (const std::size_t block : touched) {
      parts.push_back(std::move(remainders[block]));
      moved[block] = *touched.begin();
    }
    eliminated.push_back(eliminate(std::move(own), parts, remainders[*touched.begin()]));
  }

  VectorXd d = VectorXd::Zero(columns_);
  for (std::size_t i = eliminated.size(); i-- > 0;) {
    const Eliminated& e = eliminated[i];
    const Index m = static_cast<Index>(e.own.size());
    VectorXd q = e.factors.rightCols(1) - e.factors.middleCols(m, e.factors.cols() - m - 1) * d(e.others);
    e.factors.leftCols(m).triangularView<Eigen::Upper>().solveInPlace(q);
    d(e.own) = q;
  }
  return d;
}

RowBlocks RowBlocks::scaled_and_damped(const VectorXd& D, double lambda) const {
  std::vector<RowBlock> blocks;
  for (const RowBlock& block : blocks_)
    blocks.push_back({block.columns, block.A * D(block.columns).cwiseInverse().asDiagonal()});
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    std::vector<Index> damped = blocks_[b].columns;
    std::erase_if(damped, [&](Index k) { return places_[static_cast<std::size_t>(k)].front() != b; });
    const Index n = static_cast<Index>(damped.size());
    blocks.push_back({std::move(damped), std::sqrt(lambda) * MatrixXd::Identity(n, n)});
  }
  return {std::move(blocks), columns_};
}

}  // namespace mbsopt::inline optim
