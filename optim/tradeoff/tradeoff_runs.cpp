#include "optim/tradeoff/tradeoff_runs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "optim/objective/objective_run.hpp"

namespace mbsopt {
namespace {

std::vector<bool> no_derivatives(const Scene& scene) { return std::vector<bool>(scene.parameters.size(), false); }

// Follows a run and ends it when its time is up.
class Watch {
 public:
  explicit Watch(const RunLimit& limit) : limit_(limit), stopwatch_(limit.clock) {}
  bool go_on(double t) {
    out_of_time_ = stopwatch_.seconds() > limit_.seconds;
    t_ = t;
    if (limit_.progress) limit_.progress(t);
    return !out_of_time_ && !(limit_.interrupted && limit_.interrupted());
  }
  double seconds() const { return stopwatch_.seconds(); }
  void note(Answer& answer) const {
    if (answer.ok || !out_of_time_) return;
    answer.out_of_time = true;
    answer.message = fmt::format("took longer than {:.2g} s: abandoned at t = {:.3g} s", limit_.seconds, t_);
  }

 private:
  const RunLimit& limit_;
  Stopwatch stopwatch_;
  bool out_of_time_ = false;
  double t_ = 0;
};

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

Answer TradeoffRuns::values(const SimulationSettings& settings, const RunLimit& limit) const {
  return run(settings, limit, nullptr, false);
}

Answer TradeoffRuns::motion(const SimulationSettings& settings, const RunLimit& limit,
                            const StepSequence* frozen) const {
  return run(settings, limit, frozen, true);
}

Answer TradeoffRuns::run(const SimulationSettings& given, const RunLimit& limit, const StepSequence* frozen,
                         bool sampled) const {
  Answer answer;
  Watch watch(limit);
  const SimulationSettings settings = integrated(given);
  const Eigen::VectorXd rho = parameter_values(scene_);
  std::vector<const Objective*> simulated;
  for (const Objective& o : objectives_)
    if (o.needs_simulation()) simulated.push_back(&o);
  RunOptions options;
  options.frozen = frozen;
  options.progress = [&](double t) { return watch.go_on(t); };
  SimulationResult result;
  try {
    const Mechanism mechanism(scene_, rho, no_derivatives(scene_));
    result = ObjectiveRun(simulated, mechanism, settings, options.progress).run([&](std::span<const Cost> costs) {
      Sampling sampling;
      if (sampled) {
        answer.motion.times = sample_times(settings, kSamples);
        sampling = record_motion(mechanism, answer.motion);
      }
      return simulate(mechanism, settings, costs, sampling, options);
    });
  } catch (const std::exception& error) {
    answer.message = error.what();
    return answer;
  }
  answer.wall_seconds = watch.seconds();
  answer.ok = result.ok();
  answer.message = result.message;
  answer.statistics = result.statistics;
  answer.y_initial = std::move(result.y_initial);
  answer.steps = std::move(result.steps);
  watch.note(answer);
  if (!answer.ok) return answer;
  answer.psi.setZero(static_cast<Eigen::Index>(objectives_.size()));
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < objectives_.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    if (objectives_[i].needs_simulation()) answer.psi(k) = result.psi(row++);
    answer.psi(k) += objectives_[i].parameters_only(rho);
  }
  if (answer.psi.allFinite() && answer.motion.states.allFinite()) return answer;
  answer.ok = false, answer.message = "an objective or the motion is not finite";
  return answer;
}

Answer TradeoffRuns::gradients(const SimulationSettings& settings, GradientMethod method, const RunLimit& limit) const {
  Answer answer;
  Watch watch(limit);
  Scene scene = scene_;
  scene.simulation = integrated(settings);
  EvaluatorOptions options;
  options.method = method;
  options.progress = [&](double t) { return watch.go_on(t); };
  try {
    Evaluator evaluator(std::move(scene), objectives_, {}, options);
    const Evaluation& e = evaluator.gradients(evaluator.start());
    answer.ok = e.ok;
    answer.message = e.message;
    answer.psi = e.psi, answer.psi_rho = e.psi_rho;
    answer.statistics = e.statistics;
    answer.steps = e.steps;
  } catch (const std::exception& error) {
    answer.message = error.what();
    return answer;
  }
  answer.wall_seconds = watch.seconds();
  watch.note(answer);
  return answer;
}

}  // namespace mbsopt
