#include "core/force/friction.hpp"

#include <cmath>

namespace mbsopt {

double FrictionLaw::value(double rate) const { return coulomb * rate / width(rate) + viscous * rate; }

Law::Value FrictionLaw::derivatives(double rate) const {
  const double w = width(rate);
  return {value(rate), 0, coulomb * smooth * smooth / (w * w * w) + viscous};
}

Vec<3> FrictionLaw::field_gradient(double, double rate) const {
  const double w = width(rate);
  return {rate / w, -coulomb * rate * smooth / (w * w * w), rate};
}

double FrictionLaw::value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  return value(rate);
}

Law::Value FrictionLaw::derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  return derivatives(rate);
}

void FrictionLaw::add_field_gradient(double x, double rate, double f_bar, const Law::Scratch&,
                                     Eigen::VectorXd& theta_bar, Eigen::VectorXd&) const {
  if (slot >= 0) theta_bar.segment<3>(slot) += f_bar * field_gradient(x, rate);
}

double FrictionLaw::width(double rate) const { return std::sqrt(rate * rate + smooth * smooth); }

void SlidingFriction::add_load(const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const {
  const double f = law.value(rate(f1, f2));
  Mat<1, 6> J1, J2;
  displacement.jacobian(f1, f2, J1, J2);
  load1 -= f * J1.transpose();
  load2 -= f * J2.transpose();
}

void SlidingFriction::pull_back(const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                                Eigen::VectorXd& theta_bar) const {
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

void SlidingFriction::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                              const GeometryTangent& ds, const Lanes<3>* fields, Lanes<6>& load1,
                              Lanes<6>& load2) const {
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

double SlidingFriction::rate(const Frame& f1, const Frame& f2) const {
  Vec<1> xdot;
  displacement.phi_dot(f1, f2, xdot);
  return xdot(0);
}

}  // namespace mbsopt
