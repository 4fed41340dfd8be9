// The linear system every formulation, tangent, adjoint and projection solves,
//
//   [ M  J' ] [ x  ]   [ b ]
//   [ J  -c ] [ nu ] = [ g ]      c = 0: constrained (augmented Lagrangian);  c > 0: penalty, its alpha 1/c
//
// with the one factor S = M + J' diag(alpha) J. From x = 0, nu = 0, 1 + refinements times
//
//   S dx = (b - M x - J'nu) + J' alpha s,    dnu = alpha (J dx - s),      s = g - J x + c nu
//
// The first pass solves the system with 1/alpha in place of c: penalty, when c is just that. Further passes are the
// augmented-Lagrangian iteration (c = 0) or its quasi-definite counterpart. They correct x and nu by their residuals:
// this iterative refinement also removes the rounding errors of S, whose condition number grows with alpha. Each gains
// a factor of about (1 - c alpha)/(1 + alpha j), j the eigenvalues of J inv(M) J', so alpha need not be that of the
// penalty. Updating nu by alpha times the whole J x - g instead would leave it with an error of alpha times the
// rounding unit. The map (b, g) -> (x, nu) after a fixed number of passes is symmetric, so tangent and adjoint solves
// are exact transposes whatever their convergence.
//
// Redundant rows that disagree leave a residual s with J's = 0 that no x removes. If c > 0 and all rows have one alpha,
// nu lacks -s/c. The solver adds it, and further passes remove its part that was not redundant. If c = 0, each pass
// moves x equally far along directions that J hardly holds. The solver takes a pass back that gains nothing, so that
// tangent and adjoint solves have equally many.
#pragma once

#include <vector>

#include "core/dynamics/constraint_rows.hpp"
#include "core/dynamics/planar_rows.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

// How many refinements follow the first pass: `least` to `most`. Between the two they end when |s| is at most tolerance
// times the larger of |g| and |x|, or stops falling.
struct Refinements {
  int least = 0, most = 0;
  double tolerance = 0;
};

// Rows: J and M in space (ConstraintRows) or in the plane (PlanarRows).
template <class Rows>
class BlockSaddleSolver {
 public:
  static constexpr int kUnknowns = Rows::kUnknowns;  // per body
  using Settings = Refinements;
  using Frames = typename Rows::Frames;
  using Vector = std::vector<Vec<kUnknowns>>;
  using LaneVector = std::vector<Lanes<kUnknowns>>;

  // alpha: that of S, per row.
  BlockSaddleSolver(const MechanismData& data, const Eigen::VectorXd& alpha, double c = 0);

  // S from J at the frames given; false where it is not positive definite. phi_ddot: the frames' Phiddot, laws left
  // out.
  bool factor(const Frames& frames, Eigen::VectorXd* phi_ddot = nullptr);
  // J alone.
  void place(const Frames& frames) { rows_.evaluate(frames); }
  const Rows& rows() const { return rows_; }
  const Eigen::VectorXd& alpha() const { return alpha_; }

  void solve(const Vector& b, const Eigen::VectorXd& g, const Settings& settings, Vector& x, Eigen::VectorXd& nu);
  void solve(const LaneVector& b, const LaneRows& g, const Settings& settings, LaneVector& x, LaneRows& nu);

  // |s| after the last solve, relative as above, and itself.
  double residual_ratio() const { return residual_ratio_; }
  double residual_size() const { return residual_size_; }
  long factorisations() const { return factorisations_; }
  long factor_blocks() const { return static_cast<long>(S_.blocks()); }

  // M x for body i (1-based).
  template <class X>
  X mass_times(int body, const X& x) const {
    return rows_.mass_times(body, x);
  }

 private:
  template <class X, class Y>
  void solve_any(const std::vector<X>& b, const Y& g, const Settings& settings, std::vector<X>& x, Y& nu, Y& residual,
                 std::vector<X>& correction);
  template <class X, class Y>
  void refine(const SaddleIterate& at, bool from_zero, double size_of_g, const Settings& settings, std::vector<X>& x,
              Y& nu, Y& residual, std::vector<X>& correction);

  Rows rows_;
  BlockCholesky<kUnknowns> S_;
  Eigen::VectorXd alpha_;
  double c_;
  Eigen::VectorXd residual_;
  LaneRows residual_lanes_;
  Vector correction_;
  LaneVector correction_lanes_;
  long factorisations_ = 0;
  double residual_ratio_ = 0, residual_size_ = 0;
};
extern template class BlockSaddleSolver<ConstraintRows>;
extern template class BlockSaddleSolver<PlanarRows>;

using SaddleSolver = BlockSaddleSolver<ConstraintRows>;
using PlanarSaddleSolver = BlockSaddleSolver<PlanarRows>;

}  // namespace mbsopt
