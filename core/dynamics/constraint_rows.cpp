#include "core/dynamics/constraint_rows.hpp"

#include <algorithm>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"

namespace mbsopt {
namespace {

// S += x' alpha x for the entries first to last and 3 to 6 of x. It writes the lower triangle only: a factorisation
// reads no more.
void add_lower_square(double alpha, const double* x, int first, int last, Mat<6, 6>& S) {
  const double a3 = alpha * x[3], a4 = alpha * x[4], a5 = alpha * x[5];
  for (int j = first; j < last; ++j) {
    for (int i = j; i < last; ++i) S(i, j) += alpha * x[i] * x[j];
    S(3, j) += a3 * x[j];
    S(4, j) += a4 * x[j];
    S(5, j) += a5 * x[j];
  }
  S(3, 3) += a3 * x[3];
  S(4, 3) += a4 * x[3];
  S(5, 3) += a5 * x[3];
  S(4, 4) += a4 * x[4];
  S(5, 4) += a5 * x[4];
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
  std::size_t constraint = 0;
  for (const RowGroup& g : data.groups) {
    while (data.constraints.at(constraint).block < g.block) ++constraint;
    first_constraint_.push_back(constraint);
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

[[gnu::always_inline]] inline void ConstraintRows::prefetch_geometry(std::size_t group, const Frames& frames) const {
  constexpr int kMotion = 36;  // numbers of a frame: its position, axes and their rates
  const RowsInSpace::Group& g = groups_[group];
  prefetch<3>(&data_->constraints[first_constraint_[group]]);
  for (const int body : {g.body1, g.body2}) {
    if (body > 0) prefetch<kMotion>(frames[at(body)].r.data());
  }
}

template <bool Accelerations>
void ConstraintRows::evaluate(std::size_t group, const Frames& frames, Eigen::VectorXd* phi_ddot) {
  const RowsInSpace::Group& g = groups_[group];
  const Constraint* c = data_->constraints.data() + first_constraint_[group];
  const Constraint* const last = data_->constraints.data() + data_->constraints.size();
  const Frame &f1 = frames[at(g.body1)], &f2 = frames[at(g.body2)];
  for (; c != last && c->block < g.block + g.rows; ++c) {
    std::visit(
        [&](const auto& p) {
          constexpr int m = std::decay_t<decltype(p)>::kRows;
          if constexpr (Accelerations) {
            Vec<m> value;
            p.phi_ddot(f1, f2, value);
            phi_ddot->segment<m>(c->row) += c->factor * value;
          }
          Mat<m, 6> A, B;
          p.jacobian(f1, f2, A, B);
          // Copies J by the halves in which it was written: a load across both halves would wait for both stores.
          const auto copy = [&](const Mat<m, 6>& from, Rows& J) {
            J.middleRows<m>(c->block).template leftCols<3>() = c->factor * from.template leftCols<3>();
            J.middleRows<m>(c->block).template rightCols<3>() = c->factor * from.template rightCols<3>();
          };
          copy(A, J1);
          copy(B, J2);
        },
        c->primitive);
  }
}

void ConstraintRows::evaluate(const std::vector<Frame>& frames) {
  const std::size_t count = groups_.size(), ahead = static_cast<std::size_t>(kAhead);
  for (std::size_t k = 0; k < count; ++k) {
    if (k + ahead < count) prefetch_geometry(k + ahead, frames);
    evaluate<false>(k, frames, nullptr);
  }
}

// Processes a few groups at a time. Their J is then still in the cache when it is read again, but already stored.
void ConstraintRows::assemble(const std::vector<Frame>& frames, const Eigen::VectorXd& alpha, BlockCholesky<6>& S,
                              Eigen::VectorXd* phi_ddot) {
  constexpr std::size_t kAtATime = 4;
  if (phi_ddot) phi_ddot->setZero();
  set_mass(S);
  const BlockKernels& kernels = block_kernels();
  const std::size_t count = groups_.size(), ahead = static_cast<std::size_t>(kAhead);
  for (std::size_t first = 0; first < count; first += kAtATime) {
    const std::size_t end = std::min(first + kAtATime, count);
    for (std::size_t k = first; k < end; ++k) {
      if (k + ahead < count) prefetch_geometry(k + ahead, frames);
      phi_ddot ? evaluate<true>(k, frames, phi_ddot) : evaluate<false>(k, frames, nullptr);
    }
    for (std::size_t k = first; k < end; ++k) {
      if (k + ahead < count) prefetch_square(k + ahead, S);
      add_square(k, alpha, kernels, S);
    }
  }
  if (!shared_.empty()) add_shared_square(alpha, S);
}

void ConstraintRows::set_mass(BlockCholesky<6>& S) const {
  S.set_off_diagonals_to_zero();
  for (int i = 0; i < data_->n; ++i) {
    if (i + kAhead < data_->n) prefetch(&S.diagonal(i + kAhead));
    const RowsInSpace::Body& b = bodies_[static_cast<std::size_t>(i)];
    double* const D = S.diagonal(i).data();
    std::fill_n(D, 36, 0.0);
    for (int k = 0; k < 3; ++k) {
      D[7 * k] = b.mass;
      for (int j = 0; j < 3; ++j) D[21 + 6 * k + j] = b.J[3 * k + j];
    }
  }
}

void ConstraintRows::add_square(std::size_t group, const Eigen::VectorXd& alpha, const BlockKernels& kernels,
                                BlockCholesky<6>& S) {
  const RowGroup& g = data_->groups[group];
  if (g.shared) return;
  const double* const a = J1.row(g.block).data();
  const double* const b = J2.row(g.block).data();
  double* const aa = g.body1 > 0 ? S.diagonal(g.body1 - 1).data() : nullptr;
  double* const bb = g.body2 > 0 ? S.diagonal(g.body2 - 1).data() : nullptr;
  double* const ab = aa && bb ? S.off_diagonal(handle_[group]).data() : nullptr;
  if (ab && S.transposed(handle_[group])) {
    kernels.add_weighted_squares(g.rows, alpha.data() + g.row, columns_.data() + g.block, b, a, bb, aa, ab);
  } else {
    kernels.add_weighted_squares(g.rows, alpha.data() + g.row, columns_.data() + g.block, a, b, aa, bb, ab);
  }
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

void ConstraintRows::write_dense(Eigen::MatrixXd& J) const {
  const StateLayout layout{data_->n};
  J.setZero(data_->m, 6 * data_->n);
  for (const RowGroup& g : data_->groups) {
    if (g.body1 > 0) J.block(g.row, layout.z(g.body1), g.rows, 6) += J1.middleRows(g.block, g.rows);
    if (g.body2 > 0) J.block(g.row, layout.z(g.body2), g.rows, 6) += J2.middleRows(g.block, g.rows);
  }
}

BlockCholesky<6> ConstraintRows::matrix() const { return BlockCholesky<6>(data_->n, edges_); }

}  // namespace mbsopt
