// Accelerations and multipliers at any state, for sensors that need them: solves the equations of motion once more.
// Their adjoint turns a gradient in them into one in the state and the parameters. What lies in the plane of a planar
// mechanism comes from the equations of the plane, except in the penalty form, whose joints give way across it.
#pragma once

#include <memory>
#include <optional>

#include "core/dynamics/spatial_dynamics.hpp"
#include "core/mechanism/state_point.hpp"

namespace mbsopt {

class PlanarDynamics;

class MotionSolver final : public MotionSource {
 public:
  MotionSolver(const Mechanism& mechanism, const FormulationSettings& settings);

  ~MotionSolver() override;

  void forget() {  // the forces changed
    solved_.reset();
    linearised_ = false;
  }
  const Motion& motion(const StatePoint& at, MotionPart part) override;
  Motion& bar(MotionPart part) override;
  void fold_bar(const StatePoint& at, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) override;

 private:
  bool is_solved(MotionPart part) const { return solved_ && (*solved_ == part || *solved_ == MotionPart::all); }
  bool solve(const StatePoint& at);

  const Mechanism mechanism_;
  const FormulationSettings settings_;
  const bool has_plane_;
  // Each is made when it is needed first.
  std::unique_ptr<SpatialDynamics> spatial_;
  std::unique_ptr<PlanarDynamics> planar_;
  Motion motion_, bar_;
  MotionPart part_of_bar_ = MotionPart::in_plane;
  double t_ = 0;
  std::optional<MotionPart> solved_;  // at this state
  bool linearised_ = false;           // there
  Eigen::VectorXd y_, ydot_, w_, y_bar_, theta_bar_, rho_bar_;
};

}  // namespace mbsopt
