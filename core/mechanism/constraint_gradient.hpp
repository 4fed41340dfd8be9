// Single constraints: their values at a state, and the gradients of these in the state and in the geometry.
#pragma once

#include "core/constraint/constraint.hpp"
#include "core/mechanism/row_laws.hpp"
#include "core/mechanism/sensor_gradient.hpp"

namespace mbsopt {

// Phi without the factor. An angle is on the branch of the followed joint angle, or on that nearest to the row's law.
template <class P>
Vec<P::kRows> phi_of(const Constraint& c, const P& p, const Frame& f1, const Frame& f2, const RowLaws& laws,
                     const Eigen::VectorXd& angles) {
  Vec<P::kRows> phi;
  p.phi(f1, f2, phi);
  if constexpr (std::is_same_v<P, Angle>) {
    phi(0) =
        Angle::on_branch(phi(0), c.angle == Constraint::kNearestLaw ? laws.f_or_zero(c.row) : branch(angles, c.angle));
  }
  return phi;
}

// Phi_xi of all constraints, for motions xi = (rdot, omega in body axes) of the bodies: m x 6n.
inline Eigen::MatrixXd jacobian_in_motions(const MechanismData& data, const std::vector<Frame>& frames) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(data.m, 6 * data.n);
  for (const Constraint& c : data.constraints) {
    std::visit(
        [&]<class P>(const P& p) {
          Mat<P::kRows, 6> J1, J2;
          p.jacobian(frames[at(c.body1)], frames[at(c.body2)], J1, J2);
          if (c.body1 > 0) J.block<P::kRows, 6>(c.row, 6 * (c.body1 - 1)) += c.factor * J1;
          if (c.body2 > 0) J.block<P::kRows, 6>(c.row, 6 * (c.body2 - 1)) += c.factor * J2;
        },
        c.primitive);
  }
  return J;
}

// Adds the gradient of  lambda'J eta + mu0'Phi + mu1'Phidot  of a primitive. The frames hold eta, which stays fixed.
template <class P>
void add_primitive_gradient(const P& p, const BodyPair& pair, const Frame& b1, const Frame& b2,
                            const Multipliers<P::kRows>& z, SensorGradient& to) {
  FrameBar bar1 = FrameBar::zero(), bar2 = bar1;
  GeometryBar s;
  p.pull_back(b1, b2, z, bar1, bar2, s);
  if (!z.lambda.isZero(0)) {
    fold_virtual(b1.theta_eta, bar1);
    fold_virtual(b2.theta_eta, bar2);
  }
  to.add_frame(b1, pair.body1, bar1);
  to.add_frame(b2, pair.body2, bar2);
  to.add_slot<3>(pair.slot1, s.s1), to.add_slot<3>(pair.slot2, s.s2), to.add_slot<3>(pair.slot3, s.s3);
}

using ConstraintVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;  // of one constraint: three at most

// The virtual work l'(J1 eta1 + J2 eta2) of the forces l = factor times `weights` on the rows of one constraint, with
// eta = (delta r, delta theta): adds its gradient for fixed weights and eta. Returns J1 eta1 + J2 eta2.
inline ConstraintVector add_virtual_work_gradient(const Constraint& c, Frame b1, Frame b2, const Vec<6>& eta1,
                                                  const Vec<6>& eta2, const ConstraintVector& weights,
                                                  SensorGradient& to) {
  set_virtual(eta1, b1);
  set_virtual(eta2, b2);
  ConstraintVector change(c.rows());
  std::visit(
      [&]<class P>(const P& p) {
        Multipliers<P::kRows> z = Multipliers<P::kRows>::zero();
        z.lambda = c.factor * weights;
        add_primitive_gradient(p, c, b1, b2, z, to);
        change = virtual_change(p, b1, b2);
      },
      c.primitive);
  to.add_slot<1>(c.slot_factor, Vec<1>(weights.dot(change)));
  return change;
}

}  // namespace mbsopt
