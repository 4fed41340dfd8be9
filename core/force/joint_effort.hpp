// A torque about a joint's axis or a force along it: a law f(x, xdot, t, rho) of the joint's angle or displacement x,
// positive when it resists a positive x.   [N m] or [N]
//   load       -J'f,  J = x_eta                                   virtual work  -f x_eta
//   tangent    -(J'f)' at f held fixed - J'f',                    f' = f_x x' + f_xdot xdot' + through the law
//   pull-back  of lambda'x_eta + mu0 x + mu1 xdot (primitive.hpp)
//              with lambda = -f, mu0 = -x_eta f_x, mu1 = -x_eta f_xdot
// With Angle and the law  k (angle - free_angle) + c rate  or an expression it is the torsional spring-damper, rsda.
#pragma once

#include "core/force/law.hpp"
#include "core/sensor/joint_measure.hpp"

namespace mbsopt {

template <class P, class L>  // P: Angle or Dot2; L: Law, or what has the same members (friction.hpp)
struct JointEffort {
  int force = 0;  // index in the scene
  JointMeasure<P> joint;
  int angle = -1;  // of an Angle: the followed joint angle on whose branch x is
  L law;

  // reference: the value of x on whose turn it is; without meaning for a displacement.
  void add_load(double t, const Eigen::VectorXd& rho, double reference, const Frame& f1, const Frame& f2,
                Law::Scratch& scratch, Vec<6>& load1, Vec<6>& load2) const;

  // Gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(double t, const Eigen::VectorXd& rho, double reference, const Frame& f1, const Frame& f2,
                 Law::Scratch& scratch, FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar,
                 Eigen::VectorXd& rho_bar) const;

  // Tangent of the loads; f and df as in TsdaForce::tangent; ds: directions of the measure's vectors.
  void tangent(const Law::Value& f, Lanes<1> df, const Frame& f1, const Frame& f2, const FrameTangent& t1,
               const FrameTangent& t2, const GeometryTangent& ds, Lanes<6>& load1, Lanes<6>& load2) const;
};

extern template struct JointEffort<Angle, Law>;
using RsdaForce = JointEffort<Angle, Law>;

}  // namespace mbsopt
