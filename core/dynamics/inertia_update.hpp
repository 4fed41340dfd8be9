// Solves the saddle system with mass terms of users by the factor without them. With E the rows of their bodies, 6
// each,
//
//   [M + E Mu E'  J'] (z, lambda) = (b, g)       (z, lambda) = (z0, lambda0) - (Z, Lambda) Mu w,   (I + A Mu) w = E'z0
//   [J            -1/alpha]
//
// (z0, lambda0): the solution without Mu. (Z, Lambda): those of the columns of E. A = E'Z. (Sherman, Morrison,
// Woodbury.) It does and allocates nothing if users add no mass.
#pragma once

#include <vector>

#include "core/dynamics/saddle_solver.hpp"
#include "core/dynamics/user_loads.hpp"

namespace mbsopt {

class InertiaUpdate {
 public:
  using Inertias = std::vector<UserLoads::Inertia>;  // at the present state, the same ones in all calls
  InertiaUpdate(const MechanismData& data, const Inertias& added);

  // Call this after each factorisation.
  void set(const Inertias& added, SaddleSolver& solver, const SaddleSolver::Settings& settings);
  void correct(const Inertias& added, std::vector<Vec<6>>& z, Eigen::VectorXd& lambda);
  void correct(const Inertias& added, std::vector<Lanes<6>>& z, LaneRows& lambda);

 private:
  template <class X, class Multipliers>
  void correct_columns(const Inertias& added, std::vector<X>& z, Multipliers& lambda);

  std::vector<std::vector<Lanes<6>>> Z_;  // kLanes columns each
  std::vector<LaneRows> Lambda_;
  std::vector<Lanes<6>> unit_;
  LaneRows no_rows_;
  Eigen::MatrixXd Mu_, A_, inverse_;  // inverse_: Mu inv(I + A Mu)
};

}  // namespace mbsopt
