// The linear system every formulation, tangent, adjoint and projection solves,
//
//   [ M  J' ] [ x  ]   [ b ]
//   [ J  -c ] [ nu ] = [ g ]      c = 0: constrained (augmented Lagrangian);  c > 0: penalty, its alpha 1/c
//
// with the one factor S = M + J' diag(alpha) J. From x = 0, nu = 0, 1 + refinements times
//
//   S dx = (b - M x - J'nu) + J' alpha s,    dnu = alpha (J dx - s),      s = g - J x + c nu
//
// The first pass solves the system with 1/alpha in place of c: penalty, when c is just that. Further ones are the
// augmented-Lagrangian iteration (c = 0) or its quasi-definite counterpart, written as corrections of both x and nu by
// their residuals: iterative refinement, which also removes the rounding errors of S (its condition number grows with
// alpha). Each gains a factor of about (1 - c alpha)/(1 + alpha j), j the eigenvalues of J inv(M) J', so alpha need not
// be that of the penalty. Updating nu by alpha times the whole J x - g instead would leave it with an error of alpha
// times the rounding unit. The map (b, g) -> (x, nu) after a fixed number of passes is symmetric, so tangent and
// adjoint solves are exact transposes whatever their convergence.
//
// Redundant rows that disagree leave a residual s with J's = 0 that no x removes. Where c > 0, and alpha is the same in
// all rows, x is right nevertheless, and nu lacks -s/c, which is added at the end.
#pragma once

#include <vector>

#include "core/dynamics/constraint_rows.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class SaddleSolver {
 public:
  // alpha: that of S, per row.
  SaddleSolver(const MechanismData& data, const Eigen::VectorXd& alpha, double c = 0);

  // S from J at the frames given; false where it is not positive definite.
  bool factor(const std::vector<Frame>& frames);
  // J alone.
  void place(const std::vector<Frame>& frames) { rows_.evaluate(frames); }
  const ConstraintRows& rows() const { return rows_; }
  const Eigen::VectorXd& alpha() const { return alpha_; }

  // Refinements after the first pass: at least `least`, at most `most`; between the two until |s| is at most tolerance
  // times the larger of |g| and |x|, or stops falling.
  struct Settings {
    int least = 0, most = 0;
    double tolerance = 0;
  };
  void solve(const std::vector<Vec<6>>& b, const Eigen::VectorXd& g, const Settings& settings, std::vector<Vec<6>>& x,
             Eigen::VectorXd& nu);
  void solve(const std::vector<Lanes<6>>& b, const LaneRows& g, const Settings& settings, std::vector<Lanes<6>>& x,
             LaneRows& nu);

  // |s| after the last solve, relative as above, and itself.
  double residual_ratio() const { return residual_ratio_; }
  double residual_size() const { return residual_size_; }
  long factorisations() const { return factorisations_; }

  // M x for body i (1-based).
  template <class X>
  X mass_times(int body, const X& x) const {
    const BodyData& b = data_->bodies[static_cast<std::size_t>(body)];
    X y;
    y.template topRows<3>() = b.mass * x.template topRows<3>();
    y.template bottomRows<3>().noalias() = b.J * x.template bottomRows<3>();
    return y;
  }

 private:
  template <class X, class Y>
  void solve_any(const std::vector<X>& b, const Y& g, const Settings& settings, std::vector<X>& x, Y& nu, Y& residual,
                 Y& step, std::vector<X>& correction);
  template <class X, class Y>
  void add_redundant_part(Y& nu, Y& residual, Y& step, std::vector<X>& correction);

  const MechanismData* data_;
  ConstraintRows rows_;
  BlockCholesky S_;
  Eigen::VectorXd alpha_;
  double c_;
  Eigen::VectorXd residual_, step_;
  LaneRows residual_lanes_, step_lanes_;
  std::vector<Vec<6>> correction_;
  std::vector<Lanes<6>> correction_lanes_;
  long factorisations_ = 0;
  double residual_ratio_ = 0, residual_size_ = 0;
};

}  // namespace mbsopt
