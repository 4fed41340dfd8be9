// One accepted step, with everything that dense output and the derivative sweeps read.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/projection/projection.hpp"
#include "core/tableau/method.hpp"
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

// y = y0 + sum_{i < stages} c(i) k_i, of `size` numbers from row `first` of K on.
template <class Coefficient>
void sum_stages(const Eigen::MatrixXd& K, int stages, Coefficient&& c, const double* y0, double* y, Eigen::Index size,
                Eigen::Index first = 0) {
  StageSum sum;
  for (int i = 0; i < stages; ++i) sum.add(c(i), K.col(i).data() + first);
  sum.to(y0, y, size);
}
// The same of whole states.
template <class Coefficient>
void sum_stages(const Eigen::MatrixXd& K, int stages, Coefficient&& c, const Eigen::VectorXd& y0, Eigen::VectorXd& y) {
  sum_stages(K, stages, c, y0.data(), y.data(), y.size());
}
// y += sum_{i < stages} c(i) k_i
template <class Coefficient>
void add_stages(const Eigen::MatrixXd& K, int stages, Coefficient&& c, Eigen::VectorXd& y) {
  sum_stages(K, stages, c, y, y);
}

// The upper half of k_i of a Rosenbrock method, from the lower halves of k_0..k_i.
inline void set_rosenbrock_rates(const Method& rk, int i, double h, const Eigen::VectorXd& y0, Eigen::MatrixXd& K) {
  const Eigen::Index n = y0.size() / 2;
  sum_stages(
      K, i + 1, [&](int j) { return h * rk.beta(i, j); }, y0.data() + n, K.col(i).data(), n, n);
}

// Stage states Y and the upper half (v) of their derivatives K, from the lower half (qdd) of K, for a group whose
// earlier stages are known:  V_i = v0 + h sum_j A_ij a_j,   Q_i = q0 + h sum_j A_ij V_j.
// In a Rosenbrock method V_j is not the upper half of k_j, which is v0 + h sum_l beta_jl a_l.
inline void set_group_stages(const Method& rk, const StageGroup& g, double h, const Eigen::VectorXd& y0,
                             Eigen::MatrixXd& Y, Eigen::MatrixXd& K) {
  const Eigen::Index n = y0.size() / 2;
  const auto set_half = [&](int i, Eigen::Index first) {
    const auto c = [&](int j) { return h * rk.a(i, j); };
    sum_stages(K, g.last + 1, c, y0.data() + first, Y.col(i).data() + first, n, first);
  };
  for (int i = g.first; i <= g.last; ++i) {
    set_half(i, n);
    if (rk.gamma) {
      set_rosenbrock_rates(rk, i, h, y0, K);
    } else {
      K.col(i).head(n) = Y.col(i).tail(n);
    }
  }
  for (int i = g.first; i <= g.last; ++i) set_half(i, 0);
}

// y(t + theta h) = y0 + h sum_i b_i(theta) k_i + blend(theta) (y1 - y_hat): the last term spreads the projection over
// the step. The output is continuous and ends at the projected state.
inline double projection_blend(double theta) { return theta * theta * (3 - 2 * theta); }

inline void dense_output(const Method& rk, const Step& step, double theta, Eigen::VectorXd& y) {
  y = step.y0 + projection_blend(theta) * (step.y1 - step.y_hat);
  add_stages(
      step.K, rk.dense_stages, [&](int i) { return step.h * rk.dense_weight(i, theta); }, y);
}

// Its derivative in t.
inline void dense_output_rate(const Method& rk, const Step& step, double theta, Eigen::VectorXd& ydot) {
  ydot = (6 * theta * (1 - theta) / step.h) * (step.y1 - step.y_hat);
  add_stages(
      step.K, rk.dense_stages, [&](int i) { return rk.dense_weight_rate(i, theta); }, ydot);
}

// The state at node m of a running cost, and its derivative in t.
inline void node_state(const Method& rk, const Step& step, int m, Eigen::VectorXd& y) {
  if (!rk.gamma) {
    y = step.Y.col(m);
    return;
  }
  sum_stages(
      step.K, rk.stages, [&](int i) { return step.h * rk.dense_weight(i, rk.node_c[m]); }, step.y0, y);
}
inline void node_rate(const Method& rk, const Step& step, int m, Eigen::VectorXd& ydot) {
  if (!rk.gamma) {
    ydot = step.K.col(m);
    return;
  }
  ydot.setZero();
  add_stages(
      step.K, rk.stages, [&](int i) { return rk.dense_weight_rate(i, rk.node_c[m]); }, ydot);
}

}  // namespace mbsopt
