#include "core/integrate/forward_run.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/integrate/runge_kutta_run.hpp"
#include "core/run/run_ends.hpp"
#include "core/watch/jump_watch.hpp"
#include "core/watch/zero_length.hpp"

namespace mbsopt {
namespace {

const Method& method_of(const SimulationSettings& settings) {
  const Method* method = runge_kutta_method(settings.integrator.type);
  if (!method) throw std::invalid_argument("integrator '" + settings.integrator.type + "' is not known");
  if (!method->adaptive && !settings.integrator.step) {
    throw std::invalid_argument("integrator '" + settings.integrator.type + "' has no error estimate: give a step");
  }
  return *method;
}

std::optional<MotionSolver> motion_of(const Mechanism& mechanism, const SimulationSettings& settings) {
  if (!mechanism.data().needs_motion) return {};
  return std::optional<MotionSolver>(std::in_place, mechanism, settings.formulation);
}

// Whether a step ends at an event there, which derivatives follow. They do not follow a switch that is no longer held.
bool is_event(const StepSequence& steps, double t) {
  const double apart = JumpWatch::kApart * (steps.times.back() - steps.times.front());
  bool found = false;
  for (const SwitchEvent& event : steps.events) {
    if (std::abs(steps.times[event.step] + steps.sizes[event.step] - t) > apart) continue;
    if (event.after == 0) return false;
    found = true;
  }
  return found;
}

}  // namespace

ForwardRun::ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                       Assembly assembly)
    : given_(mechanism),
      given_costs_(costs),
      switches_(mechanism, costs, settings),
      mechanism_(switches_.mechanism()),
      settings_(settings),
      costs_(switches_.costs()),
      method_(method_of(settings)),
      assembly_(std::move(assembly)),
      motion_(motion_of(mechanism_, settings)),
      result_(result_at_start(assembly_, settings.start_time, costs.size())),
      quadrature_(mechanism_, method_, costs_, QuadratureWatch::Of::values, motion()),
      y_(mechanism.states()) {}

void ForwardRun::go(const Sampling& sampling, const RunOptions& options, const Follow& follow, const Cross& cross) {
  if (!result_.ok()) return;
  schedule_.emplace(costs_, sampling.times, settings_.end_time);
  sampling_ = &sampling;
  judges_ = !options.frozen;
  bool followed = true;
  ObserverOf follower(
      [&](const SeenStep& seen) {
        const Step& step = *seen.stages;
        shift_in_time_ = std::max(shift_in_time_, step.K.col(0).cwiseAbs().maxCoeff() / step.y0.cwiseAbs().maxCoeff() *
                                                      (settings_.end_time - settings_.start_time));
        followed = follow(step, samples_) && followed;
        return through_zero_length(mechanism_.data(), step.t, step.y0, step.t1, step.y1);
      },
      cross);
  std::optional<JumpWatch> jumps;
  std::vector<StepObserver*> observers{this};
  if (follow && judges_)
    observers.push_back(&jumps.emplace(given_, settings_, given_costs_, motion(), result_.statistics.jumps));
  if (follow) observers.push_back(&follower);
  StepAttempt attempt(mechanism_, settings_, method_);
  RungeKuttaRun(attempt, costs_, options, result_, &switches_, motion())
      .go(assembly_.result().y, assembly_.result().angles, observers);
  std::erase_if(result_.statistics.jumps, [&](const Jump& jump) { return is_event(result_.steps, jump.t); });
  result_.statistics.kinks = static_cast<long>(result_.steps.events.size()) - std::ssize(result_.statistics.impacts);
  quadrature_.add_to(result_.statistics);
  angles_end_ = attempt.step().angles0;
  if (result_.ok() && !followed)
    result_.stop(SimulationStatus::not_finite,
                 "the derivatives met a matrix that cannot be factored: a massless direction that no joint covers?");
  if (result_.ok()) add_terminal_costs(costs_, end(), result_);
}

std::string ForwardRun::look_at(const SeenStep& seen) {
  const Step& step = *seen.stages;
  samples_ = schedule_->take(step.t1);
  add_running_costs(step);
  std::string objection = judges_ ? quadrature_.end_step(step) : "";
  if (objection.empty()) sample(step);
  if (objection.empty() && sampling_->look_inside)
    sampling_->look_inside({step.t, step.t1, {}, [&](double t) { return inside(step, t); }});
  return objection;
}

// Each node's state is copied once for all costs.
void ForwardRun::add_running_costs(const Step& step) {
  for (int i = 0; i < method_.nodes; ++i) {
    if (method_.node_b[i] == 0) continue;
    bool copied = false;
    for (std::size_t o = 0; o < costs_.size(); ++o) {
      if (!costs_[o].running) continue;
      if (!copied) node_state(method_, step, i, y_);
      copied = true;
      const double g = costs_[o].running->value({step.t + method_.node_c[i] * step.h, y_, step.angles0, motion()});
      quadrature_.take_value(o, i, g);
      result_.psi(static_cast<Eigen::Index>(o)) += step.h * method_.node_b[i] * g;
    }
  }
}

StatePoint ForwardRun::inside(const Step& step, double t) {
  dense_output(method_, step, (t - step.t) / step.h, y_);
  return {t, y_, step.angles0, motion()};
}

void ForwardRun::sample(const Step& step) {
  for (const SampleEvent& e : samples_) {
    if (!e.cost && !sampling_->observe) continue;
    const StatePoint at = inside(step, e.time);
    if (e.cost)
      result_.psi(e.objective) += e.cost->value(at);
    else
      sampling_->observe(e.index, at);
  }
}

}  // namespace mbsopt
