// The linear system of s coupled Runge-Kutta stages in their accelerations and multipliers x_i = (a_i, lambda_i):
//
//   sum_j N_ij x_j = b_i,   N_ij = [i = j] (-r_(a, lambda)) - P_ij r_v - (P^2)_ij r_q      at stage i,   P = h A
//
// since V_i = V*_i + sum_j P_ij a_j and Q_i = Q*_i + sum_j P_ij V_j (StageEquations, MotionJacobian). One factor
// serves Newton's method, the tangents, and transposed the adjoint.
//
//   N = [ K  J' ]      factored as     S = K + J' W G,    W = inv(c + epsilon)
//       [ G  -c ]
//
// blocks of 7s rows per body, eliminated without exchanging rows between bodies: S is near the positive definite matrix
// of the equations of motion (saddle_solver.hpp). epsilon also makes it regular where constraints are redundant.
// Refinement with the residual of N itself removes the truncation and the rounding of a large W. So solve and
// solve_transposed are transposes of each other. Each factor is tried on one right-hand side, or by the convergence of
// the first refinement. If the answer is wrong, a sparse LU with pivoting factors N instead.
#pragma once

#include <optional>
#include <span>

#include "core/dynamics/motion_jacobian.hpp"
#include "core/linear/block_lu.hpp"
#include "core/linear/sparse_lu.hpp"

namespace mbsopt {

class StageMatrix {
 public:
  StageMatrix(const MechanismData& data, const MotionJacobian& jacobian, int stages);

  int stages() const { return stages_; }
  Eigen::Index size() const { return per_stage_ * stages_; }

  // A: of these stages alone. values: of each stage, or one for all; kept by reference until the next factor.
  // Trial: a factor that only serves refined solutions is tried by them.
  enum class Trial { now, by_solutions };
  bool factor(double h, const Eigen::MatrixXd& A, std::span<const MotionJacobian::Values> values,
              Trial trial = Trial::now);
  static constexpr int kExact = 4;  // refinements at most for derivatives; Newton's method needs none
  // Solves in place, at most kLanes columns.
  void solve(Eigen::Ref<Eigen::MatrixXd> b, int refinements) { refine<false>(b, refinements); }
  void solve_transposed(Eigen::Ref<Eigen::MatrixXd> b, int refinements) { refine<true>(b, refinements); }
  long factorisations() const { return factorisations_; }
  long pivoted() const { return pivoted_; }  // of them, by the sparse LU

 private:
  struct Joint {  // consecutive rows of Phi that tie the same bodies
    int row = 0, rows = 0;
    std::size_t place = 0;                // in jacobian.rows(): of its first row; body by body, then the next row
    std::vector<int> bodies;              // 0-based
    std::vector<BlockLu::Handle> blocks;  // (row body, column body), columns fastest
  };

  void find_joints(const MotionJacobian& jacobian);
  void make_blocks(const MechanismData& data, const MotionJacobian& jacobian);
  void set_scales(const MechanismData& data);
  template <bool Columns>
  void scale(Eigen::Ref<Eigen::MatrixXd> b) const;

  bool factor_blocks();
  void add_joint(const Joint& joint, int i, const MotionJacobian::Values& x);
  template <class Function>
  void for_each_entry(Function&& f) const;
  bool factor_sparse();
  bool turn_to_sparse();
  bool is_accurate();
  template <bool Transposed>
  void refine(Eigen::Ref<Eigen::MatrixXd> b, int refinements);
  // With epsilon.
  template <bool Transposed>
  void solve_factored(Eigen::Ref<Eigen::MatrixXd> b);
  template <bool Transposed>
  void solve_blocks(Eigen::Ref<Eigen::VectorXd> b);

  // y -= N x and y -= N'x
  template <bool Transposed>
  void subtract_times(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y);
  void combine(const Eigen::Ref<const Eigen::VectorXd>& x);
  void spread(double sign, Eigen::Ref<Eigen::VectorXd> y);
  template <class Function>
  void for_each_row(Function&& f) const;
  // Rows of Phi of y += sign G x, and the same of J;  accelerations of y += sign J' and G' times the multipliers of x.
  void add_G(double sign, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y);
  void add_J(double sign, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y);
  void add_J_transposed(double sign, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y);
  void add_G_transposed(double sign, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y);

  // Largest acceleration (row 0) of each column, and multiplier (row 1), in accelerations of what its row sees.
  using Sizes = Eigen::Array<double, 2, kLanes>;
  Sizes sizes(const Eigen::Ref<const Eigen::MatrixXd>& x) const;

  const MotionJacobian* jacobian_;
  int stages_;
  Eigen::Index accelerations_, per_stage_;
  Eigen::VectorXd mobility_;                  // per row of Phi: 1/inertia
  Eigen::VectorXd epsilon_;                   // per row of Phi: its compliance
  Eigen::VectorXd row_scale_, column_scale_;  // of the equations and unknowns of a stage, as they are factored
  MotionJacobian::Block scale_;               // both, of an entry of two bodies
  std::vector<Joint> joints_;
  std::vector<BlockLu::Handle> pairs_, diagonal_;  // per pair of the Jacobian; per body
  std::optional<BlockLu> blocks_;                  // none for more stages than it takes
  std::optional<SparseLu> sparse_;                 // made when first needed
  bool use_sparse_ = false, tried_ = true;
  int sparse_left_ = 0;  // factorisations by it before blocks_ is tried again

  Eigen::MatrixXd P_, P2_;
  std::vector<const MotionJacobian::Values*> values_;  // per stage
  Eigen::VectorXd W_;                                  // per row of Phi
  std::vector<MotionJacobian::Row> G_;                 // of the rows and bodies of a joint, scaled
  std::vector<Vec<6>> JW_;                             // the same: columns of J'W
  Eigen::MatrixXd right_, step_;
  Eigen::VectorXd by_body_, v_, q_, probe_, answer_;
  long factorisations_ = 0, pivoted_ = 0;
};

}  // namespace mbsopt
