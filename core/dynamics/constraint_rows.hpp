// Phi_eta of all constraints as blocks of two 6-rows each, and the products the formulations need of it. A row of Phi
// that several constraints share (a gear) has several blocks.
#pragma once

#include <algorithm>
#include <vector>

#include "core/linear/block_cholesky.hpp"
#include "core/linear/block_kernels.hpp"
#include "core/linear/pairs.hpp"
#include "core/linear/prefetch.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class ConstraintRows {
 public:
  static constexpr int kUnknowns = 6;  // per body
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  using Frames = std::vector<Frame>;

  explicit ConstraintRows(const MechanismData& data);

  Eigen::Index count() const { return data_->m; }
  void evaluate(const std::vector<Frame>& frames);  // J at the frames' positions

  // y -= J x; x: 6 numbers (or lanes of them) per moving body, body i at x[i - 1].
  void subtract_times(const std::vector<Vec<6>>& x, Eigen::VectorXd& y) const {
    for (const RowGroup& g : data_->groups) {
      if (g.body1 > 0 && g.body2 > 0) {
        const Column<3> x1(x[of_body(g.body1)].data()), x2(x[of_body(g.body2)].data());
        for (int r = 0; r < g.rows; ++r) {
          const Pair sum = x1.times(row(J1, g.block + r)) + x2.times(row(J2, g.block + r));
          y(g.row + r) -= sum[0] + sum[1];
        }
      } else if (g.body1 > 0 || g.body2 > 0) {
        const Rows& J = g.body1 > 0 ? J1 : J2;
        const Column<3> moving(x[of_body(std::max(g.body1, g.body2))].data());
        for (int r = 0; r < g.rows; ++r) {
          const Pair sum = moving.times(row(J, g.block + r));
          y(g.row + r) -= sum[0] + sum[1];
        }
      }
    }
  }
  void subtract_times(const std::vector<Lanes<6>>& x, LaneRows& y) const {
    if (!x.empty()) block_kernels().subtract_times_in_space(view(), x[0].data(), y.data());
  }
  // x -= J'lambda
  void subtract_transposed_times(const Eigen::VectorXd& lambda, std::vector<Vec<6>>& x) const {
    const auto subtract = [&](int body, const Rows& J, const RowGroup& g) {
      if (body == 0) return;
      double* to = x[of_body(body)].data();
      Column<3> sum(to);
      for (int r = 0; r < g.rows; ++r) sum.subtract(lambda(g.row + r), row(J, g.block + r));
      sum.store(to);
    };
    for (const RowGroup& g : data_->groups) subtract(g.body1, J1, g), subtract(g.body2, J2, g);
  }
  void subtract_transposed_times(const LaneRows& lambda, std::vector<Lanes<6>>& x) const {
    if (!x.empty()) block_kernels().subtract_transposed_times_in_space(view(), lambda.data(), x[0].data());
  }
  // Steps of BlockSaddleSolver (block_kernels.hpp), of a single vector without sizes.
  void load(const SaddleIterate& at, bool first, std::vector<Vec<6>>& correction) const {
    block_kernels().load(view(), at, first, correction[0].data());
  }
  void correct(const SaddleIterate& at, bool first, const std::vector<Vec<6>>& correction) const {
    block_kernels().correct(view(), at, first, correction[0].data());
  }
  void load(const SaddleIterate& at, bool first, std::vector<Lanes<6>>& correction) const {
    block_kernels().load_lanes_in_space(view(), at, first, correction[0].data());
  }
  SaddleSizes correct(const SaddleIterate& at, bool first, const std::vector<Lanes<6>>& correction) const {
    return block_kernels().correct_lanes_in_space(view(), at, first, correction[0].data());
  }
  // J and S = M + J' diag(alpha) J at the frames' positions, in one go; and, where asked for, Phiddot of the frames
  // without the laws.
  void assemble(const std::vector<Frame>& frames, const Eigen::VectorXd& alpha, BlockCholesky<6>& S,
                Eigen::VectorXd* phi_ddot = nullptr);
  // M x for body i (1-based), and S = M.
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
  void set_mass(BlockCholesky<6>& S) const;
  // S += J' diag(alpha) J
  void add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S);

  Eigen::MatrixXd dense() const;  // J, 6 columns per moving body

  BlockCholesky<6> matrix() const;  // a matrix with the pattern of J'J

  Rows J1, J2;  // one row per block row

 private:
  using Columns = RowsInSpace::Columns;
  RowsInSpace view() const {
    return {groups_.data(), groups_.size(), J1.data(), J2.data(), columns_.data(), bodies_.data(), bodies_.size()};
  }

  static const double* row(const Rows& J, int block) { return J.data() + 6 * block; }

  static std::size_t of_body(int body) { return static_cast<std::size_t>(body - 1); }
  template <bool Accelerations>
  void evaluate(std::size_t group, const Frames& frames, Eigen::VectorXd* phi_ddot);
  void add_square(std::size_t group, const Eigen::VectorXd& alpha, const BlockKernels& kernels, BlockCholesky<6>& S);
  void add_shared_square(const Eigen::VectorXd& alpha, BlockCholesky<6>& S);
  // The memory of a later group that both use (inlined: prefetch.hpp).
  [[gnu::always_inline]] void prefetch_geometry(std::size_t group, const Frames& frames) const {
    constexpr int kMotion = 36;  // numbers of a frame: its position, axes and their rates
    const RowsInSpace::Group& g = groups_[group];
    prefetch<3>(&data_->constraints[first_constraint_[group]]);
    for (const int body : {g.body1, g.body2}) {
      if (body > 0) prefetch<kMotion>(frames[static_cast<std::size_t>(body)].r.data());
    }
  }
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
