#include "core/dynamics/constraint_rows.hpp"

#include <algorithm>

namespace mbsopt {
namespace {

// S += x' alpha x: the lower triangle only, which is all that a Cholesky factorisation reads.
void add_lower_square_of(double alpha, const Mat<1, 6>& x, Mat<6, 6>& S) {
  for (int j = 0; j < 6; ++j) {
    for (int i = j; i < 6; ++i) S(i, j) += alpha * x(j) * x(i);
  }
}

}  // namespace

ConstraintRows::ConstraintRows(const MechanismData& data) : data_(&data) {
  J1.setZero(data.blocks, 6);
  J2.setZero(data.blocks, 6);
  displaces_.assign(static_cast<std::size_t>(data.blocks), Displaces::all);
  for (const Constraint& c : data.constraints) {
    for (int r = 0; r < c.rows(); ++r) {
      Displaces& d = displaces_[static_cast<std::size_t>(c.block + r)];
      if (std::holds_alternative<Coincidence>(c.primitive)) d = static_cast<Displaces>(r);
      if (std::holds_alternative<Dot1>(c.primitive) || std::holds_alternative<Angle>(c.primitive)) d = Displaces::none;
    }
  }
  for (const RowGroup& g : data.groups) {
    handle_.push_back(edges_.size());
    if (g.shared) {
      auto row = std::find_if(shared_.begin(), shared_.end(), [&](const SharedRow& s) { return s.row == g.row; });
      if (row == shared_.end()) row = shared_.insert(row, SharedRow{g.row, {}, {}, {}});
      for (const int body : {g.body1, g.body2}) {
        if (body > 0 && std::find(row->bodies.begin(), row->bodies.end(), body) == row->bodies.end())
          row->bodies.push_back(body);
      }
    } else if (g.body1 > 0 && g.body2 > 0) {
      edges_.emplace_back(g.body1 - 1, g.body2 - 1);
    }
  }
  for (SharedRow& row : shared_) {
    row.J.resize(row.bodies.size());
    for (std::size_t j = 1; j < row.bodies.size(); ++j) {
      for (std::size_t i = 0; i < j; ++i) {
        row.handles.push_back(edges_.size());
        edges_.emplace_back(row.bodies[i] - 1, row.bodies[j] - 1);
      }
    }
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
          J1.middleRows<m>(c.block) = c.factor * A;
          J2.middleRows<m>(c.block) = c.factor * B;
        },
        c.primitive);
  }
}

void ConstraintRows::add_lower_square(double alpha, const Rows& J, int block, Mat<6, 6>& S) const {
  const double* x = J.row(block).data();
  const Displaces d = displaces_[static_cast<std::size_t>(block)];
  const double a3 = alpha * x[3], a4 = alpha * x[4], a5 = alpha * x[5];
  if (d < Displaces::none) {
    const int k = static_cast<int>(d);
    S(k, k) += alpha * x[k] * x[k];
    S(3, k) += a3 * x[k], S(4, k) += a4 * x[k], S(5, k) += a5 * x[k];
  } else if (d == Displaces::all) {
    for (int j = 0; j < 3; ++j) {
      for (int i = j; i < 3; ++i) S(i, j) += alpha * x[i] * x[j];
      S(3, j) += a3 * x[j], S(4, j) += a4 * x[j], S(5, j) += a5 * x[j];
    }
  }
  S(3, 3) += a3 * x[3], S(4, 3) += a4 * x[3], S(5, 3) += a5 * x[3];
  S(4, 4) += a4 * x[4], S(5, 4) += a5 * x[4];
  S(5, 5) += a5 * x[5];
}

// S12 += alpha J1'J2 of one row.
void ConstraintRows::add_cross(double alpha, int block, Mat<6, 6>& S12) const {
  const double *a = J1.row(block).data(), *b = J2.row(block).data();
  const Displaces d = displaces_[static_cast<std::size_t>(block)];
  int first = 3, last = 3;
  if (d < Displaces::none) {
    first = static_cast<int>(d), last = first + 1;
  } else if (d == Displaces::all) {
    first = 0;
  }
  for (int j = first; j < last; ++j) {
    const double ab = alpha * b[j];
    for (int i = first; i < last; ++i) S12(i, j) += a[i] * ab;
    for (int i = 3; i < 6; ++i) S12(i, j) += a[i] * ab;
  }
  for (int j = 3; j < 6; ++j) {
    const double ab = alpha * b[j];
    for (int i = first; i < last; ++i) S12(i, j) += a[i] * ab;
    for (int i = 3; i < 6; ++i) S12(i, j) += a[i] * ab;
  }
}

void ConstraintRows::add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky& S) {
  for (std::size_t k = 0; k < data_->groups.size(); ++k) {
    const RowGroup& g = data_->groups[k];
    if (g.shared) continue;
    for (int r = 0; r < g.rows; ++r) {
      if (g.body1 > 0) add_lower_square(alpha(g.row + r), J1, g.block + r, S.diagonal(g.body1 - 1));
      if (g.body2 > 0) add_lower_square(alpha(g.row + r), J2, g.block + r, S.diagonal(g.body2 - 1));
    }
    if (g.body1 == 0 || g.body2 == 0) continue;
    Mat<6, 6> S12 = Mat<6, 6>::Zero();
    for (int r = 0; r < g.rows; ++r) add_cross(alpha(g.row + r), g.block + r, S12);
    S.add_off_diagonal(handle_[k], S12);
  }
  if (!shared_.empty()) add_shared_square(alpha, S);
}

void ConstraintRows::add_shared_square(const Eigen::VectorXd& alpha, BlockCholesky& S) {
  for (SharedRow& row : shared_) {
    for (Mat<1, 6>& J : row.J) J.setZero();
    auto of = [&](int body) -> Mat<1, 6>& {
      return row
          .J[static_cast<std::size_t>(std::find(row.bodies.begin(), row.bodies.end(), body) - row.bodies.begin())];
    };
    for (const RowGroup& g : data_->groups) {
      if (!g.shared || g.row != row.row) continue;
      if (g.body1 > 0) of(g.body1) += J1.row(g.block);
      if (g.body2 > 0) of(g.body2) += J2.row(g.block);
    }
    std::size_t pair = 0;
    for (std::size_t j = 0; j < row.bodies.size(); ++j) {
      add_lower_square_of(alpha(row.row), row.J[j], S.diagonal(row.bodies[j] - 1));
      for (std::size_t i = 0; i < j; ++i) {
        const Mat<6, 6> S12 = alpha(row.row) * row.J[i].transpose() * row.J[j];
        S.add_off_diagonal(row.handles[pair++], S12);
      }
    }
  }
}

Eigen::MatrixXd ConstraintRows::dense() const {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(data_->m, 6 * data_->n);
  for (const RowGroup& g : data_->groups) {
    if (g.body1 > 0) J.block(g.row, 6 * (g.body1 - 1), g.rows, 6) += J1.middleRows(g.block, g.rows);
    if (g.body2 > 0) J.block(g.row, 6 * (g.body2 - 1), g.rows, 6) += J2.middleRows(g.block, g.rows);
  }
  return J;
}

BlockCholesky ConstraintRows::matrix() const { return BlockCholesky(data_->n, edges_); }

}  // namespace mbsopt
