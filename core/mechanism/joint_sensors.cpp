// The angle about an axis, the displacement along one, and their rates; joint_measure.hpp has the equations.
#include "core/constraint/dot2.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

// The angle is on the turn nearest to reference.
template <class P>
double measured(const JointMeasure<P>& joint, bool rate, double reference, const Eigen::VectorXd& y,
                SensorGradient* to) {
  const BodyAt b1 = body_at(y, joint.body1), b2 = body_at(y, joint.body2);
  const double value = rate ? joint.rate(b1.frame, b2.frame) : joint.value_near(reference, b1.frame, b2.frame);
  if (!to) return value;
  Multipliers<1> z = Multipliers<1>::zero();
  (rate ? z.mu1 : z.mu0)(0) = 1;
  FrameBar bar1, bar2;
  bar1.set_zero();
  bar2.set_zero();
  GeometryBar s;
  joint.measure.pull_back(b1.frame, b2.frame, z, bar1, bar2, s);
  to->add_frame(b1, joint.body1, bar1);
  to->add_frame(b2, joint.body2, bar2);
  to->add_slot<3>(joint.slot1, s.s1), to->add_slot<3>(joint.slot2, s.s2), to->add_slot<3>(joint.slot3, s.s3);
  return value;
}

struct AngleFunction final : SensorFunction {
  int index = 0;  // of the JointAngle
  bool is_rate = false;

  const JointAngle& joint(const MechanismData& d) const { return d.angles[static_cast<std::size_t>(index)]; }
  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    return measured(joint(d), is_rate, branch(at.angles, index), at.y, to);
  }
  std::vector<int> bodies(const MechanismData& d) const override { return {joint(d).body1, joint(d).body2}; }
  SensorPtr rate(const MechanismData&) const override {
    return changed(*this, [](AngleFunction& r) { r.is_rate = true; });
  }
  int angle() const override { return index; }
};

struct DisplacementFunction final : SensorFunction {
  JointDisplacement joint;
  bool is_rate = false;

  double evaluate(const MechanismData&, const StatePoint& at, SensorGradient* to) const override {
    return measured(joint, is_rate, 0, at.y, to);
  }
  std::vector<int> bodies(const MechanismData&) const override { return {joint.body1, joint.body2}; }
  SensorPtr rate(const MechanismData&) const override {
    return changed(*this, [](DisplacementFunction& r) { r.is_rate = true; });
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_joint_angle(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<AngleFunction>();
  out->index = model.angle_of(s.joint, where + ".joint");
  out->is_rate = s.quantity == "rate";
  return out;
}

std::unique_ptr<SensorFunction> make_body_angle(Compilation& model, const Sensor& s, const std::string& where) {
  const int body1 = s.body1.empty() ? 0 : model.body_index(s.body1, where + ".body1");
  const int body2 = model.body_index(s.body2.empty() ? s.body : s.body2, where);
  auto out = std::make_unique<AngleFunction>();
  out->index = model.angle_about(body1, body2, s.axis, where);
  return out;
}

std::unique_ptr<SensorFunction> make_displacement(Compilation& model, const Sensor& s, const std::string& where) {
  auto out = std::make_unique<DisplacementFunction>();
  out->joint = model.joint_displacement(s.joint, where + ".joint");
  return out;
}

}  // namespace mbsopt
