#include "core/integrate/runge_kutta_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/body/euler_parameters.hpp"
#include "core/integrate/model_choice.hpp"
#include "core/mechanism/joint_graph.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/run/kinks.hpp"
#include "core/sensor/body_at.hpp"
#include "core/step/event_times.hpp"
#include "core/step/kink_times.hpp"
#include "core/step/step_control.hpp"
#include "core/watch/start_failure.hpp"
#include "core/watch/stiffness.hpp"
#include "core/watch/weak_joints.hpp"

namespace mbsopt {
namespace {

constexpr double kMostSteps = 1e10;
constexpr double kPartsOfPlaced = 1000;  // of rounded_step(): a thousandth moves a stage by less than matters

}  // namespace

RungeKuttaRun::RungeKuttaRun(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                             std::span<const Cost> costs)
    : mechanism_(mechanism),
      settings_(settings),
      rk_(method),
      kinks_(kinks_of(mechanism, costs)),
      tolerances_(mechanism.data(), settings.integrator),
      dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(make_projector(mechanism, settings.formulation.projection, model_of(mechanism, settings, method))),
      guard_(mechanism_.data()),
      step_(make_step(mechanism, rk_, projector_->solution())) {
  const Eigen::Index states = mechanism.states();
  angles_.setZero(static_cast<Eigen::Index>(mechanism.data().angles.size()));
  for (Eigen::VectorXd* x : {&work_, &ydot_, &y_stage_}) x->setZero(states);
  const bool constrained =
      settings.formulation.type == FormulationType::augmented_lagrangian && closes_loops(mechanism.data());
  if (constrained && !rk_.implicit() && projector_->positions()) {
    const bool planar = model_of(mechanism, settings, method) == Model::planar;
    const MechanismData& data = mechanism.data();
    response_.setZero(planar ? static_cast<Eigen::Index>(data.planar->rows.size()) : data.m);
    passage_.emplace(rk_, response_.size());
    no_parameters_ = block_without_parameters(mechanism_.data());
    for (LaneRows* x : {&error_, &projected_error_}) x->setZero(states, kLanes);
  }
  if (rk_.gamma) {
    rosenbrock_.emplace(mechanism_, rk_, dynamics_);
  } else if (rk_.implicit()) {
    implicit_.emplace(mechanism_, rk_, settings_.integrator, dynamics_.in_space());
  }
}

// Hairer, Norsett, Wanner I, section II.4, "Starting step size"; step_.y0 is the initial state.
double RungeKuttaRun::first_step(const IntegratorSettings& s, double span) {
  if (s.initial_step) return std::min(*s.initial_step, span);
  const Eigen::VectorXd& y0 = step_.y0;
  if (!dynamics_.evaluate(step_.t, y0, angles_, ydot_)) return 1e-6 * span;
  ++evaluations_;
  const double d0 = scaled_norm(y0, y0, y0, tolerances_), d1 = scaled_norm(ydot_, y0, y0, tolerances_);
  const double h0 = std::min(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1, span);
  work_ = ydot_;
  y_stage_ = y0 + h0 * ydot_;
  if (!dynamics_.evaluate(step_.t + h0, y_stage_, angles_, ydot_)) return 1e-3 * h0;
  ++evaluations_;
  work_ -= ydot_;
  const double d2 = scaled_norm(work_, y0, y0, tolerances_) / h0;
  const double largest = std::max(d1, d2);
  const double h1 = largest <= 1e-15 ? std::max(1e-6, 1e-3 * h0) : std::pow(0.01 / largest, 1.0 / (rk_.order + 1));
  return std::min(rounded_step(std::min(100 * h0, h1)), span);
}

// Never beyond the end; an adaptive run does not leave a tiny last step.
double RungeKuttaRun::propose_step(double t, double h, double end, bool adaptive) const {
  const double left = end - t;
  if (h >= left * (1 - 1e-9)) return left;
  return adaptive && 2 * h > left ? 0.5 * left : h;
}

bool RungeKuttaRun::evaluate_stage(int i) {
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
bool RungeKuttaRun::solve_stages(ImplicitStages::Goal goal) {
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

double RungeKuttaRun::error_of_step() {
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

// The error after projection: next to a singular position rounding, magnified, is most of it, in directions
// that the constraints hold again where the step ends.
double RungeKuttaRun::error_after_projection() {
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

// Whether a step of another size, of `wanted` as far as the singular position allows, is to be tried in its place.
bool RungeKuttaRun::better_placed_by(double wanted, double largest) {
  projector_->response(response_);
  if (passage_->well_placed(step_.t, step_.h, wanted, largest, response_)) return false;
  return std::abs(passage_->propose(step_.t, wanted, largest) - step_.h) > 0.02 * step_.h;
}

RungeKuttaRun::Outcome RungeKuttaRun::attempt(double h, bool adaptive, bool exact, double& error) {
  using Goal = ImplicitStages::Goal;
  step_.h = h;
  const Goal goal = adaptive ? Goal::tolerance : Goal::rounding;
  bool solved = solve_stages(goal);
  if (!solved && implicit_ && implicit_->stale()) {
    implicit_->renew();
    solved = solve_stages(goal);
  }
  if (!solved) return implicit_ ? Outcome::unsolved : Outcome::failed;
  set_y_hat();
  error = 0;
  if (!adaptive) return step_.y_hat.allFinite() ? Outcome::accepted : Outcome::failed;
  error = error_of_step();
  if (!std::isfinite(error)) return Outcome::failed;
  projected_out_ = 0;
  if (error > 1 && passage_ && passage_->near(step_.t, h))
    projected_out_ = std::exchange(error, std::min(error, error_after_projection()));
  if (error > 1) return Outcome::rejected;
  if (implicit_ && exact) {
    if (!solve_stages(Goal::polish)) return Outcome::unsolved;
    set_y_hat();
  }
  return Outcome::accepted;
}

void RungeKuttaRun::set_y_hat() {
  StageSum sum;
  for (int i = 0; i < rk_.stages; ++i) sum.add(step_.h * rk_.b[i], step_.K.col(i).data());
  sum.to(step_.y0.data(), step_.y_hat.data(), step_.y_hat.size());
}

RungeKuttaRun::Outcome RungeKuttaRun::finish_step(bool dense) {
  step_.dense = dense;
  if (dense) {
    for (int i = rk_.stages; i < rk_.dense_stages; ++i) {
      if (!evaluate_stage(i)) return Outcome::failed;
    }
  }
  if (projector_->active()) {
    if (!projector_->project(step_.t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) {
      return Outcome::off_constraints;
    }
  } else {
    step_.y1 = step_.y_hat;
  }
  const MechanismData& d = mechanism_.data();
  for (std::size_t k = 0; k < d.angles.size(); ++k) {
    const JointAngle& a = d.angles[k];
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    step_.angles1(i) =
        a.value_near(step_.angles0(i), body_at(step_.y1, a.body1).frame, body_at(step_.y1, a.body2).frame);
  }
  return Outcome::accepted;
}

double RungeKuttaRun::fastest_tracked_rate(const Eigen::VectorXd& y) const {
  double fastest = 0;
  for (const JointAngle& a : mechanism_.data().angles) {
    fastest = std::max(fastest, std::abs(a.rate(body_at(y, a.body1).frame, body_at(y, a.body2).frame)));
  }
  return fastest;
}

// Projection takes out of the velocities the constraint accelerations that a penalty leaves: it hides too small an
// alpha. Both are in the norm of the kinetic energy. If nothing moves, loads would move it as gravity does.
void RungeKuttaRun::add_projection(double h) {
  if (settings_.formulation.type != FormulationType::penalty || !projector_->active()) return;
  const MechanismData& d = mechanism_.data();
  double projected = 0, moved = 0, mass = 0;
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& b = d.bodies[static_cast<std::size_t>(i)];
    const Eigen::Index v = 7 * (d.n + i - 1);
    const Vector4d p = step_.y1.segment<4>(7 * (i - 1) + 3);
    const auto energy_norm = [&](const Eigen::VectorXd& from) {
      const Vector3d r = step_.y1.segment<3>(v) - from.segment<3>(v);
      const Vector3d omega = omega_B(p, step_.y1.segment<4>(v + 3) - from.segment<4>(v + 3));
      return b.mass * r.squaredNorm() + omega.dot(b.J * omega);
    };
    projected += energy_norm(step_.y_hat), moved += energy_norm(step_.y0), mass += b.mass;
  }
  projected_ += std::sqrt(projected);
  moved_ += std::sqrt(moved) + h * d.gravity.norm() * std::sqrt(mass);
}

Energy RungeKuttaRun::update_statistics(SimulationResult& result) {
  SimulationStatistics& s = result.statistics;
  s.max_position_violation =
      std::max(s.max_position_violation, projector_->position_violation(step_.t1, step_.angles1, step_.y1));
  s.max_velocity_violation = std::max(s.max_velocity_violation, projector_->velocity_violation(step_.t1, step_.y1));
  const Energy e = energy(mechanism_.data(), step_.y1, step_.angles1);
  s.energy_final = e.kinetic + e.potential;
  s.energy_drift = std::max(s.energy_drift, std::abs(s.energy_final - s.energy_initial));
  return e;
}

// The state of a run between its steps.
struct RungeKuttaRun::Course {
  const RunOptions& options;
  SimulationResult& result;
  const bool adaptive;
  const double end, span;
  StepController controller;
  StiffnessWatch stiffness;
  EventTimes events;
  KinkControl kinks;
  double h = 0, longest = 0;              // the step to try; the longest one so far
  double error = 0;                       // of the step tried last
  double wish = 0;                        // h before a kink made it shorter
  double wanted = 0, largest = INFINITY;  // sizes that the error and the limits allow, where passage_ chooses h
  std::size_t frozen_index = 0;
  int placed_again = 0;

  bool ends_with(double t1) const {
    const StepSequence* const frozen = options.frozen;
    return frozen ? frozen_index + 1 == frozen->sizes.size() && frozen->to_the_end : t1 >= end - kinks.gap();
  }
  bool goes_on(double t) const {
    return result.ok() && (options.frozen ? frozen_index < options.frozen->sizes.size() : t < end);
  }
  void stop(SimulationStatus status, std::string message) {
    result.status = status;
    result.message = std::move(message);
  }
};

void RungeKuttaRun::run(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles,
                        const std::function<bool(double)>& wants_dense, const Sink& accepted, const RunOptions& options,
                        SimulationResult& result) {
  const IntegratorSettings& s = settings_.integrator;
  Course course{.options = options,
                .result = result,
                .adaptive = !s.step && !options.frozen && rk_.adaptive,
                .end = settings_.end_time,
                .span = settings_.end_time - settings_.start_time,
                .controller = StepController(rk_.error_order, s.options),
                .stiffness = StiffnessWatch(rk_, mechanism_.states()),
                .events = EventTimes(settings_.events, settings_.start_time, settings_.end_time),
                .kinks = KinkControl(options.frozen ? std::vector<KinkedSignal>() : kinks_, settings_.start_time,
                                     settings_.end_time)};
  if (!begin(y_initial, angles, course)) return;
  choose_first_size(course);
  while (course.goes_on(step_.t)) {
    if (!choose_size(course)) break;
    const Outcome outcome = try_step(wants_dense, course);
    if (outcome == Outcome::accepted && misplaced(course)) continue;
    if (outcome != Outcome::accepted) {
      reject(outcome, course);
      continue;
    }
    if (!credible(course)) break;
    course.stiffness.look_at(step_);
    accepted(step_);
    if (implicit_) implicit_->accept(step_);
    choose_next_size(course);
    advance(course);
  }
  add_statistics(course);
}

bool RungeKuttaRun::begin(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles, Course& course) {
  const StepSequence* const frozen = course.options.frozen;
  SimulationResult& result = course.result;
  angles_ = angles;
  step_.t = frozen && !frozen->times.empty() ? frozen->times[0] : settings_.start_time;
  step_.y0 = y_initial;
  step_.angles0 = angles;
  const Energy e = energy(mechanism_.data(), y_initial, angles);
  result.statistics.energy_initial = result.statistics.energy_final = e.kinetic + e.potential;
  result.last_good_time = step_.t;
  const std::string at_start = guard_.begin(step_.t, y_initial, e, course.end, settings_.integrator.max_steps);
  if (!at_start.empty() && !frozen) {
    course.stop(SimulationStatus::not_credible, at_start);
    return false;
  }
  projected_ = moved_ = 0;
  evaluations_ = 0;
  first_stage_known_ = false;
  if (!dynamics_.evaluate(step_.t, y_initial, angles, ydot_)) {
    course.stop(SimulationStatus::not_finite,
                start_failure(mechanism_.data(), step_.t) + about_alpha(settings_.formulation));
    return false;
  }
  // A guard on which scenes are taken to be planar: what was assembled in space satisfies the planar equations.
  if (dynamics_.is_planar() && !frozen) {
    const double unmet = std::max(projector_->position_violation(step_.t, angles, y_initial),
                                  projector_->velocity_violation(step_.t, y_initial));
    if (unmet > 1e-6 * (1 + y_initial.cwiseAbs().maxCoeff())) {
      course.stop(SimulationStatus::not_credible,
                  fmt::format("the start does not satisfy the equations of the planar model, by {:.3g}: set "
                              "simulation.model to \"spatial\"",
                              unmet));
      return false;
    }
  }
  if (implicit_) implicit_->begin(ydot_.tail(ydot_.size() / 2), dynamics_.lambda());
  if (passage_) passage_->forget();
  return true;
}

// Tolerances that no step can meet explain whatever else may have become of the steps.
std::string RungeKuttaRun::tolerances_or(std::string message, const Course& course) const {
  const IntegratorSettings& s = settings_.integrator;
  return course.adaptive && beyond_digits(tolerances_, step_.y0) ? too_few_digits(s, step_.t) : std::move(message);
}

void RungeKuttaRun::choose_first_size(Course& course) {
  const IntegratorSettings& s = settings_.integrator;
  double& h = course.h;
  h = course.adaptive ? first_step(s, course.span) : s.step.value_or(course.span);
  if (s.max_step) h = std::min(h, *s.max_step);
  if (course.adaptive) h = std::max(h, s.options.min_step.value_or(0));
  course.longest = h;
  if (!(h > 0)) {
    course.stop(
        SimulationStatus::step_too_small,
        tolerances_or(step_failure(Outcome::rejected, step_.t, h, course.adaptive, settings_.formulation), course));
  }
  if (course.adaptive && h * kMostSteps * kMostSteps < course.span) {  // steps may still grow, but not so much
    course.stop(SimulationStatus::step_too_small, tolerances_or(too_long_run(course.span, h), course));
  }
}

bool RungeKuttaRun::choose_size(Course& course) {
  const IntegratorSettings& s = settings_.integrator;
  const StepSequence* const frozen = course.options.frozen;
  double& h = course.h;
  if (course.result.statistics.steps + course.result.statistics.rejected >= s.max_steps) {
    course.stop(SimulationStatus::too_many_steps,
                tolerances_or(fmt::format("more than {} steps were needed; stopped at t = {:.6g} s with steps of "
                                          "{:.3g} s. Loosen rtol and atol, raise simulation.integrator.max_steps, or "
                                          "look for very stiff springs or dampers",
                                          s.max_steps, step_.t, h),
                              course));
    return false;
  }
  if (frozen) {
    step_.t = frozen->times[course.frozen_index];
    h = frozen->sizes[course.frozen_index];
    return true;
  }
  const double rate = fastest_tracked_rate(step_.y0), to_event = course.events.stop_after(step_.t);
  if (course.adaptive && rate * h > 2)
    h = rounded_step(2 / rate);  // an angle is followed over turns only when steps are below half a turn
  course.wish = propose_step(step_.t, h, to_event, course.adaptive);
  h = course.wanted = course.kinks.choose(step_.t, course.wish, !course.adaptive);
  if (course.adaptive && passage_) {
    course.largest = std::min({s.max_step.value_or(INFINITY), rate > 0 ? 2 / rate : INFINITY, to_event - step_.t,
                               h < course.wish ? h : INFINITY});
    const double placed = passage_->propose(step_.t, h, course.largest);
    if (placed != h) h = rounded_step(placed, kPartsOfPlaced);
  }
  if (course.adaptive || !(rate * h > 3)) return true;
  course.stop(SimulationStatus::step_too_large,
              fmt::format("at t = {:.6g} s a joint whose angle is used turns by {:.3g} rad in one step of {:.3g} s; "
                          "more than half a turn cannot be followed: use a smaller simulation.integrator.step",
                          step_.t, rate * h, h));
  return false;
}

RungeKuttaRun::Outcome RungeKuttaRun::try_step(const std::function<bool(double)>& wants_dense, Course& course) {
  const Outcome outcome = attempt(course.h, course.adaptive, course.options.exact_stages, course.error);
  const double t1 = step_.t + course.h;
  step_.t1 = course.ends_with(t1) ? course.end : t1;
  return outcome == Outcome::accepted ? finish_step(wants_dense(step_.t1)) : outcome;
}

// Whether the step is to be tried again, placed otherwise about a singular position.
bool RungeKuttaRun::misplaced(Course& course) {
  if (!course.adaptive || !passage_) return false;
  constexpr int kMostTries = 3;
  const bool again = better_placed_by(course.wanted, course.largest);  // passage_ is to know of this step in any case
  if (again && course.placed_again < kMostTries) {
    ++course.placed_again;
    ++course.result.statistics.rejected;
    ++course.result.statistics.rejections.placed_again;
    course.h = course.wanted;
    return true;
  }
  course.placed_again = 0;
  passage_->accept();
  return false;
}

void RungeKuttaRun::reject(Outcome outcome, Course& course) {
  double& h = course.h;
  SimulationStatistics& count = course.result.statistics;
  if (!course.adaptive) {
    course.stop(outcome == Outcome::unsolved          ? SimulationStatus::not_solved
                : outcome == Outcome::off_constraints ? SimulationStatus::step_too_large
                                                      : SimulationStatus::not_finite,
                step_failure(outcome, step_.t, h, course.adaptive, settings_.formulation));
    return;
  }
  ++(outcome == Outcome::rejected          ? count.rejections.error_test
     : outcome == Outcome::unsolved        ? count.rejections.not_converged
     : outcome == Outcome::off_constraints ? count.rejections.off_constraints
                                           : count.rejections.not_finite);
  constexpr long kRejectionsToAsk = 1000;  // for the cause: far more than a motion that is resolved has
  if (++count.rejected % kRejectionsToAsk == 0) {
    const std::string objection = weak_joints_objection(error_of_weak_joints(
        mechanism_, settings_.formulation, dynamics_.worst_residual(), step_.t, step_.y0, step_.angles0));
    if (!objection.empty()) {
      course.stop(SimulationStatus::not_credible,
                  fmt::format("of {} steps to t = {:.6g} s {} were rejected: {}", count.steps + count.rejected, step_.t,
                              count.rejected, objection));
      return;
    }
  }
  if (course.kinks.crosses()) {
    course.kinks.rejected_across(h, outcome == Outcome::rejected ? course.error : INFINITY);
    h = course.wish;
    return;
  }
  const double tried = h;
  h = rounded_step(h * course.controller.after_rejection(outcome == Outcome::rejected ? course.error : INFINITY));
  const std::optional<double> min_step = settings_.integrator.options.min_step;
  if (min_step && h < *min_step) {
    h = *min_step;
    if (tried > h) return;
    course.stop(SimulationStatus::step_too_small, tolerances_or(below_min_step(outcome, step_.t, *min_step), course));
    return;
  }
  if (h >= 1e-14 * std::max(course.span, std::abs(step_.t))) return;
  course.stop(SimulationStatus::step_too_small,
              tolerances_or(course.longest * kMostSteps < course.span
                                ? too_long_run(course.span, course.longest)
                                : step_failure(outcome, step_.t, h, course.adaptive, settings_.formulation),
                            course));
}

// Notes an accepted step, and asks the guard; given steps have been looked at where they were found.
bool RungeKuttaRun::credible(Course& course) {
  SimulationResult& result = course.result;
  ++result.statistics.steps;
  if (projected_out_ > result.statistics.projected_error) {
    result.statistics.projected_error = projected_out_;
    result.statistics.projected_error_time = step_.t;
  }
  result.steps.times.push_back(step_.t);
  result.steps.sizes.push_back(course.h);
  course.longest = std::max(course.longest, course.h);
  const Energy energy_now = update_statistics(result);
  if (!course.options.frozen) {
    const std::string objection = guard_.objection(step_.t1, step_.y1, energy_now, dynamics_.worst_residual());
    if (!objection.empty()) {
      course.stop(SimulationStatus::not_credible, objection);
      return false;
    }
  }
  add_projection(course.h);
  return true;
}

void RungeKuttaRun::choose_next_size(Course& course) {
  const IntegratorSettings& s = settings_.integrator;
  double& h = course.h;
  if (course.adaptive) {
    if (course.kinks.crosses()) {
      course.kinks.accepted_across(h, course.error);
      if (course.kinks.limits(course.wish)) {
        h = course.wish;
        return;
      }
    }
    // Past a singular position the estimate is magnified rounding, which is not to decide on the next step.
    const bool passed = passage_ && passage_->passed_since(step_.t);
    if (passed) course.controller.after_passage();
    double proposed = passed ? course.wanted : rounded_step(h * course.controller.after_acceptance(course.error));
    if (course.kinks.meets()) {
      course.kinks.met();
      proposed = std::max(proposed, std::min(course.wish, h * course.controller.allowed(course.error)));
    }
    // The factor of an implicit method serves as long as the step stays.
    if (implicit_ && proposed >= h && proposed < ImplicitStages::kKeepStep * h) proposed = h;
    h = std::clamp(proposed, s.options.min_step.value_or(0), s.max_step.value_or(INFINITY));
  } else if (!course.options.frozen) {
    h = s.step.value_or(course.span);
  }
}

void RungeKuttaRun::advance(Course& course) {
  const RunOptions& options = course.options;
  const bool event = !options.frozen && course.events.reached(step_.t1);
  const bool kink = !options.frozen && !event && step_.t1 < course.end && course.kinks.reached(step_.t1);
  step_.t = event ? course.events.resume_time() : kink ? course.kinks.resume_time() : step_.t1;
  step_.y0 = step_.y1;
  angles_ = step_.angles0 = step_.angles1;
  first_stage_known_ = false;
  if (event) restart(course);
  if (kink) restart_stages();
  course.result.last_good_time = step_.t;
  ++course.frozen_index;
  if (options.after_step) options.after_step({step_.t, step_.y0, step_.angles0});
  if (options.progress && !options.progress(step_.t)) {
    course.stop(SimulationStatus::stopped, fmt::format("stopped at t = {:.6g} s", step_.t));
  }
}

// The steps before an event say nothing about those after it.
void RungeKuttaRun::restart(Course& course) {
  const IntegratorSettings& s = settings_.integrator;
  if (course.adaptive) {
    const double left = course.end - step_.t;
    course.controller = StepController(rk_.error_order, s.options);
    course.h = std::clamp(first_step(s, left), s.options.min_step.value_or(0), s.max_step.value_or(INFINITY));
    if (passage_) passage_->forget();
  }
  restart_stages();
}

// Accelerations jump: the last step is no start for the iterations of the next.
void RungeKuttaRun::restart_stages() {
  if (!implicit_ || !dynamics_.evaluate(step_.t, step_.y0, angles_, ydot_)) return;
  ++evaluations_;
  implicit_->begin(ydot_.tail(ydot_.size() / 2), dynamics_.lambda());
}

void RungeKuttaRun::add_statistics(Course& course) {
  course.result.y_end = step_.y0;
  SimulationStatistics& s = course.result.statistics;
  course.stiffness.add_to(s);
  s.weak_joints_error = error_of_weak_joints(mechanism_, settings_.formulation, dynamics_.worst_residual(), step_.t,
                                             step_.y0, step_.angles0);
  s.max_acceleration_residual =
      std::max({dynamics_.worst_residual(), s.weak_joints_error, moved_ > 0 ? projected_ / moved_ : 0.0});
  s.relative_energy_drift = guard_.relative_energy_drift();
  s.linear_solves += evaluations_;
  if (implicit_) {
    evaluations_ += implicit_->evaluations();
    s.newton_iterations += implicit_->iterations();
    s.linear_solves += implicit_->solves();
    s.linearised_states += implicit_->places();
    s.jacobians += implicit_->jacobians();
    s.factorisations += implicit_->factorisations();
  }
  if (rosenbrock_) {
    evaluations_ += rosenbrock_->evaluations();
    s.linear_solves += rosenbrock_->evaluations() + rosenbrock_->solves();
    s.jacobians += rosenbrock_->jacobians();
    s.factorisations += rosenbrock_->factorisations();
  }
  s.rhs_evaluations += evaluations_;
  s.factor_blocks = dynamics_.factor_blocks();
  s.factorisations += dynamics_.factorisations() + projector_->factorisations();
}

}  // namespace mbsopt
