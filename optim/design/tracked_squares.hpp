// A design whose objective is a sum of tracked squares, as a least-squares problem: one residual per row of a file,
//
//   z = sqrt(w_c w) (sensor(t_k) - column_k),     z_x by one tangent-linear run       w_c: weight of the load case
//
// so that Levenberg-Marquardt (levenberg_marquardt.hpp) takes the place of a general optimiser.
#pragma once

#include <functional>

#include "optim/design/design_program.hpp"
#include "optim/solver/least_squares.hpp"

namespace mbsopt {

class TrackedSquares : public LeastSquaresProblem {
 public:
  TrackedSquares(const DesignProgram& program, const CaseEvaluator& evaluator);

  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) override;
  long simulations() const { return simulations_; }

 private:
  const DesignProgram& program_;
  const CaseEvaluator& evaluator_;
  long simulations_ = 0;
};

NlpResult solve_tracked_squares(DesignProgram& program, const CaseEvaluator& evaluator, const Eigen::VectorXd& x_start,
                                const OptimizerSpec& spec, const std::function<bool(const NlpProgress&)>& progress,
                                long& simulations);

}  // namespace mbsopt
