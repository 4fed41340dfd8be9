// A sensor of a compiled mechanism: its value and gradient at a state. Each quantity is one file (sensor_kinds.hpp).
#pragma once

#include <memory>
#include <vector>

#include "core/mechanism/state_point.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {

struct MechanismData;
struct SensorGradient;
struct SensorFunction;
using SensorPtr = std::shared_ptr<const SensorFunction>;

struct SensorFunction {
  static constexpr int kNorm = 3;  // the component that is a norm

  virtual ~SensorFunction() = default;
  // Returns the value. `to` gets the gradient, if it is not null (sensor_gradient.hpp).
  virtual double evaluate(const MechanismData& data, const StatePoint& at, SensorGradient* to) const = 0;
  // The bodies that the sensor reads. An empty list means all bodies.
  virtual std::vector<int> bodies(const MechanismData&) const { return {}; }
  // Its time derivative; null if a condition may not prescribe one.
  virtual SensorPtr rate(const MechanismData&) const { return nullptr; }
  // The norm of a velocity is not linear in v: it returns the three sensors of its components. Others return none.
  virtual std::vector<SensorPtr> components() const { return {}; }
  // The followed angle (MechanismData::angles) of an angle or its rate; else -1.
  virtual int angle() const { return -1; }

  Reads reads = Reads::positions;  // of its row in kSensorQuantities
};

// A component of x, or |x| for kNorm, and its gradient in x. A norm at zero has none: it is set to zero.
inline double component_value(const Vector3d& x, int component) {
  return component == SensorFunction::kNorm ? x.norm() : x(component);
}
inline Vector3d component_gradient(const Vector3d& x, int component) {
  if (component != SensorFunction::kNorm) return Vector3d::Unit(component);
  const double l = x.norm();
  return l > 0 ? Vector3d(x / l) : Vector3d(Vector3d::Zero());
}

// A copy of a sensor with one change.
template <class Kind, class Change>
SensorPtr changed(const Kind& sensor, const Change& change) {
  auto copy = std::make_shared<Kind>(sensor);
  change(*copy);
  return copy;
}

// The three components of a sensor of a norm, as SensorFunction::components() returns them.
template <class Kind>
std::vector<SensorPtr> components_of_norm(const Kind& sensor) {
  std::vector<SensorPtr> all;
  for (int k = 0; k < 3 && sensor.component == SensorFunction::kNorm; ++k)
    all.push_back(changed(sensor, [&](Kind& c) { c.component = k; }));
  return all;
}

}  // namespace mbsopt
