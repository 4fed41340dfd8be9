// The linear system that every formulation, tangent, adjoint and projection solves,
//
//   [ M  J' ] [ x  ]   [ b ]
//   [ J  -c ] [ nu ] = [ g ]      c = 0: constrained (augmented Lagrangian);  c > 0: penalty, its alpha 1/c
//
// with the one factor S = M + J' diag(alpha) J. From x = 0, nu = 0, 1 + refinements times
//
//   S dx = (b - M x - J'nu) + J' alpha s,    dnu = alpha (J dx - s),      s = g - J x + c nu
//
// The first pass solves the system with 1/alpha in place of c: exactly the penalty system if c = 1/alpha. Further
// passes are the augmented-Lagrangian iteration (c = 0) or its quasi-definite counterpart. They correct both x and nu
// by their residuals. This is iterative refinement, which also removes the rounding errors of S (its condition number
// grows with alpha). Each pass reduces the error to about (1 - c alpha)/(1 + alpha j) of itself, j the eigenvalues of J
// inv(M) J'. So alpha may differ from that of the penalty. An update of nu by alpha times the whole J x - g would leave
// an error of alpha times the rounding unit. After a fixed number of passes the map (b, g) -> (x, nu) is symmetric. So
// tangent and adjoint solves are exact transposes, converged or not.
//
// Redundant rows that disagree leave a residual s with J's = 0 that no x removes. If c > 0 and alpha is the same in all
// rows, nu lacks -s/c. The solver adds it, and further passes remove its part that was not redundant. If c = 0, each
// pass moves x by a similar amount along directions that J hardly constrains. The solver then undoes a pass that gains
// nothing, so that tangent and adjoint solves have equally many.
#pragma once

#include <vector>

#include "core/dynamics/constraint_rows.hpp"
#include "core/dynamics/planar_rows.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

// The number of refinements after the first pass is between `least` and `most`. They end when |s| is at most tolerance
// times the larger of |g| and |x|, or stops falling.
struct Refinements {
  int least = 0, most = 0;
  double tolerance = 0;
};

// Mass beside that of the bodies, at the present state: a block of M, symmetric and not negative.
template <int N>
struct AddedMass {
  int body = 0;  // 1-based
  Mat<N, N> M = Mat<N, N>::Zero();
};

// Rows gives J and M: in space (ConstraintRows) or in the plane (PlanarRows).
template <class Rows>
class BlockSaddleSolver {
 public:
  static constexpr int kUnknowns = Rows::kUnknowns;  // per body
  using Settings = Refinements;
  using Frames = typename Rows::Frames;
  using Vector = std::vector<Vec<kUnknowns>>;
  using LaneVector = std::vector<Lanes<kUnknowns>>;

  using Added = std::vector<AddedMass<kUnknowns>>;

  // alpha is that of S, per row. `added` belongs to M; the caller sets its blocks before factor().
  BlockSaddleSolver(const MechanismData& data, const Eigen::VectorXd& alpha, double c = 0, const Added& added = none());

  // Factors S with J at the given frames. Returns false if S is not positive definite. phi_ddot receives the frames'
  // Phiddot without laws.
  bool factor(const Frames& frames, Eigen::VectorXd* phi_ddot = nullptr);
  // Evaluates J alone.
  void place(const Frames& frames) { rows_.evaluate(frames); }
  const Rows& rows() const { return rows_; }
  const Eigen::VectorXd& alpha() const { return alpha_; }

  void solve(const Vector& b, const Eigen::VectorXd& g, const Settings& settings, Vector& x, Eigen::VectorXd& nu);
  void solve(const LaneVector& b, const LaneRows& g, const Settings& settings, LaneVector& x, LaneRows& nu);

  // The residual |s| after the last solve: relative as above, and absolute.
  double residual_ratio() const { return residual_ratio_; }
  double residual_size() const { return residual_size_; }
  long factorisations() const { return factorisations_; }
  long factor_blocks() const { return static_cast<long>(S_.blocks()); }

  // M x for body i (1-based).
  template <class X>
  X mass_times(int body, const X& x) const {
    X out = rows_.mass_times(body, x);
    for (const AddedMass<kUnknowns>& a : added_) {
      if (a.body == body) out += a.M * x;
    }
    return out;
  }

 private:
  template <class X, class Y>
  void solve_any(const std::vector<X>& b, const Y& g, const Settings& settings, std::vector<X>& x, Y& nu, Y& residual,
                 std::vector<X>& correction);
  template <class X, class Y>
  void refine(const SaddleIterate& at, bool from_zero, double size_of_g, const Settings& settings, std::vector<X>& x,
              Y& nu, Y& residual, std::vector<X>& correction);

  static const Added& none() {
    static const Added kNone;
    return kNone;
  }

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
  const Added& added_;
};
extern template class BlockSaddleSolver<ConstraintRows>;
extern template class BlockSaddleSolver<PlanarRows>;

using SaddleSolver = BlockSaddleSolver<ConstraintRows>;
using PlanarSaddleSolver = BlockSaddleSolver<PlanarRows>;

}  // namespace mbsopt
