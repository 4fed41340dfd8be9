#include "core/dynamics/constraint_rows.hpp"

namespace mbsopt {

ConstraintRows::ConstraintRows(const MechanismData& data) : data_(&data) {
  J1.setZero(data.m, 6);
  J2.setZero(data.m, 6);
  std::size_t edges = 0;
  for (const RowGroup& g : data.groups) {
    handle_.push_back(edges);
    if (g.body1 > 0 && g.body2 > 0) ++edges;
  }
}

void ConstraintRows::evaluate(const std::vector<Frame>& frames) {
  for (const Constraint& c : data_->constraints) {
    const Frame &f1 = frames[static_cast<std::size_t>(c.body1)], &f2 = frames[static_cast<std::size_t>(c.body2)];
    std::visit(
        [&](const auto& p) {
          constexpr int m = std::decay_t<decltype(p)>::kRows;
          Mat<m, 6> A, B;
          p.jacobian(f1, f2, A, B);
          J1.middleRows<m>(c.row) = A;
          J2.middleRows<m>(c.row) = B;
        },
        c.primitive);
  }
}

void ConstraintRows::add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky& S) const {
  using Row = Mat<1, 6>;
  for (std::size_t k = 0; k < data_->groups.size(); ++k) {
    const RowGroup& g = data_->groups[k];
    Mat<6, 6> S11 = Mat<6, 6>::Zero(), S12 = Mat<6, 6>::Zero(), S22 = Mat<6, 6>::Zero();
    for (int r = g.row; r < g.row + g.rows; ++r) {
      const Row a = J1.row(r), b = J2.row(r), weighted_a = alpha(r) * a, weighted_b = alpha(r) * b;
      S11.noalias() += weighted_a.transpose() * a;
      S12.noalias() += weighted_a.transpose() * b;
      S22.noalias() += weighted_b.transpose() * b;
    }
    if (g.body1 > 0) S.diagonal(g.body1 - 1) += S11;
    if (g.body2 > 0) S.diagonal(g.body2 - 1) += S22;
    if (g.body1 > 0 && g.body2 > 0) S.add_off_diagonal(handle_[k], S12);
  }
}

BlockCholesky ConstraintRows::matrix() const {
  std::vector<std::pair<int, int>> edges;
  for (const RowGroup& g : data_->groups) {
    if (g.body1 > 0 && g.body2 > 0) edges.emplace_back(g.body1 - 1, g.body2 - 1);
  }
  return BlockCholesky(data_->n, edges);
}

}  // namespace mbsopt
