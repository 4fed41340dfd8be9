#include "core/force/rsda.hpp"

#include "core/body/lanes.hpp"
#include "core/force/friction.hpp"

namespace mbsopt {

template <class L>
void JointTorque<L>::directions(const JointAngle& joint, const JointAngle::Jet& j, const Frame& f1, const Frame& f2,
                                Vector3d& a1, Vector3d& a2) {
  const double theta_C = -j.S / j.D, theta_S = j.C / j.D;
  a1 = (theta_C * joint.x1 + theta_S * joint.y1).cross(f1.A.transpose() * j.n);
  a2 = joint.n2.cross(f2.A.transpose() * (theta_C * j.x + theta_S * j.y));
}

template <class L>
void JointTorque<L>::add_load(double t, const Eigen::VectorXd& rho, const JointAngle& joint, double reference,
                              const Frame& f1, const Frame& f2, Law::Scratch& scratch, Vec<6>& load1,
                              Vec<6>& load2) const {
  const JointAngle::Jet j = joint.jet(f1, f2);
  const double f = law.value(t, rho, JointAngle::on_branch(j.angle(), reference), j.rate(), scratch);
  Vector3d a1, a2;
  directions(joint, j, f1, f2, a1, a2);
  load1.tail<3>() -= f * a1;
  load2.tail<3>() -= f * a2;
}

template <class L>
void JointTorque<L>::pull_back(double t, const Eigen::VectorXd& rho, const JointAngle& joint, double reference,
                               const Frame& f1, const Frame& f2, Law::Scratch& scratch, FrameBar& bar1, FrameBar& bar2,
                               Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
  const JointAngle::Jet j = joint.jet(f1, f2);
  const double angle = JointAngle::on_branch(j.angle(), reference), rate = j.rate(), change = j.change();
  const Law::Value f = law.derivatives(t, rho, angle, rate, scratch);
  law.add_field_gradient(angle, rate, -change, scratch, theta_bar, rho_bar);
  JointAngle::SlotBars s;
  joint.pull_back(f1, f2, j, -change * f.f_x, -change * f.f_xdot, -f.f, bar1, bar2, s);
  if (joint.slot_x1 >= 0) theta_bar.segment<3>(joint.slot_x1) += s.x1;
  if (joint.slot_y1 >= 0) theta_bar.segment<3>(joint.slot_y1) += s.y1;
  if (joint.slot_n2 >= 0) theta_bar.segment<3>(joint.slot_n2) += s.n2;
}

template <class L>
void JointTorque<L>::tangent(const JointAngle& joint, const JointAngle::Jet& j, const Law::Value& f, Lanes<1> df,
                             const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                             const Lanes<3>* dx1, const Lanes<3>* dy1, const Lanes<3>* dn2, Lanes<6>& load1,
                             Lanes<6>& load2) const {
  Lanes<3> dx = times(t1.A, joint.x1), dy = times(t1.A, joint.y1), dn = times(t2.A, joint.n2);
  Lanes<3> dxd = times(t1.Adot, joint.x1), dyd = times(t1.Adot, joint.y1), dnd = times(t2.Adot, joint.n2);
  if (dx1) dx += f1.A * *dx1, dxd += f1.Adot * *dx1;
  if (dy1) dy += f1.A * *dy1, dyd += f1.Adot * *dy1;
  if (dn2) dn += f2.A * *dn2, dnd += f2.Adot * *dn2;
  const Lanes<1> dC = dot(j.n, dx) + dot(j.x, dn), dS = dot(j.n, dy) + dot(j.y, dn);
  const Lanes<1> dCd = dot(j.nd, dx) + dot(j.x, dnd) + dot(j.n, dxd) + dot(j.xd, dn);
  const Lanes<1> dSd = dot(j.nd, dy) + dot(j.y, dnd) + dot(j.n, dyd) + dot(j.yd, dn);
  const double theta_C = -j.S / j.D, theta_S = j.C / j.D;
  const double D2 = j.D * j.D, mixed = (j.S * j.S - j.C * j.C) / D2, twice = 2 * j.C * j.S / D2;
  const Lanes<1> dtheta_C = twice * dC + mixed * dS, dtheta_S = mixed * dC - twice * dS;
  df += f.f_x * (theta_C * dC + theta_S * dS) +
        f.f_xdot * (j.Cd * dtheta_C + j.Sd * dtheta_S + theta_C * dCd + theta_S * dSd);
  // a1 = w x A1'n with w = theta_C x1 + theta_S y1;  a2 = n2 x A2'g with g = theta_C x + theta_S y
  const Vector3d w = theta_C * joint.x1 + theta_S * joint.y1, g = theta_C * j.x + theta_S * j.y;
  const Vector3d m1 = f1.A.transpose() * j.n, m2 = f2.A.transpose() * g;
  Lanes<3> dw = joint.x1 * dtheta_C + joint.y1 * dtheta_S;
  if (dx1) dw += theta_C * *dx1;
  if (dy1) dw += theta_S * *dy1;
  const Lanes<3> dg = j.x * dtheta_C + j.y * dtheta_S + theta_C * dx + theta_S * dy;
  const Lanes<3> da1 = cross(w, transposed_times(t1.A, j.n) + f1.A.transpose() * dn) - cross(m1, dw);
  Lanes<3> da2 = cross(joint.n2, transposed_times(t2.A, g) + f2.A.transpose() * dg);
  if (dn2) da2 -= cross(m2, *dn2);
  load1.bottomRows<3>() -= w.cross(m1) * df + f.f * da1;
  load2.bottomRows<3>() -= joint.n2.cross(m2) * df + f.f * da2;
}

template struct JointTorque<Law>;
template struct JointTorque<FrictionLaw>;

}  // namespace mbsopt
