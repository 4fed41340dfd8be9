// Angular velocity of a body, and its Euler parameters with their rates.
//   omega_B = 2 G(p) pdot,  omega_G = A omega_B = 2 (e0 edot - e0dot e + e x edot)
#pragma once

#include "core/sensor/body_at.hpp"

namespace mbsopt {

struct AngularVelocitySensor {
  static constexpr int kNorm = 3;
  int body = 0;
  int component = 0;           // 0..2, or kNorm
  bool in_body_frame = false;  // components in the body's axes, else global

  double value(const Eigen::VectorXd& y) const;

  double add_gradient(const Eigen::VectorXd& y, double scale, Eigen::Ref<Eigen::VectorXd> y_bar) const;

 private:
  Vector3d omega(const Eigen::VectorXd& y) const;
};

// One entry of y: an Euler parameter, or its rate.
struct CoordinateSensor {
  Eigen::Index index = 0;
};

}  // namespace mbsopt
