#include "core/linear/block_lu.hpp"

#include <algorithm>
#include <stdexcept>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

BlockLu::BlockLu(int rows, int bodies, std::span<const std::pair<int, int>> edges, const LuKernelTable& kernels)
    : rows_(rows),
      stride_(rows + rows % 2),
      size_(static_cast<std::size_t>(rows_ * stride_)),
      kernels_(&kernels.of(rows)),
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
  for (std::size_t k = 0; k < elimination_.order.size(); ++k) {
    double *const D = block(k), *const inverse = inverse_of(k);
    if (!kernels_->factor_diagonal(D, exchanged_of(k), inverse)) return false;
    const std::vector<Elimination::Entry>& column = elimination_.columns[k];
    for (const auto& e : column) {
      kernels_->divide_by_upper(D, inverse, block(lower(e.block)));
      kernels_->divide_by_lower_transposed(D, exchanged_of(k), block(upper(e.block)));
    }
    for (const auto& u : elimination_.updates[k]) {
      const std::size_t i = column[u.i].block, j = column[u.j].block;
      kernels_->subtract_product(block(lower(i)), block(upper(j)), block(u.diagonal ? u.target : lower(u.target)));
      if (!u.diagonal) kernels_->subtract_product(block(upper(i)), block(lower(j)), block(upper(u.target)));
    }
  }
  return true;
}

void BlockLu::solve(Eigen::Ref<Eigen::MatrixXd> x) const {
  for (Eigen::Index c = 0; c < x.cols(); ++c) solve_column<false>(x.col(c).data());
}

void BlockLu::solve_transposed(Eigen::Ref<Eigen::MatrixXd> x) const {
  for (Eigen::Index c = 0; c < x.cols(); ++c) solve_column<true>(x.col(c).data());
}

// A = L U and A' = U'L': the blocks below the diagonal and above it change places.
template <bool Transposed>
void BlockLu::solve_column(double* x) const {
  const std::vector<int>& order = elimination_.order;
  const auto of = [&](std::size_t position) { return x + order[position] * stride_; };
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (Transposed) {
      kernels_->solve_upper_transposed(block(k), inverse_of(k), of(k));
    } else {
      kernels_->solve_lower(block(k), exchanged_of(k), of(k));
    }
    for (const auto& e : elimination_.columns[k]) {
      kernels_->subtract_times(block(Transposed ? upper(e.block) : lower(e.block)), of(k), of(at(e.row)));
    }
  }
  for (std::size_t k = order.size(); k-- > 0;) {
    for (const auto& e : elimination_.columns[k]) {
      kernels_->subtract_transposed_times(block(Transposed ? lower(e.block) : upper(e.block)), of(at(e.row)), of(k));
    }
    if (Transposed) {
      kernels_->solve_lower_transposed(block(k), exchanged_of(k), of(k));
    } else {
      kernels_->solve_upper(block(k), inverse_of(k), of(k));
    }
  }
}

}  // namespace mbsopt
