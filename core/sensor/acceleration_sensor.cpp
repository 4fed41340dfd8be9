#include "core/sensor/acceleration_sensor.hpp"

#include <algorithm>

namespace mbsopt {

double AccelerationSensor::value(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z) const {
  const Vector3d W = difference(y, z);
  if (component == PointSensor::kNorm) return W.norm();
  return (body_at(y, std::max(axes_body, 0)).frame.A.transpose() * W)(component);
}

double AccelerationSensor::add_gradient(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z, double scale,
                                        Eigen::Ref<Eigen::VectorXd> y_bar, std::vector<Vec<6>>& z_bar, Vector3d& a_bar,
                                        Vector3d& b_bar) const {
  const Vector3d W = difference(y, z);
  const BodyAt R = body_at(y, std::max(axes_body, 0));
  double result = 0;
  Vector3d W_bar = Vector3d::Zero();
  if (component == PointSensor::kNorm) {
    result = W.norm();
    if (result > 0) W_bar = W / result;
  } else {
    result = (R.frame.A.transpose() * W)(component);
    W_bar = R.frame.A.col(component);
    if (axes_body > 0) {
      FrameBar bar;
      bar.set_zero();
      bar.A.col(component) = W;
      add_pull_back(R, axes_body, bar, scale, y_bar);
    }
  }
  add_point(y, z, a, W_bar, scale, y_bar, z_bar, a_bar);
  if (relative) add_point(y, z, b, -W_bar, scale, y_bar, z_bar, b_bar);
  return result;
}

BodyAt AccelerationSensor::moving(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z, int body) {
  BodyAt b = body_at(y, body);
  if (body > 0) set_acceleration(z[static_cast<std::size_t>(body - 1)], b.state, b.frame);
  return b;
}

Vector3d AccelerationSensor::difference(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z) const {
  Vector3d W = moving(y, z, a.body).frame.point_ddot(a.s);
  if (relative) W -= moving(y, z, b.body).frame.point_ddot(b.s);
  return W;
}

void AccelerationSensor::add_point(const Eigen::VectorXd& y, const std::vector<Vec<6>>& z,
                                   const PointSensor::Point& point, const Vector3d& X, double scale,
                                   Eigen::Ref<Eigen::VectorXd> y_bar, std::vector<Vec<6>>& z_bar, Vector3d& s_bar) {
  const BodyAt b = moving(y, z, point.body);
  s_bar += scale * (b.frame.Addot.transpose() * X);
  if (point.body == 0) return;
  FrameBar bar;
  bar.set_zero();
  bar.Addot = scale * X * point.s.transpose();
  const Eigen::Index q = 7 * (point.body - 1);
  add_pull_back(b.state, bar, Vector4d::Zero(), Vector3d::Zero(), y_bar.segment<7>(q),
                y_bar.segment<7>(y_bar.size() / 2 + q));
  // X'A (omegadot x s) = omegadot'(s x A'X)
  Vec<6>& out = z_bar[static_cast<std::size_t>(point.body - 1)];
  out.head<3>() += scale * X;
  out.tail<3>() += scale * point.s.cross(b.frame.A.transpose() * X);
}

}  // namespace mbsopt
