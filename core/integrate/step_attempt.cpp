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

StepAttempt::StepAttempt(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                         const ComponentTolerances& tolerances)
    : dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(make_projector(mechanism, settings.formulation.projection, model_of(mechanism, settings, method))),
      step_(make_step(mechanism, method, projector_->solution())),
      data_(mechanism.data()),
      rk_(method),
      tolerances_(tolerances) {
  const Eigen::Index states = mechanism.states();
  for (Eigen::VectorXd* x : {&work_, &ydot_, &y_stage_}) x->setZero(states);
  const bool constrained = settings.formulation.type == FormulationType::augmented_lagrangian && closes_loops(data_);
  if (constrained && !rk_.implicit() && projector_->positions()) {
    const bool planar = model_of(mechanism, settings, method) == Model::planar;
    response_.setZero(planar ? static_cast<Eigen::Index>(data_.planar->rows.size()) : data_.m);
    passage_.emplace(rk_, response_.size());
    no_parameters_ = block_without_parameters(data_);
    for (LaneRows* x : {&error_, &projected_error_}) x->setZero(states, kLanes);
  }
  if (rk_.gamma) {
    rosenbrock_.emplace(mechanism, rk_, dynamics_);
  } else if (rk_.implicit()) {
    implicit_.emplace(mechanism, rk_, settings.integrator, dynamics_.in_space());
  }
}

void StepAttempt::start_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  step_.t = t, step_.y0 = y, step_.angles0 = angles;
}

bool StepAttempt::begin() {
  evaluations_ = 0;
  first_stage_known_ = false;
  if (!dynamics_.evaluate(step_.t, step_.y0, step_.angles0, ydot_)) return false;
  if (implicit_) implicit_->begin(ydot_.tail(ydot_.size() / 2), dynamics_.lambda());
  return true;
}

double StepAttempt::first_step(const IntegratorSettings& s, double span) {
  if (s.initial_step) return std::min(*s.initial_step, span);
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
  StageSum sum;
  for (int j = 0; j < i; ++j) sum.add(step_.h * rk_.a(i, j), step_.K.col(j).data());
  sum.to(step_.y0.data(), y_stage_.data(), y_stage_.size());
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

double StepAttempt::error_of_step() {
  auto norm = [&](const double* weights) {
    work_.setZero();
    StageSum sum;
    for (int i = 0; i < rk_.stages; ++i) sum.add(step_.h * weights[i], step_.K.col(i).data());
    sum.to(work_.data(), work_.data(), work_.size());
    if (rk_.error_filter != 0 && !implicit_->filter(step_, work_)) return double(INFINITY);
    return scaled_norm(work_, step_.y0, step_.y_hat, tolerances_);
  };
  const double high = norm(rk_.error);
  return rk_.error_low ? combined_error(high, norm(rk_.error_low)) : high;
}

// The error after projection. Next to a singular position most of the error is magnified rounding. The constraints hold
// again in its directions at the end of the step.
double StepAttempt::error_after_projection() {
  const double t1 = step_.t + step_.h;
  if (!projector_->project(t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) return INFINITY;
  if (!projector_->linearise(t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) return INFINITY;
  const double* weights[2] = {rk_.error, rk_.error_low};
  for (int k = 0; k < 2; ++k) {
    if (!weights[k]) continue;
    work_.setZero();
    StageSum sum;
    for (int i = 0; i < rk_.stages; ++i) sum.add(step_.h * weights[k][i], step_.K.col(i).data());
    sum.to(work_.data(), work_.data(), work_.size());
    error_.col(k) = work_;
  }
  projector_->tangent(no_parameters_, error_, projected_error_);
  auto norm = [&](int k) {
    work_ = projected_error_.col(k);
    return scaled_norm(work_, step_.y0, step_.y_hat, tolerances_);
  };
  return rk_.error_low ? combined_error(norm(0), norm(1)) : norm(0);
}

bool StepAttempt::better_placed_by(double wanted, double largest) {
  projector_->response(response_);
  if (passage_->well_placed(step_.t, step_.h, wanted, largest, response_)) return false;
  return std::abs(passage_->propose(step_.t, wanted, largest) - step_.h) > 0.02 * step_.h;
}

StepOutcome StepAttempt::solve(double h, bool adaptive, bool exact, double& error) {
  using Goal = ImplicitStages::Goal;
  step_.h = h;
  const Goal goal = adaptive ? Goal::tolerance : Goal::rounding;
  bool solved = solve_stages(goal);
  if (!solved && implicit_ && implicit_->stale()) {
    implicit_->renew();
    solved = solve_stages(goal);
  }
  if (!solved) return implicit_ ? StepOutcome::unsolved : StepOutcome::failed;
  set_y_hat();
  error = 0;
  if (!adaptive) return step_.y_hat.allFinite() ? StepOutcome::accepted : StepOutcome::failed;
  error = error_of_step();
  if (!std::isfinite(error)) return StepOutcome::failed;
  projected_out_ = 0;
  if (error > 1 && passage_ && passage_->near(step_.t, h))
    projected_out_ = std::exchange(error, std::min(error, error_after_projection()));
  if (error > 1) return StepOutcome::rejected;
  if (implicit_ && exact) {
    if (!solve_stages(Goal::polish)) return StepOutcome::unsolved;
    set_y_hat();
  }
  return StepOutcome::accepted;
}

double StepAttempt::change_by(double at, double beside, double duration) {
  y_stage_ = step_.y0 + (at - step_.t) / step_.h * (step_.y_hat - step_.y0);
  evaluations_ += 2;
  if (!dynamics_.evaluate(beside, y_stage_, step_.angles0, work_)) return 0;
  if (!dynamics_.evaluate(at, y_stage_, step_.angles0, ydot_)) return 0;
  work_ = duration * (ydot_ - work_);
  return scaled_norm(work_, step_.y0, step_.y_hat, tolerances_);
}

void StepAttempt::set_y_hat() {
  StageSum sum;
  for (int i = 0; i < rk_.stages; ++i) sum.add(step_.h * rk_.b[i], step_.K.col(i).data());
  sum.to(step_.y0.data(), step_.y_hat.data(), step_.y_hat.size());
}

StepOutcome StepAttempt::finish(double t1, bool dense) {
  step_.t1 = t1;
  step_.dense = dense;
  if (dense) {
    for (int i = rk_.stages; i < rk_.dense_stages; ++i) {
      if (!evaluate_stage(i)) return StepOutcome::failed;
    }
  }
  if (projector_->active()) {
    if (!projector_->project(t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) {
      return StepOutcome::off_constraints;
    }
  } else {
    step_.y1 = step_.y_hat;
  }
  step_.angles1 = step_.angles0;
  continue_angles(data_, step_.y1, step_.angles1);
  return StepOutcome::accepted;
}

void StepAttempt::accept() {
  if (implicit_) implicit_->accept(step_);
}

void StepAttempt::advance(double t) {
  step_.t = t;
  step_.y0 = step_.y1;
  step_.angles0 = step_.angles1;
  first_stage_known_ = false;
}

void StepAttempt::restart() {
  if (!implicit_ || !dynamics_.evaluate(step_.t, step_.y0, step_.angles0, ydot_)) return;
  ++evaluations_;
  implicit_->begin(ydot_.tail(ydot_.size() / 2), dynamics_.lambda());
}

void StepAttempt::add_counts(SimulationStatistics& s) const {
  s.rhs_evaluations += evaluations_;
  s.linear_solves += evaluations_;
  if (implicit_) {
    s.rhs_evaluations += implicit_->evaluations();
    s.newton_iterations += implicit_->iterations();
    s.linear_solves += implicit_->solves();
    s.linearised_states += implicit_->places();
    s.jacobians += implicit_->jacobians();
    s.factorisations += implicit_->factorisations();
  }
  if (rosenbrock_) {
    s.rhs_evaluations += rosenbrock_->evaluations();
    s.linear_solves += rosenbrock_->evaluations() + rosenbrock_->solves();
    s.jacobians += rosenbrock_->jacobians();
    s.factorisations += rosenbrock_->factorisations();
  }
  s.factor_blocks = dynamics_.factor_blocks();
  s.factorisations += dynamics_.factorisations() + projector_->factorisations();
}

}  // namespace mbsopt
