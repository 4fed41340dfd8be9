#include "core/dynamics/block_cholesky.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
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

// Lower triangle of A -> W = inv(L), unit lower, and the inverse of D, with A = L D L'; false where D is not positive.
bool factor_diagonal(Mat<6, 6>& A, Vec<6>& inverse) {
  for (int j = 0; j < 6; ++j) {
    if (!(A(j, j) > 0)) return false;
    inverse(j) = 1 / A(j, j);
    double l[6];
    for (int i = j + 1; i < 6; ++i) l[i] = A(i, j) * inverse(j);
    for (int k = j + 1; k < 6; ++k) {
      // cppcheck-suppress uninitvar  // of j = 5 no entry is read
      for (int i = k; i < 6; ++i) A(i, k) -= l[i] * A(k, j);
    }
    for (int i = j + 1; i < 6; ++i) A(i, j) = l[i];
  }
  // W L = I, column by column from the last: W(i, j) = -L(i, j) - sum_{j<k<i} W(i, k) L(k, j)
  for (int j = 4; j >= 0; --j) {
    double w[6];
    for (int i = j + 1; i < 6; ++i) {
      w[i] = -A(i, j);
      for (int k = j + 1; k < i; ++k) w[i] -= A(i, k) * A(k, j);
    }
    // cppcheck-suppress uninitvar  // j < 5: one entry is set at least
    for (int i = j + 1; i < 6; ++i) A(i, j) = w[i];
  }
  return true;
}

// M = B W', column by column.
void times_transposed(const Mat<6, 6>& B, const Mat<6, 6>& W, Mat<6, 6>& M) {
  for (int j = 0; j < 6; ++j) {
    Vec<6> column = B.col(j);
    for (int k = 0; k < j; ++k) column += W(j, k) * B.col(k);
    M.col(j) = column;
  }
}

// C -= A B'
void subtract_product(const Mat<6, 6>& A, const Mat<6, 6>& B, Mat<6, 6>& C) {
  for (int j = 0; j < 6; ++j) {
    Vec<6> column = C.col(j);
    for (int k = 0; k < 6; ++k) column -= B(j, k) * A.col(k);
    C.col(j) = column;
  }
}

// y = W b and y = W'b, W unit lower.
template <class X>
X times(const Mat<6, 6>& W, const X& b) {
  X y = b;
  for (int j = 0; j < 5; ++j) {
    for (int i = j + 1; i < 6; ++i) y.row(i) += W(i, j) * b.row(j);
  }
  return y;
}
template <class X>
X transposed_times(const Mat<6, 6>& W, const X& b) {
  X y = b;
  for (int j = 0; j < 5; ++j) {
    for (int i = j + 1; i < 6; ++i) y.row(j) += W(i, j) * b.row(i);
  }
  return y;
}
// y -= L x and y -= L'x
template <class X>
void subtract_times(const Mat<6, 6>& L, const X& x, X& y) {
  X sum = y;
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < 6; ++i) sum.row(i) -= L(i, j) * x.row(j);
  }
  y = sum;
}
template <class X>
void subtract_transposed_times(const Mat<6, 6>& L, const X& x, X& y) {
  for (int j = 0; j < 6; ++j) {
    y.row(j) -= L(0, j) * x.row(0) + L(1, j) * x.row(1) + L(2, j) * x.row(2) + L(3, j) * x.row(3) + L(4, j) * x.row(4) +
                L(5, j) * x.row(5);
  }
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
      updates_[index(k)].push_back({index(column[a].row), a, column[a].block, true});
      for (std::size_t b = 0; b < a; ++b) {
        updates_[index(k)].push_back({place[index(column[b].row)].at(column[a].row), a, column[b].block, false});
      }
    }
  }
  diagonal_.resize(index(n_));
  inverse_.resize(index(n_));
  std::size_t longest = 0;
  for (const std::vector<Entry>& column : columns_) longest = std::max(longest, column.size());
  scaled_.resize(longest);
  permuted_.resize(index(n_));
  permuted_lanes_.resize(index(n_));
  set_zero();
}

void BlockCholesky::set_zero() {
  for (Block& b : diagonal_) b.setZero();
  for (Block& b : lower_) b.setZero();
}

// L_ik = A_ik W_k' inv(D_k); A_ij -= L_ik D_k L_jk'
bool BlockCholesky::factor() {
  for (std::size_t k = 0; k < index(n_); ++k) {
    Block& W = diagonal_[k];
    Vec<6>& inverse = inverse_[k];
    if (!factor_diagonal(W, inverse)) return false;
    const std::vector<Entry>& column = columns_[k];
    for (std::size_t e = 0; e < column.size(); ++e) {
      Block &L = lower_[column[e].block], &LD = scaled_[e];
      times_transposed(L, W, LD);
      for (int j = 0; j < 6; ++j) L.col(j) = inverse(j) * LD.col(j);
    }
    for (const Update& u : updates_[k]) {
      subtract_product(scaled_[u.i], lower_[u.j], u.diagonal ? diagonal_[u.target] : lower_[u.target]);
    }
  }
  return true;
}

template <class X>
void BlockCholesky::solve_any(std::span<X> x, std::vector<X>& y) {
  for (std::size_t k = 0; k < index(n_); ++k) y[k] = x[index(order_[k])];
  for (std::size_t k = 0; k < index(n_); ++k) {
    y[k] = times(diagonal_[k], y[k]);
    for (const Entry& e : columns_[k]) subtract_times(lower_[e.block], y[k], y[index(e.row)]);
  }
  for (std::size_t k = index(n_); k-- > 0;) {
    X z;
    for (int i = 0; i < 6; ++i) z.row(i) = inverse_[k](i) * y[k].row(i);
    for (const Entry& e : columns_[k]) subtract_transposed_times(lower_[e.block], y[index(e.row)], z);
    y[k] = transposed_times(diagonal_[k], z);
    x[index(order_[k])] = y[k];
  }
}

template void BlockCholesky::solve_any(std::span<Vec<6>>, std::vector<Vec<6>>&);
template void BlockCholesky::solve_any(std::span<Lanes<6>>, std::vector<Lanes<6>>&);

}  // namespace mbsopt
