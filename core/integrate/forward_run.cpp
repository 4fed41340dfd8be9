#include "core/integrate/forward_run.hpp"

#include <stdexcept>
#include <utility>

#include "core/integrate/runge_kutta_run.hpp"
#include "core/watch/jump_watch.hpp"
#include "core/watch/quadrature_watch.hpp"
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

}  // namespace

ForwardRun::ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                       Assembly assembly)
    : mechanism_(mechanism),
      settings_(settings),
      costs_(costs),
      method_(method_of(settings)),
      assembly_(std::move(assembly)) {
  if (mechanism.data().needs_motion) motion_.emplace(mechanism, settings.formulation);
  result_.psi.setZero(static_cast<Eigen::Index>(costs.size()));
  result_.last_good_time = settings.start_time;
  result_.y_initial = assembly_.result().y;
  if (!assembly_.result().ok) {
    result_.status = SimulationStatus::assembly_failed;
    result_.message = assembly_.result().message;
  }
}

void ForwardRun::go(std::span<const double> observed, const Observe& observe, const RunOptions& options,
                    const Follow& follow) {
  if (!result_.ok()) return;
  SampleSchedule schedule(costs_, observed, settings_.end_time);
  RungeKuttaRun run(mechanism_, settings_, method_, costs_);
  Eigen::VectorXd y(mechanism_.states());
  bool followed = true;
  QuadratureWatch watch(method_, costs_, motion());
  std::optional<JumpWatch> jumps;
  if (follow && !options.frozen) {  // given steps have been looked at where they were found
    jumps.emplace(mechanism_, settings_, costs_, motion());
    jumps->begin({settings_.start_time, assembly_.result().y, assembly_.result().angles, motion()});
  }
  std::span<const SampleEvent> events;
  std::vector<StepObserver> observers;
  observers.push_back([&](const Step& step) {
    events = schedule.take(step.t1);
    return add_running_costs(step, y, options.frozen ? nullptr : &watch);
  });
  if (jumps)
    observers.push_back([&](const Step& step) {
      jumps->look_at({step.t1, step.y1, step.angles1, motion()});
      return std::string();
    });
  observers.push_back([&](const Step& step) {
    sample(step, events, observe, y);
    return std::string();
  });
  if (follow)
    observers.push_back([&](const Step& step) {
      followed = follow(step, events) && followed;
      return through_zero_length(mechanism_.data(), step.t, step.y0, step.t1, step.y1);
    });
  run.run(
      assembly_.result().y, assembly_.result().angles, [&](double t1) { return schedule.due(t1); }, observers, options,
      result_);
  watch.add_to(result_.statistics);
  if (jumps) jumps->add_to(result_.statistics);
  angles_end_ = run.angles();
  if (result_.ok() && !followed) {
    result_.status = SimulationStatus::not_finite;
    result_.message =
        "the derivatives met a matrix that cannot be factored: a massless direction that no joint covers?";
  }
  if (!result_.ok()) return;
  add_terminal_costs();
}

void ForwardRun::add_terminal_costs() {
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    if (costs_[o].terminal) {
      result_.psi(static_cast<Eigen::Index>(o)) +=
          costs_[o].terminal->value({settings_.end_time, result_.y_end, angles_end_, motion()});
    }
  }
  if (!result_.psi.allFinite()) {
    result_.status = SimulationStatus::not_finite;
    result_.message = not_finite_costs(costs_, result_.psi);
  }
}

// Each node's state is copied once for all costs. watch: none where steps are given.
std::string ForwardRun::add_running_costs(const Step& step, Eigen::VectorXd& y, QuadratureWatch* watch) {
  const std::size_t nodes = static_cast<std::size_t>(method_.nodes);
  g_.assign(nodes * costs_.size(), 0.0);
  for (int i = 0; i < method_.nodes; ++i) {
    if (method_.node_b[i] == 0) continue;
    bool copied = false;
    for (std::size_t o = 0; o < costs_.size(); ++o) {
      if (!costs_[o].running) continue;
      if (!copied) node_state(method_, step, i, y);
      copied = true;
      const StatePoint at{step.t + method_.node_c[i] * step.h, y, step.angles0, motion()};
      const std::size_t k = o * nodes + static_cast<std::size_t>(i);
      g_[k] = costs_[o].running->value(at);
      result_.psi(static_cast<Eigen::Index>(o)) += step.h * method_.node_b[i] * g_[k];
    }
  }
  std::string objection;
  for (std::size_t o = 0; watch && objection.empty() && o < costs_.size(); ++o)
    if (costs_[o].running) objection = watch->look_at(step, o, std::span(g_).subspan(o * nodes, nodes));
  return objection;
}

void ForwardRun::sample(const Step& step, std::span<const SampleEvent> events, const Observe& observe,
                        Eigen::VectorXd& y) {
  for (const SampleEvent& e : events) {
    if (!e.cost && !observe) continue;
    dense_output(method_, step, (e.time - step.t) / step.h, y);
    const StatePoint at{e.time, y, step.angles0, motion()};
    if (e.cost)
      result_.psi(e.objective) += e.cost->value(at);
    else
      observe(e.index, at);
  }
}

}  // namespace mbsopt
