// The numeric fields of a scene at one rho, each with its exact derivative in the active parameters. Forward automatic
// differentiation gives the derivatives of quantities that follow from them (unit axes, perpendicular vectors,
// rotations).
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <unsupported/Eigen/AutoDiff>
#include <vector>

#include "core/expression/program.hpp"
#include "core/linear/fixed_size.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

using Dual = Eigen::AutoDiffScalar<Eigen::VectorXd>;  // always carries a derivative of full length
template <std::size_t N>
using DualVector = std::array<Dual, N>;

class FieldValues {
 public:
  FieldValues(std::shared_ptr<ScenePrograms> programs, const Eigen::VectorXd& rho, const std::vector<int>& active);

  // where is the place in the scene, for errors ("bodies[2].mass"). Throws SceneError on unknown names and infinite
  // values.
  Dual value(const Field& field, const std::string& where) const;
  template <std::size_t N>
  DualVector<N> values(const std::array<Field, N>& fields, const std::string& where) const {
    DualVector<N> result;
    for (std::size_t i = 0; i < N; ++i) {
      const Field& field = fields[i];
      result[i] = field.is_number() ? constant(field.number()) : value(field, where + "[" + std::to_string(i) + "]");
    }
    return result;
  }
  Dual constant(double x) const { return Dual(x, Eigen::VectorXd::Zero(active_)); }

  ScenePrograms& programs() const { return *programs_; }
  const Symbols& symbols() const { return programs_->symbols(); }

  // Returns the slot of some numbers: their derivatives become consecutive rows. It is -1 if all derivatives are zero.
  template <std::size_t N>
  int slot(const DualVector<N>& x) {
    bool depends = false;
    for (const Dual& c : x) depends = depends || !c.derivatives().isZero(0);
    if (!depends) return -1;
    const int first = static_cast<int>(rows_.size());
    for (const Dual& c : x) rows_.push_back(c.derivatives());
    return first;
  }
  int slot(const Dual& x) { return slot(DualVector<1>{x}); }
  Eigen::MatrixXd theta_rho() const;  // all rows given out, slots x active

 private:
  std::shared_ptr<ScenePrograms> programs_;
  Eigen::VectorXd rho_;
  std::vector<int> active_index_;
  Eigen::Index active_ = 0;
  std::vector<Eigen::VectorXd> rows_;
};

template <std::size_t N>
Vec<static_cast<int>(N)> numbers(const DualVector<N>& x) {
  Vec<static_cast<int>(N)> v;
  for (std::size_t i = 0; i < N; ++i) v(static_cast<Eigen::Index>(i)) = x[i].value();
  return v;
}

using DualVector3 = DualVector<3>;
using DualVector4 = DualVector<4>;

DualVector3 operator+(const DualVector3& a, const DualVector3& b);
DualVector3 operator-(const DualVector3& a, const DualVector3& b);
DualVector3 operator*(const Dual& a, const DualVector3& b);
Dual dot(const DualVector3& a, const DualVector3& b);
DualVector3 cross(const DualVector3& a, const DualVector3& b);
DualVector3 unit(const DualVector3& a);  // a not zero

// A unit vector perpendicular to unit a, a smooth function of a: a x e_k normalised, k the smallest component of a.
DualVector3 perpendicular(const DualVector3& a);
// Component of n perpendicular to unit a, normalised.
DualVector3 perpendicular_part(const DualVector3& n, const DualVector3& a);

DualVector4 unit(const DualVector4& p);
DualVector4 inverse(const DualVector4& p);  // of a unit p: the opposite rotation
DualVector4 quaternion_product(const DualVector4& a, const DualVector4& b);
DualVector4 euler_parameters(const DualVector3& unit_axis, const Dual& angle);
DualVector3 rotated(const DualVector4& p, const DualVector3& s);  // A(p) s, p unit

}  // namespace mbsopt
