#include "core/sensor/rotation_sensor.hpp"

namespace mbsopt {

double AngularVelocitySensor::value(const Eigen::VectorXd& y) const {
  const Vector3d w = omega(y);
  return component == kNorm ? w.norm() : w(component);
}

double AngularVelocitySensor::add_gradient(const Eigen::VectorXd& y, double scale,
                                           Eigen::Ref<Eigen::VectorXd> y_bar) const {
  const Vector3d w = omega(y);
  const double result = component == kNorm ? w.norm() : w(component);
  if (body == 0) return result;
  Vector3d d = Vector3d::Unit(component % 3);
  if (component == kNorm) d = result > 0 ? Vector3d(w / result) : Vector3d(Vector3d::Zero());
  const BodyAt b = body_at(y, body);
  const Vector4d &p = b.state.p, &pdot = b.state.pdot;
  const Vector3d e = p.tail<3>(), f = pdot.tail<3>();
  const double sign = in_body_frame ? -1 : 1;  // of e x edot
  Vector4d p_bar, pdot_bar;
  p_bar << d.dot(f), -pdot(0) * d + sign * f.cross(d);
  pdot_bar << -d.dot(e), p(0) * d + sign * d.cross(e);
  y_bar.segment<4>(7 * (body - 1) + 3) += 2 * scale * p_bar;
  y_bar.segment<4>(y_bar.size() / 2 + 7 * (body - 1) + 3) += 2 * scale * pdot_bar;
  return result;
}

Vector3d AngularVelocitySensor::omega(const Eigen::VectorXd& y) const {
  const BodyAt b = body_at(y, body);
  const Vector3d e = b.state.p.tail<3>(), f = b.state.pdot.tail<3>();
  const double sign = in_body_frame ? -1 : 1;
  return 2 * (b.state.p(0) * f - b.state.pdot(0) * e + sign * e.cross(f));
}

}  // namespace mbsopt
