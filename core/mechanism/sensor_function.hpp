// A sensor of a compiled mechanism: its value and gradient at a state. Each quantity is one file (sensor_kinds.hpp).
#pragma once

#include <memory>
#include <vector>

#include "core/mechanism/state_point.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {

struct MechanismData;
struct SensorFunction;
using SensorPtr = std::shared_ptr<const SensorFunction>;

struct SensorFunction {
  static constexpr int kNorm = 3;  // the component that is a norm

  virtual ~SensorFunction() = default;
  virtual double value(const MechanismData& data, const StatePoint& at) const = 0;
  // y_bar, rho_bar += scale d/dy, d/drho (of all parameters); returns the value.
  virtual double add_gradient(const MechanismData& data, const StatePoint& at, double scale, VecOut y_bar,
                              VecOut rho_bar) const = 0;
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

// Evaluates at (y, branch of the angles), for sensors that need no motion.
inline double evaluate(const MechanismData& data, const SensorPtr& sensor, double t, const Eigen::VectorXd& y,
                       const Eigen::VectorXd& angles) {
  return sensor->value(data, {t, y, angles});
}
inline double add_gradient(const MechanismData& data, const SensorPtr& sensor, double t, const Eigen::VectorXd& y,
                           const Eigen::VectorXd& angles, double scale, VecOut y_bar, VecOut rho_bar) {
  return sensor->add_gradient(data, {t, y, angles}, scale, y_bar, rho_bar);
}

}  // namespace mbsopt
