// Dry and viscous friction about or along a joint's axis, independent of the load.
//   f = level rate/w + viscous rate,     w = sqrt(rate^2 + smooth^2)     resists the motion   [N m], [N]
//   level = coulomb + (breakaway - coulomb) exp(-(rate/stribeck)^2)      falls with the rate: Stribeck's curve
// Armstrong-Helouvry, Dupont and Canudas de Wit, "A survey of models, analysis tools and compensation methods for the
// control of machines with friction", Automatica 30 (1994) 1083, equation 5 with exponent 2. The rate `smooth` smooths
// Coulomb's jump at rest: at |rate| = smooth the dry part is 1/sqrt(2) of its level, at 10 smooth 0.5 % below it. So a
// joint that should stick turns slowly: at the rate  smooth tau/sqrt(coulomb^2 - tau^2) under a torque tau < coulomb =
// breakaway. Stiffness of the equations at rest: f_rate = breakaway/smooth + viscous.
#pragma once

#include "core/constraint/dot2.hpp"
#include "core/force/friction_law.hpp"
#include "core/force/joint_effort.hpp"

namespace mbsopt {

extern template struct JointEffort<Angle, FrictionLaw>;
extern template struct JointEffort<Dot2, FrictionLaw>;
using TurningFriction = JointEffort<Angle, FrictionLaw>;
using SlidingFriction = JointEffort<Dot2, FrictionLaw>;

}  // namespace mbsopt
