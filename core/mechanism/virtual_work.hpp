// The virtual work l'(J1 eta1 + J2 eta2) of the forces l = factor times `weights` on the rows of one constraint. Its
// gradient holds for fixed weights and virtual displacements eta = (delta r, delta theta).
#pragma once

#include <variant>

#include "core/constraint/constraint.hpp"
#include "core/mechanism/sensor_gradient.hpp"

namespace mbsopt {

using ConstraintRows = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;  // of one constraint: three at most

// b1, b2: the bodies of c. Returns J1 eta1 + J2 eta2 without the factor.
inline ConstraintRows add_virtual_work_gradient(const Constraint& c, BodyAt b1, BodyAt b2, const Vec<6>& eta1,
                                                const Vec<6>& eta2, const ConstraintRows& weights, SensorGradient& to) {
  set_virtual(eta1, b1.frame);
  set_virtual(eta2, b2.frame);
  FrameBar bar1, bar2;
  bar1.set_zero();
  bar2.set_zero();
  GeometryBar geometry;
  ConstraintRows change(c.rows());
  std::visit(
      [&]<class P>(const P& p) {
        Multipliers<P::kRows> z = Multipliers<P::kRows>::zero();
        z.lambda = c.factor * weights;
        p.pull_back(b1.frame, b2.frame, z, bar1, bar2, geometry);
        change = virtual_change(p, b1.frame, b2.frame);
      },
      c.primitive);
  to.add_slot<1>(c.slot_factor, Vec<1>(weights.dot(change)));
  fold_virtual(eta1.tail<3>(), bar1);
  fold_virtual(eta2.tail<3>(), bar2);
  to.add_frame(b1, c.body1, bar1);
  to.add_frame(b2, c.body2, bar2);
  to.add_slot<3>(c.slot1, geometry.s1), to.add_slot<3>(c.slot2, geometry.s2), to.add_slot<3>(c.slot3, geometry.s3);
  return change;
}

}  // namespace mbsopt
