#include "optim/objective/evaluator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "core/cvodes/cvodes.hpp"
#include "core/expression/counted.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "core/start/assembly.hpp"
#include "core/start/assembly_modes.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/machine/on_threads.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/curvature_of_run.hpp"
#include "optim/objective/obstructed_parameters.hpp"
#include "optim/problem/load_cases.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline optim {

std::string_view to_string(GradientMethod method) {
  constexpr std::string_view kNames[] = {"auto", "tlm", "adjoint", "cvodes_forward", "cvodes_adjoint", "fd"};
  return kNames[static_cast<std::size_t>(method)];
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
      options_(std::move(options)),
      programs_(std::make_shared<ScenePrograms>(scene_)),
      simulated_(static_cast<std::size_t>(std::ranges::count_if(objectives_, &Objective::needs_simulation))) {
  find_unused();
}

namespace {

std::vector<Evaluator> evaluators_of_cases(const Problem& problem, const std::vector<std::string>& objectives,
                                           const std::vector<std::string>& variables, EvaluatorOptions options) {
  if (options.progress && options.threads > 1 && problem.cases.size() > 1)  // all threads report to one listener
    options.progress = [lock = std::make_shared<std::mutex>(), progress = options.progress](double t) {
      const std::lock_guard guard(*lock);
      return progress(t);
    };
  std::vector<Evaluator> evaluators;
  const std::vector<Problem> problems = problems_of_cases(problem);
  for (std::size_t c = 0; c < problems.size(); ++c) {
    Problem needed = options.user_forces.empty() ? what_objectives_need(problems[c]) : problems[c];
    std::vector<std::string> names = variables;
    if (!problem.cases.empty()) {
      for (std::string& name : names) name = name_in(problem.cases[c], name, problem.scene);
      // A variable may have an effect in another case only.
      for (Parameter& p : needed.scene.parameters) p.allow_unused = true;
    }
    const std::vector<Objective> all = objectives_of(needed, objectives);
    evaluators.emplace_back(std::move(needed.scene), all, names, options);
  }
  return evaluators;
}

}  // namespace

Evaluator::Evaluator(const Problem& problem, const std::vector<std::string>& objectives,
                     const std::vector<std::string>& variables, const EvaluatorOptions& options)
    : Evaluator(problem, evaluators_of_cases(problem, objectives, variables, options)) {}

Evaluator::Evaluator(const Problem& problem, std::vector<Evaluator> cases) : Evaluator(cases.front()) {
  if (problem.cases.empty()) return;
  problem_ = std::make_shared<const Problem>(problem);
  cases_ = std::move(cases);
}

Evaluator Evaluator::in(Scene scene, GradientMethod method) const {
  Evaluator other = *this;
  other.scene_ = std::move(scene);
  other.programs_ = std::make_shared<ScenePrograms>(other.scene_);
  other.options_.method = method;
  other.has_differentiated_ = false;
  other.last_ = {};
  other.simulations_ = 0;
  return other;
}

void Evaluator::gather_curvature() {
  gathers_curvature_ = true;
  const bool has_extremes = std::ranges::any_of(objectives_, &Objective::is_extreme);
  if (options_.method == GradientMethod::automatic && !has_extremes) options_.method = GradientMethod::tlm;
  for (Evaluator& of_case : cases_) of_case.gather_curvature();
}

void Evaluator::follow(const Eigen::VectorXd& rho) {
  for (Evaluator& of_case : cases_) of_case.follow(rho);
  if (!cases_.empty() || !last_.ok || last_.rho != rho || !last_.statistics.solved) return;
  if (!given_) given_ = std::make_shared<const Scene>(scene_);
  scene_.bodies = given_->bodies;
  set_guess(scene_, Mechanism(*given_, rho, active(false), options_.user_forces, programs_),
            {last_.y_initial.head(last_.y_initial.size() / 2), 0});
}

bool Evaluator::has_left_guess(const Eigen::VectorXd& rho) const {
  if (!cases_.empty()) return cases_.front().has_left_guess(rho);
  return given_ && lead_to_other_poses(*given_, scene_, rho, options_.user_forces);
}

bool lead_to_other_poses(const Scene& own, const Scene& other, const Eigen::VectorXd& rho,
                         const std::vector<std::shared_ptr<const UserForce>>& forces) {
  constexpr double kSame = 1e-6;  // relative
  const auto poses = [&](const Scene& scene) {
    const std::vector<bool> none(scene.parameters.size(), false);
    return Assembly(Mechanism(scene, rho, none, forces), scene.simulation.start_time).result();
  };
  const auto there = poses(other), here = poses(own);
  if (!there.ok) return false;
  return !here.ok || (here.y - there.y).norm() > kSame * (1 + here.y.norm());
}

std::vector<bool> Evaluator::active(bool derivatives) const {
  std::vector<bool> active(scene_.parameters.size(), false);
  for (const int k : variables_) active[static_cast<std::size_t>(k)] = derivatives;
  return active;
}

Mechanism Evaluator::mechanism(const Eigen::VectorXd& rho, bool derivatives) const {
  return Mechanism(scene_, rho, active(derivatives), options_.user_forces, programs_);
}

const Parameter& Evaluator::variable(Eigen::Index k) const {
  return scene_.parameters[static_cast<std::size_t>(variables_[static_cast<std::size_t>(k)])];
}

Eigen::VectorXd Evaluator::sizes(const Eigen::VectorXd& rho) const {
  Eigen::VectorXd sizes(static_cast<Eigen::Index>(variables_.size()));
  for (Eigen::Index k = 0; k < sizes.size(); ++k)
    sizes(k) = typical_size(variable(k), rho(variables_[static_cast<std::size_t>(k)]));
  return sizes;
}

Eigen::VectorXd Evaluator::start() const { return parameter_values(scene_); }

long Evaluator::simulations() const {
  return std::accumulate(cases_.begin(), cases_.end(), simulations_,
                         [](long sum, const Evaluator& of_case) { return sum + of_case.simulations(); });
}

std::string Evaluator::in_case(std::size_t c, const std::string& what) const {
  if (!problem_) return what;
  const CaseSpec& load_case = problem_->cases[c];
  return fmt::format("{} ({})", in_names_of_problem(what, load_case, problem_->scene), load_case.name);
}

void Evaluator::for_each_case(const std::function<void(std::size_t c)>& work) const {
  std::vector<std::size_t> order(cases());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (last_.of_cases.size() == order.size())
    std::ranges::stable_sort(order, std::greater(),
                             [&](std::size_t c) { return last_.of_cases[c].statistics.rhs_evaluations; });
  on_threads(order.size(), options_.threads, [&](std::size_t i) { work(order[i]); });
}

Evaluation Evaluator::in_cases(const Eigen::VectorXd& rho, Evaluation (Evaluator::*evaluate)(const Eigen::VectorXd&)) {
  std::vector<Evaluation> found(cases());
  for_each_case([&](std::size_t c) { found[c] = (cases_[c].*evaluate)(rho); });
  const auto with_case = [&](std::size_t c, const std::string& words) {
    const CaseSpec& load_case = problem_->cases[c];
    return fmt::format("case '{}': {}", load_case.name, in_names_of_problem(words, load_case, problem_->scene));
  };
  const Eigen::Index n = static_cast<Eigen::Index>(objectives_.size()), rows = n * static_cast<Eigen::Index>(cases());
  Evaluation all = found[0];
  all.ok = true;
  all.message.clear();
  all.rho = rho;
  all.psi.setZero(rows);
  all.psi_rho.setZero(all.has_gradients() ? rows : 0, all.psi_rho.cols());
  all.pieces.clear();
  all.warnings.clear();
  all.simulations = 0;
  all.wall_seconds = 0;
  for (std::size_t c = 0; c < cases(); ++c) {
    const Evaluation& e = found[c];
    all.simulations += e.simulations;
    all.wall_seconds += e.wall_seconds;
    for (const std::string& warning : e.warnings) all.warnings.push_back(with_case(c, warning));
    if (!e.ok) {
      if (all.ok) all.message = with_case(c, e.message);
      all.ok = false;
      continue;
    }
    const Eigen::Index first = n * static_cast<Eigen::Index>(c);
    all.psi.segment(first, n) = e.psi;
    for (ExtremePiece piece : e.pieces) {
      piece.row += first;
      all.pieces.push_back(std::move(piece));
    }
    if (all.has_gradients() && e.has_gradients()) all.psi_rho.middleRows(first, n) = e.psi_rho;
  }
  all.of_cases = std::move(found);
  return last_ = std::move(all);
}

void Evaluator::find_unused() {
  if (objectives_.empty()) return;
  Problem judged;
  judged.scene = scene_;
  for (const Objective& o : objectives_)
    if (!o.is_written_in_cpp()) judged.objectives.push_back(o.spec());
  bool opaque = judged.objectives.size() < objectives_.size() || !options_.user_forces.empty();
  for (Force& force : judged.scene.forces) {
    if (auto* const user = std::get_if<UserForceSpec>(&force.kind)) {
      opaque = true;
      user->parameters.clear();
    }
  }
  // Opaque code may look at every body.
  for (const SceneIssue& issue : find_unused_parameters(judged, opaque)) {
    const auto is_at = [&](int k) {
      return issue.path == "parameters." + scene_.parameters[static_cast<std::size_t>(k)].name;
    };
    const auto variable = std::ranges::find_if(variables_, is_at);
    if (variable == variables_.end()) continue;
    if (!opaque) throw std::invalid_argument(issue.path + ": " + issue.message);
    perhaps_unused_.push_back(static_cast<std::size_t>(variable - variables_.begin()));
  }
}

// The first gradient decides whether C++ code uses a variable. In a search its derivatives may become 0 (max(0, x)).
void Evaluator::judge_zero_columns(Evaluation& e) const {
  for (const std::size_t k : perhaps_unused_) {
    if (!e.ok || e.psi_rho.col(static_cast<Eigen::Index>(k)).any()) continue;
    const std::string& name = variable(static_cast<Eigen::Index>(k)).name;
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

Evaluation Evaluator::run(const Eigen::VectorXd& rho, Sweep sweep, const StepSequence* frozen, bool by_cvodes) const {
  const Stopwatch stopwatch;
  Evaluation e;
  e.rho = rho;
  e.psi.setZero(static_cast<Eigen::Index>(objectives_.size()));
  if (sweep != Sweep::none) e.psi_rho.setZero(e.psi.size(), static_cast<Eigen::Index>(variables_.size()));
  e.ok = has_finite_parameters(e) && add_simulated(e, sweep, frozen, by_cvodes) && add_parameters_only(e) &&
         has_finite_objectives(e);
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
  if (simulated_ == 0) return true;
  const SimulationSettings settings = by_cvodes ? with_cvodes(scene_.simulation) : scene_.simulation;
  if (options_.progress && !options_.progress(settings.start_time)) {  // the assembly alone may take a second
    e.message = "stopped before its simulation";
    return false;
  }
  const RunOptions options{.frozen = frozen, .progress = options_.progress, .exact_stages = options_.exact_stages};
  const bool has_extremes =
      options_.true_extremes && !frozen && std::ranges::any_of(objectives_, &Objective::is_extreme);
  SimulationResult result;
  try {
    result = has_extremes ? extreme_run(e, sweep, settings, options)
                          : smooth_run(e, sweep, settings, options, gathers_curvature_ && !frozen && !by_cvodes);
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
  e.y_initial = std::move(result.y_initial);
  e.message = result.message;
  if (!result.ok()) return false;
  e.psi = result.psi;
  if (!e.has_gradients()) return true;
  e.psi_rho = result.psi_rho;
  for (std::size_t i = 0; i < objectives_.size() && !frozen && !has_extremes; ++i)
    if (objectives_[i].needs_simulation() && objectives_[i].mean() && !objectives_[i].is_extreme() &&
        e.psi(static_cast<Eigen::Index>(i)) == 0)
      e.warnings.push_back(
          fmt::format("objective '{}' is a root mean square of 0, where it is not smooth: its gradient is given as 0",
                      objectives_[i].name()));
  return true;
}

SimulationResult Evaluator::smooth_run(Evaluation& e, Sweep sweep, const SimulationSettings& settings,
                                       const RunOptions& options, bool gathers) const {
  const Mechanism at_rho = mechanism(e.rho, sweep != Sweep::none);
  std::optional<CurvatureOfRun> curvature;
  const auto simulated = [&](std::span<const Cost> costs) {
    ++e.simulations;
    TangentSampling sampling;
    if (gathers && sweep == Sweep::forward)
      sampling = curvature.emplace(std::span(objectives_).first(1), variables_).sampling(at_rho, {}, settings);
    return sweep == Sweep::forward    ? simulate_tlm(at_rho, settings, costs, sampling, options)
           : sweep == Sweep::backward ? simulate_adjoint(at_rho, settings, costs, options)
                                      : simulate(at_rho, settings, costs, {}, options);
  };
  SimulationResult result = run_objectives(objectives_, at_rho, settings, simulated, options_.progress);
  if (curvature && result.ok()) e.curvature = curvature->matrix(0, e.rho);
  if (result.psi_rho.size() > 0) result.psi_rho = Eigen::MatrixXd(result.psi_rho(Eigen::all, variables_));
  return result;
}

// A run for the steps, the peaks on them, and with derivatives a sweep in which each peak is a sample at its instant.
SimulationResult Evaluator::extreme_run(Evaluation& e, Sweep sweep, const SimulationSettings& settings,
                                        const RunOptions& options) const {
  ExtremeRun run(objectives_, settings, options);
  if (run.find(mechanism(e.rho, false)) && sweep != Sweep::none)
    run.differentiate(mechanism(e.rho, true), sweep == Sweep::backward, variables_);
  e.simulations += run.simulations;
  e.pieces = std::move(run.pieces);
  return std::move(run.result);
}

std::vector<std::optional<double>> Evaluator::true_values(const Eigen::VectorXd& rho) const {
  if (!cases_.empty()) {
    std::vector<std::vector<std::optional<double>>> found(cases());
    for_each_case([&](std::size_t c) { found[c] = cases_[c].true_values(rho); });
    std::vector<std::optional<double>> all;
    for (const auto& of_case : found) all.insert(all.end(), of_case.begin(), of_case.end());
    return all;
  }
  std::vector<std::optional<double>> values(objectives_.size());
  if (std::ranges::none_of(objectives_, &Objective::is_extreme)) return values;
  const Evaluation e = run(rho, Sweep::none, nullptr);  // the costs decide on the panels of a solved run
  if (!e.ok) return values;
  if (!options_.true_extremes)
    return true_extremes(objectives_, mechanism(rho, false), scene_.simulation, e.steps, options_.progress);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (objectives_[i].is_extreme()) values[i] = e.psi(static_cast<Eigen::Index>(i));
  return values;
}

bool Evaluator::add_parameters_only(Evaluation& e) const {
  try {
    for (Eigen::Index i = 0; i < e.psi.size(); ++i) {
      const Objective& objective = objectives_[static_cast<std::size_t>(i)];
      if (!e.has_gradients()) {
        e.psi(i) += objective.parameters_only(e.rho, options_.user_forces);
        continue;
      }
      std::vector<std::string> doubts;
      const std::vector<FrequencyResponse::Peak> peaks =
          objective.parameters_only_gradients(e.rho, options_.user_forces, variables_, &doubts);
      e.psi(i) += peaks.front().value;
      e.psi_rho.row(i) += peaks.front().gradient.transpose();
      for (const FrequencyResponse::Peak& peak : peaks)
        if (peaks.size() > 1) e.pieces.push_back({i, objective.side(), peak.value, peak.gradient, peak.frequency});
      for (const std::string& doubt : doubts)
        e.warnings.push_back(fmt::format("objective '{}': {}", objective.name(), doubt));
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
    best.take_better(difference_ladder(psi_at, size, {h, rungs, 0}));
  }
  return best;
}

}  // namespace

void Evaluator::add_differences(Evaluation& e) const {
  const Stopwatch stopwatch;
  const bool frozen =
      options_.differences.frozen_steps && may_freeze(e.steps) && !is_cvodes(scene_.simulation.integrator.type);
  const Eigen::VectorXd size = sizes(e.rho);
  Eigen::MatrixXd psi_rho(e.psi.size(), size.size());
  for (Eigen::Index k = 0; k < size.size(); ++k) {
    const auto psi_at = [&](double h) -> std::optional<Eigen::VectorXd> {
      Eigen::VectorXd rho = e.rho;
      rho(variables_[static_cast<std::size_t>(k)]) += h;
      Evaluation shifted = run(rho, Sweep::none, frozen ? &e.steps : nullptr);
      e.simulations += shifted.simulations;
      if (!shifted.ok) return std::nullopt;
      return shifted.psi;
    };
    const double h = options_.differences.relative_step * size(k);
    const LadderDerivative d = certain_differences(psi_at, e.psi.size(), h, options_.differences.rungs);
    if (!(d.error.array() < std::numeric_limits<double>::infinity()).all()) {
      e.ok = false;
      e.message = fmt::format("no central difference in '{}' could be evaluated", variable(k).name);
      return;
    }
    psi_rho.col(k) = d.derivative;
  }
  e.psi_rho = std::move(psi_rho);
  e.wall_seconds += stopwatch.seconds();
}

bool Evaluator::is_last(const Eigen::VectorXd& rho) const {
  return last_.psi.size() > 0 && last_.rho.size() == rho.size() && last_.rho == rho;
}

Evaluation Evaluator::values(const Eigen::VectorXd& rho) {
  if (!cases_.empty()) return in_cases(rho, &Evaluator::values);
  if (is_last(rho)) return last_;
  last_ = run(rho, Sweep::none, nullptr);
  simulations_ += last_.simulations;
  return last_;
}

Evaluation Evaluator::values_on(const StepSequence& steps, const Eigen::VectorXd& rho) const {
  return run(rho, Sweep::none, may_freeze(steps) ? &steps : nullptr);
}

Evaluation Evaluator::gradients_on(const StepSequence& steps, const Eigen::VectorXd& rho, GradientMethod method) const {
  const bool backward = method == GradientMethod::adjoint;
  if (!backward && method != GradientMethod::tlm && simulated_ > 0)
    throw std::invalid_argument(
        fmt::format("gradients on given steps are by tlm or adjoint, not by {}", to_string(method)));
  Evaluation e = run(rho, backward ? Sweep::backward : Sweep::forward, may_freeze(steps) ? &steps : nullptr);
  e.method = method;
  return e;
}

// Each peak of a true extreme has a gradient of its own.
std::size_t Evaluator::gradients_per_run() const {
  std::size_t count = 0;
  for (const Objective& o : objectives_)
    if (o.needs_simulation()) count += options_.true_extremes && o.is_extreme() ? kMostPeaks * o.parts().size() : 1;
  return count;
}

// Returns the requested method, or the one that replaces it; `choice` gives the reason if it is not obvious.
GradientMethod Evaluator::chosen_method(std::string& choice) const {
  using enum GradientMethod;
  const GradientMethod asked = options_.method;
  const IntegratorSettings& given = scene_.simulation.integrator;
  const bool by_cvodes = is_cvodes(given.type);
  const GradientMethod forward = by_cvodes ? cvodes_forward : tlm, backward = by_cvodes ? cvodes_adjoint : adjoint;
  if (simulated_ == 0) return tlm;  // nothing to simulate: the objectives' own derivatives
  if (asked == automatic) {
    const std::size_t rows = gradients_per_run();
    const GradientCost cost = gradient_cost(variables_.size(), rows);
    const GradientMethod method = cost.tlm <= cost.adjoint ? forward : backward;
    choice = fmt::format("{}: {}, {}; estimated cost in simulations: {} {:.1f}, {} {:.1f}", to_string(method),
                         counted(variables_.size(), "variable"),
                         counted(rows, rows > simulated_ ? "objective and peak" : "objective"), to_string(forward),
                         cost.tlm, to_string(backward), cost.adjoint);
    return method;
  }
  if (by_cvodes && (asked == tlm || asked == adjoint)) {
    const GradientMethod instead = asked == tlm ? forward : backward;
    choice = fmt::format("{} instead of {}: {} has no discrete derivatives", to_string(instead), to_string(asked),
                         given.type);
    return instead;
  }
  if (!by_cvodes && (asked == cvodes_forward || asked == cvodes_adjoint))
    choice = fmt::format("{}: motion and sensitivities by {} with rtol {:g}, atol {:g}, not by {}", to_string(asked),
                         with_cvodes(scene_.simulation).integrator.type, given.rtol, given.atol, given.type);
  return asked;
}

Evaluation Evaluator::gradients(const Eigen::VectorXd& rho) {
  if (!cases_.empty()) return in_cases(rho, &Evaluator::gradients);
  if (is_last(rho) && (last_.has_gradients() || !last_.ok)) return last_;
  if (simulated_ > 0 && !has_differentiated_) {
    // At other values than the scene's own, the loop may close as a structure that cannot move.
    const Eigen::VectorXd own = start();
    require_unobstructed(scene_, own, active(true), options_.user_forces);
    if (rho.size() != own.size() || rho != own) require_unobstructed(scene_, rho, active(true), options_.user_forces);
  }
  std::string choice;
  const GradientMethod method = chosen_method(choice);
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
  last_.method = simulated_ == 0 ? GradientMethod::automatic : method;
  last_.choice = std::move(choice);
  simulations_ += last_.simulations;
  return last_;
}

}  // namespace mbsopt::inline optim
