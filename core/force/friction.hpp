// Dry and viscous friction about or along a joint's axis, independent of the load.
//   f = coulomb rate/w + viscous rate,   w = sqrt(rate^2 + smooth^2)     resists the motion   [N m], [N]
// Coulomb's jump at rest is smoothed over the rate `smooth`: at |rate| = smooth the dry part is 1/sqrt(2) of its level,
// at 10 smooth 0.5 % below it. So the joint creeps where it would stick: at rate  smooth tau/sqrt(coulomb^2 - tau^2)
// under a torque tau < coulomb. Stiffness of the equations at rest: f_rate = coulomb/smooth + viscous.
#pragma once

#include "core/force/friction_law.hpp"
#include "core/force/joint_effort.hpp"

namespace mbsopt {

extern template struct JointEffort<Angle, FrictionLaw>;
extern template struct JointEffort<Dot2, FrictionLaw>;
using TurningFriction = JointEffort<Angle, FrictionLaw>;
using SlidingFriction = JointEffort<Dot2, FrictionLaw>;

}  // namespace mbsopt
