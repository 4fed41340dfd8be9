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
#include "core/watch/penalty_watch.hpp"
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
      pulses_(mechanism_, costs, settings.start_time, settings.end_time, pulse_nodes(method)),
      kinks_(with_jumps(kinks_of(mechanism, costs), pulses_.jumps())) {}

// One run: its state between steps. What is large and serves several runs stays in RungeKuttaRun.
class RungeKuttaRun::Loop {
 public:
  Loop(RungeKuttaRun& run, const RunOptions& options, SimulationResult& result)
      : mechanism_(run.mechanism_),
        settings_(run.settings_),
        rk_(run.rk_),
        tolerances_(run.tolerances_),
        attempt_(run.attempt_),
        step_(run.attempt_.step()),
        guard_(run.guard_),
        pulses_(run.pulses_),
        options_(options),
        result_(result),
        adaptive_(!settings_.integrator.step && !options.frozen && rk_.adaptive),
        end_(settings_.end_time),
        span_(settings_.end_time - settings_.start_time),
        controller_(rk_.error_order, settings_.integrator.options),
        stiffness_(rk_, mechanism_.states()),
        events_(settings_.events, settings_.start_time, settings_.end_time),
        kink_control_(options.frozen ? std::vector<KinkedSignal>() : run.kinks_, settings_.start_time,
                      settings_.end_time) {
    if (settings_.formulation.type == FormulationType::penalty && attempt_.projector().active())
      penalty_.emplace(mechanism_.data());
  }

  // Returns false, and the result says why, where the run cannot begin.
  bool begin(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles);
  void go(const std::function<bool(double t1)>& wants_dense, std::span<const StepObserver> observers);

 private:
  void choose_first_size();
  bool choose_size();
  StepOutcome try_step(const std::function<bool(double t1)>& wants_dense);
  bool passes_over_pulse();
  bool is_better_placed_elsewhere();
  void reject(StepOutcome outcome);
  void note_step(std::span<const StepObserver> observers);
  void choose_next_size();
  void advance();
  void add_statistics();
  std::string tolerances_or(std::string message) const;
  double step_to(double event) const;
  double fastest_tracked_rate() const;
  Energy update_statistics();

  bool ends_with(double t1) const {
    const StepSequence* const frozen = options_.frozen;
    return frozen ? frozen_index_ + 1 == frozen->sizes.size() && frozen->to_the_end : t1 >= end_ - kink_control_.gap();
  }
  bool goes_on() const {
    return result_.ok() && (options_.frozen ? frozen_index_ < options_.frozen->sizes.size() : step_.t < end_);
  }
  void stop(SimulationStatus status, std::string message) {
    result_.status = status;
    result_.message = std::move(message);
  }

  const Mechanism& mechanism_;
  const SimulationSettings& settings_;
  const Method& rk_;
  const ComponentTolerances& tolerances_;
  StepAttempt& attempt_;
  const Step& step_;  // of the attempt
  RunGuard& guard_;
  PulseWatch& pulses_;
  const RunOptions& options_;
  SimulationResult& result_;
  const bool adaptive_;
  const double end_, span_;
  StepController controller_;
  StiffnessWatch stiffness_;
  std::optional<PenaltyWatch> penalty_;
  EventTimes events_;
  KinkControl kink_control_;
  double h_ = 0, longest_ = 0;              // the step to try; the longest one so far
  double error_ = 0;                        // of the step tried last
  double asked_ = 0;                        // h before a kink made it shorter
  double wanted_ = 0, largest_ = INFINITY;  // sizes that the error and the limits allow, where the passage chooses h
  double residual_ = 0, residual_of_rejected_ = 0;  // the worst of the accelerations, in accepted steps and in others
  std::size_t frozen_index_ = 0;
  int placed_again_ = 0;
};

void RungeKuttaRun::run(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles,
                        const std::function<bool(double)>& wants_dense, std::span<const StepObserver> observers,
                        const RunOptions& options, SimulationResult& result) {
  Loop loop(*this, options, result);
  if (loop.begin(y_initial, angles)) loop.go(wants_dense, observers);
}

void RungeKuttaRun::Loop::go(const std::function<bool(double)>& wants_dense, std::span<const StepObserver> observers) {
  choose_first_size();
  while (goes_on() && choose_size()) {
    const StepOutcome outcome = try_step(wants_dense);
    if (outcome == StepOutcome::accepted && is_better_placed_elsewhere()) continue;
    if (outcome != StepOutcome::accepted) {
      reject(outcome);
      continue;
    }
    note_step(observers);
    if (!result_.ok()) break;
    attempt_.accept();
    choose_next_size();
    advance();
  }
  add_statistics();
}

// Never beyond the event; an adaptive run does not leave a tiny last step.
double RungeKuttaRun::Loop::step_to(double event) const {
  const double left = event - step_.t;
  if (h_ >= left * (1 - 1e-9)) return left;
  return adaptive_ && 2 * h_ > left ? 0.5 * left : h_;
}

double RungeKuttaRun::Loop::fastest_tracked_rate() const {
  double fastest = 0;
  for (const JointAngle& a : mechanism_.data().angles) {
    fastest = std::max(fastest, std::abs(a.rate(body_at(step_.y0, a.body1).frame, body_at(step_.y0, a.body2).frame)));
  }
  return fastest;
}

Energy RungeKuttaRun::Loop::update_statistics() {
  SimulationStatistics& s = result_.statistics;
  double relative = 0;
  s.max_position_violation = std::max(
      s.max_position_violation, attempt_.projector().position_violation(step_.t1, step_.angles1, step_.y1, &relative));
  s.relative_position_violation = std::max(s.relative_position_violation, relative);
  s.max_velocity_violation =
      std::max(s.max_velocity_violation, attempt_.projector().velocity_violation(step_.t1, step_.y1));
  const Energy e = energy(mechanism_.data(), step_.y1, step_.angles1);
  s.energy_final = e.kinetic + e.potential;
  s.energy_drift = std::max(s.energy_drift, std::abs(s.energy_final - s.energy_initial));
  return e;
}

bool RungeKuttaRun::Loop::begin(const Eigen::VectorXd& y_initial, const Eigen::VectorXd& angles) {
  const StepSequence* const frozen = options_.frozen;
  attempt_.start_at(frozen && !frozen->times.empty() ? frozen->times[0] : settings_.start_time, y_initial, angles);
  const Energy e = energy(mechanism_.data(), y_initial, angles);
  result_.statistics.energy_initial = result_.statistics.energy_final = e.kinetic + e.potential;
  result_.last_good_time = step_.t;
  const std::string at_start = guard_.begin(step_.t, y_initial, e, end_, settings_.integrator.max_steps);
  if (!at_start.empty() && !frozen) {
    stop(SimulationStatus::not_credible, at_start);
    return false;
  }
  // Rounding errors can hide a singular mass matrix, and give accelerations without meaning.
  if (!attempt_.begin() || (!frozen && !massless_bodies(mechanism_.data(), y_initial).empty())) {
    stop(SimulationStatus::not_finite, start_failure(mechanism_.data(), step_.t) + about_alpha(settings_.formulation));
    return false;
  }
  // A guard on which scenes are taken to be planar: what was assembled in space satisfies the planar equations.
  if (attempt_.dynamics().is_planar() && !frozen) {
    const double unmet = std::max(attempt_.projector().position_violation(step_.t, angles, y_initial),
                                  attempt_.projector().velocity_violation(step_.t, y_initial));
    if (unmet > 1e-6 * (1 + y_initial.cwiseAbs().maxCoeff())) {
      stop(SimulationStatus::not_credible,
           fmt::format("the start does not satisfy the equations of the planar model, by {:.3g}: set "
                       "simulation.model to \"spatial\"",
                       unmet));
      return false;
    }
  }
  if (attempt_.passage()) attempt_.passage()->forget();
  residual_ = attempt_.dynamics().worst_residual();
  return true;
}

// Tolerances that no step can meet explain whatever else may have become of the steps.
std::string RungeKuttaRun::Loop::tolerances_or(std::string message) const {
  const IntegratorSettings& s = settings_.integrator;
  return adaptive_ && beyond_digits(tolerances_, step_.y0) ? too_few_digits(s, step_.t) : std::move(message);
}

void RungeKuttaRun::Loop::choose_first_size() {
  const IntegratorSettings& s = settings_.integrator;
  h_ = adaptive_ ? attempt_.first_step(s, span_) : s.step.value_or(span_);
  if (s.max_step) h_ = std::min(h_, *s.max_step);
  if (adaptive_) h_ = std::max(h_, s.options.min_step.value_or(0));
  longest_ = h_;
  if (!(h_ > 0)) {
    stop(SimulationStatus::step_too_small,
         tolerances_or(step_failure(StepOutcome::rejected, step_.t, h_, adaptive_, settings_.formulation)));
  }
  if (adaptive_ && h_ * kMostSteps * kMostSteps < span_) {  // steps may still grow, but not so much
    stop(SimulationStatus::step_too_small, tolerances_or(too_long_run(span_, h_)));
  }
}

bool RungeKuttaRun::Loop::choose_size() {
  const IntegratorSettings& s = settings_.integrator;
  const StepSequence* const frozen = options_.frozen;
  if (result_.statistics.steps + result_.statistics.rejected >= s.max_steps) {
    stop(SimulationStatus::too_many_steps,
         tolerances_or(fmt::format("more than {} steps were needed; stopped at t = {:.6g} s with steps of "
                                   "{:.3g} s. Loosen rtol and atol, raise simulation.integrator.max_steps, or "
                                   "look for very stiff springs or dampers",
                                   s.max_steps, step_.t, h_)));
    return false;
  }
  if (frozen) {
    attempt_.set_time(frozen->times[frozen_index_]);
    h_ = frozen->sizes[frozen_index_];
    return true;
  }
  const double rate = fastest_tracked_rate(), to_event = events_.stop_after(step_.t);
  if (adaptive_ && rate * h_ > 2)
    h_ = rounded_step(2 / rate);  // an angle is followed over turns only when steps are below half a turn
  asked_ = step_to(to_event);
  h_ = wanted_ = kink_control_.choose(step_.t, asked_, !adaptive_);
  if (adaptive_ && attempt_.passage()) {
    largest_ = std::min({s.max_step.value_or(INFINITY), rate > 0 ? 2 / rate : INFINITY, to_event - step_.t,
                         h_ < asked_ ? h_ : INFINITY});
    const double placed = attempt_.passage()->propose(step_.t, h_, largest_);
    if (placed != h_) h_ = rounded_step(placed, kPartsOfPlaced);
  }
  if (adaptive_ || !(rate * h_ > 3)) return true;
  stop(SimulationStatus::step_too_large,
       fmt::format("at t = {:.6g} s a joint whose angle is used turns by {:.3g} rad in one step of {:.3g} s; "
                   "more than half a turn cannot be followed: use a smaller simulation.integrator.step",
                   step_.t, rate * h_, h_));
  return false;
}

StepOutcome RungeKuttaRun::Loop::try_step(const std::function<bool(double t1)>& wants_dense) {
  const StepOutcome outcome = attempt_.solve(h_, adaptive_, options_.exact_stages, error_);
  if (outcome == StepOutcome::accepted && !options_.frozen && passes_over_pulse()) return StepOutcome::rejected;
  if (outcome != StepOutcome::accepted) return outcome;
  const double t1 = ends_with(step_.t + h_) ? end_ : step_.t + h_;
  return attempt_.finish(t1, wants_dense(t1));
}

// Returns whether to try shorter steps, since this one misses a pulse; its error is that of the pulse.
bool RungeKuttaRun::Loop::passes_over_pulse() {
  constexpr double kMissed = 10;       // tolerances: a step's own estimate errs by less
  constexpr double kShortest = 1e-10;  // of the run: shorter steps do not search for pulses
  const double least = std::max(kShortest * span_, settings_.integrator.options.min_step.value_or(0));
  double worst = 0;
  for (const PulseWatch::Doubt& doubt : pulses_.doubts(step_.t, h_, adaptive_)) {
    const double error = doubt.share > 0 ? doubt.share / settings_.integrator.rtol
                                         : attempt_.change_by(doubt.at, doubt.beside, doubt.duration);
    if (adaptive_ && h_ > least) {
      worst = std::max(worst, error);
      continue;
    }
    Pulse& pulse = result_.statistics.pulse;
    const double relative = error * settings_.integrator.rtol;
    if (relative > pulse.error) pulse = doubt.pulse, pulse.error = relative;
  }
  if (worst <= kMissed) return false;
  error_ = worst;
  return true;
}

// Returns whether to try the step again, with another size about a singular position.
bool RungeKuttaRun::Loop::is_better_placed_elsewhere() {
  if (!adaptive_ || !attempt_.passage()) return false;
  constexpr int kMostTries = 3;
  const bool again =
      attempt_.better_placed_by(wanted_, largest_);  // attempt_.passage() is to know of this step in any case
  if (again && placed_again_ < kMostTries) {
    ++placed_again_;
    ++result_.statistics.rejected;
    ++result_.statistics.rejections.placed_again;
    h_ = wanted_;
    return true;
  }
  placed_again_ = 0;
  attempt_.passage()->accept();
  return false;
}

void RungeKuttaRun::Loop::reject(StepOutcome outcome) {
  SimulationStatistics& count = result_.statistics;
  residual_of_rejected_ = std::max(residual_of_rejected_, attempt_.dynamics().worst_residual());
  attempt_.dynamics().set_worst_residual(residual_);
  if (!adaptive_) {
    stop(outcome == StepOutcome::unsolved          ? SimulationStatus::not_solved
         : outcome == StepOutcome::off_constraints ? SimulationStatus::step_too_large
                                                   : SimulationStatus::not_finite,
         step_failure(outcome, step_.t, h_, adaptive_, settings_.formulation));
    return;
  }
  ++(outcome == StepOutcome::rejected          ? count.rejections.error_test
     : outcome == StepOutcome::unsolved        ? count.rejections.not_converged
     : outcome == StepOutcome::off_constraints ? count.rejections.off_constraints
                                               : count.rejections.not_finite);
  constexpr long kRejectionsToAsk = 1000;  // for the cause: far more than a motion that is resolved has
  if (++count.rejected % kRejectionsToAsk == 0) {
    const std::string objection = weak_joints_objection(error_of_weak_joints(
        mechanism_, settings_.formulation, residual_of_rejected_, step_.t, step_.y0, step_.angles0));
    if (!objection.empty()) {
      stop(SimulationStatus::not_credible,
           fmt::format("of {} steps to t = {:.6g} s {} were rejected: {}", count.steps + count.rejected, step_.t,
                       count.rejected, objection));
      return;
    }
  }
  if (kink_control_.crosses()) {
    kink_control_.rejected_across(h_, outcome == StepOutcome::rejected ? error_ : INFINITY);
    h_ = asked_;
    return;
  }
  const double tried = h_;
  h_ = rounded_step(h_ * controller_.after_rejection(outcome == StepOutcome::rejected ? error_ : INFINITY));
  const std::optional<double> min_step = settings_.integrator.options.min_step;
  if (min_step && h_ < *min_step) {
    h_ = *min_step;
    if (tried > h_) return;
    stop(SimulationStatus::step_too_small, tolerances_or(below_min_step(outcome, step_.t, *min_step)));
    return;
  }
  if (h_ >= 1e-14 * std::max(span_, std::abs(step_.t))) return;
  stop(SimulationStatus::step_too_small,
       tolerances_or(longest_ * kMostSteps < span_
                         ? too_long_run(span_, longest_)
                         : step_failure(outcome, step_.t, h_, adaptive_, settings_.formulation)));
}

// Notes an accepted step, and shows it to all that look at the run. Given steps have been looked at where they were
// found.
void RungeKuttaRun::Loop::note_step(std::span<const StepObserver> observers) {
  ++result_.statistics.steps;
  residual_ = attempt_.dynamics().worst_residual();
  if (attempt_.projected_out() > result_.statistics.projected_error) {
    result_.statistics.projected_error = attempt_.projected_out();
    result_.statistics.projected_error_time = step_.t;
  }
  result_.steps.times.push_back(step_.t);
  result_.steps.sizes.push_back(h_);
  longest_ = std::max(longest_, h_);
  const Energy energy_now = update_statistics();
  std::string objection = options_.frozen ? "" : guard_.objection(step_.t1, step_.y1, energy_now, residual_);
  if (penalty_) penalty_->add(step_);
  stiffness_.look_at(step_);
  for (auto observer = observers.begin(); observer != observers.end() && objection.empty(); ++observer)
    objection = (*observer)(step_);
  if (!objection.empty()) stop(SimulationStatus::not_credible, std::move(objection));
}

void RungeKuttaRun::Loop::choose_next_size() {
  const IntegratorSettings& s = settings_.integrator;
  if (adaptive_) {
    if (kink_control_.crosses()) {
      kink_control_.accepted_across(h_, error_);
      if (kink_control_.limits(asked_)) {
        h_ = asked_;
        return;
      }
    }
    // Past a singular position the estimate is magnified rounding, which is not to decide on the next step.
    const bool passed = attempt_.passage() && attempt_.passage()->passed_since(step_.t);
    if (passed) controller_.after_passage();
    double proposed = passed ? wanted_ : rounded_step(h_ * controller_.after_acceptance(error_));
    if (kink_control_.meets()) {
      kink_control_.met();
      proposed = std::max(proposed, std::min(asked_, h_ * controller_.allowed(error_)));
    }
    // The factor of an implicit method serves as long as the step stays.
    if (attempt_.has_implicit_stages() && proposed >= h_ && proposed < ImplicitStages::kKeepStep * h_) proposed = h_;
    h_ = std::clamp(proposed, s.options.min_step.value_or(0), s.max_step.value_or(INFINITY));
  } else if (!options_.frozen) {
    h_ = s.step.value_or(span_);
  }
}

void RungeKuttaRun::Loop::advance() {
  const bool event = !options_.frozen && events_.reached(step_.t1);
  const bool kink = !options_.frozen && !event && step_.t1 < end_ && kink_control_.reached(step_.t1);
  attempt_.advance(event ? events_.resume_time() : kink ? kink_control_.resume_time() : step_.t1);
  if (event && adaptive_) {  // the steps before say nothing about those after it
    const IntegratorSettings& s = settings_.integrator;
    controller_ = StepController(rk_.error_order, s.options);
    h_ = std::clamp(attempt_.first_step(s, end_ - step_.t), s.options.min_step.value_or(0),
                    s.max_step.value_or(INFINITY));
    if (attempt_.passage()) attempt_.passage()->forget();
  }
  if (event || kink) attempt_.restart();
  result_.last_good_time = step_.t;
  ++frozen_index_;
  if (options_.after_step) options_.after_step({step_.t, step_.y0, step_.angles0});
  if (options_.progress && !options_.progress(step_.t)) {
    stop(SimulationStatus::stopped, fmt::format("stopped at t = {:.6g} s", step_.t));
  }
}

void RungeKuttaRun::Loop::add_statistics() {
  result_.y_end = step_.y0;
  SimulationStatistics& s = result_.statistics;
  stiffness_.add_to(s);
  s.weak_joints_error = error_of_weak_joints(mechanism_, settings_.formulation, attempt_.dynamics().worst_residual(),
                                             step_.t, step_.y0, step_.angles0);
  s.max_acceleration_residual =
      std::max({attempt_.dynamics().worst_residual(), s.weak_joints_error, penalty_ ? penalty_->projected_share() : 0});
  s.relative_energy_drift = guard_.relative_energy_drift();
  attempt_.add_counts(s);
}

}  // namespace mbsopt
