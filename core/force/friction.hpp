// Dry and viscous friction about or along a joint's axis, independent of the load.
//   f = coulomb rate/w + viscous rate,   w = sqrt(rate^2 + smooth^2)     resists the motion   [N m], [N]
// Coulomb's jump at rest is smoothed over the rate `smooth`: at |rate| = smooth the dry part is 1/sqrt(2) of its level,
// at 10 smooth 0.5 % below it. So the joint creeps where it would stick: at rate  smooth tau/sqrt(coulomb^2 - tau^2)
// under a torque tau < coulomb. Stiffness of the equations at rest: f_rate = coulomb/smooth + viscous.
#pragma once

#include <cmath>

#include "core/constraint/dot2.hpp"
#include "core/force/rsda.hpp"

namespace mbsopt {

struct FrictionLaw {
  static constexpr int kFields = 3;
  double coulomb = 0, smooth = 1, viscous = 0;  // [N m], [rad/s], [N m s/rad], or [N], [m/s], [N s/m]
  int slot = -1;                                // first of their three rows among the differentiated fields

  double value(double rate) const { return coulomb * rate / width(rate) + viscous * rate; }
  Law::Value derivatives(double rate) const {
    const double w = width(rate);
    return {value(rate), 0, coulomb * smooth * smooth / (w * w * w) + viscous};
  }
  // df/d(coulomb, smooth, viscous)
  Vec<3> field_gradient(double, double rate) const {
    const double w = width(rate);
    return {rate / w, -coulomb * rate * smooth / (w * w * w), rate};
  }
  // As a law of JointTorque: of the rate alone.
  double value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const { return value(rate); }
  Law::Value derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
    return derivatives(rate);
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

// Along the axis: x = the joint's displacement (dot2.hpp), rate = xdot          virtual work  -f x_eta
struct SlidingFriction {
  int force = 0;  // index in the scene
  int body1 = 0, body2 = 0;
  Dot2 displacement;
  int slot1 = -1, slot2 = -1, slot3 = -1;  // of its points and its axis
  FrictionLaw law;

  void add_load(const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const {
    const double f = law.value(rate(f1, f2));
    Mat<1, 6> J1, J2;
    displacement.jacobian(f1, f2, J1, J2);
    load1 -= f * J1.transpose();
    load2 -= f * J2.transpose();
  }

  // Gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar) const {
    const double xdot = rate(f1, f2), change = virtual_change(displacement, f1, f2)(0);
    const Law::Value f = law.derivatives(xdot);
    if (law.slot >= 0) theta_bar.segment<3>(law.slot) -= change * law.field_gradient(0, xdot);
    Multipliers<1> z = Multipliers<1>::zero();
    z.lambda(0) = -f.f, z.mu1(0) = -change * f.f_xdot;
    GeometryBar s;
    displacement.pull_back(f1, f2, z, bar1, bar2, s);
    if (slot1 >= 0) theta_bar.segment<3>(slot1) += s.s1;
    if (slot2 >= 0) theta_bar.segment<3>(slot2) += s.s2;
    if (slot3 >= 0) theta_bar.segment<3>(slot3) += s.s3;
  }

  // Tangent of the loads; ds: directions of the points and the axis, fields: of the law's (null: constant).
  void tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const GeometryTangent& ds, const Lanes<3>* fields, Lanes<6>& load1, Lanes<6>& load2) const {
    const double xdot = rate(f1, f2);
    const Law::Value f = law.derivatives(xdot);
    PrimitiveTangent<1> out;
    displacement.tangent(f1, f2, t1, t2, ds, Vec<1>(f.f), out);
    Lanes<1> df = f.f_xdot * out.phi_dot;
    if (fields) df += law.field_gradient(0, xdot).transpose() * *fields;
    Mat<1, 6> J1, J2;
    displacement.jacobian(f1, f2, J1, J2);
    load1 -= out.load1 + J1.transpose() * df;
    load2 -= out.load2 + J2.transpose() * df;
  }

 private:
  double rate(const Frame& f1, const Frame& f2) const {
    Vec<1> xdot;
    displacement.phi_dot(f1, f2, xdot);
    return xdot(0);
  }
};

}  // namespace mbsopt
