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
#include "core/integrate/cost.hpp"
#include "core/integrate/linearised_stages.hpp"
#include "core/integrate/sample_schedule.hpp"
#include "core/integrate/step.hpp"

namespace mbsopt {

// What a backward sweep keeps of a step; stages are rebuilt from their accelerations.
struct StoredStep {
  double t = 0, h = 0, t1 = 0;
  bool dense = false;
  Eigen::VectorXd y0, y_hat, y1, angles0;
  Eigen::MatrixXd a;  // qddot of each stage, 7n x stages
  Eigen::MatrixXd lambda;
  ProjectionSolution projection;
  std::vector<SampleEvent> samples;  // of costs

  StoredStep(const Step& step, const Method& rk, std::span<const SampleEvent> events);
  std::size_t bytes() const;
};

class AdjointSweep {
 public:
  AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
               std::span<const Cost> costs);

  // Where the sweep starts (AdjInit): lambda and mu from the terminal costs.
  void begin(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
  bool step_back(const StoredStep& step);
  // lambda at the current time, 14n x objectives; and d psi/d rho of all that was swept, parameters x objectives
  // (without the dependence of the initial state).
  const Eigen::MatrixXd& lambda() const { return lambda_; }
  Eigen::MatrixXd mu() const;

  long linearised_states() const { return dynamics_.linearised_states(); }
  long factorisations() {
    return dynamics_.factorisations() + projector_.factorisations() + (implicit_ ? implicit_->factorisations() : 0);
  }

 private:
  void rebuild(const StoredStep& step);
  bool explicit_back(const StoredStep& step, int i);
  bool implicit_back(const StoredStep& step, const StageGroup& group);

  const Mechanism mechanism_;
  const Method& rk_;
  std::span<const Cost> costs_;
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  Dynamics dynamics_;
  Projector projector_;
  std::optional<LinearisedStages> implicit_;
  Eigen::MatrixXd lambda_, theta_bar_, rho_bar_;  // a column per objective
  Eigen::MatrixXd Y_, K_;                         // stages of the step in hand
  std::vector<Eigen::MatrixXd> K_bar_;            // per objective
  std::vector<Eigen::MatrixXd> Y_bar_;            // the same, of coupled stages
  Eigen::MatrixXd lambda_hat_, sample_bar_, x_bar_;
  Eigen::VectorXd y_, w_, y_bar_, theta_, rho_, r_bar_;
};

}  // namespace mbsopt
