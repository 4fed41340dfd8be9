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
  const auto found = std::find(model.data.sensor_names.begin(), model.data.sensor_names.end(), c.sensor);
  if (found == model.data.sensor_names.end())
    throw SceneError(where + ".sensor: there is no sensor '" + c.sensor + "'");
  const int index = static_cast<int>(found - model.data.sensor_names.begin());
  const SensorPtr &sensor = model.data.sensors[at(index)], rate = sensor->rate(model.data);
  if (sensor->reads > Reads::velocities)
    throw SceneError(where + ": a condition on sensor '" + c.sensor +
                     "' is not possible; use positions, velocities, angles, distances, their rates, angular "
                     "velocities or Euler parameters");
  if (c.acceleration)
    throw SceneError(
        where + ".acceleration: is for the command kinematics only; elsewhere accelerations follow from the forces");
  const bool of_velocities = sensor->reads == Reads::velocities;
  const Dimension of = shown_dimension(model.scene, model.scene.sensors[at(index)]).value_or(Dimension{});
  const auto add = [&](ConditionData out, const Field& field, const char* key) {
    const FieldValue v = model.fields.value(field, where + key);
    out.value = v.value();
    out.slot = model.fields.slot(v);
    if (!of.is_none()) out.unit = " " + to_string(out.of_rate ? of / dimension::kTime : of);
    model.data.conditions.push_back(std::move(out));
  };
  if (c.value) add({index, of_velocities, false, sensor, of_velocities ? sensor : rate}, *c.value, ".value");
  if (!c.rate) return;
  if (of_velocities) throw SceneError(where + ".rate: sensor '" + c.sensor + "' is a velocity: give its value");
  if (!rate) throw SceneError(where + ".rate: the rate of sensor '" + c.sensor + "' is not available");
  add({index, true, true, rate, rate}, *c.rate, ".rate");
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
