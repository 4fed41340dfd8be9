#include "core/mechanism/field_values.hpp"

#include <cmath>

#include "core/scene/scene_error.hpp"

namespace mbsopt {

FieldValues::FieldValues(std::shared_ptr<ScenePrograms> programs, const Eigen::VectorXd& rho,
                         const std::vector<int>& active)
    : programs_(std::move(programs)),
      rho_(rho),
      active_index_(active),
      active_(static_cast<Eigen::Index>(active.size())) {}

FieldValue FieldValues::value(const Field& field, const std::string& where) const {
  if (field.is_number()) return constant(field.number());
  try {
    const std::shared_ptr<const Program> program = programs_->field(field);
    Program::Scratch scratch = program->scratch();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(rho_.size());
    const std::span<const double> x(rho_.data(), static_cast<std::size_t>(rho_.size()));
    const double v = program->add_gradient(
        x, 1.0, std::span<double>(gradient.data(), static_cast<std::size_t>(rho_.size())), scratch);
    Eigen::VectorXd d(active_);
    for (Eigen::Index k = 0; k < active_; ++k) d(k) = gradient(active_index_[static_cast<std::size_t>(k)]);
    if (!std::isfinite(v) || !d.allFinite()) {
      throw SceneError(where + ": '" + field.text() + "' or its derivative is not finite at these parameters");
    }
    return FieldValue(v, d);
  } catch (const UnknownName& e) {
    throw SceneError(where + ": " + e.what());
  }
}

Eigen::MatrixXd FieldValues::theta_rho() const {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(rows_.size()), active_);
  for (std::size_t i = 0; i < rows_.size(); ++i) result.row(static_cast<Eigen::Index>(i)) = rows_[i].transpose();
  return result;
}

FieldVector3 operator+(const FieldVector3& a, const FieldVector3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
FieldVector3 operator-(const FieldVector3& a, const FieldVector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
FieldVector3 operator*(const FieldValue& a, const FieldVector3& b) { return {a * b[0], a * b[1], a * b[2]}; }
FieldValue dot(const FieldVector3& a, const FieldVector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
FieldVector3 cross(const FieldVector3& a, const FieldVector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

FieldVector3 unit(const FieldVector3& a) {
  const FieldValue norm = sqrt(dot(a, a));
  return {a[0] / norm, a[1] / norm, a[2] / norm};
}

FieldVector3 perpendicular(const FieldVector3& a) {
  Eigen::Index k = 0;
  numbers(a).cwiseAbs().minCoeff(&k);
  const FieldValue zero = 0.0 * a[0], one = zero + 1.0;
  FieldVector3 e{zero, zero, zero};
  e[static_cast<std::size_t>(k)] = one;
  return unit(cross(a, e));
}

FieldVector3 perpendicular_part(const FieldVector3& n, const FieldVector3& a) {
  const FieldValue along = dot(n, a);
  return unit(n - along * a);
}

FieldVector4 unit(const FieldVector4& p) {
  const FieldValue norm = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
  return {p[0] / norm, p[1] / norm, p[2] / norm, p[3] / norm};
}

FieldVector4 inverse(const FieldVector4& p) { return {p[0], -p[1], -p[2], -p[3]}; }

FieldVector4 euler_parameters(const FieldVector3& unit_axis, const FieldValue& angle) {
  const FieldValue half = 0.5 * angle;
  const FieldValue c = cos(half), s = sin(half);
  return {c, s * unit_axis[0], s * unit_axis[1], s * unit_axis[2]};
}

FieldVector3 rotated(const FieldVector4& p, const FieldVector3& s) {
  const FieldVector3 e{p[1], p[2], p[3]};
  const FieldValue a = p[0] * p[0] - dot(e, e), b = 2.0 * dot(e, s), c = 2.0 * p[0];
  return a * s + b * e + c * cross(e, s);
}

}  // namespace mbsopt
