#include "core/linear/block_lu.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/linear/fixed_size.hpp"
#include "core/linear/pairs.hpp"

namespace mbsopt {
namespace {

// Zeros pad columns to an even length.
template <int N>
constexpr int kPairs = (N + 1) / 2;
template <int N>
constexpr int kStride = 2 * kPairs<N>;

Pair* pairs(double* x) { return reinterpret_cast<Pair*>(x); }
const Pair* pairs(const double* x) { return reinterpret_cast<const Pair*>(x); }

template <int N>
double dot(const double* x, const double* y) {
  Pair sum = {0, 0};
  for (int i = 0; i < kPairs<N>; ++i) sum += pairs(x)[i] * pairs(y)[i];
  return sum[0] + sum[1];
}

// C -= A B'
template <int N>
void subtract_product(const double* A, const double* B, double* C) {
  for (int c = 0; c < N; ++c) {
    Column<kPairs<N>> column(C + c * kStride<N>);
    for (int k = 0; k < N; ++k) column.subtract(B[c + k * kStride<N>], A + k * kStride<N>);
    column.store(C + c * kStride<N>);
  }
}

// P D = L U in place.
template <int N>
bool factor_diagonal(double* D, int* exchanged, double* inverse) {
  for (int j = 0; j < N; ++j) {
    double* column = D + j * kStride<N>;
    int largest = j;
    for (int i = j + 1; i < N; ++i) {
      if (std::abs(column[i]) > std::abs(column[largest])) largest = i;
    }
    exchanged[j] = largest;
    if (largest != j) {
      for (int c = 0; c < N; ++c) std::swap(D[j + c * kStride<N>], D[largest + c * kStride<N>]);
    }
    inverse[j] = 1 / column[j];
    if (!std::isfinite(inverse[j])) return false;
    double l[kStride<N>] = {};
    for (int i = j + 1; i < N; ++i) l[i] = column[i] *= inverse[j];
    for (int c = j + 1; c < N; ++c) {
      double* other = D + c * kStride<N>;
      const Pair s = {other[j], other[j]};
      for (int i = (j + 1) / 2; i < kPairs<N>; ++i) pairs(other)[i] -= s * pairs(l)[i];
    }
  }
  return true;
}

// X inv(U)
template <int N>
void divide_by_upper(const double* D, const double* inverse, double* X) {
  for (int j = 0; j < N; ++j) {
    Column<kPairs<N>> column(X + j * kStride<N>);
    for (int k = 0; k < j; ++k) column.subtract(D[k + j * kStride<N>], X + k * kStride<N>);
    column.scale(inverse[j]);
    column.store(X + j * kStride<N>);
  }
}

// X P' inv(L')
template <int N>
void divide_by_lower_transposed(const double* D, const int* exchanged, double* X) {
  for (int j = 0; j < N; ++j) {
    if (exchanged[j] != j) {
      std::swap_ranges(X + j * kStride<N>, X + (j + 1) * kStride<N>, X + exchanged[j] * kStride<N>);
    }
  }
  for (int j = 0; j < N; ++j) {
    Column<kPairs<N>> column(X + j * kStride<N>);
    for (int k = 0; k < j; ++k) column.subtract(D[j + k * kStride<N>], X + k * kStride<N>);
    column.store(X + j * kStride<N>);
  }
}

// y -= A x,  y -= A'x
template <int N>
void subtract_times(const double* A, const double* x, double* y) {
  Column<kPairs<N>> sum(y);
  for (int k = 0; k < N; ++k) sum.subtract(x[k], A + k * kStride<N>);
  sum.store(y);
}
template <int N>
void subtract_transposed_times(const double* A, const double* x, double* y) {
  for (int k = 0; k < N; ++k) y[k] -= dot<N>(A + k * kStride<N>, x);
}

// Selects the kernels for the size of a block.
template <class Do>
auto with_size(Eigen::Index rows, const Do& act) {
  switch (rows) {
    case 7:
      return act(std::integral_constant<int, 7>());
    case 14:
      return act(std::integral_constant<int, 14>());
    case 21:
      return act(std::integral_constant<int, 21>());
    default:
      return act(std::integral_constant<int, 28>());
  }
}

}  // namespace

BlockLu::BlockLu(int rows, int bodies, std::span<const std::pair<int, int>> edges)
    : rows_(rows),
      stride_(rows + rows % 2),
      size_(static_cast<std::size_t>(rows_ * stride_)),
      elimination_(bodies, edges) {
  if (!takes(rows)) throw std::invalid_argument("BlockLu: blocks of 7, 14, 21 or 28 rows");
  values_.assign((at(bodies) + 2 * elimination_.blocks) * size_, 0.0);
  inverse_.assign(at(bodies) * static_cast<std::size_t>(rows_), 0.0);
  exchanged_.assign(inverse_.size(), 0);
}

BlockLu::Handle BlockLu::handle(int row_body, int column_body) const {
  if (row_body == column_body) return {at(elimination_.position[at(row_body)]) * size_, false};
  const Elimination::Place place = elimination_.place(row_body, column_body);
  return {(place.transposed ? upper(place.block) : lower(place.block)) * size_, place.transposed};
}

void BlockLu::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

bool BlockLu::factor() {
  return with_size(rows_, [&](auto n) { return factor_blocks<n()>(); });
}

template <int N>
bool BlockLu::factor_blocks() {
  for (std::size_t k = 0; k < elimination_.order.size(); ++k) {
    double *D = block(k), *inverse = inverse_.data() + k * N;
    int* exchanged = exchanged_.data() + k * N;
    if (!factor_diagonal<N>(D, exchanged, inverse)) return false;
    const std::vector<Elimination::Entry>& column = elimination_.columns[k];
    for (const auto& e : column) {
      divide_by_upper<N>(D, inverse, block(lower(e.block)));
      divide_by_lower_transposed<N>(D, exchanged, block(upper(e.block)));
    }
    for (const auto& u : elimination_.updates[k]) {
      const std::size_t i = column[u.i].block, j = column[u.j].block;
      subtract_product<N>(block(lower(i)), block(upper(j)), block(u.diagonal ? u.target : lower(u.target)));
      if (!u.diagonal) subtract_product<N>(block(upper(i)), block(lower(j)), block(upper(u.target)));
    }
  }
  return true;
}

void BlockLu::solve(Eigen::Ref<Eigen::MatrixXd> x) const {
  with_size(rows_, [&](auto n) {
    for (Eigen::Index c = 0; c < x.cols(); ++c) solve_blocks<n()>(x.col(c).data());
  });
}

void BlockLu::solve_transposed(Eigen::Ref<Eigen::MatrixXd> x) const {
  with_size(rows_, [&](auto n) {
    for (Eigen::Index c = 0; c < x.cols(); ++c) solve_blocks_transposed<n()>(x.col(c).data());
  });
}

template <int N>
void BlockLu::solve_blocks(double* x) const {
  const std::vector<int>& order = elimination_.order;
  auto of = [&](std::size_t position) { return x + order[position] * kStride<N>; };
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double* D = block(k);
    const int* exchanged = exchanged_.data() + k * N;
    double* y = of(k);
    for (int j = 0; j < N; ++j) std::swap(y[j], y[exchanged[j]]);
    for (int j = 0; j < N; ++j) {
      for (int i = j + 1; i < N; ++i) y[i] -= D[i + j * kStride<N>] * y[j];
    }
    for (const auto& e : elimination_.columns[k]) subtract_times<N>(block(lower(e.block)), y, of(at(e.row)));
  }
  for (std::size_t k = order.size(); k-- > 0;) {
    const double *D = block(k), *inverse = inverse_.data() + k * N;
    double* y = of(k);
    for (const auto& e : elimination_.columns[k]) {
      subtract_transposed_times<N>(block(upper(e.block)), of(at(e.row)), y);
    }
    for (int j = N - 1; j >= 0; --j) {
      y[j] *= inverse[j];
      for (int i = 0; i < j; ++i) y[i] -= D[i + j * kStride<N>] * y[j];
    }
  }
}

template <int N>
void BlockLu::solve_blocks_transposed(double* x) const {
  const std::vector<int>& order = elimination_.order;
  auto of = [&](std::size_t position) { return x + order[position] * kStride<N>; };
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double *D = block(k), *inverse = inverse_.data() + k * N;
    double* y = of(k);
    for (int j = 0; j < N; ++j) {
      for (int i = 0; i < j; ++i) y[j] -= D[i + j * kStride<N>] * y[i];
      y[j] *= inverse[j];
    }
    for (const auto& e : elimination_.columns[k]) subtract_times<N>(block(upper(e.block)), y, of(at(e.row)));
  }
  for (std::size_t k = order.size(); k-- > 0;) {
    const double* D = block(k);
    const int* exchanged = exchanged_.data() + k * N;
    double* y = of(k);
    for (const auto& e : elimination_.columns[k]) {
      subtract_transposed_times<N>(block(lower(e.block)), of(at(e.row)), y);
    }
    for (int j = N - 1; j >= 0; --j) {
      for (int i = j + 1; i < N; ++i) y[j] -= D[i + j * kStride<N>] * y[i];
    }
    for (int j = N - 1; j >= 0; --j) std::swap(y[j], y[exchanged[j]]);
  }
}

}  // namespace mbsopt
