#include "core/dynamics/block_cholesky.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <cmath>
#include <map>
#include <set>

namespace mbsopt {
namespace {

std::vector<int> elimination_order(int n, std::span<const std::pair<int, int>> edges) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [i, j] : edges) {
    entries.emplace_back(i, j, 1.0);
    entries.emplace_back(j, i, 1.0);
  }
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  const auto& order = permutation.indices();
  return {order.data(), order.data() + order.size()};
}

// D -> inv(L) with D = L L', lower triangle of D used; false where D is not positive definite.
bool invert_factor(Mat<6, 6>& D) {
  Mat<6, 6> L;
  for (int j = 0; j < 6; ++j) {
    double d = D(j, j);
    for (int k = 0; k < j; ++k) d -= L(j, k) * L(j, k);
    if (!(d > 0)) return false;
    const double root = std::sqrt(d), inverse = 1 / root;
    L(j, j) = inverse;  // the inverse of the diagonal is all that is needed
    for (int i = j + 1; i < 6; ++i) {
      double x = D(i, j);
      for (int k = 0; k < j; ++k) x -= L(i, k) * L(j, k);
      L(i, j) = x * inverse;
    }
  }
  D.setZero();
  for (int j = 0; j < 6; ++j) {
    D(j, j) = L(j, j);
    for (int i = j + 1; i < 6; ++i) {
      double x = 0;
      for (int k = j; k < i; ++k) x -= L(i, k) * D(k, j);
      D(i, j) = x * L(i, i);
    }
  }
  return true;
}

}  // namespace

BlockCholesky::BlockCholesky(int bodies, std::span<const std::pair<int, int>> edges) : n_(bodies) {
  order_ = elimination_order(n_, edges);
  position_.resize(index(n_));
  for (int k = 0; k < n_; ++k) position_[index(order_[index(k)])] = k;

  // Symbolic elimination: the rows of column k are its own edges and what eliminating its children leaves.
  std::vector<std::set<int>> rows(index(n_));
  for (const auto& [a, b] : edges) {
    const int i = position_[index(a)], j = position_[index(b)];
    rows[index(std::min(i, j))].insert(std::max(i, j));
  }
  std::vector<std::map<int, std::size_t>> place(index(n_));
  columns_.resize(index(n_));
  for (int k = 0; k < n_; ++k) {
    const std::set<int>& below = rows[index(k)];
    for (const int i : below) {
      place[index(k)][i] = lower_.size();
      columns_[index(k)].push_back({i, lower_.size()});
      lower_.emplace_back();
    }
    if (!below.empty()) {
      const int parent = *below.begin();
      for (const int i : below) {
        if (i != parent) rows[index(parent)].insert(i);
      }
    }
  }
  for (const auto& [a, b] : edges) {
    const int i = position_[index(a)], j = position_[index(b)];
    handles_.push_back({place[index(std::min(i, j))].at(std::max(i, j)), i < j});
  }
  updates_.resize(index(n_));
  for (int k = 0; k < n_; ++k) {
    const std::vector<Entry>& column = columns_[index(k)];
    for (std::size_t a = 0; a < column.size(); ++a) {
      updates_[index(k)].push_back({index(column[a].row), column[a].block, column[a].block, true});
      for (std::size_t b = 0; b < a; ++b) {
        updates_[index(k)].push_back(
            {place[index(column[b].row)].at(column[a].row), column[a].block, column[b].block, false});
      }
    }
  }
  diagonal_.resize(index(n_));
  permuted_.resize(index(n_));
  permuted_lanes_.resize(index(n_));
  set_zero();
}

void BlockCholesky::set_zero() {
  for (Block& b : diagonal_) b.setZero();
  for (Block& b : lower_) b.setZero();
}

bool BlockCholesky::factor() {
  for (std::size_t k = 0; k < index(n_); ++k) {
    Block& W = diagonal_[k];
    if (!invert_factor(W)) return false;
    for (const Entry& e : columns_[k]) lower_[e.block] = (lower_[e.block] * W.transpose()).eval();
    for (const Update& u : updates_[k]) {
      Block& target = u.diagonal ? diagonal_[u.target] : lower_[u.target];
      target.noalias() -= lower_[u.i] * lower_[u.j].transpose();
    }
  }
  return true;
}

template <class X>
void BlockCholesky::solve_any(std::span<X> x, std::vector<X>& y) {
  for (std::size_t k = 0; k < index(n_); ++k) y[k] = x[index(order_[k])];
  for (std::size_t k = 0; k < index(n_); ++k) {
    const X b = y[k];
    y[k].noalias() = diagonal_[k] * b;
    for (const Entry& e : columns_[k]) y[index(e.row)].noalias() -= lower_[e.block] * y[k];
  }
  for (std::size_t k = index(n_); k-- > 0;) {
    for (const Entry& e : columns_[k]) y[k].noalias() -= lower_[e.block].transpose() * y[index(e.row)];
    const X b = y[k];
    y[k].noalias() = diagonal_[k].transpose() * b;
    x[index(order_[k])] = y[k];
  }
}

template void BlockCholesky::solve_any(std::span<Vec<6>>, std::vector<Vec<6>>&);
template void BlockCholesky::solve_any(std::span<Lanes<6>>, std::vector<Lanes<6>>&);

}  // namespace mbsopt
