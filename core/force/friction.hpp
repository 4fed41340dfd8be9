// Dry and viscous friction about a joint's axis, independent of the load.
//   f = coulomb rate/w + viscous rate,   w = sqrt(rate^2 + smooth^2)     resists the motion   [N m]
// Coulomb's jump at rest is smoothed over the rate `smooth`: at |rate| = smooth the dry part is 1/sqrt(2) of its level,
// at 10 smooth 0.5 % below it. So the joint creeps where it would stick: at rate  smooth tau/sqrt(coulomb^2 - tau^2)
// under a torque tau < coulomb. Stiffness of the equations at rest: f_rate = coulomb/smooth + viscous.
#pragma once

#include <cmath>

#include "core/force/rsda.hpp"

namespace mbsopt {

struct FrictionLaw {
  static constexpr int kFields = 3;
  double coulomb = 0, smooth = 1, viscous = 0;  // [N m], [rad/s], [N m s/rad]
  int slot = -1;                                // first of their three rows among the differentiated fields

  double value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
    return coulomb * rate / width(rate) + viscous * rate;
  }
  Law::Value derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
    const double w = width(rate);
    return {coulomb * rate / w + viscous * rate, 0, coulomb * smooth * smooth / (w * w * w) + viscous};
  }
  // df/d(coulomb, smooth, viscous)
  Vec<3> field_gradient(double, double rate) const {
    const double w = width(rate);
    return {rate / w, -coulomb * rate * smooth / (w * w * w), rate};
  }
  void add_field_gradient(double x, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd&) const {
    if (slot >= 0) theta_bar.segment<3>(slot) += f_bar * field_gradient(x, rate);
  }
  template <class RhoDirection>
  Lanes<1> field_tangent(double x, double rate, const Lanes<3>* fields, RhoDirection&&, const Law::Scratch&) const {
    return fields ? Lanes<1>(field_gradient(x, rate).transpose() * *fields) : Lanes<1>(Lanes<1>::Zero());
  }

 private:
  double width(double rate) const { return std::sqrt(rate * rate + smooth * smooth); }
};

using FrictionForce = JointTorque<FrictionLaw>;

}  // namespace mbsopt
