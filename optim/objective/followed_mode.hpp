// The frequency or the damping ratio of one mode of the motion near the initial state, or the least of all modes. It is
// a function of the parameters alone, with its gradient.
//
//   f_y v = lambda v,   w'f_y = lambda w',   w'v = 1:      lambda' = w'(f_y)' v
//
// f: the equations of motion ydot = f(y, rho), y0(rho) the equilibrium from which the scene starts. (f_y)' v is the
// derivative of f_y and f_rho along v: differences of the exact adjoint f_y'w, f_rho'w at y0 +- h v, extrapolated.
//
// The mode has its number at the scene's own parameter values, from slow to fast as in `linearise`. At other values all
// modes are assigned to those, one to one, so that their shapes are as similar as possible. So the value depends on the
// parameters only, not on the path to them, and objectives of different modes never follow the same one. The least of
// all modes has a kink where two are equally low, so the others are known beside it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/start/linearisation.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

class FollowedMode {
 public:
  FollowedMode(const Scene& scene, const EigenvalueSpec& spec);
  ~FollowedMode();

  using UserForces = std::vector<std::shared_ptr<const UserForce>>;
  // Throw std::runtime_error if the mode does not exist: assembly failed, no equilibrium, fewer modes.
  double value(const Eigen::VectorXd& rho, const UserForces& forces) const;
  // The number of the mode from slow to fast at other values.
  int number(const Eigen::VectorXd& rho, const UserForces& forces) const;

  struct Slope {
    double value = 0;
    Eigen::VectorXd gradient;  // in all parameters
  };
  // The value with its gradient; of the least one with those of the modes above it. It warns if the mode is not smooth,
  // because another one coincides with it.
  std::vector<Slope> slopes(const Eigen::VectorXd& rho, const UserForces& forces,
                            std::vector<std::string>* warnings = nullptr) const;

 private:
  struct State;  // the linearised equilibrium at some rho
  bool is_least() const { return spec_.value.starts_with("least"); }
  // The mode of the file, or the lowest ones, from low to high.
  std::vector<Eigen::Index> modes_of(const State& state, const UserForces& forces) const;
  Eigen::Index mode_of(const State& state, const UserForces& forces) const;
  Slope slope(State& state, Eigen::Index mode) const;
  double value_of(std::complex<double> lambda) const;

  Scene scene_;
  EigenvalueSpec spec_;
  struct Reference;
  std::unique_ptr<Reference> reference_;  // the shape at the scene's own values, once known
};

}  // namespace mbsopt::inline optim
