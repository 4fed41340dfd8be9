#include "core/force/joint_effort.hpp"

#include "core/force/friction_law.hpp"

namespace mbsopt {

template <class P, class L>
void JointEffort<P, L>::add_load(double t, const Eigen::VectorXd& rho, double reference, const Frame& f1,
                                 const Frame& f2, Law::Scratch& scratch, Vec<6>& load1, Vec<6>& load2) const {
  const double f = law.value(t, rho, joint.value_near(reference, f1, f2), joint.rate(f1, f2), scratch);
  Mat<1, 6> J1, J2;
  joint.measure.jacobian(f1, f2, J1, J2);
  load1 -= f * J1.transpose();
  load2 -= f * J2.transpose();
}

template <class P, class L>
void JointEffort<P, L>::pull_back(double t, const Eigen::VectorXd& rho, double reference, const Frame& f1,
                                  const Frame& f2, Law::Scratch& scratch, FrameBar& bar1, FrameBar& bar2,
                                  Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
  const double x = joint.value_near(reference, f1, f2), xdot = joint.rate(f1, f2);
  const double change = virtual_change(joint.measure, f1, f2)(0);
  const Law::Value f = law.derivatives(t, rho, x, xdot, scratch);
  law.add_field_gradient(x, xdot, -change, scratch, theta_bar, rho_bar);
  Multipliers<1> z = Multipliers<1>::zero();
  z.lambda(0) = -f.f, z.mu0(0) = -change * f.f_x, z.mu1(0) = -change * f.f_xdot;
  GeometryBar s;
  joint.measure.pull_back(f1, f2, z, bar1, bar2, s);
  if (joint.slot1 >= 0) theta_bar.segment<3>(joint.slot1) += s.s1;
  if (joint.slot2 >= 0) theta_bar.segment<3>(joint.slot2) += s.s2;
  if (joint.slot3 >= 0) theta_bar.segment<3>(joint.slot3) += s.s3;
}

template <class P, class L>
void JointEffort<P, L>::tangent(const Law::Value& f, Lanes<1> df, const Frame& f1, const Frame& f2,
                                const FrameTangent& t1, const FrameTangent& t2, const GeometryTangent& ds,
                                Lanes<6>& load1, Lanes<6>& load2) const {
  PrimitiveTangent<1> x;
  joint.measure.tangent(f1, f2, t1, t2, ds, Vec<1>(f.f), x);
  df += f.f_x * x.phi + f.f_xdot * x.phi_dot;
  Mat<1, 6> J1, J2;
  joint.measure.jacobian(f1, f2, J1, J2);
  load1 -= x.load1 + J1.transpose() * df;
  load2 -= x.load2 + J2.transpose() * df;
}

template struct JointEffort<Angle, Law>;
template struct JointEffort<Angle, FrictionLaw>;
template struct JointEffort<Dot2, FrictionLaw>;

}  // namespace mbsopt
