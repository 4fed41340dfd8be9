#include "core/integrate/runge_kutta_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/run/timed_laws.hpp"
#include "core/sensor/body_at.hpp"
#include "core/start/model_warnings.hpp"
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

// Jumps, as those of a held signal.
std::vector<KinkedSignal> with_jumps(std::vector<KinkedSignal> kinks, std::vector<double> jumps) {
  std::ranges::sort(jumps);
  jumps.erase(std::unique(jumps.begin(), jumps.end()), jumps.end());
  if (jumps.empty()) return kinks;
  jumps.insert(jumps.begin(), std::nextafter(jumps.front(), -INFINITY));
  std::vector<double> levels;
  for (std::size_t i = 0; i < jumps.size(); ++i) levels.push_back(i % 2 == 0 ? 0 : 1);
  kinks.push_back({std::make_shared<const Curve>(Interpolation::hold, std::move(jumps), std::move(levels)), 0, {}, 0});
  return kinks;
}

}  // namespace

RungeKuttaRun::RungeKuttaRun(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                             std::span<const Cost> costs)
    : mechanism_(mechanism),
      settings_(settings),
      rk_(method),
      tolerances_(mechanism.data(), settings.integrator),
      attempt_(mechanism_, settings_, rk_, tolerances_),
      guard_(mechanism_.data()),
      penalty_(mechanism_.data()),
      pulses_(mechanism_, costs, settings.start_time, settings.end_time, pulse_nodes(method)),
      kinks_(with_jumps(kinks_of(mechanism, costs), pulses_.jumps())) {}

// Never beyond the end; an adaptive run does not leave a tiny last step.
double RungeKuttaRun::propose_step(double t, double h, double end, bool adaptive) const {
  const double left = end - t;
  if (h >= left * (1 - 1e-9)) return left;
  return adaptive && 2 * h > left ? 0.5 * left : h;
}

double RungeKuttaRun::fastest_tracked_rate(const Eigen::VectorXd& y) const {
  double fastest = 0;
  for (const JointAngle& a : mechanism_.data().angles) {
    fastest = std::max(fastest, std::abs(a.rate(body_at(y, a.body1).frame, body_at(y, a.body2).frame)));
  }
  return fastest;
}

Energy RungeKuttaRun::update_statistics(SimulationResult& result) {
  SimulationStatistics& s = result.statistics;
  double relative = 0;
  s.max_position_violation = std::max(
      s.max_position_violation,
      attempt_.projector->position_violation(attempt_.step.t1, attempt_.step.angles1, attempt_.step.y1, &relative));
  s.relative_position_violation = std::max(s.relative_position_violation, relative);
  s.max_velocity_violation =
      std::max(s.max_velocity_violation, attempt_.projector->velocity_violation(attempt_.step.t1, attempt_.step.y1));
  const Energy e = energy(mechanism_.data(), attempt_.step.y1, attempt_.step.angles1);
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
  double wanted = 0, largest = INFINITY;  // sizes that the error and the limits allow, where attempt_.passage chooses h
  double residual = 0, of_rejected = 0;   // the worst of the accelerations, in accepted steps and in others
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
  while (course.goes_on(attempt_.step.t)) {
    if (!choose_size(course)) break;
    const Outcome outcome = try_step(wants_dense, course);
    if (outcome == Outcome::accepted && misplaced(course)) continue;
    if (outcome != Outcome::accepted) {
      reject(outcome, course);
      continue;
    }
    if (!credible(course)) break;
    course.stiffness.look_at(attempt_.step);
    accepted(attempt_.step);
    attempt_.accept();
    choose_next_size(course);
    advance(course);
  }
  add_statistics(course);
}

bool RungeKuttaRun::begin(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles, Course& course) {
  const StepSequence* const frozen = course.options.frozen;
  SimulationResult& result = course.result;
  attempt_.step.t = frozen && !frozen->times.empty() ? frozen->times[0] : settings_.start_time;
  attempt_.step.y0 = y_initial;
  attempt_.step.angles0 = angles;
  const Energy e = energy(mechanism_.data(), y_initial, angles);
  result.statistics.energy_initial = result.statistics.energy_final = e.kinetic + e.potential;
  result.last_good_time = attempt_.step.t;
  const std::string at_start = guard_.begin(attempt_.step.t, y_initial, e, course.end, settings_.integrator.max_steps);
  if (!at_start.empty() && !frozen) {
    course.stop(SimulationStatus::not_credible, at_start);
    return false;
  }
  penalty_ = PenaltyWatch(mechanism_.data());
  // Rounding errors can hide a singular mass matrix, and give accelerations without meaning.
  if (!attempt_.begin() || (!frozen && !massless_bodies(mechanism_.data(), y_initial).empty())) {
    course.stop(SimulationStatus::not_finite,
                start_failure(mechanism_.data(), attempt_.step.t) + about_alpha(settings_.formulation));
    return false;
  }
  // A guard on which scenes are taken to be planar: what was assembled in space satisfies the planar equations.
  if (attempt_.dynamics.is_planar() && !frozen) {
    const double unmet = std::max(attempt_.projector->position_violation(attempt_.step.t, angles, y_initial),
                                  attempt_.projector->velocity_violation(attempt_.step.t, y_initial));
    if (unmet > 1e-6 * (1 + y_initial.cwiseAbs().maxCoeff())) {
      course.stop(SimulationStatus::not_credible,
                  fmt::format("the start does not satisfy the equations of the planar model, by {:.3g}: set "
                              "simulation.model to \"spatial\"",
                              unmet));
      return false;
    }
  }
  if (attempt_.passage) attempt_.passage->forget();
  course.residual = attempt_.dynamics.worst_residual();
  return true;
}

// Tolerances that no step can meet explain whatever else may have become of the steps.
std::string RungeKuttaRun::tolerances_or(std::string message, const Course& course) const {
  const IntegratorSettings& s = settings_.integrator;
  return course.adaptive && beyond_digits(tolerances_, attempt_.step.y0) ? too_few_digits(s, attempt_.step.t)
                                                                         : std::move(message);
}

void RungeKuttaRun::choose_first_size(Course& course) {
  const IntegratorSettings& s = settings_.integrator;
  double& h = course.h;
  h = course.adaptive ? attempt_.first_step(s, course.span) : s.step.value_or(course.span);
  if (s.max_step) h = std::min(h, *s.max_step);
  if (course.adaptive) h = std::max(h, s.options.min_step.value_or(0));
  course.longest = h;
  if (!(h > 0)) {
    course.stop(SimulationStatus::step_too_small, tolerances_or(step_failure(Outcome::rejected, attempt_.step.t, h,
                                                                             course.adaptive, settings_.formulation),
                                                                course));
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
                                          s.max_steps, attempt_.step.t, h),
                              course));
    return false;
  }
  if (frozen) {
    attempt_.step.t = frozen->times[course.frozen_index];
    h = frozen->sizes[course.frozen_index];
    return true;
  }
  const double rate = fastest_tracked_rate(attempt_.step.y0), to_event = course.events.stop_after(attempt_.step.t);
  if (course.adaptive && rate * h > 2)
    h = rounded_step(2 / rate);  // an angle is followed over turns only when steps are below half a turn
  course.wish = propose_step(attempt_.step.t, h, to_event, course.adaptive);
  h = course.wanted = course.kinks.choose(attempt_.step.t, course.wish, !course.adaptive);
  if (course.adaptive && attempt_.passage) {
    course.largest = std::min({s.max_step.value_or(INFINITY), rate > 0 ? 2 / rate : INFINITY,
                               to_event - attempt_.step.t, h < course.wish ? h : INFINITY});
    const double placed = attempt_.passage->propose(attempt_.step.t, h, course.largest);
    if (placed != h) h = rounded_step(placed, kPartsOfPlaced);
  }
  if (course.adaptive || !(rate * h > 3)) return true;
  course.stop(SimulationStatus::step_too_large,
              fmt::format("at t = {:.6g} s a joint whose angle is used turns by {:.3g} rad in one step of {:.3g} s; "
                          "more than half a turn cannot be followed: use a smaller simulation.integrator.step",
                          attempt_.step.t, rate * h, h));
  return false;
}

RungeKuttaRun::Outcome RungeKuttaRun::try_step(const std::function<bool(double)>& wants_dense, Course& course) {
  const Outcome outcome = attempt_.solve(course.h, course.adaptive, course.options.exact_stages, course.error);
  if (outcome == Outcome::accepted && !course.options.frozen && passes_over_pulse(course)) return Outcome::rejected;
  const double t1 = attempt_.step.t + course.h;
  attempt_.step.t1 = course.ends_with(t1) ? course.end : t1;
  return outcome == Outcome::accepted ? attempt_.finish(wants_dense(attempt_.step.t1)) : outcome;
}

// Returns whether to try shorter steps, since this one misses a pulse; its error is that of the pulse.
bool RungeKuttaRun::passes_over_pulse(Course& course) {
  constexpr double kMissed = 10;       // tolerances: a step's own estimate errs by less
  constexpr double kShortest = 1e-10;  // of the run: shorter steps do not search for pulses
  const double least = std::max(kShortest * course.span, settings_.integrator.options.min_step.value_or(0));
  double worst = 0;
  for (const PulseWatch::Doubt& doubt : pulses_.doubts(attempt_.step.t, course.h, course.adaptive)) {
    const double error = doubt.share > 0 ? doubt.share / settings_.integrator.rtol
                                         : attempt_.change_by(doubt.at, doubt.beside, doubt.duration);
    if (course.adaptive && course.h > least) {
      worst = std::max(worst, error);
      continue;
    }
    Pulse& pulse = course.result.statistics.pulse;
    const double relative = error * settings_.integrator.rtol;
    if (relative > pulse.error) pulse = doubt.pulse, pulse.error = relative;
  }
  if (worst <= kMissed) return false;
  course.error = worst;
  return true;
}

// Returns whether to try the step again, with another size about a singular position.
bool RungeKuttaRun::misplaced(Course& course) {
  if (!course.adaptive || !attempt_.passage) return false;
  constexpr int kMostTries = 3;
  const bool again =
      attempt_.better_placed_by(course.wanted, course.largest);  // attempt_.passage is to know of this step in any case
  if (again && course.placed_again < kMostTries) {
    ++course.placed_again;
    ++course.result.statistics.rejected;
    ++course.result.statistics.rejections.placed_again;
    course.h = course.wanted;
    return true;
  }
  course.placed_again = 0;
  attempt_.passage->accept();
  return false;
}

void RungeKuttaRun::reject(Outcome outcome, Course& course) {
  double& h = course.h;
  SimulationStatistics& count = course.result.statistics;
  course.of_rejected = std::max(course.of_rejected, attempt_.dynamics.worst_residual());
  attempt_.dynamics.set_worst_residual(course.residual);
  if (!course.adaptive) {
    course.stop(outcome == Outcome::unsolved          ? SimulationStatus::not_solved
                : outcome == Outcome::off_constraints ? SimulationStatus::step_too_large
                                                      : SimulationStatus::not_finite,
                step_failure(outcome, attempt_.step.t, h, course.adaptive, settings_.formulation));
    return;
  }
  ++(outcome == Outcome::rejected          ? count.rejections.error_test
     : outcome == Outcome::unsolved        ? count.rejections.not_converged
     : outcome == Outcome::off_constraints ? count.rejections.off_constraints
                                           : count.rejections.not_finite);
  constexpr long kRejectionsToAsk = 1000;  // for the cause: far more than a motion that is resolved has
  if (++count.rejected % kRejectionsToAsk == 0) {
    const std::string objection =
        weak_joints_objection(error_of_weak_joints(mechanism_, settings_.formulation, course.of_rejected,
                                                   attempt_.step.t, attempt_.step.y0, attempt_.step.angles0));
    if (!objection.empty()) {
      course.stop(SimulationStatus::not_credible,
                  fmt::format("of {} steps to t = {:.6g} s {} were rejected: {}", count.steps + count.rejected,
                              attempt_.step.t, count.rejected, objection));
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
    course.stop(SimulationStatus::step_too_small,
                tolerances_or(below_min_step(outcome, attempt_.step.t, *min_step), course));
    return;
  }
  if (h >= 1e-14 * std::max(course.span, std::abs(attempt_.step.t))) return;
  course.stop(SimulationStatus::step_too_small,
              tolerances_or(course.longest * kMostSteps < course.span
                                ? too_long_run(course.span, course.longest)
                                : step_failure(outcome, attempt_.step.t, h, course.adaptive, settings_.formulation),
                            course));
}

// Notes an accepted step, and asks the guard; given steps have been looked at where they were found.
bool RungeKuttaRun::credible(Course& course) {
  SimulationResult& result = course.result;
  ++result.statistics.steps;
  course.residual = attempt_.dynamics.worst_residual();
  if (attempt_.projected_out > result.statistics.projected_error) {
    result.statistics.projected_error = attempt_.projected_out;
    result.statistics.projected_error_time = attempt_.step.t;
  }
  result.steps.times.push_back(attempt_.step.t);
  result.steps.sizes.push_back(course.h);
  course.longest = std::max(course.longest, course.h);
  const Energy energy_now = update_statistics(result);
  if (!course.options.frozen) {
    const std::string objection =
        guard_.objection(attempt_.step.t1, attempt_.step.y1, energy_now, attempt_.dynamics.worst_residual());
    if (!objection.empty()) {
      course.stop(SimulationStatus::not_credible, objection);
      return false;
    }
  }
  if (settings_.formulation.type == FormulationType::penalty && attempt_.projector->active())
    penalty_.add(attempt_.step);
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
    const bool passed = attempt_.passage && attempt_.passage->passed_since(attempt_.step.t);
    if (passed) course.controller.after_passage();
    double proposed = passed ? course.wanted : rounded_step(h * course.controller.after_acceptance(course.error));
    if (course.kinks.meets()) {
      course.kinks.met();
      proposed = std::max(proposed, std::min(course.wish, h * course.controller.allowed(course.error)));
    }
    // The factor of an implicit method serves as long as the step stays.
    if (attempt_.has_implicit_stages() && proposed >= h && proposed < ImplicitStages::kKeepStep * h) proposed = h;
    h = std::clamp(proposed, s.options.min_step.value_or(0), s.max_step.value_or(INFINITY));
  } else if (!course.options.frozen) {
    h = s.step.value_or(course.span);
  }
}

void RungeKuttaRun::advance(Course& course) {
  const RunOptions& options = course.options;
  const bool event = !options.frozen && course.events.reached(attempt_.step.t1);
  const bool kink =
      !options.frozen && !event && attempt_.step.t1 < course.end && course.kinks.reached(attempt_.step.t1);
  attempt_.step.t = event ? course.events.resume_time() : kink ? course.kinks.resume_time() : attempt_.step.t1;
  attempt_.advance();
  if (event) restart(course);
  if (kink) attempt_.restart();
  course.result.last_good_time = attempt_.step.t;
  ++course.frozen_index;
  if (options.after_step) options.after_step({attempt_.step.t, attempt_.step.y0, attempt_.step.angles0});
  if (options.progress && !options.progress(attempt_.step.t)) {
    course.stop(SimulationStatus::stopped, fmt::format("stopped at t = {:.6g} s", attempt_.step.t));
  }
}

// The steps before an event say nothing about those after it.
void RungeKuttaRun::restart(Course& course) {
  const IntegratorSettings& s = settings_.integrator;
  if (course.adaptive) {
    const double left = course.end - attempt_.step.t;
    course.controller = StepController(rk_.error_order, s.options);
    course.h = std::clamp(attempt_.first_step(s, left), s.options.min_step.value_or(0), s.max_step.value_or(INFINITY));
    if (attempt_.passage) attempt_.passage->forget();
  }
  attempt_.restart();
}

void RungeKuttaRun::add_statistics(Course& course) {
  course.result.y_end = attempt_.step.y0;
  SimulationStatistics& s = course.result.statistics;
  course.stiffness.add_to(s);
  s.weak_joints_error = error_of_weak_joints(mechanism_, settings_.formulation, attempt_.dynamics.worst_residual(),
                                             attempt_.step.t, attempt_.step.y0, attempt_.step.angles0);
  s.max_acceleration_residual =
      std::max({attempt_.dynamics.worst_residual(), s.weak_joints_error, penalty_.projected_share()});
  s.relative_energy_drift = guard_.relative_energy_drift();
  attempt_.add_counts(s);
}

}  // namespace mbsopt
