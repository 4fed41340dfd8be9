#include "core/mechanism/tension_sensor.hpp"

namespace mbsopt {
namespace {

// Numbers of one evaluation of a law that is an expression, one set per thread: they carry nothing from one call to the
// next, and grow at the first only.
Law::Scratch& scratch_of_this_thread(const MechanismData& data, const Program& program) {
  static thread_local Law::Scratch scratch;
  const std::size_t inputs = static_cast<std::size_t>(data.rho.size()) + 3;
  if (scratch.inputs.size() != inputs) scratch.inputs.resize(inputs), scratch.gradient.resize(inputs);
  program.grow(scratch.program);
  return scratch;
}

// A law made of coefficients needs none.
Law::Scratch& scratch_for(const MechanismData& data, const Law& law, Law::Scratch& none) {
  return law.program ? scratch_of_this_thread(data, *law.program) : none;
}

// Through the law's own coefficients, or through the parameters of its expression.
void add_law_gradient(const MechanismData& data, const Law& law, double x, double xdot, double scale,
                      const Law::Scratch& scratch, Eigen::Ref<Eigen::VectorXd> rho_bar) {
  if (!law.program) return add_slot<4>(data, law.slot, law.field_gradient(x, xdot), scale, rho_bar);
  for (const int k : data.active) rho_bar(k) += scale * scratch.gradient[static_cast<std::size_t>(k)];
}

double branch(const Eigen::VectorXd& angles, int i) { return i < angles.size() ? angles(i) : 0.0; }

}  // namespace

double tension(const MechanismData& d, const TensionSensor& s, double t, const Eigen::VectorXd& y,
               const Eigen::VectorXd& angles) {
  Law::Scratch none;
  if (!s.is_torque) {
    const TsdaForce& f = d.tsda[static_cast<std::size_t>(s.index)];
    const TsdaForce::Span x = f.span(body_at(y, f.body1).frame, body_at(y, f.body2).frame);
    return f.law.value(t, d.rho, x.l, x.ldot, scratch_for(d, f.law, none));
  }
  const RsdaForce& f = d.rsda[static_cast<std::size_t>(s.index)];
  const JointAngle& joint = d.angles[static_cast<std::size_t>(f.joint_angle)];
  const JointAngle::Jet j = joint.jet(body_at(y, joint.body1).frame, body_at(y, joint.body2).frame);
  const double angle = JointAngle::on_branch(j.angle(), branch(angles, f.joint_angle));
  return f.law.value(t, d.rho, angle, j.rate(), scratch_for(d, f.law, none));
}

double add_tension_gradient(const MechanismData& d, const TensionSensor& s, double t, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& angles, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                            Eigen::Ref<Eigen::VectorXd> rho_bar) {
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  Law::Scratch none;
  if (!s.is_torque) {
    const TsdaForce& f = d.tsda[static_cast<std::size_t>(s.index)];
    const BodyAt b1 = body_at(y, f.body1), b2 = body_at(y, f.body2);
    const TsdaForce::Span x = f.span(b1.frame, b2.frame);
    Law::Scratch& scratch = scratch_for(d, f.law, none);
    const Law::Value law = f.law.derivatives(t, d.rho, x.l, x.ldot, scratch);
    add_law_gradient(d, f.law, x.l, x.ldot, scale, scratch, rho_bar);
    // l_d = u,  (ldot)_d = (ddot - ldot u)/l,  (ldot)_ddot = u; a spring of zero length has no direction
    const Vector3d ddot_bar = law.f_xdot * x.u;
    Vector3d d_bar = law.f_x * x.u;
    if (x.l > 0) d_bar += law.f_xdot * (x.ddot - x.ldot * x.u) / x.l;
    bar2.r = d_bar, bar2.rdot = ddot_bar;
    bar2.A = d_bar * f.s2.transpose(), bar2.Adot = ddot_bar * f.s2.transpose();
    bar1.r = -d_bar, bar1.rdot = -ddot_bar;
    bar1.A = -d_bar * f.s1.transpose(), bar1.Adot = -ddot_bar * f.s1.transpose();
    add_pull_back(b1, f.body1, bar1, scale, y_bar);
    add_pull_back(b2, f.body2, bar2, scale, y_bar);
    auto through = [&](const Frame& frame) {
      return Vector3d(frame.A.transpose() * d_bar + frame.Adot.transpose() * ddot_bar);
    };
    add_slot<3>(d, f.slot1, through(b1.frame), -scale, rho_bar);
    add_slot<3>(d, f.slot2, through(b2.frame), scale, rho_bar);
    return law.f;
  }
  const RsdaForce& f = d.rsda[static_cast<std::size_t>(s.index)];
  const JointAngle& joint = d.angles[static_cast<std::size_t>(f.joint_angle)];
  const BodyAt b1 = body_at(y, joint.body1), b2 = body_at(y, joint.body2);
  const JointAngle::Jet j = joint.jet(b1.frame, b2.frame);
  const double angle = JointAngle::on_branch(j.angle(), branch(angles, f.joint_angle));
  Law::Scratch& scratch = scratch_for(d, f.law, none);
  const Law::Value law = f.law.derivatives(t, d.rho, angle, j.rate(), scratch);
  add_law_gradient(d, f.law, angle, j.rate(), scale, scratch, rho_bar);
  JointAngle::SlotBars slots;
  joint.pull_back(b1.frame, b2.frame, j, law.f_x, law.f_xdot, 0, bar1, bar2, slots);
  add_pull_back(b1, joint.body1, bar1, scale, y_bar);
  add_pull_back(b2, joint.body2, bar2, scale, y_bar);
  add_slot<3>(d, joint.slot_x1, slots.x1, scale, rho_bar);
  add_slot<3>(d, joint.slot_y1, slots.y1, scale, rho_bar);
  add_slot<3>(d, joint.slot_n2, slots.n2, scale, rho_bar);
  return law.f;
}

}  // namespace mbsopt
