// The point nearest to a guess among those that satisfy some equations, with its derivatives in guess and equations.
//
//   min 1/2 |x - x_guess|^2   subject to  F(x) = 0
//
// At the solution, with multipliers nu, J = F_x and H = I + sum_i nu_i F_i,xx:
//
//   x - x_guess + J'nu = 0,  F = 0
//   H x' + J'nu' = g,  J x' = b          g = x_guess' - (J'nu)' at fixed x,   b = -F' at fixed x
//   x' = J+ b + Z (Z'H Z)^-1 Z'(g - H J+ b)          Z: orthonormal basis of the null space of J
//
// J may be rank deficient (redundant equations). The last steps and derivatives decompose it with unknowns in units of
// their sizes. Z separates pure translations (or pure turns). So a mechanism of micrometres or of kilometres loses no
// digits between metres and Euler parameters. Nocedal and Wright, "Numerical Optimization" (2006), sections 16.2
// (null-space method), 18.4 and 18.5 (SQP, merit functions).
//
// Far from the solution, Gauss-Newton steps (H = I) of limited length lead from the guess onto the equations, without a
// merit function. They stay on the guess's branch. They also pass redundant equations whose rank changes on the way, at
// which a line search stalls. Near the solution Newton steps converge to rounding. If Gauss-Newton cycles (the
// curvature of the equations exceeds 2 as seen from the guess), SQP with a merit function follows.
#pragma once

#include <Eigen/Core>

#include "core/linear/dense.hpp"

namespace mbsopt {

// F of one nearest-point problem.
struct NearestPointEquations {
  virtual ~NearestPointEquations() = default;
  virtual Eigen::VectorXd values(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::MatrixXd jacobian(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::MatrixXd curvature(const Eigen::VectorXd& x, const Eigen::VectorXd& nu) const = 0;  // sum nu_i F_i,xx
  // The part of a step, at most 1, that keeps it small against the equations' nonlinearity.
  virtual double step_fraction(const Eigen::VectorXd& step) const = 0;
  // Returns x moved to satisfy the equations that can be satisfied one by one (unit norms).
  virtual Eigen::VectorXd retracted(const Eigen::VectorXd& x) const = 0;
  // The unit of each unknown, in which the entries of J become comparable.
  virtual Eigen::VectorXd sizes(const Eigen::MatrixXd& J) const { return Eigen::VectorXd::Ones(J.cols()); }
  // Returns the change of each value per relative change of its terms, which is its accuracy after rounding.
  virtual Eigen::VectorXd magnitudes(const Eigen::VectorXd& x) const { return jacobian(x).cwiseAbs() * x.cwiseAbs(); }
  // Returns the weight of each violation if the equations cannot all be satisfied.
  virtual Eigen::VectorXd weights() const = 0;
  virtual void accept(const Eigen::VectorXd&) {}  // x is the next iterate: continue what is continued (angles)
};

// J decomposed at one point, and the solution of the linear system above.
class NearestPointLinearisation {
 public:
  static constexpr double kRankThreshold = 1e-8;  // relative, rows of J scaled to unit length

  NearestPointLinearisation() = default;
  explicit NearestPointLinearisation(const Eigen::MatrixXd& J);
  NearestPointLinearisation(const Eigen::MatrixXd& J, const Eigen::VectorXd& sizes);

  Eigen::Index rank() const { return J_transposed_.rank(); }
  const Eigen::VectorXd& row_scale() const { return scale_; }
  const Eigen::VectorXd& sizes() const { return sizes_; }
  // Returns the part of b outside the range of J, rows of J scaled to unit length.
  Eigen::MatrixXd left(const Eigen::Ref<const Eigen::MatrixXd>& b) const {
    return scale_.asDiagonal() * (b - J_ * particular(b));
  }
  const Eigen::MatrixXd& null_space() const { return Z_; }                        // Z
  Eigen::MatrixXd multipliers(const Eigen::Ref<const Eigen::MatrixXd>& g) const;  // least nu with J'nu = g
  // Returns nu with J'nu = x_guess - x, as exact as x is: to eps of each unknown's size.
  Eigen::VectorXd multipliers_at(const Eigen::VectorXd& away) const;
  Eigen::MatrixXd pseudo_inverse_times(const Eigen::Ref<const Eigen::MatrixXd>& b) const;  // J+ b

  // Call this before solve and solve_transposed.
  void set_hessian(const Eigen::MatrixXd& H);
  // Eigenvalues of Z'HZ, ascending: all positive at a strict minimum.
  const Eigen::VectorXd& reduced_eigenvalues() const { return lambda_; }

  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& b, const Eigen::Ref<const Eigen::MatrixXd>& g) const;
  // The adjoint: finds b_bar and g_bar with x_bar'x' = b_bar'b + g_bar'g.
  void solve_transposed(const Eigen::Ref<const Eigen::MatrixXd>& x_bar, Eigen::MatrixXd& b_bar,
                        Eigen::MatrixXd& g_bar) const;
  // The rounding of x = solve(b, g), whose part along Z sums large terms: eps |Z| |Z'HZ|^-1 |Z|'(|g| + |H| |x|). The
  // largest over all unknowns and columns, each relative to the largest unknown, in units of the sizes.
  double rounding(const Eigen::Ref<const Eigen::MatrixXd>& x, const Eigen::Ref<const Eigen::MatrixXd>& g) const;
  // Solves with the eigenvalues of Z'HZ made positive: a descent direction of the merit function everywhere.
  Eigen::VectorXd descent(const Eigen::VectorXd& b, const Eigen::VectorXd& g) const;

 private:
  Eigen::MatrixXd particular(const Eigen::Ref<const Eigen::MatrixXd>& b) const;  // some x with J x = b

  Eigen::MatrixXd J_;
  Eigen::VectorXd scale_, sizes_;         // of the rows and of the columns of J
  OrthogonalDecomposition J_transposed_;  // of (scale J sizes)'
  Eigen::MatrixXd Z_, H_, V_;             // Z'HZ = V diag(lambda) V'
  Eigen::VectorXd lambda_;
};

enum class NearestPointStatus {
  found,
  unsatisfiable,  // x: a point of locally least violation
  undetermined,   // a stationary point that is not a strict minimum: several points are equally near
  singular,       // the equations are satisfied where their rank drops: branches meet, no nearest point is settled on
  stalled,        // no convergence within the allowed iterations
};

struct NearestPoint {
  NearestPointStatus status = NearestPointStatus::stalled;
  Eigen::VectorXd x, nu, F;
  int iterations = 0;
  bool determined = false;  // the equations were seen to leave nothing free: no multipliers are computed, nu = 0
  // At x, with its Hessian if status is found. If the guess itself was found, or if there is no freedom, linearise()
  // below computes it on demand.
  bool linearised = true;
  NearestPointLinearisation linearisation;
};

enum class Decomposition { now, on_demand };
// iterations is the largest number for each method.
NearestPoint nearest_point(NearestPointEquations& equations, const Eigen::VectorXd& x_guess,
                           Decomposition decomposition = Decomposition::now, int iterations = 400);
// Computes the dense decomposition. A guess that satisfies its equations to rounding needs none before this call.
void linearise(NearestPointEquations& equations, NearestPoint& found);

}  // namespace mbsopt
