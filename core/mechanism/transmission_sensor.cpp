// The transmission angle of a joint: the angle between the two links that meet in it.   [rad]
//   x_k = A_k s_k, the vector in link k from this joint to the link's only other pin
//   mu  = atan2(|x1 x x2|, x1'x2), from 0 to pi
//   dmu = -(u2 - cos(mu) u1)'dx1 / (|x1| sin(mu)) and the same with 1 and 2 exchanged,   u_k = x_k/|x_k|
// If the links are in line (mu = 0 or pi), it has no derivative, and its gradient is set to zero. Source: J. M.
// McCarthy, G. S. Soh, "Geometric Design of Linkages", section 2.3.
#include <cmath>

#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

constexpr std::string_view kPins = "revolute spherical universal cylindrical";

struct Link {
  int body = 0;
  Vector3d s = Vector3d::Zero();  // body axes [m]
  int slot = -1;
};

struct TransmissionFunction final : SensorFunction {
  Link link1, link2;

  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    const Frame b1 = body_at(at.y, link1.body), b2 = body_at(at.y, link2.body);
    const Vector3d x1 = b1.A * link1.s, x2 = b2.A * link2.s;
    const double across = x1.cross(x2).norm(), along = x1.dot(x2);
    // across = |x1| |x2| sin(mu): the formula never divides by a length of zero.
    if (to && across > 0) {
      add(link1, b1, (along / x1.squaredNorm() * x1 - x2) / across, *to);
      add(link2, b2, (along / x2.squaredNorm() * x2 - x1) / across, *to);
    }
    return std::atan2(across, along);
  }
  std::vector<int> bodies(const MechanismData&) const override { return {link1.body, link2.body}; }

 private:
  static void add(const Link& link, const Frame& body, const Vector3d& x_bar, SensorGradient& to) {
    FrameBar bar = FrameBar::zero();
    bar.A = x_bar * link.s.transpose();
    to.add_frame(body, link.body, bar);
    to.add_slot<3>(link.slot, Vec<3>(body.A.transpose() * x_bar));
  }
};

// The vector in the link `name` from its point in joint `here` to its only other pin.
Link link_from(Compilation& model, const std::string& name, const PointField& point, std::size_t here,
               const std::string& where) {
  Link link;
  link.body = model.body_index(name, where);
  std::vector<FieldVector3> ends;
  for (std::size_t i = 0; i < model.scene.joints.size(); ++i) {
    const Joint& joint = model.scene.joints[i];
    if (i == here || !has_word(kPins, joint.type)) continue;
    const std::string path = child_path("joints", i);
    if (joint.body1 == name) ends.push_back(model.point(link.body, joint.point1, path + ".point1"));
    if (joint.body2 == name) ends.push_back(model.point(link.body, joint.point2, path + ".point2"));
  }
  if (ends.size() != 1)
    throw SceneError(where + ": body '" + name + "' has " + std::to_string(ends.size()) +
                     " other pins (revolute, spherical, universal, cylindrical joints); a transmission angle needs "
                     "exactly one. Use an expression of joint angles instead");
  link.s = numbers(model.keep(link.slot, ends[0] - model.point(link.body, point, where)));
  return link;
}

}  // namespace

std::unique_ptr<SensorFunction> make_transmission_angle(Compilation& model, const Sensor& s, const std::string& where) {
  const std::string at_joint = where + ".joint";
  const std::size_t i = model.joint_index(s.joint, at_joint);
  const Joint& joint = model.scene.joints[i];
  if (!has_word(kPins, joint.type))
    throw SceneError(at_joint + ": joint '" + s.joint + "' is " + joint.type +
                     "; a transmission angle needs a revolute, spherical, universal or cylindrical joint");
  auto out = std::make_unique<TransmissionFunction>();
  out->link1 = link_from(model, joint.body1, joint.point1, i, at_joint);
  out->link2 = link_from(model, joint.body2, joint.point2, i, at_joint);
  return out;
}

}  // namespace mbsopt
