// A torque about a joint's axis: a law f(angle, rate, t), positive when it resists a positive angle.   [N m]
//   virtual work  -f angle_eta,   angle_eta = theta_C C_eta + theta_S S_eta   (joint_angle.hpp)
// With the law  k (angle - free_angle) + c rate  or an expression it is the torsional spring-damper, rsda.
#pragma once

#include "core/force/law.hpp"
#include "core/sensor/joint_angle.hpp"

namespace mbsopt {

template <class L>  // Law, or what has the same members (friction.hpp)
struct JointTorque {
  int force = 0;        // index in the scene
  int joint_angle = 0;  // index of its JointAngle
  L law;

  // Moments per unit torque on each body, in body axes: angle_eta = a1'eta_theta1 + a2'eta_theta2.
  static void directions(const JointAngle& joint, const JointAngle::Jet& j, const Frame& f1, const Frame& f2,
                         Vector3d& a1, Vector3d& a2);

  void add_load(double t, const Eigen::VectorXd& rho, const JointAngle& joint, double reference, const Frame& f1,
                const Frame& f2, Law::Scratch& scratch, Vec<6>& load1, Vec<6>& load2) const;

  void pull_back(double t, const Eigen::VectorXd& rho, const JointAngle& joint, double reference, const Frame& f1,
                 const Frame& f2, Law::Scratch& scratch, FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar,
                 Eigen::VectorXd& rho_bar) const;

  // Tangent of the loads; df as in TsdaForce::tangent; dx1, dy1, dn2: directions of the joint's vectors (null:
  // constant).
  void tangent(const JointAngle& joint, const JointAngle::Jet& j, const Law::Value& f, Lanes<1> df, const Frame& f1,
               const Frame& f2, const FrameTangent& t1, const FrameTangent& t2, const Lanes<3>* dx1,
               const Lanes<3>* dy1, const Lanes<3>* dn2, Lanes<6>& load1, Lanes<6>& load2) const;
};

extern template struct JointTorque<Law>;
using RsdaForce = JointTorque<Law>;

}  // namespace mbsopt
