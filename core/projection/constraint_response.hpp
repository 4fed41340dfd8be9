// How the constraint forces answer a fixed load, at a solver's factor: what Projector::response() gives, in space and
// in the plane.
#pragma once

#include <cmath>

#include "core/dynamics/saddle_solver.hpp"

namespace mbsopt {

// Accelerations of body i (1-based), of size 1, that no symmetry of a mechanism leaves a direction out of.
template <int N>
Vec<N> test_load(int i) {
  Vec<N> x;
  for (int k = 0; k < N; ++k) x(k) = std::cos(1.0 + 2.7 * (N * i + k) + 0.31 * i * i);
  return x;
}

// out: the forces for which the constraints accelerate as those for the load push, in units of row_alpha.
// load(i): of body i; relative_alpha: of the solver's alpha; b, g, dx, dnu: scratch.
template <class Rows, class Load>
void constraint_response(BlockSaddleSolver<Rows>& solver, const Load& load, double relative_alpha,
                         std::vector<Vec<Rows::kUnknowns>>& b, Eigen::VectorXd& g,
                         std::vector<Vec<Rows::kUnknowns>>& dx, Eigen::VectorXd& dnu, Eigen::VectorXd& out) {
  constexpr Refinements kOnePass{};
  for (std::size_t k = 0; k < b.size(); ++k) {
    const int i = static_cast<int>(k) + 1;
    b[k] = solver.mass_times(i, load(i));
  }
  g.setZero();
  solver.solve(b, g, kOnePass, dx, dnu);
  g = relative_alpha * dnu.cwiseQuotient(solver.alpha());
  for (auto& zero : b) zero.setZero();
  solver.solve(b, g, kOnePass, dx, dnu);
  out = relative_alpha * dnu.cwiseQuotient(solver.alpha());
}

}  // namespace mbsopt
