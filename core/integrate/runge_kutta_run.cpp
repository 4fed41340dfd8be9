#include "core/integrate/runge_kutta_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mechanism/mechanism_data.hpp"
#include "core/run/run_ends.hpp"
#include "core/run/timed_laws.hpp"
#include "core/start/model_warnings.hpp"

namespace mbsopt {
namespace {

constexpr double kMostSteps = 1e10;
constexpr double kInstant = 1e-12;       // of the run: pieces of functions of time end within a tenth of it
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

RungeKuttaRun::RungeKuttaRun(StepAttempt& attempt, std::span<const Cost> costs, const RunOptions& options,
                             SimulationResult& result, Switches* switches, MotionSource* motion)
    : attempt_(attempt),
      step_(attempt.step()),
      mechanism_(attempt.mechanism()),
      settings_(attempt.settings()),
      integrator_(settings_.integrator),
      options_(options),
      result_(result),
      frozen_(options.frozen),
      adaptive_(!integrator_.step && !frozen_ && attempt.method().adaptive),
      end_(settings_.end_time),
      span_(settings_.end_time - settings_.start_time),
      controller_(attempt.method().error_order, integrator_.options),
      events_(settings_.events, settings_.start_time, end_),
      kink_control_({}, settings_.start_time, end_),
      switches_(switches && switches->count() > 0 ? switches : nullptr),
      guard_(switches ? switches->given().data() : mechanism_.data(), attempt.projector(), settings_, result.statistics,
             !frozen_),
      penalty_(mechanism_.data()),
      stiffness_(attempt.method(), mechanism_.states(), result.statistics) {
  if (adaptive_ && attempt.responses() > 0) passage_.emplace(attempt.method(), attempt.responses());
  if (frozen_) return;
  pulses_.emplace(mechanism_, settings_, costs, pulse_nodes(attempt.method()));
  std::vector<double> jumps = pulses_->jumps();
  if (switches_) {
    crossings_.emplace(*switches_, settings_, motion);
    for (std::size_t k = 0; k < switches_->count(); ++k) {
      if (!switches_->is_of_time(k)) continue;
      for (const double zero : switches_->zeros(k, settings_.start_time, end_)) {
        std::erase_if(jumps, [&](double t) { return std::abs(t - zero) <= kInstant * span_; });
        jumps.push_back(zero);
      }
    }
  }
  kink_control_ = KinkControl(with_jumps(kinks_of(mechanism_, costs), std::move(jumps)), settings_.start_time, end_);
}

void RungeKuttaRun::go(const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                       std::span<StepObserver* const> observers, std::size_t first, std::size_t last) {
  frozen_index_ = first;
  is_part_ = last != SIZE_MAX;
  if (frozen_) last_ = std::min(last, frozen_->sizes.size());
  if (settings_.formulation.type == FormulationType::penalty && attempt_.projector().active())
    observers_.push_back(&penalty_);
  observers_.insert(observers_.end(), {&stiffness_, &guard_});
  observers_.insert(observers_.end(), observers.begin(), observers.end());
  if (!begin(y, angles)) return;
  choose_first_size();
  while (goes_on() && choose_size()) {
    const StepOutcome outcome = try_step();
    if (outcome != StepOutcome::accepted) {
      reject(outcome);
      continue;
    }
    if (passes_event() || is_better_placed_elsewhere()) continue;
    note_step();
    if (!result_.ok()) break;
    choose_next_size();
    advance();
  }
  add_statistics();
}

// Never beyond the event; an adaptive run does not leave a tiny last step.
double RungeKuttaRun::size_to(double event) const {
  const double left = event - step_.t;
  if (h_ >= left * (1 - 1e-9)) return left;
  return adaptive_ && 2 * h_ > left ? 0.5 * left : h_;
}

double RungeKuttaRun::limited(double h) const {
  return std::clamp(h, integrator_.options.min_step.value_or(0), integrator_.max_step.value_or(INFINITY));
}

SeenStep RungeKuttaRun::seen() const {
  return {{step_.t, step_.y0, step_.angles0}, {step_.t1, step_.y1, step_.angles1}, attempt_.worst_residual(), &step_};
}

bool RungeKuttaRun::begin(const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  const double t = frozen_ && frozen_index_ < last_ ? frozen_->times[frozen_index_] : settings_.start_time;
  result_.last_good_time = t;
  if (crossings_) {
    if (const std::optional<std::size_t> passed = crossings_->begin({t, y, angles})) {
      result_.stop(SimulationStatus::not_credible,
                   fmt::format("limit '{}' is passed at the start, t = {:.6g} s", switches_->limit(*passed).name, t));
      return false;
    }
    result_.steps.sides = switches_->sides();
  } else if (switches_) {
    follow_given_events();
  }
  if (std::string words = objection_to_start(observers_, {t, y, angles}); !words.empty()) {
    result_.stop(SimulationStatus::not_credible, std::move(words));
    return false;
  }
  // Rounding errors can hide a singular mass matrix, and give accelerations without meaning.
  if (!attempt_.begin(t, y, angles) || (!frozen_ && !massless_bodies(mechanism_.data(), y).empty())) {
    result_.stop(SimulationStatus::not_finite,
                 start_failure(mechanism_.data(), t) + about_alpha(settings_.formulation));
    return false;
  }
  // A guard on which scenes are taken to be planar: what was assembled in space satisfies the planar equations.
  if (attempt_.is_planar() && !frozen_) {
    Projector& projector = attempt_.projector();
    const double unmet = std::max(projector.position_violation(t, angles, y), projector.velocity_violation(t, y));
    if (unmet > 1e-6 * (1 + y.cwiseAbs().maxCoeff())) {
      result_.stop(SimulationStatus::not_credible,
                   fmt::format("the start does not satisfy the equations of the planar model, by {:.3g}: set "
                               "simulation.model to \"spatial\"",
                               unmet));
      return false;
    }
  }
  return true;
}

// Other costs have other switches, so a run again with its own costs is the only one that holds theirs.
void RungeKuttaRun::follow_given_events() {
  const std::size_t held = is_part_ ? switches_->count() : switches_->of_mechanism();
  for (std::size_t k = 0; k < switches_->count(); ++k)
    switches_->hold(k, k < held && k < frozen_->sides.size() ? frozen_->sides[k] : 0);
  given_events_.clear();
  for (const SwitchEvent& event : frozen_->events) {
    if (event.of >= held) continue;
    given_events_.push_back(event);
    if (event.step < frozen_index_) switches_->hold(event.of, event.after);
  }
  if (!is_part_) {
    result_.steps.sides = switches_->sides();
    result_.steps.events = given_events_;
  }
}

// Tolerances that no step can meet explain whatever else may have become of the steps.
std::string RungeKuttaRun::tolerances_or(std::string message) const {
  return adaptive_ && beyond_digits(attempt_.tolerances(), step_.y0) ? too_few_digits(integrator_, step_.t)
                                                                     : std::move(message);
}

void RungeKuttaRun::choose_first_size() {
  longest_ = h_ = limited(adaptive_ ? attempt_.first_size(span_) : integrator_.step.value_or(span_));
  if (!(h_ > 0)) {
    result_.stop(SimulationStatus::step_too_small,
                 tolerances_or(step_failure(StepOutcome::rejected, step_.t, h_, adaptive_, settings_.formulation)));
  }
  if (adaptive_ && h_ * kMostSteps * kMostSteps < span_) {  // steps may still grow, but not so much
    result_.stop(SimulationStatus::step_too_small, tolerances_or(too_long_run(span_, h_)));
  }
}

bool RungeKuttaRun::choose_size() {
  if (result_.statistics.steps + result_.statistics.rejected >= integrator_.max_steps) {
    result_.stop(SimulationStatus::too_many_steps,
                 tolerances_or(fmt::format("more than {} steps were needed; stopped at t = {:.6g} s with steps of "
                                           "{:.3g} s. Loosen rtol and atol, raise simulation.integrator.max_steps, or "
                                           "look for very stiff springs or dampers",
                                           integrator_.max_steps, step_.t, h_)));
    return false;
  }
  if (frozen_) {
    attempt_.set_time(frozen_->times[frozen_index_]);
    h_ = frozen_->sizes[frozen_index_];
    return true;
  }
  if (split_) return true;
  const double rate = fastest_followed_rate(mechanism_.data(), step_.y0), to_event = events_.stop_after(step_.t);
  if (adaptive_ && rate * h_ > 2)
    h_ = rounded_step(2 / rate);  // an angle is followed over turns only when steps are below half a turn
  asked_ = size_to(to_event);
  h_ = wanted_ = kink_control_.choose(step_.t, asked_, !adaptive_);
  if (passage_) {
    largest_ = std::min({integrator_.max_step.value_or(INFINITY), rate > 0 ? 2 / rate : INFINITY, to_event - step_.t,
                         h_ < asked_ ? h_ : INFINITY});
    const double placed = passage_->propose(step_.t, h_, largest_);
    if (placed != h_) h_ = rounded_step(placed, kPartsOfPlaced);
  }
  if (adaptive_ || !(rate * h_ > 3)) return true;
  result_.stop(SimulationStatus::step_too_large,
               fmt::format("at t = {:.6g} s a joint whose angle is used turns by {:.3g} rad in one step of {:.3g} s; "
                           "more than half a turn cannot be followed: use a smaller simulation.integrator.step",
                           step_.t, rate * h_, h_));
  return false;
}

StepOutcome RungeKuttaRun::try_step() {
  const StepGoal goal = !adaptive_              ? StepGoal::fixed
                        : options_.exact_stages ? StepGoal::derivatives
                                                : StepGoal::tolerance;
  const auto [outcome, error] = attempt_.solve(h_, goal, passage_ && passage_->near(step_.t, h_));
  error_ = error;
  if (outcome != StepOutcome::accepted) return outcome;
  if (crossings_ && adaptive_) error_ = crossings_->with_derivatives(step_.t, h_, error);
  if (error_ > 1 && adaptive_) return StepOutcome::rejected;
  if (pulses_ && passes_over_pulse()) return StepOutcome::rejected;
  const double t1 = ends_with(step_.t + h_) ? end_ : step_.t + h_;
  return attempt_.finish(t1, std::ranges::any_of(observers_, [&](auto* o) { return o->reads_inside(t1); }));
}

// Returns whether to try shorter steps, since this one misses a pulse; its error is that of the pulse.
bool RungeKuttaRun::passes_over_pulse() {
  if (h_ <= kInstant * span_) return false;
  const double least = std::max(PulseWatch::kShortest * span_, integrator_.options.min_step.value_or(0));
  const auto change = [&](double at, double beside, double duration) {
    return attempt_.change_by(at, beside, duration);
  };
  Pulse worst = pulses_->worst(step_.t, h_, adaptive_, step_.y0, step_.angles0, change);
  if (adaptive_ && h_ > least) {
    if (worst.error > PulseWatch::kMissed) error_ = worst.error;
    return worst.error > PulseWatch::kMissed;
  }
  worst.error *= integrator_.rtol;
  if (worst.error > result_.statistics.pulse.error) result_.statistics.pulse = worst;
  return false;
}

// Returns whether to try the step again, with another size about a singular position.
bool RungeKuttaRun::is_better_placed_elsewhere() {
  if (!passage_) return false;
  constexpr int kMostTries = 3;
  // The passage is to know of this step in any case.
  const bool is_well_placed = passage_->well_placed(step_.t, step_.h, wanted_, largest_, attempt_.response());
  const bool again =
      !is_well_placed && !split_ && std::abs(passage_->propose(step_.t, wanted_, largest_) - step_.h) > 0.02 * step_.h;
  if (again && placed_again_ < kMostTries) {
    ++placed_again_;
    ++result_.statistics.rejected;
    ++result_.statistics.rejections.placed_again;
    h_ = wanted_;
    return true;
  }
  placed_again_ = 0;
  passage_->accept();
  return false;
}

// Returns whether to try the step again: up to an event within it, or after one at its start.
bool RungeKuttaRun::passes_event() {
  if (!crossings_) return false;
  const auto& [size, at_start, rests] = crossings_->look_at(step_, error_);
  if (rests)
    result_.stop(SimulationStatus::not_credible,
                 fmt::format("limit '{}' comes to rest at t = {:.6g} s: resting contact is not followed. End the run "
                             "before, or let a force of type contact or stop hold it instead",
                             switches_->limit(*rests).name, step_.t));
  if (rests) return true;
  for (SwitchEvent event : at_start) {
    if (result_.statistics.steps > 0) {
      event.step = result_.steps.sizes.size() - 1;
      result_.steps.events.push_back(event);
      cross(event, step_.t, step_.y0, step_.angles0);
    } else {
      switches_->hold(event.of, event.after);
      result_.steps.sides = switches_->sides();
    }
  }
  if (!at_start.empty()) {
    if (result_.statistics.steps > 0) cross_driven(step_.t);
    attempt_.restart();
  }
  if (!size) return !at_start.empty();
  if (!split_) split_ = h_;
  h_ = *size;
  return true;
}

// Changes what jumps with the changes so far, at the end of the last step.
void RungeKuttaRun::cross_driven(double t) {
  const StatePoint at{step_.t, step_.y0, step_.angles0};
  while (std::optional<SwitchEvent> event = crossings_->driven(at)) {
    event->step = result_.steps.sizes.size() - 1;
    result_.steps.events.push_back(*event);
    cross(*event, t, step_.y0, step_.angles0);
  }
  crossings_->restart(at);
}

void RungeKuttaRun::cross(const SwitchEvent& event, double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  for (StepObserver* const observer : observers_) observer->cross(event, {t, y, angles});
  switches_->hold(event.of, event.after);
  if (crossings_) crossings_->changed(event, step_.t);
  if (!switches_->is_limit(event.of)) return;
  const std::string& name = switches_->limit(event.of).name;
  const std::optional<double> impulse = attempt_.strike(*switches_, event.of);
  if (impulse && !is_part_) result_.statistics.impacts.push_back({name, t, *impulse});
  if (!impulse)
    result_.stop(SimulationStatus::not_credible,
                 fmt::format("limit '{}' is struck at t = {:.6g} s, but joints and drives leave no motion away from it",
                             name, t));
}

void RungeKuttaRun::reject(StepOutcome outcome) {
  SimulationStatistics& count = result_.statistics;
  attempt_.reject();
  split_.reset();
  if (crossings_) crossings_->forget();
  if (!adaptive_) {
    result_.stop(outcome == StepOutcome::unsolved          ? SimulationStatus::not_solved
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
        mechanism_, settings_.formulation, attempt_.worst_of_rejected(), step_.t, step_.y0, step_.angles0));
    if (!objection.empty()) {
      result_.stop(SimulationStatus::not_credible,
                   fmt::format("of {} steps to t = {:.6g} s {} were rejected: {}", count.steps + count.rejected,
                               step_.t, count.rejected, objection));
      return;
    }
  }
  const double error = outcome == StepOutcome::rejected ? error_ : INFINITY;
  if (kink_control_.crosses()) {
    kink_control_.rejected_across(h_, error);
    h_ = asked_;
    return;
  }
  const double tried = h_;
  h_ = rounded_step(h_ * controller_.after_rejection(error));
  const std::optional<double> min_step = integrator_.options.min_step;
  if (min_step && h_ < *min_step) {
    h_ = *min_step;
    if (tried > h_) return;
    result_.stop(SimulationStatus::step_too_small, tolerances_or(below_min_step(outcome, step_.t, *min_step)));
    return;
  }
  if (h_ >= 1e-14 * std::max(span_, std::abs(step_.t))) return;
  result_.stop(SimulationStatus::step_too_small,
               tolerances_or(longest_ * kMostSteps < span_
                                 ? too_long_run(span_, longest_)
                                 : step_failure(outcome, step_.t, h_, adaptive_, settings_.formulation)));
}

// Notes an accepted step, and shows it to all that look at the run.
void RungeKuttaRun::note_step() {
  SimulationStatistics& s = result_.statistics;
  ++s.steps;
  if (attempt_.projected_error() > s.projected_error) {
    s.projected_error = attempt_.projected_error();
    s.projected_error_time = step_.t;
  }
  if (!is_part_) result_.steps.add(step_.t, h_);
  longest_ = std::max(longest_, h_);
  std::string words = objection_to(seen(), observers_);
  if (!words.empty()) result_.stop(SimulationStatus::not_credible, std::move(words));
}

void RungeKuttaRun::choose_next_size() {
  if (frozen_) return;
  if (split_) {
    h_ = std::exchange(split_, std::nullopt).value();
    if (!adaptive_) h_ -= step_.h;  // the grid of fixed steps stays
    return;
  }
  if (!adaptive_) {
    h_ = integrator_.step.value_or(span_);
    return;
  }
  if (kink_control_.crosses()) {
    kink_control_.accepted_across(h_, error_);
    if (kink_control_.limits(asked_)) {
      h_ = asked_;
      return;
    }
  }
  // Past a singular position the estimate is magnified rounding, which is not to decide on the next step.
  const bool passed = passage_ && passage_->passed_since(step_.t);
  if (passed) controller_.after_passage();
  double proposed = passed ? wanted_ : rounded_step(h_ * controller_.after_acceptance(error_));
  if (kink_control_.meets()) {
    kink_control_.met();
    proposed = std::max(proposed, std::min(asked_, h_ * controller_.allowed(error_)));
  }
  // The factor of an implicit method serves as long as the step stays.
  if (attempt_.keeps_sizes() && proposed >= h_ && proposed < ImplicitStages::kKeepStep * h_) proposed = h_;
  h_ = limited(proposed);
}

void RungeKuttaRun::advance() {
  const bool event = !frozen_ && events_.reached(step_.t1);
  const bool kink = !frozen_ && !event && step_.t1 < end_ && kink_control_.reached(step_.t1);
  const double t1 = step_.t1, next = event                                      ? events_.resume_time()
                                     : kink                                     ? kink_control_.resume_time()
                                     : crossings_ && crossings_->ends_at_time() ? t1 + kink_control_.past()
                                                                                : t1;
  std::vector<SwitchEvent> changes;
  if (crossings_ && t1 < end_) {
    changes = crossings_->advance(step_, next);
    for (SwitchEvent& change : changes) change.step = result_.steps.sizes.size() - 1;
    result_.steps.events.insert(result_.steps.events.end(), changes.begin(), changes.end());
  } else if (switches_ && frozen_) {
    auto found = std::ranges::lower_bound(given_events_, frozen_index_, {}, &SwitchEvent::step);
    for (; found != given_events_.end() && found->step == frozen_index_; ++found) changes.push_back(*found);
  }
  attempt_.advance(next);
  for (const SwitchEvent& change : changes) cross(change, t1, step_.y0, step_.angles0);
  if (crossings_ && !changes.empty()) cross_driven(t1);
  if (event && adaptive_) {  // the steps before say nothing about those after it
    controller_ = StepController(attempt_.method().error_order, integrator_.options);
    h_ = limited(attempt_.first_size(end_ - step_.t));
    if (passage_) passage_->forget();
  }
  if (!changes.empty() && adaptive_) h_ = std::min(h_, limited(attempt_.first_size(end_ - step_.t)));
  if (event || kink || !changes.empty()) attempt_.restart();
  result_.last_good_time = step_.t;
  ++frozen_index_;
  report_step({step_.t, step_.y0, step_.angles0}, options_, result_);
}

void RungeKuttaRun::add_statistics() {
  result_.y_end = step_.y0;
  add_residuals(mechanism_, settings_.formulation, attempt_.worst_residual(), {step_.t, step_.y0, step_.angles0},
                result_.statistics);
  double& worst = result_.statistics.max_acceleration_residual;
  worst = std::max(worst, penalty_.share());
  attempt_.add_to(result_.statistics);
}

}  // namespace mbsopt
