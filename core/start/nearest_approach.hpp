// The nearest approach of a mechanism whose joints and drives may not all hold: the positions with the smallest |Phi|,
// continued from instant to instant.
//
//   q(t, rho) = argmin 1/2 |Phi(q, t, rho)|^2          by Levenberg-Marquardt steps from the instant before
//   e = |Phi|/sqrt(m),  e_rho = Phi'Phi_rho/(|Phi| sqrt(m)),  both 0 where it closes
//
// It starts from the poses of the scene.
//
//   NearestApproach approach(mechanism, 0);
//   for (const double t : times) e += approach.defect(t, e_rho);
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/mechanism/mechanism.hpp"
#include "core/projection/projection.hpp"

namespace mbsopt {

class NearestApproach {
 public:
  NearestApproach(const Mechanism& mechanism, double start_time);
  // t must be later than in the call before. e_rho is the gradient in all parameters.
  double defect(double t, Eigen::VectorXd& e_rho);
  const Eigen::VectorXd& y() const { return y_; }  // positions there
  const Eigen::VectorXd& angles() const { return angles_; }

 private:
  const Mechanism mechanism_;
  std::unique_ptr<Projector> projector_;
  Eigen::VectorXd y_, angles_;
};

}  // namespace mbsopt
