// The two spaces of mechanics, for code that is written once for both. A Space gives the unknowns of a body, its motion
// in a constraint, and the dependence of its inertia on the parameters.
//
//   InSpace   x = (r, turn about the body's three axes)         frame.hpp
//   InPlane   x = (r along t1 and t2, turn about n)             planar_frame.hpp
#pragma once

#include <vector>

#include "core/body/inertia.hpp"
#include "core/body/planar_frame.hpp"
#include "core/dynamics/planar_bodies.hpp"
#include "core/dynamics/saddle_solver.hpp"

namespace mbsopt {

struct InSpace {
  static constexpr int kUnknowns = 6;
  using Frame = mbsopt::Frame;
  using FrameBar = mbsopt::FrameBar;
  using FrameTangent = mbsopt::FrameTangent;
  using Constraints = ConstraintTerms;
  using Rows = ConstraintRows;

  // The solver uses all rows of Phi.
  static RowLaws laws(const MechanismData& data) { return RowLaws(data); }
  static Eigen::Index rows(const MechanismData& data) { return data.m; }
  static void gather(const MechanismData&, const Eigen::VectorXd& of_phi, Eigen::VectorXd& x) { x = of_phi; }
  static void spread(const MechanismData&, const Eigen::VectorXd& x, Eigen::VectorXd& of_phi) { of_phi = x; }

  static FrameTangent still() { return FrameTangent::zero(); }

  // b -= M' x of a body, M' in the directions of the parameters. The pull-back is theta_bar -= gradient of eta'M x.
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
  using FrameTangent = PlanarFrame<Dual>;
  using Constraints = PlanarConstraints;
  using Rows = PlanarRows;

  // The solver uses the rows that constrain motion in the plane.
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
    if (const auto* dm = block.field<1>(of.slot_mass, m_dir)) {
      b.row(0) -= x(0) * *dm;
      b.row(1) -= x(1) * *dm;
    }
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

// Selects the entries of the rows that the solver uses.
template <class Space>
Eigen::VectorXd rows_of(const MechanismData& data, const Eigen::VectorXd& of_phi) {
  Eigen::VectorXd x(Space::rows(data));
  Space::gather(data, of_phi, x);
  return x;
}

}  // namespace mbsopt
