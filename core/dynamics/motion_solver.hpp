// Accelerations and multipliers at any state, for sensors that need them: solves the equations of motion once more.
// Their adjoint turns a gradient in them into one in the state and the parameters.
#pragma once

#include "core/dynamics/spatial_dynamics.hpp"
#include "core/mechanism/state_point.hpp"

namespace mbsopt {

class MotionSolver final : public MotionSource {
 public:
  MotionSolver(const Mechanism& mechanism, const FormulationSettings& settings);

  const Motion& motion(const StatePoint& at) override;
  Motion& bar() override { return bar_; }
  void fold_bar(const StatePoint& at, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) override;

 private:
  SpatialDynamics dynamics_;
  Motion motion_, bar_;
  double t_ = 0;
  bool linearised_ = false;  // at this state
  Eigen::VectorXd y_, ydot_, w_, y_bar_, theta_bar_, rho_bar_;
};

}  // namespace mbsopt
