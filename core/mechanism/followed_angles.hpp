// The branches of followed joint angles, continued from one state to the next: less than half a turn lies between them.
#pragma once

#include "core/mechanism/mechanism_data.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {

inline void continue_angles(const MechanismData& d, const Eigen::VectorXd& y, Eigen::VectorXd& angles) {
  double* angle = angles.data();
  for (const JointAngle& a : d.angles) {
    *angle = a.value_near(*angle, body_at(y, a.body1), body_at(y, a.body2));
    ++angle;
  }
}

}  // namespace mbsopt
