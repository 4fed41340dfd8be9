// One accepted step of an explicit method, with everything that dense output and the derivative sweeps read.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/dynamics/projection.hpp"
#include "core/integrate/tableaus.hpp"

namespace mbsopt {

struct Step {
  double t = 0, h = 0;
  double t1 = 0;                     // t + h; exactly the end time in the last step
  bool dense = false;                // whether the stages of dense output were computed
  Eigen::VectorXd y0, y_hat;         // at the start; at the end before projection
  Eigen::VectorXd y1;                // at the end, projected
  Eigen::VectorXd angles0, angles1;  // branch of each tracked joint angle, start and end
  Eigen::MatrixXd Y, K;              // stages and their derivatives (v, a), 14n x dense_stages
  Eigen::MatrixXd lambda;            // multipliers of each stage
  ProjectionSolution projection;

  int stages(const Method& rk) const { return dense ? rk.dense_stages : rk.stages; }
};

// y(t + theta h) = y0 + h sum_i b_i(theta) k_i + blend(theta) (y1 - y_hat): the last term spreads the projection over
// the step, so that the output is continuous and ends at the projected state.
inline double projection_blend(double theta) { return theta * theta * (3 - 2 * theta); }

inline void dense_output(const Method& rk, const Step& step, double theta, Eigen::VectorXd& y) {
  y = step.y0 + projection_blend(theta) * (step.y1 - step.y_hat);
  for (int i = 0; i < rk.dense_stages; ++i) y += (step.h * rk.dense_weight(i, theta)) * step.K.col(i);
}

}  // namespace mbsopt
