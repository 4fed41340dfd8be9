// A mechanism that its joints hold in a plane: three unknowns per body instead of six.
//
// The plane's normal n is a coordinate axis, (t1, t2, n) a cyclic permutation of (x, y, z). Joints that lead to the
// ground hold every body in the plane: revolute and planar ones about n, translational ones along the plane, fixed
// ones. Every row of Phi either constrains motion in the plane or is satisfied by every planar motion. Then the
// feasible accelerations are those with rddot'n = 0 and omegadot along n, for any forces: reactions balance components
// out of the plane. No parameter turns a joint's axis out of the plane, so derivatives stay in it, too.
//
// Vectors of the plane are complex numbers, t1 + i t2. A body's Euler parameters move in the span of p_a and p_b,
//   p = Re(P) p_a + Im(P) p_b,   P = e0 + i e_n seen from the pose p_a,   A(p) s = P^2 s   for s in the plane,
// with p_a any pose that has the body's own normal along n, and p_b = p_a turned by pi about n.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/body/complex.hpp"
#include "core/constraint/primitive.hpp"

namespace mbsopt {

struct MechanismData;
struct Scene;

struct PlanarBody {
  double mass = 0, inertia = 0;  // [kg], about n through the centre of mass [kg m^2]
  Vector3d b1 = Vector3d::UnitX(), b2 = Vector3d::UnitY(), n = Vector3d::UnitZ();  // t1, t2, n in body axes at p_a
  Vector4d p_a{1, 0, 0, 0}, p_b{0, 0, 0, 1};

  Plane in_plane(const Vector3d& s) const { return {b1.dot(s), b2.dot(s)}; }
  Vector3d in_body(const Plane& s) const { return s.re * b1 + s.im * b2; }
};

// A primitive (constraint.hpp) in the plane.
struct PlanarConstraint : BodyPair {
  enum class Kind { point, dot1, dot2, distance, angle };
  Kind kind = Kind::point;
  int row = 0, row2 = 0;   // number of its row (PlanarModel::rows); row2: of a point's second coordinate
  Plane s1{}, s2{}, s3{};  // parts in the plane of the primitive's vectors
  double sign = 1;         // angle: about +n or -n
  double factor = 1;
  int slot_factor = -1, angle = -1;
};

struct PlanarModel {
  int t1 = 0, t2 = 1, n = 2;       // coordinate axes
  std::vector<PlanarBody> bodies;  // the ground first
  std::vector<PlanarConstraint> constraints;
  std::vector<int> rows;  // rows of Phi that constrain motion in the plane; the constraints above number them 0, 1, ...
  Plane gravity;

  // Writes x to the rows of Phi that the model uses. The other rows keep their values.
  void spread(const Eigen::VectorXd& x, Eigen::VectorXd& phi_rows) const {
    for (std::size_t k = 0; k < rows.size(); ++k) phi_rows(rows[k]) = x(static_cast<Eigen::Index>(k));
  }
  template <class PhiRows>
  void gather(const PhiRows& phi_rows, Eigen::VectorXd& x) const {
    for (std::size_t k = 0; k < rows.size(); ++k) x(static_cast<Eigen::Index>(k)) = phi_rows(rows[k]);
  }

  Plane in_plane(const Vector3d& x) const { return {x(t1), x(t2)}; }
  Vector3d in_space(const Plane& x) const {
    Vector3d out = Vector3d::Zero();
    out(t1) = x.re;
    out(t2) = x.im;
    return out;
  }
};

// Sets the planar model of compiled data whose theta_rho is set. If there is none, sets data.not_planar to the reason,
// in words that end the sentence "is not planar: ...".
void find_planar_model(const Scene& scene, MechanismData& data);

}  // namespace mbsopt
