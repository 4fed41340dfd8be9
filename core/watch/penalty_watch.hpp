// Watches what projection takes out of the velocities of a penalty formulation: the constraint accelerations that the
// penalty leaves. They hide too small an alpha.
//
//   share = sum |v_hat - v1| / sum (|v_hat - v0| + h |g| sqrt(m))      |v|: the norm of the kinetic energy
//
// v_hat: before projection; v0, v1: at the ends of the step. If nothing moves, loads would move it as gravity g does.
#pragma once

#include "core/step/step.hpp"

namespace mbsopt {

struct MechanismData;

class PenaltyWatch {
 public:
  explicit PenaltyWatch(const MechanismData& data) : data_(&data) {}

  void add(const Step& step);
  double projected_share() const { return moved_ > 0 ? projected_ / moved_ : 0; }

 private:
  const MechanismData* data_;
  double projected_ = 0, moved_ = 0;
};

}  // namespace mbsopt
