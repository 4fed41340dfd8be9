// Discrete adjoint: the transpose of the tangent-linear sweep, steps and stages in reverse. For explicit stages
//
//   lambda at y1 -> projection' -> lambda^ at y^
//   kbar_i = h b_i lambda^ + h sum_{j>i} A_ji ybar_j,      ybar_i = f_y(Y_i)' kbar_i + h b_i g_y(Y_i)
//   lambda at y0 = lambda^ + sum_i ybar_i,                 mu += sum_i (f_rho' kbar_i + h b_i g_rho)
// Samples inside the step enter through the dense output's weights. One backward sweep serves all objectives: they
// share the factor of each stage.
#pragma once

#include <optional>

#include "core/dynamics/dynamics.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/integrate/gradient_quadrature.hpp"
#include "core/run/cost.hpp"
#include "core/step/linearised_stages.hpp"
#include "core/step/rosenbrock_stages.hpp"
#include "core/step/stored_step.hpp"

namespace mbsopt {

class AdjointSweep {
 public:
  // watch: gets the gradients of running costs; may be null.
  AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
               std::span<const Cost> costs, GradientQuadrature* watch);

  // Where the sweep starts (AdjInit): lambda and mu from the terminal costs.
  void begin(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  bool step_back(const StoredStep& step);
  // lambda at the current time, 14n x objectives; and d psi/d rho of all that was swept, parameters x objectives
  // (without the dependence of the initial state).
  Eigen::MatrixXd lambda() const;
  Eigen::MatrixXd mu() const;

  // The largest change of an objective by a change of the state, both relative, over all steps.
  double magnification(const Eigen::VectorXd& psi) const;

  long linearised_states() const {
    return dynamics_.linearised_states() + (equations_ ? equations_->places() : 0) +
           (rosenbrock_ ? rosenbrock_->linearised_states() : 0);
  }
  long factorisations() {
    return dynamics_.factorisations() + projector_->factorisations() + (implicit_ ? implicit_->factorisations() : 0) +
           (rosenbrock_ ? rosenbrock_->factorisations() : 0);
  }

 private:
  // The cotangents of one objective.
  struct Bars {
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
  bool explicit_back(int i);
  bool implicit_back(const StageGroup& group);
  bool rosenbrock_back();
  void nodes_back();
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }
  // The gradient of the running cost at a node, whose state is y_, into y_bar_ and the objective's rho.
  void add_running_cost(std::size_t objective, int node);

  const Mechanism mechanism_;
  const Method& rk_;
  std::span<const Cost> costs_;
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  Dynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  std::optional<StageEquations> equations_;  // of implicit stages
  std::optional<LinearisedStages> implicit_;
  std::optional<RosenbrockStages> rosenbrock_;
  Step step_;                        // in hand
  std::vector<int> explicit_swept_;  // its explicit stages whose bars are known
  std::vector<Bars> bars_;           // per objective
  Eigen::MatrixXd x_bar_;
  Eigen::VectorXd y_, ydot_, w_, y_bar_, r_bar_;
  Eigen::VectorXd g_y_, g_rho_;  // of a running cost, times its weight
  GradientQuadrature* watch_;
};

}  // namespace mbsopt
