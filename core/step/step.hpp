// One accepted step, with everything that dense output and the derivative sweeps read.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/projection/projection.hpp"
#include "core/tableau/stage_groups.hpp"
#include "core/tableau/stage_sum.hpp"
#include "core/tableau/tableaus.hpp"

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

// Makes a step with the sizes of the mechanism. projection: has the right sizes.
Step make_step(const Mechanism& mechanism, const Method& rk, ProjectionSolution projection);

// The upper half of k_i of a Rosenbrock method, from the lower halves of k_0..k_i.
inline void set_rosenbrock_rates(const Method& rk, int i, double h, const Eigen::VectorXd& y0, Eigen::MatrixXd& K) {
  const Eigen::Index n = y0.size() / 2;
  StageSum sum;
  for (int j = 0; j <= i; ++j) sum.add(h * rk.beta(i, j), K.col(j).data() + n);
  sum.to(y0.data() + n, K.col(i).data(), n);
}

// Stage states Y and the upper half (v) of their derivatives K, from the lower half (qdd) of K, for a group whose
// earlier stages are known:  V_i = v0 + h sum_j A_ij a_j,   Q_i = q0 + h sum_j A_ij V_j.
// In a Rosenbrock method V_j is not the upper half of k_j, which is v0 + h sum_l beta_jl a_l.
inline void set_group_stages(const Method& rk, const StageGroup& g, double h, const Eigen::VectorXd& y0,
                             Eigen::MatrixXd& Y, Eigen::MatrixXd& K) {
  const Eigen::Index n = y0.size() / 2;
  auto add_stages = [&](int i, Eigen::Index first) {
    StageSum sum;
    for (int j = 0; j <= g.last; ++j) sum.add(h * rk.a(i, j), K.col(j).data() + first);
    sum.to(y0.data() + first, Y.col(i).data() + first, n);
  };
  for (int i = g.first; i <= g.last; ++i) {
    add_stages(i, n);
    if (rk.gamma) {
      set_rosenbrock_rates(rk, i, h, y0, K);
    } else {
      K.col(i).head(n) = Y.col(i).tail(n);
    }
  }
  for (int i = g.first; i <= g.last; ++i) add_stages(i, 0);
}

// y(t + theta h) = y0 + h sum_i b_i(theta) k_i + blend(theta) (y1 - y_hat): the last term spreads the projection over
// the step. The output is continuous and ends at the projected state.
inline double projection_blend(double theta) { return theta * theta * (3 - 2 * theta); }

inline void dense_output(const Method& rk, const Step& step, double theta, Eigen::VectorXd& y) {
  y = step.y0 + projection_blend(theta) * (step.y1 - step.y_hat);
  StageSum sum;
  for (int i = 0; i < rk.dense_stages; ++i) sum.add(step.h * rk.dense_weight(i, theta), step.K.col(i).data());
  sum.to(y.data(), y.data(), y.size());
}

// Its derivative in t.
inline void dense_output_rate(const Method& rk, const Step& step, double theta, Eigen::VectorXd& ydot) {
  ydot = (6 * theta * (1 - theta) / step.h) * (step.y1 - step.y_hat);
  StageSum sum;
  for (int i = 0; i < rk.dense_stages; ++i) sum.add(rk.dense_weight_rate(i, theta), step.K.col(i).data());
  sum.to(ydot.data(), ydot.data(), ydot.size());
}

// The state at node m of a running cost, and its derivative in t.
inline void node_state(const Method& rk, const Step& step, int m, Eigen::VectorXd& y) {
  if (!rk.gamma) {
    y = step.Y.col(m);
    return;
  }
  StageSum sum;
  for (int i = 0; i < rk.stages; ++i) sum.add(step.h * rk.dense_weight(i, rk.node_c[m]), step.K.col(i).data());
  sum.to(step.y0.data(), y.data(), y.size());
}
inline void node_rate(const Method& rk, const Step& step, int m, Eigen::VectorXd& ydot) {
  if (!rk.gamma) {
    ydot = step.K.col(m);
    return;
  }
  ydot.setZero();
  StageSum sum;
  for (int i = 0; i < rk.stages; ++i) sum.add(rk.dense_weight_rate(i, rk.node_c[m]), step.K.col(i).data());
  sum.to(ydot.data(), ydot.data(), ydot.size());
}

}  // namespace mbsopt
