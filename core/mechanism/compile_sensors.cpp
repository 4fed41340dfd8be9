// Sensors, and the conditions on them that the initial state meets.
#include <algorithm>

#include "core/mechanism/compilation.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {
namespace {

PointSensor::Point sensor_point(Compilation& model, const std::string& body, const PointField& field,
                                const std::string& where) {
  PointSensor::Point result;
  result.body = model.body_index(body, where);
  result.s = numbers(model.keep(result.slot, model.point(result.body, field, where)));
  return result;
}

int component(const std::string& name, const std::string& where) {
  constexpr std::array<const char*, 4> names{"x", "y", "z", "norm"};
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw SceneError(where + ".component: is '" + name + "'; allowed: x, y, z, norm");
  return static_cast<int>(found - names.begin());
}

// The fields that sensors of points share (PointSensor, AccelerationSensor): a point, perhaps relative to another, a
// component in some axes.
template <class Kind>
Kind with_points(Compilation& model, const Sensor& s, Kind out, const std::string& where) {
  out.a = sensor_point(model, s.body, s.point, where);
  if (s.relative_to) {
    out.relative = true;
    out.b = sensor_point(model, s.relative_to->body, s.relative_to->point, where + ".relative_to");
  }
  out.component = component(s.component, where);
  if (s.in_body_frame && out.a.body > 0) out.axes_body = out.a.body;
  return out;
}

SensorKind tension_sensor(const MechanismData& data, const std::string& name, const std::vector<Force>& forces,
                          const std::string& where) {
  const auto found = std::find_if(forces.begin(), forces.end(), [&](const Force& f) { return f.name == name; });
  if (found == forces.end()) throw SceneError(where + ": there is no force '" + name + "'");
  const int force = static_cast<int>(found - forces.begin());
  std::optional<TensionSensor> sensor;
  data.forces.for_each([&]<class Kind>(const Kind& f, Forces::Place place) {
    if (HasLaw<Kind> && f.force == force) sensor = TensionSensor{place};
  });
  if (sensor) return *sensor;
  throw SceneError(where + ": '" + name + "' is a " + std::string(type_of(*found)) +
                   "; only a tsda or an rsda has one number to measure");
}

ReactionSensor reaction_sensor(Compilation& model, const Sensor& s, const std::string& where) {
  ReactionSensor out;
  const std::size_t i = model.joint_index(s.joint, where + ".joint");
  const Joint& joint = model.scene.joints[i];
  if (ties_joints(joint)) {
    throw SceneError(where + ".joint: joint '" + s.joint + "' is " + joint.type + ", which has no bodies of its own");
  }
  out.joint = static_cast<int>(i);
  out.torque = s.kind == "torque";
  if (!out.torque && s.kind != "force") {
    throw SceneError(where + ".kind: is '" + s.kind + "'; allowed: force, torque");
  }
  out.component = component(s.component, where);
  const std::string path = child_path("joints", i);
  out.body2 = model.body_index(joint.body2, path + ".body2");
  out.s2 = numbers(model.keep(out.slot_s2, model.point(out.body2, joint.point2, path + ".point2")));
  return out;
}

// The angle of the direction n of the body, which is perpendicular to the axis where the body lies along the ground,
// from n in the ground, seen along the axis.
AngleSensor body_angle(Compilation& model, const Sensor& s, const std::string& where) {
  JointAngle angle;
  angle.body2 = model.body_index(s.body, where);
  const DualVector3 axis = model.direction(0, s.axis, where + ".axis"), n = perpendicular(axis);
  angle.measure.s1 = numbers(model.keep(angle.slot1, n));
  angle.measure.s3 = numbers(model.keep(angle.slot3, cross(axis, n)));
  angle.measure.s2 = numbers(model.keep(angle.slot2, n));
  model.data.angles.push_back(angle);
  return {static_cast<int>(model.data.angles.size()) - 1, false};
}

SensorKind sensor(Compilation& model, const Sensor& s, const std::string& where) {
  const std::string& quantity = s.quantity;
  if (quantity == "position" || quantity == "velocity") {
    PointSensor out;
    out.quantity = quantity == "position" ? PointSensor::Quantity::position : PointSensor::Quantity::velocity;
    return with_points(model, s, out, where);
  }
  if (quantity == "distance" || quantity == "distance_rate") {
    PointSensor out;
    out.quantity = quantity == "distance" ? PointSensor::Quantity::position : PointSensor::Quantity::position_rate;
    out.component = PointSensor::kNorm;
    out.relative = true;
    out.a = sensor_point(model, s.body2, s.point2, where);
    out.b = sensor_point(model, s.body1.empty() ? "ground" : s.body1, s.point1, where);
    return out;
  }
  if (quantity == "angle" || quantity == "rate") {
    return AngleSensor{model.angle_of(s.joint, where + ".joint"), quantity == "rate"};
  }
  if (quantity == "body_angle") return body_angle(model, s, where);
  if (quantity == "angular_velocity") {
    return AngularVelocitySensor{model.body_index(s.body, where), component(s.component, where), s.in_body_frame};
  }
  if (quantity == "orientation") {
    const int body = model.body_index(s.body, where);
    if (body == 0 || s.component.size() != 2 || s.component[0] != 'e' || s.component[1] < '0' || s.component[1] > '3') {
      throw SceneError(where + ": orientation needs a moving body and a component e0, e1, e2 or e3");
    }
    return CoordinateSensor{7 * (body - 1) + 3 + (s.component[1] - '0')};
  }
  if (quantity == "energy") {
    if (s.component != "kinetic" && s.component != "potential" && s.component != "total") {
      throw SceneError(where + ".component: is '" + s.component + "'; allowed: kinetic, potential, total");
    }
    return EnergySensor{s.component != "potential", s.component != "kinetic"};
  }
  if (quantity == "constraint_violation") return ViolationSensor{};
  if (quantity == "displacement") {
    return DisplacementSensor{model.joint_displacement(s.joint, where + ".joint")};
  }
  if (quantity == "acceleration") return with_points(model, s, AccelerationSensor{}, where);
  if (quantity == "reaction") return reaction_sensor(model, s, where);
  if (quantity == "drive_force") {
    ReactionSensor out;
    for (const Constraint& c : model.data.constraints) {
      if (c.drive >= 0 && model.scene.drives[static_cast<std::size_t>(c.drive)].name == s.drive) out.drive_row = c.row;
    }
    if (out.drive_row < 0) throw SceneError(where + ".drive: there is no drive '" + s.drive + "'");
    return out;
  }
  if (quantity == "force") return tension_sensor(model.data, s.force, model.scene.forces, where + ".force");
  throw SceneError(where + ".quantity: '" + quantity + "' is not a quantity known here");
}

// The time derivative of a position-level sensor as a sensor of its own, where it is one.
bool rate_of(const Compilation& model, const SensorKind& kind, SensorKind& rate) {
  if (const auto* p = std::get_if<PointSensor>(&kind)) {
    if (p->quantity != PointSensor::Quantity::position) return false;
    PointSensor r = *p;
    r.quantity = PointSensor::Quantity::position_rate;
    rate = r;
    return true;
  }
  if (const auto* a = std::get_if<AngleSensor>(&kind); a && !a->rate) {
    rate = AngleSensor{a->angle, true};
    return true;
  }
  if (const auto* x = std::get_if<DisplacementSensor>(&kind); x && !x->rate) {
    DisplacementSensor r = *x;
    r.rate = true;
    rate = r;
    return true;
  }
  if (const auto* c = std::get_if<CoordinateSensor>(&kind)) {
    rate = CoordinateSensor{c->index + 7 * model.data.n};
    return true;
  }
  return false;
}

void add_condition(Compilation& model, std::size_t i) {
  const Condition& c = model.scene.conditions[i];
  const std::string where = std::string("initial.") + child_path("conditions", i);
  ConditionData out;
  const auto found = std::find(model.data.sensor_names.begin(), model.data.sensor_names.end(), c.sensor);
  if (found == model.data.sensor_names.end())
    throw SceneError(where + ".sensor: there is no sensor '" + c.sensor + "'");
  out.sensor = static_cast<int>(found - model.data.sensor_names.begin());
  const SensorKind& kind = model.data.sensors[static_cast<std::size_t>(out.sensor)];
  const bool has_rate = rate_of(model, kind, out.rate_kind);
  if (const auto* p = std::get_if<PointSensor>(&kind)) {
    out.velocity_level = p->quantity != PointSensor::Quantity::position;
  } else if (const auto* a = std::get_if<AngleSensor>(&kind)) {
    out.velocity_level = a->rate;
    out.modulo_turn = !a->rate;
  } else {
    out.velocity_level =
        !std::holds_alternative<CoordinateSensor>(kind) && !std::holds_alternative<DisplacementSensor>(kind);
  }
  if (needs_motion(kind) || std::holds_alternative<EnergySensor>(kind) ||
      std::holds_alternative<ViolationSensor>(kind) || std::holds_alternative<TensionSensor>(kind)) {
    throw SceneError(where + ": a condition on sensor '" + c.sensor +
                     "' is not possible; use positions, velocities, "
                     "angles, distances, their rates, angular velocities or Euler parameters");
  }
  if (c.value) {
    const Dual v = model.fields.value(*c.value, where + ".value");
    out.has_value = true, out.value = v.value(), out.slot_value = model.fields.slot(v);
  }
  if (c.rate) {
    if (out.velocity_level) throw SceneError(where + ".rate: sensor '" + c.sensor + "' is a velocity: give its value");
    if (!has_rate) throw SceneError(where + ".rate: the rate of sensor '" + c.sensor + "' is not available");
    const Dual v = model.fields.value(*c.rate, where + ".rate");
    out.has_rate = true, out.rate = v.value(), out.slot_rate = model.fields.slot(v);
  }
  model.data.conditions.push_back(out);
}

}  // namespace

void compile_sensors(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.sensors.size(); ++i) {
    model.data.sensors.push_back(sensor(model, model.scene.sensors[i], child_path("sensors", i)));
    model.data.sensor_names.push_back(model.scene.sensors[i].name);
    model.data.needs_motion = model.data.needs_motion || needs_motion(model.data.sensors.back());
  }
}

void compile_conditions(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.conditions.size(); ++i) add_condition(model, i);
}

}  // namespace mbsopt
