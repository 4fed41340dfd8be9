// The point nearest to a guess among those that satisfy some equations, with its derivatives in guess and equations.
//
//   min 1/2 |x - x_guess|^2   subject to  F(x) = 0
//
//   x - x_guess + J'nu = 0,  F = 0,  J = F_x,  multipliers nu
//
// Its derivatives are those of nearest_point_linearisation.hpp. Nocedal and Wright, "Numerical Optimization" (2006),
// sections 10.3 (Levenberg-Marquardt) and 18.1 (Newton's method on the optimality conditions).
//
// Far from the solution, Gauss-Newton steps (H = I) of limited length lead from the guess onto the equations, without a
// merit function. They stay on the guess's branch. They also pass redundant equations whose rank changes on the way, at
// which a line search stalls. Near the solution Newton steps converge to rounding. If Gauss-Newton circles (the
// curvature of the equations exceeds 2 as seen from the guess), it takes a part of each step along the equations. If
// the equations stay violated, Levenberg-Marquardt steps lead to their least violation.
#pragma once

#include <Eigen/Core>

#include "core/start/nearest_point_linearisation.hpp"

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

// iterations is the largest number for each method.
NearestPoint nearest_point(NearestPointEquations& equations, const Eigen::VectorXd& x_guess, int iterations = 400);
// Computes the dense decomposition. A guess that satisfies its equations to rounding needs none before this call.
void linearise(NearestPointEquations& equations, NearestPoint& found);

}  // namespace mbsopt
