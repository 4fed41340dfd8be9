// Watches what projection takes out of the velocities of a penalty formulation: the constraint accelerations that the
// penalty leaves. They hide too small an alpha.
//
//   share = sum |v_hat - v1| / sum (|v_hat - v0| + h |g| sqrt(m))      |v|: the norm of the kinetic energy
//
// v_hat: before projection; v0, v1: at the ends of the step. If nothing moves, loads would move it as gravity g does.
#pragma once

#include "core/watch/step_observer.hpp"

namespace mbsopt {

struct MechanismData;

class PenaltyWatch final : public StepObserver {
 public:
  explicit PenaltyWatch(const MechanismData& data) : data_(data) {}

  std::string look_at(const SeenStep& step) override;
  void add_to(SimulationStatistics& statistics) override;  // the share, as a residual of the accelerations

 private:
  const MechanismData& data_;
  double projected_ = 0, moved_ = 0;
};

}  // namespace mbsopt
