#include "optim/fit/state_chart.hpp"

#include "core/body/state_layout.hpp"
#include "core/linear/dense.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

StateChart::StateChart(const VectorXd& y, const MatrixXd& y_u)
    : y0_(y), W_(OrthogonalDecomposition(y_u).solve(MatrixXd::Identity(y.size(), y.size()))) {}

void StateChart::read(const VectorXd& y, const MatrixXd& y_rho, VectorXd& s, MatrixXd& s_rho) const {
  const StateLayout layout = StateLayout::of(y);
  VectorXd sign = VectorXd::Ones(y.size());
  for (int i = 1; i <= layout.n; ++i) {
    const Index p = layout.p(i), pdot = layout.pdot(i);
    if (y.segment<4>(p).dot(y0_.segment<4>(p)) < 0)
      sign.segment<4>(p).setConstant(-1), sign.segment<4>(pdot).setConstant(-1);
  }
  s = W_ * (sign.cwiseProduct(y) - y0_);
  s_rho = W_ * (sign.asDiagonal() * y_rho);
}

}  // namespace mbsopt::inline optim
