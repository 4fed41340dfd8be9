// Mass-orthogonal projection of a state onto the constraints, after each accepted step, with its tangent and adjoint.
//
//   positions:   q = q^ (+) delta:     M delta + J(q~)' nu = 0,   Phi(q) = 0
//   velocities:  v = v_n + T(q) u:     M u + J(q)' kappa = 0,     Phidot(q, v) = 0
//
// q~ is q^ at unit norms, and v_n is v^ without the part of pdot along p. body_in_space.hpp and body_in_plane.hpp
// define how a body moves by delta and u. Both levels are iterated to rounding with the one factor of S(q~)
// (saddle_solver.hpp). Derivatives are those of these conditions. The same stationary iteration solves their linear
// systems in a fixed number of passes; the adjoint transposes it. Mass-orthogonal projection: Eich, "Convergence
// results for a coordinate projection method", SIAM J. Numer. Anal. 30 (1993).
#pragma once

#include <memory>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

// The result of a projection, which determines its derivatives. In the plane, each body's entries are (along t1, along
// t2, about n, 0, 0, 0).
struct ProjectionSolution {
  std::vector<Vec<6>> delta, u;
  Eigen::VectorXd nu, kappa;
};

class Projector {
 public:
  virtual ~Projector() = default;

  bool positions() const { return what_ == Projection::position_velocity; }
  bool active() const { return what_ != Projection::none; }
  ProjectionSolution solution() const;  // of the right sizes

  // Sets y to the projected y_hat at time t. angles holds branches of the followed joint angles. Returns false if it
  // does not converge.
  virtual bool project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
                       ProjectionSolution& solution) = 0;

  // Does the same by Newton's method for a mechanism without freedom, near a state that satisfies its constraints.
  virtual bool settle(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) = 0;

  // Does the same from far by damped Newton steps that keep the sign of det J. This keeps the assembly mode of a
  // mechanism whose modes differ in that sign. Returns false also if J is not square.
  virtual bool assemble(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) = 0;

  // Moves the positions of y to the nearby minimum of |Phi|^2/2, and returns |Phi| there. Adds the gradient of
  // |Phi|^2/2 in the fields and in the parameters of laws to theta_bar and rho_bar; q is stationary.
  virtual double approach(double t, const Eigen::VectorXd& angles, Eigen::VectorXd& y, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd& rho_bar) = 0;

  // Prepares derivatives at an earlier projection (also of another Projector of the same mechanism).
  virtual bool linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat,
                         const Eigen::VectorXd& y, const ProjectionSolution& solution) = 0;
  // Without velocities, their rows are undefined.
  virtual void tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir,
                       bool velocities = true) = 0;
  // y_hat_bar += (dy/dy_hat)' y_bar, and the same for the differentiated fields and the parameters in laws
  virtual void add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                           Eigen::VectorXd& rho_bar) = 0;

  // Computes, after project() or settle() and with its factor, the constraint forces of a fixed load on all bodies. It
  // also computes the forces that these cause as accelerations of the constraints. Near a singular position they grow
  // as 1/d^3 in the directions that become free, d the distance from it, and change sign there.
  virtual void response(Eigen::VectorXd& out) = 0;

  // The largest violations at y: those of Phi and the unit norms, and those of their rates. `relative` receives that of
  // positions with lengths in units of the mechanism's.
  virtual double position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y,
                                    double* relative = nullptr) = 0;
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

// planar: `what` must be none or position_velocity, and the mechanism must have a planar model. With Free::nothing,
// `what` is position_velocity, states come from settle(), and derivatives are taken there with a solution of zeros. If
// J is square and small, J itself is then factored.
enum class Free { something, nothing };
std::unique_ptr<Projector> make_projector(const Mechanism& mechanism, Projection what, Model model = Model::spatial,
                                          Free free = Free::something);

}  // namespace mbsopt
