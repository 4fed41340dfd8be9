#include "core/force/joint_effort.hpp"

#include "core/constraint/dot2.hpp"
#include "core/force/friction.hpp"

namespace mbsopt {

// Adds the gradient of lambda x_eta + x_bar x + xdot_bar xdot in the frames and in the measure's fields.
template <class P>
static void add_pull_back(const JointMeasure<P>& joint, double lambda, double x_bar, double xdot_bar, const Frame& f1,
                          const Frame& f2, FrameBar& bar1, FrameBar& bar2, auto&& fields) {
  const Multipliers<1> z{Vec<1>(lambda), Vec<1>(x_bar), Vec<1>(xdot_bar), Vec<1>(0)};
  GeometryBar s;
  joint.measure.pull_back(f1, f2, z, bar1, bar2, s);
  fields.template add<3>(joint.slot1, s.s1);
  fields.template add<3>(joint.slot2, s.s2);
  fields.template add<3>(joint.slot3, s.s3);
}

template <class P, class L>
void JointEffort<P, L>::pull_back_measured(const Frame& f1, const Frame& f2, double x_bar, double xdot_bar,
                                           FrameBar& bar1, FrameBar& bar2, FieldGradient& fields) const {
  add_pull_back(joint, 0, x_bar, xdot_bar, f1, f2, bar1, bar2, fields);
}

template <class P, class L>
void JointEffort<P, L>::add_load(const ForceInputs& in, const Frame& f1, const Frame& f2, Vec<6>& load1,
                                 Vec<6>& load2) const {
  const auto [x, xdot] = measured(in.angles, f1, f2);
  const double f = law.value(in.t, in.rho, x, xdot, in.scratch);
  Mat<1, 6> J1, J2;
  joint.measure.jacobian(f1, f2, J1, J2);
  load1 -= f * J1.transpose();
  load2 -= f * J2.transpose();
}

template <class P, class L>
void JointEffort<P, L>::pull_back(const ForceInputs& in, const Frame& f1, const Frame& f2, FrameBar& bar1,
                                  FrameBar& bar2, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
  const auto [x, xdot] = measured(in.angles, f1, f2);
  const double change = virtual_change(joint.measure, f1, f2)(0);
  const Law::Value f = law.derivatives(in.t, in.rho, x, xdot, in.scratch);
  law.add_field_gradient(x, xdot, -change, in.scratch, theta_bar, rho_bar);
  add_pull_back(joint, -f.f, -change * f.f_x, -change * f.f_xdot, f1, f2, bar1, bar2, ThetaGradient{theta_bar});
}

template <class P, class L>
Law::Value JointEffort<P, L>::at(const ForceInputs& in, const Frame& f1, const Frame& f2) const {
  const auto [x, xdot] = measured(in.angles, f1, f2);
  return law.derivatives(in.t, in.rho, x, xdot, in.scratch);
}

template <class P, class L>
void JointEffort<P, L>::tangent(const Law::Value& f, const Frame& f1, const Frame& f2, const FrameTangent& t1,
                                const FrameTangent& t2, const FieldLanes& dir, Lanes<6>& load1, Lanes<6>& load2) const {
  PrimitiveTangent<1> x;
  joint.measure.tangent(f1, f2, t1, t2, dir.s, Vec<1>(f.f), x);
  const Lanes<1> df = dir.f + (f.f_x * x.phi + f.f_xdot * x.phi_dot);
  Mat<1, 6> J1, J2;
  joint.measure.jacobian(f1, f2, J1, J2);
  load1 -= x.load1 + J1.transpose() * df;
  load2 -= x.load2 + J2.transpose() * df;
}

template <class P, class L>
void JointEffort<P, L>::add_field_tangent(const ForceInputs& in, const ParameterBlock& block, const Frame& f1,
                                          const Frame& f2, Lanes<6>& load1, Lanes<6>& load2) const {
  Lanes<3> s1, s2, s3;
  const GeometryTangent s{block.field<3>(joint.slot1, s1), block.field<3>(joint.slot2, s2),
                          block.field<3>(joint.slot3, s3)};
  if (!law.moves(block) && !s.s1 && !s.s2 && !s.s3) return;
  const Law::Value f = at(in, f1, f2);
  Lanes<L::kFields> fields;
  const Lanes<1> df = law.field_tangent(
      measured(in.angles, f1, f2), block.field<L::kFields>(law.slot, fields), [&](int k) { return block.direction(k); },
      in.scratch);
  if (s.s1 || s.s2 || s.s3) return tangent(f, f1, f2, kStill, kStill, {df, s}, load1, load2);
  Mat<1, 6> J1, J2;  // the measure stays as it is
  joint.measure.jacobian(f1, f2, J1, J2);
  load1 -= J1.transpose() * df;
  load2 -= J2.transpose() * df;
}

template <class P, class L>
double JointEffort<P, L>::potential(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2) const {
  return law.potential(measured(angles, f1, f2).x);
}

template <class P, class L>
void JointEffort<P, L>::pull_back_potential(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2,
                                            FrameBar& bar1, FrameBar& bar2, FieldGradient& fields) const {
  const double x = measured(angles, f1, f2).x;
  pull_back_measured(f1, f2, law.potential_slope(x), 0, bar1, bar2, fields);
  fields.add<L::kFields>(law.slot, law.potential_gradient(x));
}

template struct JointEffort<Angle, Law>;
template struct JointEffort<Angle, FrictionLaw>;
template struct JointEffort<Dot2, FrictionLaw>;
template struct JointEffort<Dot2, Law>;

}  // namespace mbsopt
