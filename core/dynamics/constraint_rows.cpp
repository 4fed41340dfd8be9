#include "core/dynamics/constraint_rows.hpp"

#include <algorithm>

namespace mbsopt {
namespace {

// S += x' alpha x, of x the entries first to last and 3 to 6: the lower triangle only, which is all that a
// factorisation reads.
void add_lower_square(double alpha, const double* x, int first, int last, Mat<6, 6>& S) {
  const double a3 = alpha * x[3], a4 = alpha * x[4], a5 = alpha * x[5];
  for (int j = first; j < last; ++j) {
    for (int i = j; i < last; ++i) S(i, j) += alpha * x[i] * x[j];
    S(3, j) += a3 * x[j], S(4, j) += a4 * x[j], S(5, j) += a5 * x[j];
  }
  S(3, 3) += a3 * x[3], S(4, 3) += a4 * x[3], S(5, 3) += a5 * x[3];
  S(4, 4) += a4 * x[4], S(5, 4) += a5 * x[4];
  S(5, 5) += a5 * x[5];
}

}  // namespace

ConstraintRows::ConstraintRows(const MechanismData& data) : data_(&data) {
  J1.setZero(data.blocks, 6);
  J2.setZero(data.blocks, 6);
  columns_.resize(static_cast<std::size_t>(data.blocks));
  for (const Constraint& c : data.constraints) {
    const Displacements moved =
        std::visit([](const auto& p) { return std::decay_t<decltype(p)>::kDisplacements; }, c.primitive);
    for (int r = 0; r < c.rows(); ++r) {
      Columns& x = columns_[static_cast<std::size_t>(c.block + r)];
      if (moved == Displacements::none) x = {3, 3};
      if (moved == Displacements::own_axis) x = {r, r + 1};
    }
  }
  for (int i = 1; i <= data.n; ++i) {
    const BodyData& b = data.bodies[static_cast<std::size_t>(i)];
    RowsInSpace::Body& of = bodies_.emplace_back();
    of.mass = b.mass;
    std::copy_n(b.J.data(), 9, of.J);
  }
  for (const RowGroup& g : data.groups) {
    groups_.push_back({g.body1, g.body2, g.row, g.block, g.rows});
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

void ConstraintRows::add_mass(BlockCholesky<6>& S) const {
  for (int i = 1; i <= data_->n; ++i) {
    const BodyData& b = data_->bodies[static_cast<std::size_t>(i)];
    Mat<6, 6>& D = S.diagonal(i - 1);
    D.diagonal().head<3>().array() += b.mass;
    D.bottomRightCorner<3, 3>() += b.J;
  }
}

// S12 += alpha J1'J2 of one row.
void ConstraintRows::add_cross(double alpha, int block, Mat<6, 6>& S12) const {
  const double *a = J1.row(block).data(), *b = J2.row(block).data();
  const auto [first, last] = columns(block);
  const auto add_column = [&, first = first, last = last](int j) {
    const double ab = alpha * b[j];
    for (int i = first; i < last; ++i) S12(i, j) += a[i] * ab;
    for (int i = 3; i < 6; ++i) S12(i, j) += a[i] * ab;
  };
  for (int j = first; j < last; ++j) add_column(j);
  for (int j = 3; j < 6; ++j) add_column(j);
}

void ConstraintRows::add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S) {
  for (std::size_t k = 0; k < data_->groups.size(); ++k) {
    const RowGroup& g = data_->groups[k];
    if (g.shared) continue;
    for (int r = 0; r < g.rows; ++r) {
      const auto add_square = [&](int body, const Rows& J) {
        if (body == 0) return;
        const Columns& x = columns(g.block + r);
        add_lower_square(alpha(g.row + r), J.row(g.block + r).data(), x.first, x.last, S.diagonal(body - 1));
      };
      add_square(g.body1, J1);
      add_square(g.body2, J2);
    }
    if (g.body1 == 0 || g.body2 == 0) continue;
    Mat<6, 6> S12 = Mat<6, 6>::Zero();
    for (int r = 0; r < g.rows; ++r) add_cross(alpha(g.row + r), g.block + r, S12);
    S.add_off_diagonal(handle_[k], S12);
  }
  if (!shared_.empty()) add_shared_square(alpha, S);
}

void ConstraintRows::add_shared_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S) {
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
      add_lower_square(alpha(row.row), row.J[j].data(), 0, 3, S.diagonal(row.bodies[j] - 1));
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

BlockCholesky<6> ConstraintRows::matrix() const { return BlockCholesky<6>(data_->n, edges_); }

}  // namespace mbsopt
