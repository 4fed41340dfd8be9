// The two spaces of mechanics, for code that serves both. A Space says how many unknowns a body has, how a constraint
// sees its motion, and how its inertia depends on the parameters.
//
//   InSpace   x = (r, turn about the body's three axes)         frame.hpp
//   InPlane   x = (r along t1 and t2, turn about n)             planar_frame.hpp
#pragma once

#include <vector>

#include "core/body/planar_frame.hpp"
#include "core/dynamics/planar_bodies.hpp"
#include "core/dynamics/saddle_solver.hpp"

namespace mbsopt {

// J' x of an inertia's directions J' (its rows xx yy zz xy xz yz).
inline Lanes<3> inertia_tangent_times(const Lanes<6>& J, const Vector3d& x) {
  Lanes<3> y;
  y.row(0) = x(0) * J.row(0) + x(1) * J.row(3) + x(2) * J.row(4);
  y.row(1) = x(0) * J.row(3) + x(1) * J.row(1) + x(2) * J.row(5);
  y.row(2) = x(0) * J.row(4) + x(1) * J.row(5) + x(2) * J.row(2);
  return y;
}
// The gradient of <X, J> in these six numbers.
inline Vec<6> inertia_gradient(const Matrix3d& X) {
  Vec<6> x;
  x << X(0, 0), X(1, 1), X(2, 2), X(0, 1) + X(1, 0), X(0, 2) + X(2, 0), X(1, 2) + X(2, 1);
  return x;
}

struct InSpace {
  static constexpr int kUnknowns = 6;
  using Frame = mbsopt::Frame;
  using FrameBar = mbsopt::FrameBar;
  using FrameTangent = mbsopt::FrameTangent;
  using Constraints = ConstraintTerms;
  using Rows = ConstraintRows;

  // The rows of Phi that are solved for: all.
  static RowLaws laws(const MechanismData& data) { return RowLaws(data); }
  static Eigen::Index rows(const MechanismData& data) { return data.m; }
  static void gather(const MechanismData&, const Eigen::VectorXd& of_phi, Eigen::VectorXd& x) { x = of_phi; }
  static void spread(const MechanismData&, const Eigen::VectorXd& x, Eigen::VectorXd& of_phi) { of_phi = x; }

  static FrameTangent still() { return FrameTangent::zero(); }

  // b -= M' x of a body, M' in the directions of the parameters; and theta_bar -= gradient of eta'M x.
  static void subtract_mass_tangent(const MechanismData& data, std::size_t body, const ParameterBlock& block,
                                    const Vec<6>& x, Lanes<6>& b) {
    Lanes<1> m_dir;
    Lanes<6> J_dir;
    const BodyData& of = data.bodies[body];
    if (const auto* dm = block.field<1>(of.slot_mass, m_dir)) b.topRows<3>() -= x.head<3>() * *dm;
    if (const auto* dJ = block.field<6>(of.slot_J, J_dir)) b.bottomRows<3>() -= inertia_tangent_times(*dJ, x.tail<3>());
  }
  static void subtract_mass_bar(const MechanismData& data, std::size_t body, const Vec<6>& eta, const Vec<6>& x,
                                Eigen::VectorXd& theta_bar) {
    const BodyData& of = data.bodies[body];
    if (of.slot_mass >= 0) theta_bar(of.slot_mass) -= eta.head<3>().dot(x.head<3>());
    if (of.slot_J >= 0) {
      theta_bar.segment<6>(of.slot_J) -= inertia_gradient(eta.tail<3>() * x.tail<3>().transpose());
    }
  }
};

struct InPlane {
  static constexpr int kUnknowns = 3;
  using Frame = PlanarFrame<double>;
  using FrameBar = PlanarFrameBar;
  using FrameTangent = PlanarFrame<LaneDual>;
  using Constraints = PlanarConstraints;
  using Rows = PlanarRows;

  // The rows that constrain motion in the plane.
  static RowLaws laws(const MechanismData& data) { return RowLaws(data, data.planar->rows); }
  static Eigen::Index rows(const MechanismData& data) { return static_cast<Eigen::Index>(data.planar->rows.size()); }
  static void gather(const MechanismData& data, const Eigen::VectorXd& of_phi, Eigen::VectorXd& x) {
    data.planar->gather(of_phi, x);
  }
  static void spread(const MechanismData& data, const Eigen::VectorXd& x, Eigen::VectorXd& of_phi) {
    data.planar->spread(x, of_phi);
  }

  static FrameTangent still() { return {}; }

  static void subtract_mass_tangent(const MechanismData& data, std::size_t body, const ParameterBlock& block,
                                    const Vec<3>& x, Lanes<3>& b) {
    Lanes<1> m_dir;
    Lanes<6> J_dir;
    const BodyData& of = data.bodies[body];
    if (const auto* dm = block.field<1>(of.slot_mass, m_dir)) b.row(0) -= x(0) * *dm, b.row(1) -= x(1) * *dm;
    if (const auto* dJ = block.field<6>(of.slot_J, J_dir)) {
      b.row(2) -= x(2) * (PlanarBodies(*data.planar).inertia_weights(body).transpose() * *dJ);
    }
  }
  static void subtract_mass_bar(const MechanismData& data, std::size_t body, const Vec<3>& eta, const Vec<3>& x,
                                Eigen::VectorXd& theta_bar) {
    const BodyData& of = data.bodies[body];
    if (of.slot_mass >= 0) theta_bar(of.slot_mass) -= eta(0) * x(0) + eta(1) * x(1);
    if (of.slot_J >= 0) {
      theta_bar.segment<6>(of.slot_J) -= eta(2) * x(2) * PlanarBodies(*data.planar).inertia_weights(body);
    }
  }
};

// The numbers of the rows that are solved for.
template <class Space>
Eigen::VectorXd rows_of(const MechanismData& data, const Eigen::VectorXd& of_phi) {
  Eigen::VectorXd x(Space::rows(data));
  Space::gather(data, of_phi, x);
  return x;
}

}  // namespace mbsopt
