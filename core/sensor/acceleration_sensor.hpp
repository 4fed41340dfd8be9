// Kinematic acceleration (without gravity) of a body point, or the plain difference of two.   [m/s^2]
//   W = Pddot_a - Pddot_b,  Pddot = rddot + Addot s;   a component of R'W in the axes R of a body or global, or |W|
// It depends on the state and on z = (rddot, omegadot) of the bodies, which the equations of motion give.
#pragma once

#include <vector>

#include "core/sensor/body_at.hpp"
#include "core/sensor/point_sensor.hpp"

namespace mbsopt {

struct AccelerationSensor {
  PointSensor::Point a, b;
  bool relative = false;  // whether b counts
  int component = 0;      // 0..2, or PointSensor::kNorm
  int axes_body = -1;     // body whose axes the components are in; -1: global

  double value(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z) const;

  // y_bar, z_bar += scale d/dy, d/dz; a_bar, b_bar += scale d/ds of the two points.
  double add_gradient(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z, double scale,
                      Eigen::Ref<Eigen::VectorXd> y_bar, std::vector<Vec<6>>& z_bar, Vector3d& a_bar,
                      Vector3d& b_bar) const;

 private:
  static BodyAt moving(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z, int body);
  Vector3d difference(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z) const;
  static void add_point(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z, const PointSensor::Point& point,
                        const Vector3d& X, double scale, Eigen::Ref<Eigen::VectorXd> y_bar, std::vector<Vec<6>>& z_bar,
                        Vector3d& s_bar);
};

}  // namespace mbsopt
