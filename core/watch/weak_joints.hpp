// Joints that hold too weakly for simulation.formulation.alpha.
//
// A loop that locks only by a small angle d between its axes has an eigenvalue j of J inv(M) J' as small as d^2. If
// alpha j is below 1, a refinement gains nearly nothing, and the loop gives way. The residual of the row does not show
// it, since the row is weak by d itself. Accelerations with a larger alpha show it, down to a few 1e-6 rad.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/settings.hpp"
#include "core/watch/step_observer.hpp"

namespace mbsopt {

// The change of the accelerations, relative to the largest, if alpha is 1e4 times as large; 0 for penalties, whose
// alpha is intended. `worst_residual` is that of the run (Dynamics). If it is only rounding, the function computes
// nothing.
double error_of_weak_joints(const Mechanism& mechanism, const FormulationSettings& settings, double worst_residual,
                            double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
// Adds this error at the end of a run, and the worst residual, to the statistics.
void add_residuals(const Mechanism& mechanism, const FormulationSettings& settings, double worst_residual,
                   const StatePoint& end, SimulationStatistics& statistics);
// A message for an error that makes accelerations too rough for normal steps; empty for a smaller one.
std::string weak_joints_objection(double error);

// Watches what projection takes out of the velocities of a penalty formulation: the constraint accelerations that the
// penalty leaves. They hide too small an alpha.
//
//   share = sum |v_hat - v1| / sum (|v_hat - v0| + h |g| sqrt(m))      |v|: the norm of the kinetic energy
//
// v_hat: before projection; v0, v1: at the ends of the step. If nothing moves, loads would move it as gravity g does.
class PenaltyWatch final : public StepObserver {
 public:
  explicit PenaltyWatch(const MechanismData& data) : data_(data) {}

  std::string look_at(const SeenStep& step) override;
  double share() const { return moved_ > 0 ? projected_ / moved_ : 0; }

 private:
  const MechanismData& data_;
  double projected_ = 0, moved_ = 0;
};

}  // namespace mbsopt
