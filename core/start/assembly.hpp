// Initial assembly: the nearest state to the guess that satisfies all constraints and initial.conditions.
//
//   positions:   min 1/2 |q - q_guess|^2   subject to  Phi(q, rho) = 0, c(q, rho) = 0      (q: r_g and p, unweighted)
//   velocities:  min 1/2 |v - v_guess|^2   subject to  Phi_q v = -Phi_t, c_q v = rates
//
// If the scene starts from static equilibrium, it is the state at rest of equilibrium.hpp.
//
// Derivatives come from the optimality conditions of both problems (nearest_point.hpp). docs/assembly.md.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

struct AssemblyResult {
  bool ok = false;
  bool in_mode = false;    // in the assembly mode of the guess, in the sense of the sign of det Phi_q, as far as known
  std::string message;     // names violated constraints and amounts where it failed
  Eigen::VectorXd y;       // (q, v)
  Eigen::VectorXd angles;  // branch of each tracked joint angle
  int iterations = 0;
  double residual = 0;
};

// of_guess fails if planar Newton steps do not reach the mode of the guess (AssemblyResult::in_mode). If a linkage does
// not close, the search in all modes costs several of its evaluations.
enum class Modes { all, of_guess };

class Assembly {
 public:
  Assembly(const Mechanism& mechanism, double start_time, Modes modes = Modes::all);
  Assembly(Assembly&&) noexcept;
  ~Assembly();
  const AssemblyResult& result() const;
  ModelSummary summary() const;
  int degrees_of_freedom() const;  // those of the summary
  // Both are NaN if the assembly failed.
  Eigen::MatrixXd tangent() const;                                                 // dy/drho, 14n x P
  void add_adjoint(const Eigen::MatrixXd& y_bar, Eigen::MatrixXd& rho_bar) const;  // rho_bar += (dy/drho)' y_bar
  // Parameters that cannot change by themselves. A change would make redundant equations contradict each other (one of
  // two parallel cranks longer than the other). The state has no derivative with respect to them.
  std::vector<int> obstructed() const;
  // The rounding of dy/drho, relative to the largest entry of a column (lengths in units of the mechanism's): about
  // 1e-14 in metres, more where lengths are far from 1 m. It is 0 where nothing is free, and not estimated for many
  // bodies.
  double rounding() const;
  // A warning of an unstable static equilibrium (equilibrium.hpp); empty if the scene does not start from one.
  std::string equilibrium_warning() const;

 private:
  struct Solution;
  std::unique_ptr<Solution> solution_;
};

}  // namespace mbsopt
