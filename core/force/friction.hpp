// Dry and viscous friction about or along a joint's axis, independent of the load.
//   f = coulomb rate/w + viscous rate,   w = sqrt(rate^2 + smooth^2)     resists the motion   [N m], [N]
// Coulomb's jump at rest is smoothed over the rate `smooth`: at |rate| = smooth the dry part is 1/sqrt(2) of its level,
// at 10 smooth 0.5 % below it. So the joint creeps where it would stick: at rate  smooth tau/sqrt(coulomb^2 - tau^2)
// under a torque tau < coulomb. Stiffness of the equations at rest: f_rate = coulomb/smooth + viscous.
#pragma once

#include "core/constraint/dot2.hpp"
#include "core/force/rsda.hpp"

namespace mbsopt {

struct FrictionLaw {
  static constexpr int kFields = 3;
  double coulomb = 0, smooth = 1, viscous = 0;  // [N m], [rad/s], [N m s/rad], or [N], [m/s], [N s/m]
  int slot = -1;                                // first of their three rows among the differentiated fields

  double value(double rate) const;
  Law::Value derivatives(double rate) const;
  // df/d(coulomb, smooth, viscous)
  Vec<3> field_gradient(double, double rate) const;
  // As a law of JointTorque: of the rate alone.
  double value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const;
  Law::Value derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const;
  void add_field_gradient(double x, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd&) const;
  template <class RhoDirection>
  Lanes<1> field_tangent(double x, double rate, const Lanes<3>* fields, RhoDirection&&, const Law::Scratch&) const {
    return fields ? Lanes<1>(field_gradient(x, rate).transpose() * *fields) : Lanes<1>(Lanes<1>::Zero());
  }

 private:
  double width(double rate) const;
};

extern template struct JointTorque<FrictionLaw>;
using FrictionForce = JointTorque<FrictionLaw>;

// Along the axis: x = the joint's displacement (dot2.hpp), rate = xdot          virtual work  -f x_eta
struct SlidingFriction {
  int force = 0;  // index in the scene
  int body1 = 0, body2 = 0;
  Dot2 displacement;
  int slot1 = -1, slot2 = -1, slot3 = -1;  // of its points and its axis
  FrictionLaw law;

  void add_load(const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const;

  // Gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar) const;

  // Tangent of the loads; ds: directions of the points and the axis, fields: of the law's (null: constant).
  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& ds, const Lanes<3>* fields, Lanes<6>& load1, Lanes<6>& load2) const;

 private:
  double rate(const Frame& f1, const Frame& f2) const;
};

}  // namespace mbsopt
