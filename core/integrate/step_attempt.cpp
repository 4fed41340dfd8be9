#include "core/integrate/step_attempt.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/integrate/model_choice.hpp"
#include "core/mechanism/followed_angles.hpp"
#include "core/mechanism/joint_graph.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/step/step_control.hpp"

namespace mbsopt {

StepAttempt::StepAttempt(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method)
    : mechanism_(mechanism),
      settings_(settings),
      rk_(method),
      tolerances_(mechanism.data(), settings.integrator),
      dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(make_projector(mechanism, settings.formulation.projection, model_of(mechanism, settings, method))),
      step_(make_step(mechanism, method, projector_->solution())) {
  const MechanismData& d = mechanism.data();
  const Eigen::Index states = mechanism.states();
  for (Eigen::VectorXd* x : {&work_, &ydot_, &y_stage_}) x->setZero(states);
  const bool constrained = settings.formulation.type == FormulationType::augmented_lagrangian && closes_loops(d);
  if (constrained && !rk_.implicit() && projector_->positions()) {
    response_.setZero(is_planar() ? static_cast<Eigen::Index>(d.planar->rows.size()) : d.m);
    no_parameters_ = block_without_parameters(d);
    for (LaneRows* x : {&error_lanes_, &projected_lanes_}) x->setZero(states, kLanes);
  }
  if (rk_.gamma) {
    rosenbrock_.emplace(mechanism, rk_, dynamics_);
  } else if (rk_.implicit()) {
    implicit_.emplace(mechanism, rk_, settings.integrator, dynamics_.in_space());
  }
}

bool StepAttempt::begin(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  step_.t = t;
  step_.y0 = y;
  step_.angles0 = angles;
  evaluations_ = 0;
  worst_of_rejected_ = 0;
  first_stage_known_ = false;
  if (!dynamics_.evaluate(t, step_.y0, step_.angles0, ydot_)) return false;
  if (implicit_) implicit_->begin(ydot_.tail(ydot_.size() / 2), dynamics_.lambda());
  accepted_residual_ = dynamics_.worst_residual();
  return true;
}

double StepAttempt::first_size(double span) {
  if (settings_.integrator.initial_step) return std::min(*settings_.integrator.initial_step, span);
  const Eigen::VectorXd& y0 = step_.y0;
  if (!dynamics_.evaluate(step_.t, y0, step_.angles0, ydot_)) return 1e-6 * span;
  ++evaluations_;
  const double d0 = scaled_norm(y0, y0, y0, tolerances_), d1 = scaled_norm(ydot_, y0, y0, tolerances_);
  const double h0 = std::min(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1, span);
  work_ = ydot_;
  y_stage_ = y0 + h0 * ydot_;
  if (!dynamics_.evaluate(step_.t + h0, y_stage_, step_.angles0, ydot_)) return 1e-3 * h0;
  ++evaluations_;
  work_ -= ydot_;
  const double d2 = scaled_norm(work_, y0, y0, tolerances_) / h0;
  const double largest = std::max(d1, d2);
  const double h1 = largest <= 1e-15 ? std::max(1e-6, 1e-3 * h0) : std::pow(0.01 / largest, 1.0 / (rk_.order + 1));
  return std::min(rounded_step(std::min(100 * h0, h1)), span);
}

bool StepAttempt::evaluate_stage(int i) {
  sum_stages(
      step_.K, i, [&](int j) { return step_.h * rk_.a(i, j); }, step_.y0, y_stage_);
  step_.Y.col(i) = y_stage_;
  ++evaluations_;
  if (!dynamics_.evaluate(step_.t + rk_.c[i] * step_.h, y_stage_, step_.angles0, step_.K.col(i))) return false;
  step_.lambda.col(i) = dynamics_.lambda();
  return true;
}

// All stages but those of dense output.
bool StepAttempt::solve_stages(ImplicitStages::Goal goal) {
  if (rosenbrock_) {
    first_stage_known_ = first_stage_known_ || rosenbrock_->begin(step_);
    return first_stage_known_ && rosenbrock_->solve(step_);
  }
  if (implicit_) implicit_->new_attempt();
  for (const StageGroup& g : rk_.stage_groups_of_step()) {
    if (is_implicit(rk_, g)) {
      if (!implicit_->solve(step_, g, goal)) return false;
    } else if (g.first > 0 || !first_stage_known_) {
      if (!evaluate_stage(g.first)) return false;
      first_stage_known_ = true;  // at this start, whatever h
    }
  }
  return true;
}

double StepAttempt::norm_of_work() const { return scaled_norm(work_, step_.y0, step_.y_hat, tolerances_); }

// norm(): of the estimate in work_.
template <class Norm>
double StepAttempt::error_by(Norm&& norm) {
  const auto estimate = [&](const double* weights) {
    work_.setZero();
    add_stages(
        step_.K, rk_.stages, [&](int i) { return step_.h * weights[i]; }, work_);
    return norm();
  };
  const double high = estimate(rk_.error);
  return rk_.error_low ? combined_error(high, estimate(rk_.error_low)) : high;
}

double StepAttempt::error_of_step() {
  return error_by(
      [&] { return rk_.error_filter != 0 && !implicit_->filter(step_, work_) ? double(INFINITY) : norm_of_work(); });
}

// The error after projection. Next to a singular position most of the error is magnified rounding. The constraints hold
// again in its directions at the end of the step.
double StepAttempt::error_after_projection() {
  const double t1 = step_.t + step_.h;
  if (!projector_->project(t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) return INFINITY;
  if (!projector_->linearise(t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) return INFINITY;
  return error_by([&] {
    error_lanes_.col(0) = work_;
    projector_->tangent(no_parameters_, error_lanes_, projected_lanes_);
    work_ = projected_lanes_.col(0);
    return norm_of_work();
  });
}

StepAttempt::Solved StepAttempt::solve(double h, StepGoal goal, bool near_singular) {
  using Goal = ImplicitStages::Goal;
  const Goal of_stages = goal == StepGoal::fixed ? Goal::rounding : Goal::tolerance;
  step_.h = h;
  bool solved = solve_stages(of_stages);
  if (!solved && implicit_ && implicit_->stale()) {
    implicit_->renew();
    solved = solve_stages(of_stages);
  }
  if (!solved) return {implicit_ ? StepOutcome::unsolved : StepOutcome::failed};
  set_y_hat();
  if (goal == StepGoal::fixed) return {step_.y_hat.allFinite() ? StepOutcome::accepted : StepOutcome::failed};
  double error = error_of_step();
  if (!std::isfinite(error)) return {StepOutcome::failed, error};
  projected_error_ = 0;
  if (error > 1 && near_singular) projected_error_ = std::exchange(error, std::min(error, error_after_projection()));
  if (error > 1) return {StepOutcome::rejected, error};
  if (implicit_ && goal == StepGoal::derivatives) {
    if (!solve_stages(Goal::polish)) return {StepOutcome::unsolved, error};
    set_y_hat();
  }
  return {StepOutcome::accepted, error};
}

double StepAttempt::change_by(double at, double beside, double duration) {
  y_stage_ = step_.y0 + (at - step_.t) / step_.h * (step_.y_hat - step_.y0);
  evaluations_ += 2;
  if (!dynamics_.evaluate(beside, y_stage_, step_.angles0, work_)) return 0;
  if (!dynamics_.evaluate(at, y_stage_, step_.angles0, ydot_)) return 0;
  work_ = duration * (ydot_ - work_);
  return norm_of_work();
}

void StepAttempt::set_y_hat() {
  sum_stages(
      step_.K, rk_.stages, [&](int i) { return step_.h * rk_.b[i]; }, step_.y0, step_.y_hat);
}

StepOutcome StepAttempt::finish(double t1, bool dense) {
  step_.t1 = t1;
  step_.dense = dense;
  if (dense) {
    for (int i = rk_.stages; i < rk_.dense_stages; ++i) {
      if (!evaluate_stage(i)) return StepOutcome::failed;
    }
  }
  if (!projector_->active()) {
    step_.y1 = step_.y_hat;
  } else if (!projector_->project(t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) {
    return StepOutcome::off_constraints;
  }
  step_.angles1 = step_.angles0;
  continue_angles(mechanism_.data(), step_.y1, step_.angles1);
  return StepOutcome::accepted;
}

const Eigen::VectorXd& StepAttempt::response() {
  projector_->response(response_);
  return response_;
}

void StepAttempt::reject() {
  worst_of_rejected_ = std::max(worst_of_rejected_, dynamics_.worst_residual());
  dynamics_.set_worst_residual(accepted_residual_);
}

void StepAttempt::advance(double t) {
  accepted_residual_ = dynamics_.worst_residual();
  if (implicit_) implicit_->accept(step_);
  step_.t = t;
  step_.y0 = step_.y1;
  step_.angles0 = step_.angles1;
  first_stage_known_ = false;
}

std::optional<double> StepAttempt::strike(Switches& switches, std::size_t limit) {
  Impact impact;
  if (!set_impact(switches, limit, dynamics_, {step_.t, step_.y0, step_.angles0}, impact)) return std::nullopt;
  step_.y0 = impact.after;
  return impact.Ln;
}

void StepAttempt::restart() {
  first_stage_known_ = false;
  if (!implicit_ || !dynamics_.evaluate(step_.t, step_.y0, step_.angles0, ydot_)) return;
  ++evaluations_;
  implicit_->begin(ydot_.tail(ydot_.size() / 2), dynamics_.lambda());
}

void StepAttempt::add_to(SimulationStatistics& s) const {
  s.rhs_evaluations += evaluations_;
  s.linear_solves += evaluations_;
  if (implicit_) implicit_->add_to(s);
  if (rosenbrock_) rosenbrock_->add_to(s);
  s.factor_blocks = dynamics_.factor_blocks();
  s.factorisations += dynamics_.factorisations() + projector_->factorisations();
}

}  // namespace mbsopt
