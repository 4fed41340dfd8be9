// Costs of the state for tests of integration and its derivatives.
#pragma once

#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"

namespace mbsopt::testing {

struct StateNorm final : PointCost {
  double value(const StatePoint& at) const override { return at.y.squaredNorm(); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut) const override {
    y_bar += 2 * scale * at.y;
    return at.y.squaredNorm();
  }
};

// Product of two sensors, or the square of one.
struct SensorProduct final : PointCost {
  const Mechanism& mechanism;
  int a, b;
  SensorProduct(const Mechanism& m, int first, int second) : mechanism(m), a(first), b(second) {}
  double value(const StatePoint& at) const override {
    return mechanism.sensor_value(a, at) * mechanism.sensor_value(b, at);
  }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    const double x = mechanism.sensor_value(a, at), y = mechanism.sensor_value(b, at);
    mechanism.add_sensor_gradient(a, at, scale * y, y_bar, rho_bar);
    mechanism.add_sensor_gradient(b, at, scale * x, y_bar, rho_bar);
    return x * y;
  }
};

}  // namespace mbsopt::testing
