// Phi_eta of all constraints as blocks of two 6-rows each, with the products that the formulations need. A row of Phi
// that several constraints share (a gear) has several blocks.
#pragma once

#include <algorithm>
#include <vector>

#include "core/dynamics/row_products.hpp"
#include "core/linear/block_cholesky.hpp"
#include "core/linear/kernel_table.hpp"
#include "core/linear/pairs.hpp"
#include "core/linear/prefetch.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class ConstraintRows : public RowProducts<ConstraintRows, RowsInSpace> {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  using Frames = std::vector<Frame>;

  explicit ConstraintRows(const MechanismData& data);

  Eigen::Index count() const { return data_->m; }
  void evaluate(const std::vector<Frame>& frames);  // J at the frames' positions

  // Sets J and S = M + J' diag(alpha) J at the frames' positions. Sets phi_ddot, unless null, to the frames' Phiddot
  // without laws.
  void assemble(const std::vector<Frame>& frames, const Eigen::VectorXd& alpha, BlockCholesky<6>& S,
                Eigen::VectorXd* phi_ddot = nullptr);
  // M x for body i (1-based).
  template <class X>
  X mass_times(int body, const X& x) const {
    const BodyData& b = data_->bodies[static_cast<std::size_t>(body)];
    X out;
    const auto* from = entries(x);
    auto* to = entries(out);
    for (int i = 0; i < 3; ++i) to[i] = b.mass * from[i];
    for (int i = 0; i < 3; ++i) to[3 + i] = b.J(i, 0) * from[3] + b.J(i, 1) * from[4] + b.J(i, 2) * from[5];
    return out;
  }

  void write_dense(Eigen::MatrixXd& J) const;  // 6 columns per moving body

  BlockCholesky<6> matrix() const;  // a matrix with the pattern of J'J

  Rows J1, J2;  // one row per block row
  RowsInSpace view() const {
    return {groups_.data(), groups_.size(), J1.data(), J2.data(), columns_.data(), bodies_.data(), bodies_.size()};
  }

 private:
  using Columns = RowsInSpace::Columns;
  template <bool Accelerations>
  void evaluate(std::size_t group, const Frames& frames, Eigen::VectorXd* phi_ddot);
  void set_mass(BlockCholesky<6>& S) const;  // S = M
  // S += J' diag(alpha) J of a group
  void add_square(std::size_t group, const Eigen::VectorXd& alpha, const BlockKernels& kernels, BlockCholesky<6>& S);
  void add_shared_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S);
  // Prefetches the data that evaluate and add_square need for a later group.
  void prefetch_geometry(std::size_t group, const Frames& frames) const;
  [[gnu::always_inline]] void prefetch_square(std::size_t group, BlockCholesky<6>& S) const {
    const RowGroup& g = data_->groups[group];
    if (g.shared) return;
    prefetch<30>(J1.data(), 6 * g.block), prefetch<30>(J2.data(), 6 * g.block);
    if (g.body1 > 0) prefetch(&S.diagonal(g.body1 - 1));
    if (g.body2 > 0) prefetch(&S.diagonal(g.body2 - 1));
    if (g.body1 > 0 && g.body2 > 0) prefetch(&S.off_diagonal(handle_[group]));
  }

  // A row with several constraints: its distinct moving bodies, and the off-diagonal blocks of their pairs.
  struct SharedRow {
    int row = 0;
    std::vector<int> bodies;
    std::vector<std::size_t> handles;  // of pairs (0,1), (0,2), (1,2), ...
    std::vector<Mat<1, 6>> J;          // per body
  };

  const MechanismData* data_;
  std::vector<Columns> columns_;  // per block row
  std::vector<RowsInSpace::Group> groups_;
  std::vector<RowsInSpace::Body> bodies_;
  std::vector<std::size_t> handle_;            // per group: its off-diagonal block
  std::vector<std::size_t> first_constraint_;  // per group
  std::vector<SharedRow> shared_;
  std::vector<std::pair<int, int>> edges_;
};

}  // namespace mbsopt
