// One evaluation of objectives with true extremes. A run finds the steps and the other objectives, a look at its dense
// output the peaks (peaks.hpp). Derivatives are those of a sweep on the same steps, in which each peak is a sample at
// its instant.
//
//   ExtremeRun run(objectives, settings, options);
//   if (run.find(mechanism_without_derivatives)) run.differentiate(mechanism, false, variables);
//   run.result().psi, run.pieces()
#pragma once

#include <vector>

#include "core/simulate/simulation.hpp"
#include "optim/objective/objective.hpp"
#include "optim/objective/peaks.hpp"

namespace mbsopt::inline optim {

// One of the functions of which an objective is the largest or least: a peak of its expression, or of a peak to peak
// value two of them.
struct ExtremePiece {
  Eigen::Index row = 0;  // of psi
  int side = 1;          // -1: of the least
  double value = 0;
  Eigen::VectorXd gradient;  // per variable; the instant does not move it, as it is stationary
  double t = 0;              // [s]; of two, a sum that tells pairs apart
};

class ExtremeRun {
 public:
  // The objectives outlive the run.
  ExtremeRun(const std::vector<Objective>& objectives, const SimulationSettings& settings, const RunOptions& options);

  // Sets psi, steps and statistics. Returns false with a message if the run fails. Throws as Objective::instants_of().
  bool find(const Mechanism& mechanism);
  // Then psi_rho, objective x variable of these, and the pieces.
  bool differentiate(const Mechanism& mechanism, bool backward, const std::vector<int>& variables);

  const SimulationResult& result() const { return result_; }
  const std::vector<ExtremePiece>& pieces() const { return pieces_; }  // the most extreme ones of each objective first
  long simulations() const { return simulations_; }

 private:
  // The largest or least values of an objective's expression.
  struct Side {
    Eigen::Index row;  // of the objective
    ObjectivePart part;
    std::vector<Peak> peaks;
    std::vector<ExtremePiece> pieces(const Eigen::VectorXd& values, const Eigen::MatrixXd& values_rho,
                                     Eigen::Index first) const;
  };
  void set_others(const SimulationResult& of, const std::vector<int>& variables);
  void set_extremes(const Eigen::VectorXd& values, const Eigen::MatrixXd& values_rho);

  const std::vector<Objective>& objectives_;
  const SimulationSettings settings_;
  const RunOptions options_;
  std::vector<Objective> others_;
  std::vector<Eigen::Index> rows_;  // of the others
  std::vector<Side> sides_;
  SimulationResult result_;
  std::vector<ExtremePiece> pieces_;
  long simulations_ = 0;
};

}  // namespace mbsopt::inline optim
