// A design whose objective is a sum of tracked squares, as a least-squares problem: one residual per row of a file,
//
//   z = sqrt(w_c w) (sensor(t_k) - column_k),     z_x by one tangent-linear run       w_c: weight of the load case
//
// so that Levenberg-Marquardt (levenberg_marquardt.hpp) takes the place of a general optimiser.
#pragma once

#include <functional>

#include "core/start/assembly.hpp"
#include "optim/design/design_program.hpp"
#include "optim/solver/least_squares.hpp"

namespace mbsopt::inline optim {

class TrackedSquares : public LeastSquaresProblem {
 public:
  explicit TrackedSquares(const DesignProgram& program);

  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) override;
  long simulations() const { return simulations_; }
  bool abandoned() const { return abandoned_; }          // the last evaluation, by the user
  bool without_value() const { return without_value_; }  // whether a residual was not a number somewhere

 private:
  void simulate(const Eigen::VectorXd& x, LeastSquaresPoint& point);
  SimulationResult with_tangents(const Mechanism& mechanism, const SimulationSettings& settings,
                                 const TangentSampling& sampling, const RunOptions& options);

  const DesignProgram& program_;
  const Evaluator& evaluator_;  // of the program
  long simulations_ = 0;
  bool abandoned_ = false, without_value_ = false;
  bool is_solved_ = true;          // until a run is integrated
  bool reads_velocities_ = false;  // a sensor, as far as its derivatives were seen
  Modes modes_ = Modes::all;       // until a start is assembled in the mode of its guess
};

// simulations: is added to.
NlpResult solve_tracked_squares(DesignProgram& program, const Eigen::VectorXd& x_start, const OptimizerSpec& spec,
                                const std::function<bool(const NlpProgress&)>& progress, long& simulations);

}  // namespace mbsopt::inline optim
