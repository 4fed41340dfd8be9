#include "core/mechanism/reaction_sensor.hpp"

#include <cassert>
#include <optional>

#include "core/mechanism/constraint_gradient.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct Loads {
  Vector3d F = Vector3d::Zero(), T = Vector3d::Zero();  // global; about the centre of mass, body axes
};

template <class P>
Vec<P::kRows> weights(const Constraint& c, const Eigen::VectorXd& lambda) {
  return c.factor * lambda.segment<P::kRows>(c.row);
}

// visitor(constraint, body 1, body 2) for those of the joint, whose bodies are placed once
template <class Visitor>
void for_each_constraint(const MechanismData& d, const ReactionSensor& s, const Eigen::VectorXd& y, const Frame& b2,
                         const Visitor& visitor) {
  std::optional<Frame> b1;
  for (const Constraint& c : d.constraints) {
    if (c.joint != s.joint) continue;
    if (!b1) b1 = body_at(y, c.body1);
    visitor(c, *b1, b2);
  }
}

Loads loads_on_body2(const MechanismData& d, const ReactionSensor& s, const Eigen::VectorXd& y, const Frame& on,
                     const Eigen::VectorXd& lambda) {
  Loads loads;
  for_each_constraint(d, s, y, on, [&](const Constraint& c, const Frame& b1, const Frame& b2) {
    std::visit(
        [&]<class P>(const P& p) {
          Mat<P::kRows, 6> J1, J2;
          p.jacobian(b1, b2, J1, J2);
          const Vec<6> f = J2.transpose() * weights<P>(c, lambda);
          loads.F -= f.template head<3>();
          loads.T -= f.template tail<3>();
        },
        c.primitive);
  });
  return loads;
}

Vector3d measured(const ReactionSensor& s, const Loads& loads, const Matrix3d& A2) {
  if (!s.torque) return loads.F;
  return A2 * loads.T - (A2 * s.s2).cross(loads.F);
}

// Adds the gradient of -(lambda' J2 eta), with eta of body 2 in its frame and none of body 1.
void add_pull_back_of_loads(const ReactionSensor& s, const Eigen::VectorXd& y, const Frame& on,
                            const Eigen::VectorXd& lambda, const Vec<6>& eta, SensorGradient& to,
                            Eigen::VectorXd& lambda_bar) {
  for_each_constraint(to.data, s, y, on, [&](const Constraint& c, const Frame& b1, const Frame& b2) {
    const ConstraintVector change =
        add_virtual_work_gradient(c, b1, b2, Vec<6>::Zero(), eta, -lambda.segment(c.row, c.rows()), to);
    lambda_bar.segment(c.row, c.rows()) -= to.scale * c.factor * change;
  });
}

}  // namespace

// A row without effect on the motion in a plane loads bodies across it only. Drives act in the plane.
bool ReactionSensor::is_in_plane(const MechanismData& d) const {
  if (!d.planar) return false;
  return drive_row >= 0 || (component != kNorm && torque == (component == d.planar->n));
}

double ReactionSensor::evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const {
  assert(at.motion);
  const MotionPart part = is_in_plane(d) ? MotionPart::in_plane : MotionPart::all;
  const Motion& motion = at.motion->motion(at, part);
  return evaluate(d, at.y, motion.lambda, to, to ? &at.motion->bar(part).lambda : nullptr);
}

double ReactionSensor::evaluate(const MechanismData& d, const Eigen::VectorXd& y, const Eigen::VectorXd& lambda,
                                SensorGradient* to, Eigen::VectorXd* lambda_bar) const {
  if (drive_row >= 0) {
    if (to) (*lambda_bar)(drive_row) -= to->scale;
    return -lambda(drive_row);
  }
  const Frame b2 = body_at(y, body2);
  const Matrix3d& A2 = b2.A;
  const Loads loads = loads_on_body2(d, *this, y, b2, lambda);
  const Vector3d x = measured(*this, loads, A2);
  const double result = component_value(x, component);
  if (!to) return result;
  const Vector3d c = component_gradient(x, component);

  // c'x = F'eta_r + T'eta_theta with eta_r = c, or for a torque eta_theta = A2'c and eta_r = (A2 s2) x c
  Vec<6> eta = Vec<6>::Zero();
  if (torque) {
    eta << (A2 * s2).cross(c), A2.transpose() * c;
  } else {
    eta.head<3>() = c;
  }
  add_pull_back_of_loads(*this, y, b2, lambda, eta, *to, *lambda_bar);
  if (!torque) return result;
  // The gradient through eta itself, with F and T fixed.
  const Vector3d arm_bar = c.cross(loads.F);
  FrameBar bar = FrameBar::zero();
  bar.A = c * loads.T.transpose() + arm_bar * s2.transpose();
  to->add_frame(b2, body2, bar);
  to->add_slot<3>(slot_s2, Vec<3>(A2.transpose() * arm_bar));
  return result;
}

std::unique_ptr<SensorFunction> make_reaction(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<ReactionSensor>();
  const std::size_t i = model.joint_index(s.joint, where + ".joint");
  const Joint& joint = model.scene.joints[i];
  if (ties_joints(joint)) {
    throw SceneError(where + ".joint: joint '" + s.joint + "' is " + joint.type + ", which has no bodies of its own");
  }
  out->joint = static_cast<int>(i);
  out->torque = s.kind == "torque";
  if (!out->torque && s.kind != "force") {
    throw SceneError(where + ".kind: is '" + s.kind + "'; allowed: force, torque");
  }
  out->component = component_of(s, where);
  const std::string path = child_path("joints", i);
  out->body2 = model.body_index(joint.body2, path + ".body2");
  out->s2 = numbers(model.keep(out->slot_s2, model.point(out->body2, joint.point2, path + ".point2")));
  return out;
}

std::unique_ptr<SensorFunction> make_drive_force(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<ReactionSensor>();
  for (const Constraint& c : model.data.constraints) {
    if (c.drive >= 0 && model.scene.drives[static_cast<std::size_t>(c.drive)].name == s.drive) out->drive_row = c.row;
  }
  if (out->drive_row < 0) throw SceneError(where + ".drive: there is no drive '" + s.drive + "'");
  return out;
}

}  // namespace mbsopt
