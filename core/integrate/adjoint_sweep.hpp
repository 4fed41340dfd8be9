// Discrete adjoint: the transpose of the tangent-linear sweep, steps and stages in reverse. For explicit stages
//
//   lambda at y1 -> projection' -> lambda^ at y^
//   kbar_i = h b_i lambda^ + h sum_{j>i} A_ji ybar_j,      ybar_i = f_y(Y_i)' kbar_i + h b_i g_y(Y_i)
//   lambda at y0 = lambda^ + sum_i ybar_i,                 mu += sum_i (f_rho' kbar_i + h b_i g_rho)
// Samples inside the step enter through the dense output's weights. One backward sweep serves all objectives: they
// share the factor of each stage.
#pragma once

#include "core/integrate/sweep.hpp"
#include "core/step/stored_step.hpp"

namespace mbsopt {

class AdjointSweep : public Sweep {
 public:
  // Starts at the end (AdjInit): lambda and mu from the terminal costs.
  AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
               std::span<const Cost> costs, bool watched, const StatePoint& end);

  bool step_back(const StoredStep& step);
  // Moves the cotangents from after an event to before it (sweep.hpp).
  void cross_back(Switches& switches, const SwitchEvent& event, std::size_t first, const StatePoint& at);
  // lambda at the current time, 14n x objectives; and d psi/d rho of all that was swept, parameters x objectives
  // (without the dependence of the initial state).
  Eigen::MatrixXd lambda() const;
  Eigen::MatrixXd mu() const;

  // The largest change of an objective by a change of the state, both relative, over all steps.
  double magnification(const Eigen::VectorXd& psi) const;

 private:
  void cross_limit_back(Switches& switches, const SwitchEvent& event, const StatePoint& at);
  // The cotangents of one objective.
  struct Bars {
    Eigen::Index objective;
    Eigen::VectorXd lambda, lambda_hat;  // at y1, from there on at y0; at y^
    Eigen::VectorXd theta, rho;          // of all that was swept
    Eigen::VectorXd samples;             // what samples in the step see of y0
    Eigen::VectorXd start, common;       // of f(t0, y0); of D(h, h k_0) there: by a Rosenbrock method
    double largest = 0;                  // of sum_i |lambda_i y_i| over all steps
    Eigen::MatrixXd K;                   // of the stages' derivatives, without what explicit stages after them see
    Eigen::MatrixXd Y;                   // of the stages; those of implicit groups are used up within their group
  };

  void rebuild(const StoredStep& step);
  void sample_back(const StoredStep& step);
  bool stages_back();
  bool explicit_back(int i);
  bool implicit_back(const StageGroup& group);
  bool rosenbrock_back();
  void nodes_back();
  // Adds the gradient of the running cost at a node, whose state is y_, to y_bar_ and the objective's rho.
  void add_running_cost(Bars& b, int node);

  Step step_;                        // in hand
  std::vector<int> explicit_swept_;  // its explicit stages whose bars are known
  std::vector<Bars> bars_;           // per objective
  Eigen::MatrixXd x_bar_;
  Eigen::VectorXd w_, y_bar_, r_bar_;
};

}  // namespace mbsopt
