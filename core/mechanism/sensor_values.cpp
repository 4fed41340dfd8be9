// Sensors evaluated on a compiled mechanism: those of bodies and joints, and the whole model's energy and violation.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/body/euler_parameters.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/reaction_sensor.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/mechanism/tension_sensor.hpp"
#include "core/mechanism/violation.hpp"

namespace mbsopt {
namespace {

// reference: the value on whose turn an angle is.
template <class P>
double measure_value(const JointMeasure<P>& joint, bool rate, double reference, const Eigen::VectorXd& y) {
  const BodyAt b1 = body_at(y, joint.body1), b2 = body_at(y, joint.body2);
  return rate ? joint.rate(b1.frame, b2.frame) : joint.value_near(reference, b1.frame, b2.frame);
}

template <class P>
double measure_gradient(const MechanismData& d, const JointMeasure<P>& joint, bool rate, double reference,
                        const Eigen::VectorXd& y, double scale, VecOut y_bar, VecOut rho_bar) {
  const BodyAt b1 = body_at(y, joint.body1), b2 = body_at(y, joint.body2);
  Multipliers<1> z = Multipliers<1>::zero();
  (rate ? z.mu1 : z.mu0)(0) = scale;
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  GeometryBar s;
  joint.measure.pull_back(b1.frame, b2.frame, z, bar1, bar2, s);
  add_pull_back(b1, joint.body1, bar1, 1, y_bar);
  add_pull_back(b2, joint.body2, bar2, 1, y_bar);
  add_slot<3>(d, joint.slot1, s.s1, 1, rho_bar);
  add_slot<3>(d, joint.slot2, s.s2, 1, rho_bar);
  add_slot<3>(d, joint.slot3, s.s3, 1, rho_bar);
  return rate ? joint.rate(b1.frame, b2.frame) : joint.value_near(reference, b1.frame, b2.frame);
}

const JointAngle& followed(const MechanismData& d, int angle) { return d.angles[static_cast<std::size_t>(angle)]; }

Vec<6> inertia_entries(const Matrix3d& X) {  // gradient in xx yy zz xy xz yz of <X, J>
  Vec<6> x;
  x << X(0, 0), X(1, 1), X(2, 2), X(0, 1) + X(1, 0), X(0, 2) + X(2, 0), X(1, 2) + X(2, 1);
  return x;
}

void add_kinetic_gradient(const MechanismData& d, const Eigen::VectorXd& y, double scale, VecOut y_bar,
                          VecOut rho_bar) {
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
    const BodyAt b = body_at(y, i);
    const Vector3d w = b.state.omega(), w_bar = body.J * w;
    const Eigen::Index q = 7 * (i - 1), v = y.size() / 2 + q;
    y_bar.segment<3>(v) += scale * body.mass * b.frame.rdot;
    // w = 2 G(p) pdot = -2 G(pdot) p
    y_bar.segment<4>(v + 3) += 2 * scale * G_transposed_times(b.state.p, w_bar);
    y_bar.segment<4>(q + 3) -= 2 * scale * G_transposed_times(b.state.pdot, w_bar);
    add_slot<1>(d, body.slot_mass, Vec<1>(0.5 * b.frame.rdot.squaredNorm()), scale, rho_bar);
    add_slot<6>(d, body.slot_J, inertia_entries(0.5 * w * w.transpose()), scale, rho_bar);
  }
}

void add_potential_gradient(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                            double scale, VecOut y_bar, VecOut rho_bar) {
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
    const Vector3d r = y.segment<3>(7 * (i - 1));
    y_bar.segment<3>(7 * (i - 1)) -= scale * body.mass * d.gravity;
    add_slot<1>(d, body.slot_mass, Vec<1>(-d.gravity.dot(r)), scale, rho_bar);
    add_slot<3>(d, d.slot_gravity, Vec<3>(-body.mass * r), scale, rho_bar);
  }
  FieldGradient fields{d.theta_rho, d.active, scale, rho_bar};
  d.forces.for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    const BodyAt b1 = body_at(y, i), b2 = body_at(y, j);
    FrameBar bar1, bar2;
    bar1.set_zero(), bar2.set_zero();
    f.pull_back_potential(angles, b1.frame, b2.frame, bar1, bar2, fields);
    add_pull_back(b1, i, bar1, scale, y_bar);
    add_pull_back(b2, j, bar2, scale, y_bar);
  });
}

// Sensors that need accelerations are evaluated by the functions below, with a motion.
double without_motion() {
  assert(false && "this sensor needs accelerations");
  return std::numeric_limits<double>::quiet_NaN();
}

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;  // clang 14 deduces no arguments of an aggregate

}  // namespace

Energy energy(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  Energy e;
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[static_cast<std::size_t>(i)];
    const BodyAt b = body_at(y, i);
    const Vector3d w = b.state.omega();
    e.kinetic += 0.5 * (body.mass * b.frame.rdot.squaredNorm() + w.dot(body.J * w));
    e.potential -= body.mass * d.gravity.dot(b.frame.r);
  }
  d.forces.for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    e.potential += f.potential(angles, body_at(y, i).frame, body_at(y, j).frame);
  });
  return e;
}

bool conserves_energy(const MechanismData& d) {
  return d.applied.empty() && d.user_forces.empty() &&
         d.forces.all_of([](const auto& f) { return f.conserves_energy(); }) &&
         std::all_of(d.laws.begin(), d.laws.end(), [](auto& l) { return !l.law.programs && !l.law.spline; });
}

double evaluate(const MechanismData& d, const SensorKind& sensor, double t, const Eigen::VectorXd& y,
                const Eigen::VectorXd& angles) {
  return std::visit(
      Overloaded{
          [&](const PointSensor& s) { return s.value(y); }, [&](const AngularVelocitySensor& s) { return s.value(y); },
          [&](const CoordinateSensor& s) { return y(s.index); },
          [&](const AngleSensor& s) { return measure_value(followed(d, s.angle), s.rate, branch(angles, s.angle), y); },
          [&](const EnergySensor& s) {
            const Energy e = energy(d, y, angles);
            return (s.kinetic ? e.kinetic : 0) + (s.potential ? e.potential : 0);
          },
          [&](const ViolationSensor&) { return std::abs(worst_violation(d, t, y, angles).amount); },
          [&](const TensionSensor& s) { return tension(d, s, t, y, angles); },
          [&](const DisplacementSensor& s) { return measure_value(s.joint, s.rate, 0, y); },
          [&](const AccelerationSensor&) { return without_motion(); },
          [&](const ReactionSensor&) { return without_motion(); }},
      sensor);
}

double add_gradient(const MechanismData& d, const SensorKind& sensor, double t, const Eigen::VectorXd& y,
                    const Eigen::VectorXd& angles, double scale, VecOut y_bar, VecOut rho_bar) {
  return std::visit(
      Overloaded{
          [&](const PointSensor& s) {
            Vector3d a_bar = Vector3d::Zero(), b_bar = Vector3d::Zero();
            const double value = s.add_gradient(y, scale, y_bar, a_bar, b_bar);
            add_slot<3>(d, s.a.slot, a_bar, 1, rho_bar);
            if (s.relative) add_slot<3>(d, s.b.slot, b_bar, 1, rho_bar);
            return value;
          },
          [&](const AngularVelocitySensor& s) { return s.add_gradient(y, scale, y_bar); },
          [&](const CoordinateSensor& s) {
            y_bar(s.index) += scale;
            return y(s.index);
          },
          [&](const AngleSensor& s) {
            return measure_gradient(d, followed(d, s.angle), s.rate, branch(angles, s.angle), y, scale, y_bar, rho_bar);
          },
          [&](const EnergySensor& s) {
            if (s.kinetic) add_kinetic_gradient(d, y, scale, y_bar, rho_bar);
            if (s.potential) add_potential_gradient(d, y, angles, scale, y_bar, rho_bar);
            return evaluate(d, s, t, y, angles);
          },
          [&](const ViolationSensor&) { return add_violation_gradient(d, t, y, angles, scale, y_bar, rho_bar); },
          [&](const TensionSensor& s) { return add_tension_gradient(d, s, t, y, angles, scale, y_bar, rho_bar); },
          [&](const DisplacementSensor& s) {
            return measure_gradient(d, s.joint, s.rate, 0, y, scale, y_bar, rho_bar);
          },
          [&](const AccelerationSensor&) { return without_motion(); },
          [&](const ReactionSensor&) { return without_motion(); }},
      sensor);
}

double evaluate(const MechanismData& d, const SensorKind& sensor, const StatePoint& at) {
  if (const auto* s = std::get_if<AccelerationSensor>(&sensor)) return s->value(at.y, at.motion->motion(at).z);
  if (const auto* s = std::get_if<ReactionSensor>(&sensor)) {
    return evaluate(d, *s, at.y, at.motion->motion(at).lambda);
  }
  return evaluate(d, sensor, at.t, at.y, at.angles);
}

double add_gradient(const MechanismData& d, const SensorKind& sensor, const StatePoint& at, double scale, VecOut y_bar,
                    VecOut rho_bar) {
  double value = 0;
  if (const auto* s = std::get_if<AccelerationSensor>(&sensor)) {
    Vector3d a_bar = Vector3d::Zero(), b_bar = Vector3d::Zero();
    value = s->add_gradient(at.y, at.motion->motion(at).z, scale, y_bar, at.motion->bar().z, a_bar, b_bar);
    add_slot<3>(d, s->a.slot, a_bar, 1, rho_bar);
    if (s->relative) add_slot<3>(d, s->b.slot, b_bar, 1, rho_bar);
  } else if (const auto* r = std::get_if<ReactionSensor>(&sensor)) {
    const Motion& motion = at.motion->motion(at);
    value = add_gradient(d, *r, at.y, motion.lambda, scale, y_bar, at.motion->bar().lambda, rho_bar);
  } else {
    return add_gradient(d, sensor, at.t, at.y, at.angles, scale, y_bar, rho_bar);
  }
  at.motion->fold_bar(at, y_bar, rho_bar);
  return value;
}

}  // namespace mbsopt
