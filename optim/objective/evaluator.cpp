#include "optim/objective/evaluator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <unordered_map>
#include <unordered_set>

#include "core/cvodes/cvodes.hpp"
#include "core/expression/counted.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/objective_run.hpp"
#include "optim/objective/obstructed_parameters.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline optim {
std::string_view to_string(GradientMethod method) {
  switch (method) {
    case GradientMethod::tlm:
      return "tlm";
    case GradientMethod::adjoint:
      return "adjoint";
    case GradientMethod::cvodes_forward:
      return "cvodes_forward";
    case GradientMethod::cvodes_adjoint:
      return "cvodes_adjoint";
    case GradientMethod::differences:
      return "fd";
    case GradientMethod::automatic:
      break;
  }
  return "auto";
}

GradientCost gradient_cost(std::size_t variables, std::size_t objectives) {
  const double blocks = std::ceil(static_cast<double>(variables) / 4);
  return {1.5 + 2.2 * blocks, 1.7 + 0.9 * static_cast<double>(objectives)};
}

Evaluator::Evaluator(Scene scene, std::vector<Objective> objectives, const std::vector<std::string>& variables,
                     EvaluatorOptions options)
    : scene_(std::move(scene)),
      objectives_(std::move(objectives)),
      variables_(parameter_indices(scene_, variables)),
      active_(scene_.parameters.size(), false),
      options_(std::move(options)),
      programs_(std::make_shared<ScenePrograms>(scene_)) {
  for (const int k : variables_) active_[static_cast<std::size_t>(k)] = true;
  for (std::size_t i = 0; i < objectives_.size(); ++i)
    if (objectives_[i].needs_simulation()) simulated_.push_back(i);
  find_unused();
}

void Evaluator::find_unused() {
  if (objectives_.empty()) return;
  Problem judged;
  judged.scene = scene_;
  for (const Objective& o : objectives_)
    if (!o.is_written_in_cpp()) judged.objectives.push_back(o.spec());
  bool opaque = judged.objectives.size() < objectives_.size() || !options_.user_forces.empty();
  for (Force& force : judged.scene.forces) {
    if (auto* const user = std::get_if<UserForceSpec>(&force.kind)) opaque = true, user->parameters.clear();
  }
  std::vector<SceneIssue> unused = find_unused_parameters(judged);
  if (opaque) {  // may look at every body
    judged.objectives.clear();
    const std::vector<SceneIssue> by_model = find_unused_parameters(judged);
    std::unordered_set<std::string> paths;
    for (const SceneIssue& issue : by_model) paths.insert(issue.path);
    std::erase_if(unused, [&](const SceneIssue& issue) { return !paths.contains(issue.path); });
  }
  if (unused.empty()) return;
  std::unordered_map<std::string, std::size_t> variables;  // by path
  for (std::size_t k = 0; k < variables_.size(); ++k)
    variables.emplace("parameters." + scene_.parameters[static_cast<std::size_t>(variables_[k])].name, k);
  for (const SceneIssue& issue : unused) {
    const auto variable = variables.find(issue.path);
    if (variable == variables.end()) continue;
    if (!opaque) throw std::invalid_argument(issue.path + ": " + issue.message);
    perhaps_unused_.push_back(variable->second);
  }
}

// The first gradient decides whether C++ code uses a variable. In a search its derivatives may become 0 (max(0, x)).
void Evaluator::judge_zero_columns(Evaluation& e) const {
  for (const std::size_t k : perhaps_unused_) {
    if (!e.ok || e.psi_rho.col(static_cast<Eigen::Index>(k)).any()) continue;
    const std::string& name = scene_.parameters[static_cast<std::size_t>(variables_[k])].name;
    if (has_differentiated_) {
      e.warnings.push_back(fmt::format(
          "parameters.{}: its derivatives are all exactly 0 here: only C++ code uses it, and does not at these values",
          name));
      continue;
    }
    e.ok = false;
    e.message = fmt::format(
        "parameters.{}: is used by nothing in the scene, and no objective or force written in C++ has a derivative in "
        "it: its gradient entries are all exactly 0; allow_unused lifts this error",
        name);
  }
}

Eigen::VectorXd Evaluator::start() const { return parameter_values(scene_); }

Evaluation Evaluator::run(const Eigen::VectorXd& rho, Sweep sweep, const StepSequence* frozen, bool by_cvodes) const {
  const Stopwatch stopwatch;
  Evaluation e;
  e.rho = rho;
  e.psi.setZero(static_cast<Eigen::Index>(objectives_.size()));
  if (sweep != Sweep::none) e.psi_rho.setZero(e.psi.size(), static_cast<Eigen::Index>(variables_.size()));
  e.ok = has_finite_parameters(e) && add_simulated(e, sweep, frozen, by_cvodes) &&
         add_parameters_only(e, sweep != Sweep::none) && has_finite_objectives(e);
  e.wall_seconds = stopwatch.seconds();
  return e;
}

// An optimiser's own numbers may overflow.
bool Evaluator::has_finite_parameters(Evaluation& e) const {
  for (Eigen::Index k = 0; k < e.rho.size(); ++k) {
    if (std::isfinite(e.rho(k))) continue;
    e.message = fmt::format("parameters.{}: is no finite number", scene_.parameters[static_cast<std::size_t>(k)].name);
    return false;
  }
  return true;
}

bool Evaluator::has_finite_objectives(Evaluation& e) const {
  for (Eigen::Index i = 0; i < e.psi.size(); ++i) {
    if (std::isfinite(e.psi(i)) && (!e.has_gradients() || e.psi_rho.row(i).allFinite())) continue;
    e.message = fmt::format("the objective '{}' or its gradient is not finite here",
                            objectives_[static_cast<std::size_t>(i)].name());
    return false;
  }
  return true;
}

bool Evaluator::add_simulated(Evaluation& e, Sweep sweep, const StepSequence* frozen, bool by_cvodes) const {
  if (simulated_.empty()) return true;
  const SimulationSettings settings = by_cvodes ? with_cvodes(scene_.simulation) : scene_.simulation;
  if (options_.progress && !options_.progress(settings.start_time)) {  // the assembly alone may take a second
    e.message = "stopped before its simulation";
    return false;
  }
  // Derivatives are computed only if a sweep needs them.
  const std::vector<bool> active = sweep == Sweep::none ? std::vector<bool>(active_.size(), false) : active_;
  SimulationResult result;
  try {
    const Mechanism mechanism(scene_, e.rho, active, options_.user_forces, programs_);
    ObjectiveRun objective_run(simulated(), mechanism, settings, options_.progress);
    result = objective_run.run([&](std::span<const Cost> costs) {
      const RunOptions run_options{
          .frozen = frozen, .progress = options_.progress, .exact_stages = options_.exact_stages};
      ++e.simulations;
      return sweep == Sweep::forward    ? simulate_tlm(mechanism, settings, costs, {}, run_options)
             : sweep == Sweep::backward ? simulate_adjoint(mechanism, settings, costs, run_options)
                                        : simulate(mechanism, settings, costs, {}, run_options);
    });
  } catch (const SceneError& error) {  // a field that this rho drives out of its range
    e.message = error.what();
    return false;
  } catch (const NoMotion& error) {
    e.message = error.what();
    return false;
  }
  e.statistics = result.statistics;
  if (!frozen) e.warnings = simulation_warnings(scene_, settings, result.statistics, result.ok());
  e.steps = std::move(result.steps);
  e.message = result.message;
  if (result.ok()) take(result, !frozen, e);
  return result.ok();
}

void Evaluator::take(const SimulationResult& result, bool warn, Evaluation& e) const {
  for (std::size_t j = 0; j < simulated_.size(); ++j) {
    const Eigen::Index i = static_cast<Eigen::Index>(simulated_[j]), row = static_cast<Eigen::Index>(j);
    e.psi(i) = result.psi(row);
    if (!e.has_gradients()) continue;
    const Objective& objective = objectives_[simulated_[j]];
    if (objective.mean() && !objective.is_extreme() && e.psi(i) == 0 && warn)
      e.warnings.push_back(
          fmt::format("objective '{}' is a root mean square of 0, where it is not smooth: its gradient is given as 0",
                      objective.name()));
    for (Eigen::Index k = 0; k < e.psi_rho.cols(); ++k)
      e.psi_rho(i, k) = result.psi_rho(row, variables_[static_cast<std::size_t>(k)]);
  }
}

std::vector<const Objective*> Evaluator::simulated() const {
  std::vector<const Objective*> list;
  for (const std::size_t i : simulated_) list.push_back(&objectives_[i]);
  return list;
}

std::vector<std::optional<double>> Evaluator::true_values(const Eigen::VectorXd& rho) const {
  std::vector<std::optional<double>> values(objectives_.size());
  if (std::none_of(objectives_.begin(), objectives_.end(), [](const Objective& o) { return o.is_extreme(); }))
    return values;
  const Mechanism mechanism(scene_, rho, std::vector<bool>(active_.size(), false), options_.user_forces, programs_);
  const Evaluation e = run(rho, Sweep::none, nullptr);  // the costs decide on the panels of a solved run
  if (!e.ok) return values;
  const std::vector<std::optional<double>> found =
      true_extremes(simulated(), mechanism, scene_.simulation, e.steps, options_.progress);
  for (std::size_t j = 0; j < found.size(); ++j) values[simulated_[j]] = found[j];
  return values;
}

bool Evaluator::add_parameters_only(Evaluation& e, bool gradients) const {
  Eigen::VectorXd gradient(e.rho.size());
  try {
    for (Eigen::Index i = 0; i < e.psi.size(); ++i) {
      const Objective& objective = objectives_[static_cast<std::size_t>(i)];
      if (!gradients) {
        e.psi(i) += objective.parameters_only(e.rho, options_.user_forces);
        continue;
      }
      gradient.setZero();
      std::vector<std::string> doubts;
      e.psi(i) += objective.add_parameters_only_gradient(e.rho, gradient, options_.user_forces, &doubts);
      for (const std::string& doubt : doubts)
        e.warnings.push_back(fmt::format("objective '{}': {}", objective.name(), doubt));
      for (Eigen::Index k = 0; k < e.psi_rho.cols(); ++k)
        e.psi_rho(i, k) += gradient(variables_[static_cast<std::size_t>(k)]);
    }
  } catch (const std::runtime_error& error) {  // of an eigenvalue
    e.message = error.what();
    return false;
  }
  return true;
}

namespace {

// If the rungs disagree, it takes differences from smaller steps on: a stage of one rung may have met a singular
// position.
LadderDerivative certain_differences(const LadderFunction& psi_at, Eigen::Index size, double h, int rungs) {
  constexpr double kUncertain = 1e-4;  // of a derivative
  constexpr int kMoreLadders = 2;
  LadderDerivative best = difference_ladder(psi_at, size, {h, rungs, 0});
  for (int k = 0; k < kMoreLadders; ++k) {
    const Eigen::ArrayXd limit = (kUncertain * best.derivative.array().abs()).max(10 * best.rounding.array());
    if ((best.error.array() <= limit).all()) break;
    h /= 1 << rungs;
    const LadderDerivative smaller = difference_ladder(psi_at, size, {h, rungs, 0});
    for (Eigen::Index i = 0; i < size; ++i) {
      if (!(smaller.error(i) < best.error(i))) continue;
      best.error(i) = smaller.error(i), best.derivative(i) = smaller.derivative(i);
      best.rounding(i) = smaller.rounding(i), best.step(i) = smaller.step(i);
      best.largest(i) = smaller.largest(i);
    }
  }
  return best;
}

}  // namespace

void Evaluator::add_differences(Evaluation& e) const {
  const Stopwatch stopwatch;
  const StepSequence steps = e.steps;
  Eigen::MatrixXd psi_rho(e.psi.size(), static_cast<Eigen::Index>(variables_.size()));
  for (Eigen::Index k = 0; k < psi_rho.cols(); ++k) {
    const int index = variables_[static_cast<std::size_t>(k)];
    const auto psi_at = [&](double h) -> std::optional<Eigen::VectorXd> {
      Eigen::VectorXd rho = e.rho;
      rho(index) += h;
      const bool frozen =
          options_.differences.frozen_steps && !simulated_.empty() && !is_cvodes(scene_.simulation.integrator.type);
      Evaluation shifted = run(rho, Sweep::none, frozen ? &steps : nullptr);
      e.simulations += shifted.simulations;
      if (!shifted.ok) return std::nullopt;
      return shifted.psi;
    };
    const Parameter& parameter = scene_.parameters[static_cast<std::size_t>(index)];
    const double h = options_.differences.relative_step * typical_size(parameter, e.rho(index));
    const LadderDerivative d = certain_differences(psi_at, e.psi.size(), h, options_.differences.rungs);
    if (!(d.error.array() < std::numeric_limits<double>::infinity()).all()) {
      e.ok = false;
      e.message = fmt::format("no central difference in '{}' could be evaluated", parameter.name);
      return;
    }
    psi_rho.col(k) = d.derivative;
  }
  e.psi_rho = std::move(psi_rho);
  e.wall_seconds += stopwatch.seconds();
}

Evaluation Evaluator::values(const Eigen::VectorXd& rho) {
  if (last_.psi.size() > 0 && last_.rho.size() == rho.size() && last_.rho == rho) return last_;
  last_ = run(rho, Sweep::none, nullptr);
  simulations_ += last_.simulations;
  return last_;
}

Evaluation Evaluator::values_on(const StepSequence& steps, const Eigen::VectorXd& rho) const {
  return run(rho, Sweep::none, simulated_.empty() ? nullptr : &steps);
}

Evaluation Evaluator::gradients_on(const StepSequence& steps, const Eigen::VectorXd& rho, GradientMethod method) const {
  const bool backward = method == GradientMethod::adjoint;
  if (!backward && method != GradientMethod::tlm && !simulated_.empty())
    throw std::invalid_argument(
        fmt::format("gradients on given steps are by tlm or adjoint, not by {}", to_string(method)));
  Evaluation e = run(rho, backward ? Sweep::backward : Sweep::forward, simulated_.empty() ? nullptr : &steps);
  e.method = method;
  return e;
}

// Returns the requested method, or the one that replaces it; `choice` gives the reason if it is not obvious.
GradientMethod Evaluator::available(GradientMethod method, std::string& choice) const {
  const IntegratorSettings& given = scene_.simulation.integrator;
  const bool by_cvodes = is_cvodes(given.type);
  if (by_cvodes && (method == GradientMethod::tlm || method == GradientMethod::adjoint)) {
    const GradientMethod instead =
        method == GradientMethod::tlm ? GradientMethod::cvodes_forward : GradientMethod::cvodes_adjoint;
    choice = fmt::format("{} instead of {}: {} has no discrete derivatives", to_string(instead), to_string(method),
                         given.type);
    return instead;
  }
  if (!by_cvodes && (method == GradientMethod::cvodes_forward || method == GradientMethod::cvodes_adjoint)) {
    choice = fmt::format("{}: motion and sensitivities by {} with rtol {:g}, atol {:g}, not by {}", to_string(method),
                         with_cvodes(scene_.simulation).integrator.type, given.rtol, given.atol, given.type);
  }
  return method;
}

Evaluation Evaluator::gradients(const Eigen::VectorXd& rho) {
  if (last_.psi.size() > 0 && last_.rho.size() == rho.size() && last_.rho == rho &&
      (last_.has_gradients() || !last_.ok))
    return last_;
  if (!simulated_.empty() && !has_differentiated_) {
    // At other values than the scene's own, the loop may close as a structure that cannot move.
    const Eigen::VectorXd own = start();
    require_unobstructed(scene_, own, active_, options_.user_forces);
    if (rho.size() != own.size() || rho != own) require_unobstructed(scene_, rho, active_, options_.user_forces);
  }
  GradientMethod method = options_.method;
  std::string choice;
  if (simulated_.empty()) {
    method = GradientMethod::tlm;  // nothing to simulate: the objectives' own derivatives
  } else if (method == GradientMethod::automatic) {
    const GradientCost cost = gradient_cost(variables_.size(), simulated_.size());
    const bool by_cvodes = is_cvodes(scene_.simulation.integrator.type);
    const GradientMethod forward = by_cvodes ? GradientMethod::cvodes_forward : GradientMethod::tlm,
                         backward = by_cvodes ? GradientMethod::cvodes_adjoint : GradientMethod::adjoint;
    method = cost.tlm <= cost.adjoint ? forward : backward;
    choice = fmt::format("{}: {}, {}; estimated cost in simulations: {} {:.1f}, {} {:.1f}", to_string(method),
                         counted(variables_.size(), "variable"), counted(simulated_.size(), "objective"),
                         to_string(forward), cost.tlm, to_string(backward), cost.adjoint);
  } else {
    method = available(method, choice);
  }
  if (method == GradientMethod::differences) {
    last_ = run(rho, Sweep::none, nullptr);
    if (last_.ok) add_differences(last_);
  } else {
    const bool backward = method == GradientMethod::adjoint || method == GradientMethod::cvodes_adjoint,
               by_cvodes = method == GradientMethod::cvodes_forward || method == GradientMethod::cvodes_adjoint;
    last_ = run(rho, backward ? Sweep::backward : Sweep::forward, nullptr, by_cvodes);
  }
  judge_zero_columns(last_);
  has_differentiated_ = has_differentiated_ || last_.ok;
  last_.method = simulated_.empty() ? GradientMethod::automatic : method;
  last_.choice = std::move(choice);
  simulations_ += last_.simulations;
  return last_;
}

}  // namespace mbsopt::inline optim
