// The angle about an axis, the displacement along one, and their rates; joint_measure.hpp has the equations.
#include "core/constraint/dot2.hpp"
#include "core/mechanism/sensor_kinds.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

// The angle is on the turn nearest to reference.
template <class P>
double measure_value(const JointMeasure<P>& joint, bool rate, double reference, const BodyAt& b1, const BodyAt& b2) {
  return rate ? joint.rate(b1.frame, b2.frame) : joint.value_near(reference, b1.frame, b2.frame);
}
template <class P>
double measure_value(const JointMeasure<P>& joint, bool rate, double reference, const Eigen::VectorXd& y) {
  return measure_value(joint, rate, reference, body_at(y, joint.body1), body_at(y, joint.body2));
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
  return measure_value(joint, rate, reference, b1, b2);
}

struct AngleFunction final : SensorFunction {
  int index = 0;  // of the JointAngle
  bool is_rate = false;

  const JointAngle& joint(const MechanismData& d) const { return d.angles[static_cast<std::size_t>(index)]; }
  double value(const MechanismData& d, const StatePoint& at) const override {
    return measure_value(joint(d), is_rate, branch(at.angles, index), at.y);
  }
  double add_gradient(const MechanismData& d, const StatePoint& at, double scale, VecOut y_bar,
                      VecOut rho_bar) const override {
    return measure_gradient(d, joint(d), is_rate, branch(at.angles, index), at.y, scale, y_bar, rho_bar);
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

  double value(const MechanismData&, const StatePoint& at) const override {
    return measure_value(joint, is_rate, 0, at.y);
  }
  double add_gradient(const MechanismData& d, const StatePoint& at, double scale, VecOut y_bar,
                      VecOut rho_bar) const override {
    return measure_gradient(d, joint, is_rate, 0, at.y, scale, y_bar, rho_bar);
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
