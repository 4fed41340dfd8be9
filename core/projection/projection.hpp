// Mass-orthogonal projection of a state onto the constraints, after each accepted step, with its tangent and adjoint.
//
//   positions:   q = q^ (+) delta:     M delta + J(q~)' nu = 0,   Phi(q) = 0
//   velocities:  v = v_n + T(q) u:     M u + J(q)' kappa = 0,     Phidot(q, v) = 0
//
// with q~ = q^ at unit norms, and v_n = v^ without the part of pdot along p; body_in_space.hpp and body_in_plane.hpp
// say how a body moves by delta and u. Both levels are iterated to rounding with the one factor of S(q~)
// (saddle_solver.hpp). Derivatives are those of these conditions; their linear systems are solved by the same
// stationary iteration, transposed in the adjoint, a fixed number of times. Mass-orthogonal projection: Eich,
// "Convergence results for a coordinate projection method", SIAM J. Numer. Anal. 30 (1993).
#pragma once

#include <memory>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/projection/projection_solution.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class Projector {
 public:
  virtual ~Projector() = default;

  bool positions() const { return what_ == Projection::position_velocity; }
  bool active() const { return what_ != Projection::none; }
  ProjectionSolution solution() const;  // of the right sizes

  // y = projected y_hat, at time t; angles: branches of the followed joint angles. False where it does not converge.
  virtual bool project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
                       ProjectionSolution& solution) = 0;

  // As project, for a mechanism whose constraints leave nothing free, near a state that satisfies them: Newton's
  // method.
  virtual bool settle(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) = 0;

  // As settle, from far: damped Newton steps that keep the sign of det J, and with it the assembly mode of a mechanism
  // whose modes differ in that sign. False where J is not square, too.
  virtual bool assemble(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) = 0;

  // Moves the positions of y to where |Phi|^2/2 is least, near y, and returns |Phi| there; theta_bar and rho_bar += the
  // gradient of |Phi|^2/2 in the fields and in the parameters of laws, q being stationary.
  virtual double approach(double t, const Eigen::VectorXd& angles, Eigen::VectorXd& y, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd& rho_bar) = 0;

  // Prepares derivatives at a projection made before (also of another Projector of the same mechanism).
  virtual bool linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat,
                         const Eigen::VectorXd& y, const ProjectionSolution& solution) = 0;
  virtual void tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir) = 0;
  // The same of positions alone; rows of velocities are of no use.
  virtual void position_tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir) = 0;
  // y_hat_bar += (dy/dy_hat)' y_bar, and the same for the differentiated fields and the parameters in laws
  virtual void add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                           Eigen::VectorXd& rho_bar) = 0;

  // After project(), with its factor: the constraint forces that a fixed load on all bodies calls for, and those that
  // these call for as accelerations of the constraints. In the directions that a singular position is about to set free
  // they grow as 1/d^3, d the distance from it, and change their sign there.
  virtual void response(Eigen::VectorXd& out) = 0;

  // Largest violations at y: of Phi and the unit norms, and of their rates.
  virtual double position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y) = 0;
  virtual double velocity_violation(double t, const Eigen::VectorXd& y) = 0;
  virtual long factorisations() const = 0;

 protected:
  Projector(const Mechanism& mechanism, Projection what)
      : mechanism_(mechanism), data_(mechanism_.data()), what_(what) {}

  const Mechanism mechanism_;
  const MechanismData& data_;

 private:
  const Projection what_;
};

// planar: what is none or position_velocity, and the mechanism has a planar model. Free::nothing: what is
// position_velocity, states come from settle() and derivatives are taken where they are, with a solution of zeros.
// Where the rows are as many as the unknowns, and few, J itself is factored then.
enum class Free { something, nothing };
std::unique_ptr<Projector> make_projector(const Mechanism& mechanism, Projection what, Model model = Model::spatial,
                                          Free free = Free::something);

}  // namespace mbsopt
