// The numeric fields of a scene at one rho, each with its exact derivative in the active parameters. Forward automatic
// differentiation gives the derivatives of quantities that follow from them (unit axes, perpendicular vectors,
// rotations).
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "core/expression/program.hpp"
#include "core/linear/dual_numbers.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

using FieldValue = DualNumber<Eigen::Dynamic>;  // always carries all derivatives
template <std::size_t N>
using FieldVector = std::array<FieldValue, N>;

class FieldValues {
 public:
  FieldValues(std::shared_ptr<ScenePrograms> programs, const Eigen::VectorXd& rho, const std::vector<int>& active);

  // where is the place in the scene, for errors ("bodies[2].mass"). Throws SceneError on unknown names and infinite
  // values.
  FieldValue value(const Field& field, const std::string& where) const;
  template <std::size_t N>
  FieldVector<N> values(const std::array<Field, N>& fields, const std::string& where) const {
    FieldVector<N> result;
    for (std::size_t i = 0; i < N; ++i) {
      const Field& field = fields[i];
      result[i] = field.is_number() ? constant(field.number()) : value(field, where + "[" + std::to_string(i) + "]");
    }
    return result;
  }
  FieldValue constant(double x) const { return FieldValue(x, Eigen::VectorXd::Zero(active_)); }
  FieldVector<3> constants(const Vector3d& x) const { return {constant(x(0)), constant(x(1)), constant(x(2))}; }

  ScenePrograms& programs() const { return *programs_; }
  const Symbols& symbols() const { return programs_->symbols(); }

  // Returns the slot of some numbers: their derivatives become consecutive rows. It is -1 if all derivatives are zero.
  template <std::size_t N>
  int slot(const FieldVector<N>& x) {
    bool depends = false;
    for (const FieldValue& c : x) depends = depends || !c.derivatives().isZero(0);
    if (!depends) return -1;
    const int first = static_cast<int>(rows_.size());
    for (const FieldValue& c : x) rows_.push_back(c.derivatives());
    return first;
  }
  int slot(const FieldValue& x) { return slot(FieldVector<1>{x}); }
  Eigen::MatrixXd theta_rho() const;  // all rows given out, slots x active

 private:
  std::shared_ptr<ScenePrograms> programs_;
  Eigen::VectorXd rho_;
  std::vector<int> active_index_;
  Eigen::Index active_ = 0;
  std::vector<Eigen::VectorXd> rows_;
};

template <std::size_t N>
Vec<static_cast<int>(N)> numbers(const FieldVector<N>& x) {
  Vec<static_cast<int>(N)> v;
  for (std::size_t i = 0; i < N; ++i) v(static_cast<Eigen::Index>(i)) = x[i].value();
  return v;
}

using FieldVector3 = FieldVector<3>;
using FieldVector4 = FieldVector<4>;

FieldVector3 operator+(const FieldVector3& a, const FieldVector3& b);
FieldVector3 operator-(const FieldVector3& a, const FieldVector3& b);
FieldVector3 operator*(const FieldValue& a, const FieldVector3& b);
FieldValue dot(const FieldVector3& a, const FieldVector3& b);
FieldVector3 cross(const FieldVector3& a, const FieldVector3& b);
FieldVector3 unit(const FieldVector3& a);  // a not zero

// A unit vector perpendicular to unit a, a smooth function of a: a x e_k normalised, k the smallest component of a.
FieldVector3 perpendicular(const FieldVector3& a);
// Component of n perpendicular to unit a, normalised.
FieldVector3 perpendicular_part(const FieldVector3& n, const FieldVector3& a);

// The product of two quaternions of numbers, fields or expressions.
template <class Q>
Q quaternion_product(const Q& a, const Q& b) {
  return Q{
      {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
       a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]}};
}

FieldVector4 unit(const FieldVector4& p);
FieldVector4 inverse(const FieldVector4& p);  // of a unit p: the opposite rotation
FieldVector4 euler_parameters(const FieldVector3& unit_axis, const FieldValue& angle);
FieldVector3 rotated(const FieldVector4& p, const FieldVector3& s);  // A(p) s, p unit

}  // namespace mbsopt
