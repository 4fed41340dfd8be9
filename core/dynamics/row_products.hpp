// The products with J that the block solvers need, for a single vector and for lanes. The loops are those of
// kernel_table.hpp.
//
//   class ConstraintRows : public RowProducts<ConstraintRows, RowsInSpace> { RowsInSpace view() const; ... };
#pragma once

#include <vector>

#include "core/linear/kernel_table.hpp"
#include "core/linear/parameter_block.hpp"

namespace mbsopt {

// View is the form of the rows in the loops. X holds numbers or lanes of a body, body i at x[i - 1]. Y is
// Eigen::VectorXd or LaneRows.
template <class Rows, class View>
class RowProducts {
 public:
  static constexpr int kUnknowns = View::kUnknowns;  // per body

  // y -= J x
  template <class X, class Y>
  void subtract_times(const std::vector<X>& x, Y& y) const {
    if (!x.empty()) kernels<X>().subtract_times(view(), x[0].data(), y.data());
  }
  // x -= J'lambda
  template <class X, class Y>
  void subtract_transposed_times(const Y& lambda, std::vector<X>& x) const {
    if (!x.empty()) kernels<X>().subtract_transposed_times(view(), lambda.data(), x[0].data());
  }
  // The steps of BlockSaddleSolver.
  template <class X>
  void load(const SaddleIterate& at, bool first, std::vector<X>& correction) const {
    kernels<X>().load(view(), at, first, correction[0].data());
  }
  template <class X>
  SaddleSizes correct(const SaddleIterate& at, bool first, const std::vector<X>& correction) const {
    return kernels<X>().correct(view(), at, first, correction[0].data());
  }

 private:
  View view() const { return static_cast<const Rows*>(this)->view(); }
  template <class X>
  static const RowKernels<View>& kernels() {
    const BlockKernels& all = block_kernels();
    if constexpr (kUnknowns == 6) {
      return X::ColsAtCompileTime == 1 ? all.in_space : all.lanes_in_space;
    } else {  // single numbers fill no registers: wider ones only reload what was just stored
      return X::ColsAtCompileTime == 1 ? portable_block_kernels().in_plane : all.lanes_in_plane;
    }
  }
};

}  // namespace mbsopt
