// The angle about an axis, the displacement along one, an Euler parameter of a body, and their rates; joint_measure.hpp
// has the equations.
#include "core/mechanism/constraint_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

template <class P>
struct JointSensor final : SensorFunction {
  JointMeasure<P> joint;
  int index = -1;  // of a followed angle, on whose turn it is
  bool is_rate = false;

  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    const Frame b1 = body_at(at.y, joint.body1), b2 = body_at(at.y, joint.body2);
    if (to) {
      Multipliers<1> z = Multipliers<1>::zero();
      (is_rate ? z.mu1 : z.mu0)(0) = 1;
      add_primitive_gradient(joint.measure, joint, b1, b2, z, *to);
    }
    if (is_rate) return joint.rate(b1, b2);
    return joint.value_near(branch(at.angles, index), b1, b2);
  }
  std::vector<int> bodies(const MechanismData&) const override { return {joint.body1, joint.body2}; }
  SensorPtr rate(const MechanismData&) const override {
    return changed(*this, [](JointSensor& r) { r.is_rate = true; });
  }
  int angle() const override { return index; }
};

std::unique_ptr<SensorFunction> angle_sensor(const Compilation& model, int index, bool is_rate = false) {
  auto out = std::make_unique<JointSensor<Angle>>();
  out->joint = model.data.angles[at(index)];
  out->index = index;
  out->is_rate = is_rate;
  return out;
}

}  // namespace

std::unique_ptr<SensorFunction> make_joint_angle(Compilation& model, const Sensor& s, const std::string& where) {
  return angle_sensor(model, model.angle_of(s.joint, where + ".joint"), s.quantity == "rate");
}

std::unique_ptr<SensorFunction> make_body_angle(Compilation& model, const Sensor& s, const std::string& where) {
  const int body1 = s.body1.empty() ? 0 : model.body_index(s.body1, where + ".body1");
  const int body2 = model.body_index(s.body2.empty() ? s.body : s.body2, where);
  return angle_sensor(model, model.angle_about(body1, body2, s.axis, where));
}

std::unique_ptr<SensorFunction> make_displacement(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<JointSensor<Dot2>>();
  out->joint = model.joint_displacement(s.joint, where + ".joint");
  return out;
}

std::unique_ptr<SensorFunction> make_orientation(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<JointSensor<Coordinate>>();
  out->joint.body2 = model.body_index(s.body, where);
  if (out->joint.body2 == 0 || s.component.size() != 2 || s.component[0] != 'e' || s.component[1] < '0' ||
      s.component[1] > '3')
    throw SceneError(where + ": orientation needs a moving body and a component e0, e1, e2 or e3");
  out->joint.measure.index = 3 + s.component[1] - '0';
  return out;
}

}  // namespace mbsopt
