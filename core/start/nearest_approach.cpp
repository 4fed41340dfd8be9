#include "core/start/nearest_approach.hpp"

#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/mechanism/followed_angles.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {

NearestApproach::NearestApproach(const Mechanism& mechanism, double start_time)
    : mechanism_(mechanism),
      projector_(make_projector(mechanism, Projection::position_velocity,
                                mechanism.data().planar ? Model::planar : Model::spatial, Free::nothing)),
      y_(Eigen::VectorXd::Zero(mechanism.states())) {
  const MechanismData& d = mechanism_.data();
  y_.head(StateLayout{d.n}.positions()) = position_guess(d);
  AssemblyEquations equations(d, AssemblyLevel::position, start_time);
  equations.start_branches(y_);
  angles_ = equations.angles();
}

double NearestApproach::defect(double t, Eigen::VectorXd& e_rho) {
  constexpr double kClosed = 1e-9;  // the tolerance of a path's constraints
  const MechanismData& d = mechanism_.data();
  Eigen::VectorXd theta_bar = Eigen::VectorXd::Zero(d.slots());
  e_rho.setZero(d.rho.size());
  const double violation = projector_->approach(t, angles_, y_, theta_bar, e_rho);
  continue_angles(d, y_, angles_);
  if (violation <= kClosed) {
    e_rho.setZero();
    return 0;
  }
  d.add_to_rho(theta_bar, e_rho);
  const double root = std::sqrt(static_cast<double>(d.m));
  e_rho /= violation * root;
  return violation / root;
}

}  // namespace mbsopt
