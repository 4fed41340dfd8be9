// Sensors, and the conditions on them that the initial state meets.
#include <algorithm>

#include "core/mechanism/sensor_kinds.hpp"
#include "core/scene/scene_facts.hpp"

namespace mbsopt {
namespace {

std::shared_ptr<SensorFunction> sensor(Compilation& model, const Sensor& s, const std::string& where) {
  const auto kind = std::ranges::find(kSensorMakers, s.quantity, &SensorMakerRow::quantity);
  if (kind == std::end(kSensorMakers))
    throw SceneError(where + ".quantity: '" + s.quantity + "' is not a quantity known here");
  std::shared_ptr<SensorFunction> made = kind->make(model, s, where);
  if (s.quantity != "expression") made->reads = reads_of_quantity(s);  // the maker of an expression knows what it reads
  return made;
}

void add_condition(Compilation& model, std::size_t i) {
  const Condition& c = model.scene.conditions[i];
  const std::string where = std::string("initial.") + child_path("conditions", i);
  ConditionData out;
  const auto found = std::find(model.data.sensor_names.begin(), model.data.sensor_names.end(), c.sensor);
  if (found == model.data.sensor_names.end())
    throw SceneError(where + ".sensor: there is no sensor '" + c.sensor + "'");
  out.sensor = static_cast<int>(found - model.data.sensor_names.begin());
  const SensorPtr& sensor = model.data.sensors[static_cast<std::size_t>(out.sensor)];
  if (sensor->reads > Reads::velocities)
    throw SceneError(where + ": a condition on sensor '" + c.sensor +
                     "' is not possible; use positions, velocities, angles, distances, their rates, angular "
                     "velocities or Euler parameters");
  if (c.acceleration)
    throw SceneError(
        where + ".acceleration: is for the command kinematics only; elsewhere accelerations follow from the forces");
  out.rate_sensor = sensor->rate(model.data);
  out.velocity_level = sensor->reads == Reads::velocities;
  out.modulo_turn = sensor->angle() >= 0 && !out.velocity_level;
  const Sensor& spec = model.scene.sensors[static_cast<std::size_t>(out.sensor)];
  const Dimension of = shown_dimension(model.scene, spec).value_or(Dimension{});
  if (!of.is_none()) {
    out.unit = " " + to_string(of);
    out.rate_unit = " " + to_string(of / dimension::kTime);
  }
  if (c.value) {
    const FieldValue v = model.fields.value(*c.value, where + ".value");
    out.has_value = true;
    out.value = v.value();
    out.slot_value = model.fields.slot(v);
  }
  if (c.rate) {
    if (out.velocity_level) throw SceneError(where + ".rate: sensor '" + c.sensor + "' is a velocity: give its value");
    if (!out.rate_sensor) throw SceneError(where + ".rate: the rate of sensor '" + c.sensor + "' is not available");
    const FieldValue v = model.fields.value(*c.rate, where + ".rate");
    out.has_rate = true;
    out.rate = v.value();
    out.slot_rate = model.fields.slot(v);
  }
  model.data.conditions.push_back(out);
}

}  // namespace

int component_of(const Sensor& sensor, const std::string& where) {
  constexpr std::string_view kComponents[] = {"x", "y", "z", "norm"};
  const auto found = std::ranges::find(kComponents, sensor.component);
  if (found == std::end(kComponents))
    throw SceneError(where + ".component: is '" + sensor.component + "'; allowed: x, y, z, norm");
  return static_cast<int>(found - std::begin(kComponents));
}

void compile_sensors(Compilation& model) {
  const std::vector<Sensor>& sensors = model.scene.sensors;
  model.data.sensors.resize(sensors.size());
  for (const bool expressions : {false, true}) {  // these measure by the others
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if ((sensors[i].quantity == "expression") != expressions) continue;
      model.data.sensors[i] = sensor(model, sensors[i], child_path("sensors", i));
      if (model.data.sensors[i]->reads == Reads::motion) model.data.needs_motion = true;
    }
  }
  for (const Sensor& s : sensors) model.data.sensor_names.push_back(s.name);
}

void compile_conditions(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.conditions.size(); ++i) add_condition(model, i);
}

}  // namespace mbsopt
