// Which equation is violated most at a state: a row of Phi, or a body's unit norm.
#pragma once

#include <Eigen/Core>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

struct Violation {
  double amount = 0;  // signed
  int row = -1;       // of Phi, or -1
  int body = 0;       // of a unit norm, or 0
};

Violation worst_violation(const MechanismData& data, double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);

// Returns its size, and adds scale times the gradient of that.
double add_violation_gradient(const MechanismData& data, double t, const Eigen::VectorXd& y,
                              const Eigen::VectorXd& angles, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                              Eigen::Ref<Eigen::VectorXd> rho_bar);

}  // namespace mbsopt
