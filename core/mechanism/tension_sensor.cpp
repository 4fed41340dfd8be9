#include "core/mechanism/tension_sensor.hpp"

#include "core/mechanism/measure_gradient.hpp"

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
  const BodyAt b1 = body_at(y, f.joint.body1), b2 = body_at(y, f.joint.body2);
  return f.law.value(t, d.rho, f.joint.value_near(branch(angles, f.angle), b1.frame, b2.frame),
                     f.joint.rate(b1.frame, b2.frame), scratch_for(d, f.law, none));
}

double add_tension_gradient(const MechanismData& d, const TensionSensor& s, double t, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& angles, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                            Eigen::Ref<Eigen::VectorXd> rho_bar) {
  Law::Scratch none;
  if (!s.is_torque) {
    FrameBar bar1, bar2;
    bar1.set_zero(), bar2.set_zero();
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
  const BodyAt b1 = body_at(y, f.joint.body1), b2 = body_at(y, f.joint.body2);
  const double angle = f.joint.value_near(branch(angles, f.angle), b1.frame, b2.frame),
               rate = f.joint.rate(b1.frame, b2.frame);
  Law::Scratch& scratch = scratch_for(d, f.law, none);
  const Law::Value law = f.law.derivatives(t, d.rho, angle, rate, scratch);
  add_law_gradient(d, f.law, angle, rate, scale, scratch, rho_bar);
  add_measure_gradient(d, f.joint, b1, b2, scale * law.f_x, scale * law.f_xdot, y_bar, rho_bar);
  return law.f;
}

}  // namespace mbsopt
