// The Gauss-Newton matrices of objectives (gauss_newton.hpp), gathered at instants of a tangent-linear run.
//
//   CurvatureOfRun curvature(objectives, variables);
//   const TangentSampling sampling = curvature.sampling(mechanism, steps, settings);
//   simulate_tlm(mechanism, settings, costs, sampling, options);
//   curvature.matrix(0, rho);   // of the first objective, variable x variable
#pragma once

#include <span>
#include <vector>

#include "core/simulate/simulation.hpp"
#include "optim/objective/objective.hpp"

namespace mbsopt::inline optim {

class CurvatureOfRun {
 public:
  // Both outlive this. Throws std::invalid_argument for objectives written in C++ or with free instants.
  CurvatureOfRun(std::span<const Objective> objectives, const std::vector<int>& variables);
  ~CurvatureOfRun();

  // Integrals are looked at on given steps; without any, on equal parts of the run: what a search needs of a matrix.
  // The mechanism outlives the run.
  TangentSampling sampling(const Mechanism& mechanism, const StepSequence& steps, const SimulationSettings& settings);
  Eigen::MatrixXd matrix(std::size_t objective, const Eigen::VectorXd& rho) const;

 private:
  class Gathered;
  struct Look;

  std::span<const Objective> objectives_;
  const std::vector<int>& variables_;
  std::vector<std::vector<Gathered>> gathered_;  // the parts of each objective
  std::vector<Look> looks_;
};

}  // namespace mbsopt::inline optim
