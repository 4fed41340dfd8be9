// Forward sensitivities by CVODES: s_k = dy/drho_k solves
//   s_k' = f_y s_k + f_rho_k,     s_k(t0) = dy0/drho_k, through the assembly
// beside the state (staggered corrector), for all parameters at once. The sensitivities have an error control of their
// own: rtol, and atol over the parameter's size. Running costs integrate g_y s_k + g_rho_k under the same control.
#pragma once

#include <vector>

#include "core/cvodes/cvodes_run.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt::cvodes {

class Sensitivities {
 public:
  // Registers the sensitivities with CVODES. Requires at least one active parameter.
  Sensitivities(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs,
                const TangentSampling& sampling);
  Sensitivities(const Sensitivities&) = delete;
  Sensitivities& operator=(const Sensitivities&) = delete;

  void take_sample(const SampleEvent& event, const StatePoint& at);
  // Adds integrals and terminal costs, after the last step, and returns psi_rho.
  const Eigen::MatrixXd& finish();

 private:
  static int f(int count, realtype t, N_Vector y, N_Vector ydot, N_Vector* s, N_Vector* sdot, void* run, N_Vector,
               N_Vector);
  static int g(int count, realtype t, N_Vector y, N_Vector* s, N_Vector gdot, N_Vector* gsdot, void* run, N_Vector,
               N_Vector);
  // psi_rho of one objective += g_y S + g_rho
  void add_cost(const PointCost& cost, const StatePoint& at, Eigen::Index objective);

  ForwardRun& run_;
  std::span<const Cost> costs_;
  const TangentSampling& sampling_;
  std::vector<int> active_;
  std::vector<ParameterBlock> blocks_;
  LaneRows direction_, change_;
  Eigen::VectorXd y_bar_, rho_bar_;
  Eigen::MatrixXd y_rho_, psi_rho_;
  VectorArray s_;
  Vector rate_;  // dy/dt at a sample
  NonlinearSolver fixed_point_;
};

}  // namespace mbsopt::cvodes
