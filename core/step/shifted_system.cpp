#include "core/step/shifted_system.hpp"

#include "core/body/state_layout.hpp"

namespace mbsopt {

ShiftedSystem::ShiftedSystem(const MechanismData& data, SpatialDynamics& dynamics)
    : equations_(dynamics),
      jacobian_(data),
      values_(jacobian_.values()),
      matrix_(data, jacobian_, 1),
      half_(StateLayout{data.n}.positions()) {
  r_.setZero(matrix_.size(), kLanes);
  y_.setZero(2 * half_, kLanes);
}

void ShiftedSystem::linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                              const Eigen::Ref<const Eigen::VectorXd>& a,
                              const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  equations_.place_at(t, y, angles, a, lambda);
  jacobian_.evaluate(equations_, values_);
  factored_ = false;
}

bool ShiftedSystem::factor(double gamma) {
  if (factored_ && gamma == gamma_) return true;
  gamma_ = gamma;
  return factored_ = matrix_.factor(gamma, one_, std::span(&values_, 1));
}

void ShiftedSystem::solve(Eigen::Ref<Eigen::MatrixXd> x, int refinements) {
  auto x_q = x.topRows(half_), x_v = x.bottomRows(half_);
  auto r = r_.leftCols(x.cols());
  x_q += gamma_ * x_v;
  r.setZero();
  jacobian_.for_each_block(values_,
                           [&]<class Block>(Eigen::Index row, Eigen::Index column, const Block& q, const Block& v) {
                             auto out = r.middleRows<Block::RowsAtCompileTime>(row);
                             out.noalias() -= q * x_q.middleRows<7>(column);
                             out.noalias() -= v * x_v.middleRows<7>(column);
                           });
  matrix_.solve(r, refinements);
  x_v += gamma_ * r.topRows(half_);
  x_q += gamma_ * gamma_ * r.topRows(half_);
}

void ShiftedSystem::solve_transposed(Eigen::Ref<Eigen::MatrixXd> x, int refinements) {
  auto x_q = x.topRows(half_), x_v = x.bottomRows(half_);
  auto r = r_.leftCols(x.cols());
  auto y = y_.leftCols(x.cols());
  x_v += gamma_ * x_q;
  r.setZero();
  r.topRows(half_) = gamma_ * x_v;
  matrix_.solve_transposed(r, refinements);
  y.setZero();
  jacobian_.for_each_block(values_,
                           [&]<class Block>(Eigen::Index row, Eigen::Index column, const Block& q, const Block& v) {
                             const auto beta = r.middleRows<Block::RowsAtCompileTime>(row);
                             y.middleRows<7>(column).noalias() -= q.transpose() * beta;
                             y.middleRows<7>(half_ + column).noalias() -= v.transpose() * beta;
                           });
  x_q += y.topRows(half_);
  x_v += gamma_ * y.topRows(half_) + y.bottomRows(half_);
}

}  // namespace mbsopt
