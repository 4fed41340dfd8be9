#include "optim/objective.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"

namespace mbsopt {
namespace {

template <class Make>
auto at_place(const std::string& place, const Make& make) {
  try {
    return make();
  } catch (const UnknownName& error) {
    throw std::invalid_argument(place + ": " + error.what());
  }
}

std::span<const double> view(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

}  // namespace

Objective::Objective(const Scene& scene, const ObjectiveSpec& spec) : name_(spec.name) {
  const std::string place = "objectives." + spec.name;
  auto compile = [&](const std::optional<Expression>& expression, const std::string& part) {
    std::optional<CostExpression> result;
    if (!expression) return result;
    result = at_place(place + "." + part, [&] { return CostExpression(*expression, scene); });
    if (result->is_zero()) result.reset();
    return result;
  };
  running_ = compile(spec.running, "running");
  terminal_ = compile(spec.terminal, "terminal");
  const double t0 = scene.simulation.start_time, t1 = scene.simulation.end_time;
  for (std::size_t i = 0; i < spec.samples.size(); ++i) {
    const ObjectiveSample& sample = spec.samples[i];
    const std::string part = fmt::format("samples[{}]", i);
    if (!(sample.time >= t0 && sample.time <= t1))
      throw std::invalid_argument(
          fmt::format("{}.{}.time: is {} s, outside the simulated time {} to {} s", place, part, sample.time, t0, t1));
    if (std::optional<CostExpression> value = compile(sample.value, part + ".value"))
      samples_.push_back({sample.time, *std::move(value)});
  }
  std::stable_sort(samples_.begin(), samples_.end(), [](const Sample& a, const Sample& b) { return a.time < b.time; });
  if (spec.parameters_only)
    parameters_only_ =
        at_place(place + ".parameters_only", [&] { return Program(*spec.parameters_only, parameter_symbols(scene)); });
}

Objective::Objective(std::string name, std::shared_ptr<const RunningCost> running,
                     std::shared_ptr<const TerminalCost> terminal)
    : name_(std::move(name)), user_running_(std::move(running)), user_terminal_(std::move(terminal)) {}

bool Objective::needs_simulation() const {
  return running_ || terminal_ || !samples_.empty() || user_running_ || user_terminal_;
}

Cost Objective::cost(const Mechanism& mechanism) const {
  Cost cost;
  if (running_) cost.running = running_->bind(mechanism);
  if (terminal_) cost.terminal = terminal_->bind(mechanism);
  for (const Sample& sample : samples_) cost.samples.push_back({sample.time, sample.value.bind(mechanism)});
  if (user_running_) cost.running = point_cost(user_running_, mechanism.rho());
  if (user_terminal_) cost.terminal = point_cost(user_terminal_, mechanism.rho());
  return cost;
}

double Objective::parameters_only(const Eigen::VectorXd& rho) const {
  if (!parameters_only_) return 0;
  Program::Scratch scratch = parameters_only_->scratch();
  return parameters_only_->value(view(rho), scratch);
}

double Objective::add_parameters_only_gradient(const Eigen::VectorXd& rho, Eigen::Ref<Eigen::VectorXd> rho_bar) const {
  if (!parameters_only_) return 0;
  Program::Scratch scratch = parameters_only_->scratch();
  const std::span<double> gradient(rho_bar.data(), static_cast<std::size_t>(rho_bar.size()));
  return parameters_only_->add_gradient(view(rho), 1, gradient, scratch);
}

std::vector<Objective> objectives_of(const Problem& problem, const std::vector<std::string>& names) {
  std::vector<Objective> result;
  std::vector<std::string> known;
  for (const ObjectiveSpec& spec : problem.objectives) known.push_back(spec.name);
  for (const std::string& name : names.empty() ? known : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end())
      throw std::invalid_argument(
          fmt::format("there is no objective '{}'{}; known: {}", name, did_you_mean(name, known), joined(known)));
    result.emplace_back(problem.scene, problem.objectives[static_cast<std::size_t>(found - known.begin())]);
  }
  return result;
}

}  // namespace mbsopt
