// The tangent of the point nearest to a guess (nearest_point.hpp) for large sparse J, if the guess itself satisfies the
// equations, so that nu = 0 and H = I:
//
//   x' = J+ b + (I - J+ J) g          that is   x' + J'nu' = g,  J x' = b
//
// It uses the augmented-Lagrangian iteration of saddle_solver.hpp on one sparse factor of S = I + alpha J'J, with rows
// of J scaled to unit length. Redundant rows do no harm. Rows that disagree are satisfied in the least-squares sense.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

namespace mbsopt {

struct SparseEntry {
  int row = 0, column = 0;
  double value = 0;
};

class SparseProjection {
 public:
  // Entries of the same place add up.
  SparseProjection(Eigen::Index rows, Eigen::Index columns, std::span<const SparseEntry> J);
  ~SparseProjection();
  SparseProjection(SparseProjection&&) noexcept;

  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& b, const Eigen::Ref<const Eigen::MatrixXd>& g) const;
  // The adjoint: finds b_bar and g_bar with x_bar'x' = b_bar'b + g_bar'g.
  void solve_transposed(const Eigen::Ref<const Eigen::MatrixXd>& x_bar, Eigen::MatrixXd& b_bar,
                        Eigen::MatrixXd& g_bar) const;

  const Eigen::VectorXd& row_scale() const;
  // Returns the residual b - J x', with rows of J scaled to unit length.
  Eigen::MatrixXd left(const Eigen::Ref<const Eigen::MatrixXd>& b, const Eigen::Ref<const Eigen::MatrixXd>& x) const;

 private:
  struct Factor;
  void solve_system(const Eigen::MatrixXd& b, const Eigen::Ref<const Eigen::MatrixXd>& g, Eigen::MatrixXd& x,
                    Eigen::MatrixXd& nu) const;
  std::unique_ptr<Factor> factor_;
};

}  // namespace mbsopt
