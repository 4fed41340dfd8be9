// Sensors, and the conditions on them that the initial state meets.
#include <algorithm>

#include "core/mechanism/sensor_kinds.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {
namespace {

std::shared_ptr<SensorFunction> sensor(Compilation& model, const Sensor& s, const std::string& where) {
  const auto kind = std::ranges::find(kSensorMakers, s.quantity, &SensorMakerRow::quantity);
  if (kind == std::end(kSensorMakers))
    throw SceneError(where + ".quantity: '" + s.quantity + "' is not a quantity known here");
  std::shared_ptr<SensorFunction> made = kind->make(model, s, where);
  made->reads = find_row(kSensorQuantities, s.quantity)->reads;
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
  out.rate_sensor = sensor->rate(model.data);
  out.velocity_level = sensor->reads == Reads::velocities;
  out.modulo_turn = sensor->angle() >= 0 && !out.velocity_level;
  const Dimension of =
      find_row(kSensorQuantities, model.scene.sensors[static_cast<std::size_t>(out.sensor)].quantity)->dimension;
  if (of != Dimension{}) out.unit = " " + to_string(of), out.rate_unit = " " + to_string(of / dimension::kTime);
  if (c.value) {
    const Dual v = model.fields.value(*c.value, where + ".value");
    out.has_value = true, out.value = v.value(), out.slot_value = model.fields.slot(v);
  }
  if (c.rate) {
    if (out.velocity_level) throw SceneError(where + ".rate: sensor '" + c.sensor + "' is a velocity: give its value");
    if (!out.rate_sensor) throw SceneError(where + ".rate: the rate of sensor '" + c.sensor + "' is not available");
    const Dual v = model.fields.value(*c.rate, where + ".rate");
    out.has_rate = true, out.rate = v.value(), out.slot_rate = model.fields.slot(v);
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
  for (std::size_t i = 0; i < model.scene.sensors.size(); ++i) {
    model.data.sensors.push_back(sensor(model, model.scene.sensors[i], child_path("sensors", i)));
    model.data.sensor_names.push_back(model.scene.sensors[i].name);
    if (model.data.sensors.back()->reads == Reads::motion) model.data.needs_motion = true;
  }
}

void compile_conditions(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.conditions.size(); ++i) add_condition(model, i);
}

}  // namespace mbsopt
