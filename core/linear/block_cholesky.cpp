#include "core/linear/block_cholesky.hpp"

#include <algorithm>

#include "core/linear/kernel_table.hpp"
#include "core/linear/prefetch.hpp"

namespace mbsopt {
namespace {

// Factors A = L D L' from the lower triangle of A. It writes W = inv(L), unit lower, below the diagonal and zeros
// elsewhere, and the inverse of D. Returns false if D is not positive.
template <int N>
bool factor_diagonal(Mat<N, N>& A, Vec<N>& inverse) {
  for (int j = 0; j < N; ++j) {
    if (!(A(j, j) > 0)) return false;
    inverse(j) = 1 / A(j, j);
    double l[N];
    for (int i = j + 1; i < N; ++i) l[i] = A(i, j) * inverse(j);
    for (int k = j + 1; k < N; ++k) {
      // cppcheck-suppress uninitvar  // of the last j no entry is read
      for (int i = k; i < N; ++i) A(i, k) -= l[i] * A(k, j);
    }
    for (int i = j + 1; i < N; ++i) A(i, j) = l[i];
  }
  // W L = I, column by column from the last: W(i, j) = -L(i, j) - sum_{j<k<i} W(i, k) L(k, j)
  for (int j = N - 2; j >= 0; --j) {
    double w[N];
    for (int i = j + 1; i < N; ++i) {
      w[i] = -A(i, j);
      for (int k = j + 1; k < i; ++k) w[i] -= A(i, k) * A(k, j);
    }
    // cppcheck-suppress uninitvar  // j < N - 1: one entry is set at least
    for (int i = j + 1; i < N; ++i) A(i, j) = w[i];
  }
  for (int j = 0; j < N; ++j) {
    for (int i = 0; i <= j; ++i) A(i, j) = 0;
  }
  return true;
}

// LD = A W',  A = LD inv(D), column by column from the last.
template <int N>
void divide(const Mat<N, N>& W, const Vec<N>& inverse, Mat<N, N>& A, Mat<N, N>& LD) {
  for (int j = N - 1; j >= 0; --j) {
    Vec<N> sum = A.col(j);
    for (int k = 0; k < j; ++k) sum += W(j, k) * A.col(k);
    LD.col(j) = sum;
    A.col(j) = inverse(j) * sum;
  }
}
// C -= A B'
template <int N>
void subtract_product(const Mat<N, N>& A, const Mat<N, N>& B, Mat<N, N>& C) {
  C.noalias() -= A.lazyProduct(B.transpose());
}

// kernel_table.hpp treats blocks of six.
bool factor_diagonal(Mat<6, 6>& A, Vec<6>& inverse) {
  return block_kernels().factor_diagonal(A.data(), inverse.data());
}
void divide(const Mat<6, 6>& W, const Vec<6>& inverse, Mat<6, 6>& A, Mat<6, 6>& LD) {
  block_kernels().divide(W.data(), inverse.data(), A.data(), LD.data());
}
void subtract_product(const Mat<6, 6>& A, const Mat<6, 6>& B, Mat<6, 6>& C) {
  block_kernels().subtract_product(A.data(), B.data(), C.data());
}

}  // namespace

template <int N>
BlockCholesky<N>::BlockCholesky(int bodies, std::span<const std::pair<int, int>> edges) : elimination_(bodies, edges) {
  for (const auto& [a, b] : edges) handles_.push_back(elimination_.place(a, b));
  diagonal_.resize(at(bodies));
  inverse_.resize(at(bodies));
  lower_.resize(elimination_.blocks);
  std::size_t longest = 0;
  first_block_.push_back(0);
  for (const auto& column : elimination_.columns) {
    longest = std::max(longest, column.size());
    for (const Elimination::Entry& e : column) body_.push_back(e.body);  // blocks are numbered column by column
    first_block_.push_back(static_cast<int>(body_.size()));
  }
  first_update_.push_back(0);
  for (const auto& of_column : elimination_.updates) {
    updates_.insert(updates_.end(), of_column.begin(), of_column.end());
    first_update_.push_back(updates_.size());
  }
  elimination_.updates.clear();
  scaled_.resize(longest);
  set_zero();
}

template <int N>
void BlockCholesky<N>::set_zero() {
  std::fill_n(diagonal_.empty() ? nullptr : diagonal_[0].data(), N * N * diagonal_.size(), 0.0);
  set_off_diagonals_to_zero();
}
template <int N>
void BlockCholesky<N>::set_off_diagonals_to_zero() {
  std::fill_n(lower_.empty() ? nullptr : lower_[0].data(), N * N * lower_.size(), 0.0);
}

// L_ik = A_ik W_k' inv(D_k); A_ij -= L_ik D_k L_jk'
template <int N>
bool BlockCholesky<N>::factor() {
  for (std::size_t k = 0; k < diagonal_.size(); ++k) {
    prefetch(&diagonal_[k], kAhead);
    prefetch(lower_.data(), first_block_[k] + kAhead);
    Block& W = diagonal_[k];
    Vec<N>& inverse = inverse_[k];
    if (!factor_diagonal(W, inverse)) return false;
    const std::size_t first = at(first_block_[k]), count = at(first_block_[k + 1]) - first;
    for (std::size_t e = 0; e < count; ++e) divide(W, inverse, lower_[first + e], scaled_[e]);
    for (std::size_t e = first_update_[k]; e < first_update_[k + 1]; ++e) {
      const Elimination::Update& u = updates_[e];
      subtract_product(scaled_[u.i], lower_[first + u.j], u.diagonal ? diagonal_[u.target] : lower_[u.target]);
    }
  }
  return true;
}

template <int N>
FactorView BlockCholesky<N>::view() const {
  return {elimination_.bodies(), elimination_.order.data(), first_block_.data(),
          body_.data(),          diagonal_[0].data(),       lower_.empty() ? nullptr : lower_[0].data(),
          inverse_[0].data()};
}

// Solves in place, in the order of elimination.
template <int N>
void BlockCholesky<N>::solve(std::span<Vec<N>> x) {
  if (x.empty()) return;
  (N == 6 ? block_kernels().in_space.solve : portable_block_kernels().in_plane.solve)(view(), x[0].data());
}

template <int N>
void BlockCholesky<N>::solve(std::span<Lanes<N>> x) {
  if (x.empty()) return;
  const BlockKernels& kernels = block_kernels();
  (N == 6 ? kernels.lanes_in_space.solve : kernels.lanes_in_plane.solve)(view(), x[0].data());
}

template class BlockCholesky<6>;
template class BlockCholesky<3>;

}  // namespace mbsopt
