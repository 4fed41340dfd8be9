// Solves the coupled stages of an implicit Runge-Kutta step in their accelerations a_i and multipliers lambda_i, by
// simplified Newton iterations. One Jacobian, that of a step's start, serves as long as the iterations converge. Each
// step size and distinct block of the tableau has one factor. If a stiff direction turns within the step, each stage
// gets its own Jacobian for some steps.
//
//   V_i = v0 + h sum_j A_ij a_j,   Q_i = q0 + h sum_j A_ij V_j,   r(t_i, Q_i, V_i, a_i, lambda_i) = 0
//
// Convergence test: Hairer and Wanner, "Solving Ordinary Differential Equations II" (1996), section IV.8. An adaptive
// run stops at a fraction of its tolerance. For derivatives it polishes the stages of accepted steps to 1e-12 of the
// state. With fixed or given steps it solves the stages to rounding, so that differences of runs over the same steps
// mean something.
#pragma once

#include <vector>

#include "core/body/state_layout.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"
#include "core/step/shifted_system.hpp"
#include "core/step/step.hpp"
#include "core/tableau/method.hpp"

namespace mbsopt {

class ImplicitStages {
 public:
  ImplicitStages(const Mechanism& mechanism, const Method& method, const IntegratorSettings& settings,
                 SpatialDynamics& dynamics);

  // The motion at the start of the run: a, lambda at step.y0.
  void begin(const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::VectorXd& lambda);
  // Before each attempt at a step.
  void new_attempt() { present_.count = 0; }
  // Solves the stages of a group; earlier groups are solved. False: no convergence.
  enum class Goal {
    tolerance,  // a fraction of it, from a guess
    rounding,   // from a guess
    polish      // to 1e-12 of the state, from stages that are solved to a tolerance
  };
  bool solve(Step& step, const StageGroup& group, Goal goal);
  // error = (I - h error_filter f_y)^-1 error
  bool filter(const Step& step, Eigen::VectorXd& error);
  // After an accepted step.
  void accept(const Step& step);

  // Returns whether a failure may be cured at the same step size, by a new Jacobian.
  bool stale() const { return age_ > 0 && own_steps_ == 0; }
  void renew() { renew_ = true; }
  // Fastest contraction is left alone while the step changes by less than this.
  static constexpr double kKeepStep = 1.2;

  void add_to(SimulationStatistics& statistics) const;  // the work so far

 private:
  struct Matrix {  // of one distinct block of A
    Eigen::MatrixXd A;
    StageMatrix matrix;
    double h = 0;
    long jacobian = -1;
  };
  struct Point {  // of the past, for the first guess
    double t = 0;
    Eigen::VectorXd x;  // (a, lambda)
  };
  struct Points {
    std::vector<Point> places;  // room for all stages
    std::size_t count = 0;
  };

  bool ready(const Step& step, Matrix& m);
  void evaluate_jacobian(const Step& step);
  void predict(const Step& step, int stage, Eigen::Ref<Eigen::VectorXd> x) const;
  void set_stages(Step& step, const StageGroup& group);
  bool linearise_stages(const Step& step, const StageGroup& group, Matrix& m);
  bool evaluate_residuals(Step& step, const StageGroup& group);
  double add_change(const Step& step, const StageGroup& group, const Matrix& m, bool exact);
  bool iterate(Step& step, const StageGroup& group, Matrix& m, Goal goal, bool own);
  enum class Convergence { reached, ahead, lost };
  // Judges an iteration that changes the stages by `now`, after one that changed them by `before` with the same matrix
  // (infinite: there is none). `left` more are allowed.
  Convergence judged(double now, double before, long left, Goal goal, bool own);

  const MechanismData& data_;
  const StateLayout layout_;
  const Method& rk_;
  IntegratorSettings settings_;
  ComponentTolerances tolerances_;
  ShiftedSystem start_;                             // linearised at a step's start; the filter solves with it
  std::vector<MotionJacobian::Values> own_values_;  // per stage of a group
  std::vector<Matrix> matrices_;
  std::vector<int> matrix_of_;  // per group, in order

  Eigen::VectorXd a_start_, lambda_start_;
  Points past_, present_;  // of the last accepted step; of the attempt in hand
  Eigen::MatrixXd x_, r_, change_;
  Eigen::VectorXd y_;
  double rate_ = 1;  // of the last iteration
  bool renew_ = true;
  long age_ = 0;       // steps since the Jacobian was taken
  int own_steps_ = 0;  // for which each stage still gets a Jacobian of its own
  long evaluations_ = 0, jacobians_ = 0, own_jacobians_ = 0, iterations_ = 0, filters_ = 0;
};

}  // namespace mbsopt
