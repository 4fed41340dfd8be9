// Where the gradient of a sensor goes.
#pragma once

#include "core/mechanism/mechanism_data.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {

// y_bar, rho_bar += scale d/dy, d/drho (of all parameters). t_bar, if it is not null, gets that of t in expressions.
struct SensorGradient {
  const MechanismData& data;
  double scale;
  VecOut y_bar, rho_bar;
  double* t_bar = nullptr;

  // Adds scale times a gradient in the frame of a body, and in a field.
  void add_frame(const Frame& b, int body, const FrameBar& bar) { add_pull_back(b, body, bar, scale, y_bar); }
  template <int N>
  void add_slot(int slot, const Vec<N>& bar) {
    fields().add<N>(slot, bar);
  }
  FieldGradient fields() { return {data.theta_rho, data.active, scale, rho_bar}; }
};

// The value of a sensor at (y, branch of the angles), and with its gradient; for sensors that need no motion.
inline double evaluate(const MechanismData& data, const SensorPtr& sensor, double t, const Eigen::VectorXd& y,
                       const Eigen::VectorXd& angles) {
  return sensor->evaluate(data, {t, y, angles}, nullptr);
}
inline double add_gradient(const MechanismData& data, const SensorPtr& sensor, double t, const Eigen::VectorXd& y,
                           const Eigen::VectorXd& angles, double scale, VecOut y_bar, VecOut rho_bar) {
  SensorGradient to{data, scale, y_bar, rho_bar};
  return sensor->evaluate(data, {t, y, angles}, &to);
}

}  // namespace mbsopt
