// Dry and viscous friction about or along a joint's axis, independent of the load.
//   f = coulomb rate/w + viscous rate,   w = sqrt(rate^2 + smooth^2)     resists the motion   [N m], [N]
// Coulomb's jump at rest is smoothed over the rate `smooth`: at |rate| = smooth the dry part is 1/sqrt(2) of its level,
// at 10 smooth 0.5 % below it. So the joint creeps where it would stick: at rate  smooth tau/sqrt(coulomb^2 - tau^2)
// under a torque tau < coulomb. Stiffness of the equations at rest: f_rate = coulomb/smooth + viscous.
#pragma once

#include "core/force/joint_effort.hpp"

namespace mbsopt {

// A law of JointEffort, of the rate alone.
struct FrictionLaw {
  static constexpr int kFields = 3;
  double coulomb = 0, smooth = 1, viscous = 0;  // [N m], [rad/s], [N m s/rad], or [N], [m/s], [N s/m]
  int slot = -1;                                // first of their three rows among the differentiated fields

  double value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const;
  Law::Value derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const;
  void add_field_gradient(double, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd&) const;
  template <class RhoDirection>
  Lanes<1> field_tangent(double, double rate, const Lanes<3>* fields, RhoDirection&&, const Law::Scratch&) const {
    return fields ? Lanes<1>(field_gradient(rate).transpose() * *fields) : Lanes<1>(Lanes<1>::Zero());
  }

 private:
  double width(double rate) const;
  Vec<3> field_gradient(double rate) const;  // df/d(coulomb, smooth, viscous)
};

extern template struct JointEffort<Angle, FrictionLaw>;
extern template struct JointEffort<Dot2, FrictionLaw>;
using TurningFriction = JointEffort<Angle, FrictionLaw>;
using SlidingFriction = JointEffort<Dot2, FrictionLaw>;

}  // namespace mbsopt
