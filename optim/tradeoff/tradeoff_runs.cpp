#include "optim/tradeoff/tradeoff_runs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "optim/objective/objective_run.hpp"

namespace mbsopt::inline optim {
namespace {

std::vector<bool> no_derivatives(const Scene& scene) { return std::vector<bool>(scene.parameters.size(), false); }

// Calls `body(answer, go_on)` and ends it by go_on(t) when its time is up. An exception becomes a message.
template <typename Body>
Answer run_within(const RunLimit& limit, const Body& body) {
  Answer answer;
  const Stopwatch stopwatch(limit.clock);
  bool out_of_time = false;
  double reached = 0;
  try {
    body(answer, [&](double t) {
      out_of_time = stopwatch.seconds() > limit.seconds;
      reached = t;
      if (limit.progress) limit.progress(t);
      return !out_of_time && !(limit.interrupted && limit.interrupted());
    });
  } catch (const std::exception& error) {
    answer.ok = false;
    answer.message = error.what();
    return answer;
  }
  answer.wall_seconds = stopwatch.seconds();
  answer.out_of_time = out_of_time && !answer.ok;
  if (answer.out_of_time)
    answer.message = fmt::format("took longer than {:.2g} s: abandoned at t = {:.3g} s", limit.seconds, reached);
  return answer;
}

// Methods and tolerances of integration are compared, so a driven mechanism is integrated, too.
SimulationSettings integrated(SimulationSettings settings) {
  settings.solve = Solve::dynamics;
  return settings;
}

}  // namespace

TradeoffRuns::TradeoffRuns(Scene scene, std::vector<Objective> objectives)
    : scene_(std::move(scene)),
      objectives_(std::move(objectives)),
      mechanism_(scene_, parameter_values(scene_), no_derivatives(scene_)) {}

bool TradeoffRuns::has_gradients() const {
  return !scene_.parameters.empty() &&
         std::any_of(objectives_.begin(), objectives_.end(), [](const Objective& o) { return o.needs_simulation(); });
}

GradientMethod TradeoffRuns::discrete_method() const {
  const GradientCost cost = gradient_cost(scene_.parameters.size(), objectives_.size());
  return cost.tlm <= cost.adjoint ? GradientMethod::tlm : GradientMethod::adjoint;
}

Answer TradeoffRuns::run(const SimulationSettings& given, const RunLimit& limit, bool sampled) const {
  return run_within(limit, [&](Answer& answer, const std::function<bool(double)>& go_on) {
    const SimulationSettings settings = integrated(given);
    const Eigen::VectorXd rho = parameter_values(scene_);
    RunOptions options;
    options.progress = go_on;
    const Mechanism mechanism(scene_, rho, no_derivatives(scene_));
    const auto simulated = [&](std::span<const Cost> costs) {
      Sampling sampling;
      if (sampled) {
        answer.motion.times = sample_times(settings, kSamples);
        sampling = record_motion(mechanism, answer.motion);
      }
      return simulate(mechanism, settings, costs, sampling, options);
    };
    SimulationResult result = run_objectives(objectives_, mechanism, settings, simulated, go_on);
    answer.ok = result.ok();
    answer.message = result.message;
    answer.statistics = result.statistics;
    answer.y_initial = std::move(result.y_initial);
    answer.steps = std::move(result.steps);
    if (!answer.ok) return;
    answer.psi = result.psi;
    for (std::size_t i = 0; i < objectives_.size(); ++i)
      answer.psi(static_cast<Eigen::Index>(i)) += objectives_[i].parameters_only(rho);
    answer.ok = answer.psi.allFinite() && answer.motion.states.allFinite();
    if (!answer.ok) answer.message = "an objective or the motion is not finite";
  });
}

Answer TradeoffRuns::gradients(const SimulationSettings& settings, GradientMethod method, const RunLimit& limit) const {
  return run_within(limit, [&](Answer& answer, const std::function<bool(double)>& go_on) {
    Scene scene = scene_;
    scene.simulation = integrated(settings);
    EvaluatorOptions options;
    options.method = method;
    options.progress = go_on;
    Evaluator evaluator(std::move(scene), objectives_, {}, options);
    const Evaluation e = evaluator.gradients(evaluator.start());
    answer.ok = e.ok;
    answer.message = e.message;
    answer.psi = e.psi;
    answer.psi_rho = e.psi_rho;
    answer.statistics = e.statistics;
    answer.steps = e.steps;
  });
}

}  // namespace mbsopt::inline optim
