// A torque about a joint's axis or a force along it: a law f(x, xdot, t, rho) of the joint's angle or displacement x,
// positive when it resists a positive x.   [N m] or [N]
//   load       -J'f,  J = x_eta                                   virtual work  -f x_eta
//   tangent    -(J'f)' at f held fixed - J'f',                    f' = f_x x' + f_xdot xdot' + through the law
//   pull-back  of lambda'x_eta + mu0 x + mu1 xdot (primitive.hpp)
//              with lambda = -f, mu0 = -x_eta f_x, mu1 = -x_eta f_xdot
// The torsional spring-damper, rsda, has Angle and the law  k (angle - free_angle) + c rate  or an expression.
#pragma once

#include <array>

#include "core/force/force_inputs.hpp"
#include "core/sensor/joint_measure.hpp"

namespace mbsopt {

template <class P, class L>  // P: Angle or Dot2; L: Law, or what has the same members (friction.hpp)
struct JointEffort {
  int force = 0;  // index in the scene
  JointMeasure<P> joint;
  int angle = -1;  // of an Angle: the followed joint angle on whose branch x is
  L law;

  std::array<int, 2> bodies() const { return {joint.body1, joint.body2}; }
  Law::Point measured(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2) const {
    return {joint.value_near(branch(angles, angle), f1, f2), joint.rate(f1, f2)};
  }
  // Gradient of x_bar x + xdot_bar xdot.
  void pull_back_measured(const Frame& f1, const Frame& f2, double x_bar, double xdot_bar, FrameBar& bar1,
                          FrameBar& bar2, FieldGradient& fields) const;

  void add_load(const ForceInputs& in, const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const;

  // Adds the gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(const ForceInputs& in, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                 Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const;

  // Directions of the law (Law::field_tangent) and of the measure's vectors.
  struct FieldLanes {
    Lanes<1> f = Lanes<1>::Zero();
    GeometryTangent s = {};
  };
  Law::Value at(const ForceInputs& in, const Frame& f1, const Frame& f2) const;
  void tangent(const Law::Value& f, const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const FieldLanes& dir, Lanes<6>& load1, Lanes<6>& load2) const;
  void add_field_tangent(const ForceInputs& in, const ParameterBlock& block, const Frame& f1, const Frame& f2,
                         Lanes<6>& load1, Lanes<6>& load2) const;

  double potential(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2) const;
  void pull_back_potential(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2, FrameBar& bar1,
                           FrameBar& bar2, FieldGradient& fields) const;
  bool conserves_energy() const { return law.conserves_energy(); }
  double natural_energy(const Frame&, const Frame&) const { return law.stiffness(); }
};

extern template struct JointEffort<Angle, Law>;
using RsdaForce = JointEffort<Angle, Law>;

}  // namespace mbsopt
