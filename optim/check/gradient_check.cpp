#include "optim/check/gradient_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>

#include "core/cvodes/cvodes.hpp"
#include "core/run/kinks.hpp"
#include "optim/check/rounding_scatter.hpp"
#include "optim/check/taylor_remainders.hpp"
#include "optim/check/user_terms.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// psi carries the rounding of all steps: some units in the last place of the largest numbers it is made of.
constexpr double kPsiRounding = 100 * kEpsilon;
constexpr int kJumpRungs = 3;  // the smallest: further off, frozen steps have errors of their own

// Returns whether the methods agree. Wrong terms of a user do not count here.
bool agree(const GradientCheck& check) {
  auto fine = [](const CheckedEntry& e) {
    return passes(e.exact) && (!e.frozen_verdict || passes(*e.frozen_verdict)) &&
           (!e.free_verdict || passes(*e.free_verdict));
  };
  auto held = [](const auto& c) { return c.passed; };
  return check.ran && std::all_of(check.entries.begin(), check.entries.end(), fine) &&
         std::all_of(check.taylor.begin(), check.taylor.end(), held) &&
         std::all_of(check.identities.begin(), check.identities.end(), held) &&
         (!check.continuous || check.continuous->passed());
}

class Check {
 public:
  Check(const Scene& scene, const std::vector<Objective>& objectives, const GradientCheckOptions& options)
      : scene_(scene),
        objectives_(objectives),
        options_(options),
        adjoint_(evaluator(GradientMethod::adjoint)),
        tlm_(evaluator(GradientMethod::tlm)) {
    for (const Objective& objective : objectives) result_.objectives.push_back(objective.name());
    for (const Parameter& p : scene.parameters) result_.parameters.push_back(p.name);
    rho_ = adjoint_.start();
    size_.resize(rho_.size());
    for (Index k = 0; k < rho_.size(); ++k)
      size_(k) = typical_size(scene.parameters[static_cast<std::size_t>(k)], rho_(k));
    taylor_size_ = size_;
  }

  GradientCheck run() {
    if (!base_runs()) return std::move(result_);
    result_.ran = true;
    result_.discrete = !is_cvodes(scene_.simulation.integrator.type);
    set_what_moves_kinks();
    measure_times();
    difference();
    estimate_integration_error();
    compare();
    if (result_.discrete) {
      check_identity();
      check_taylor();
      if (!agree(result_)) {
        measure_rounding();
        compare();
        if (difference_finer()) compare();
        generator_.seed(options_.seed);
        check_identity();
        check_taylor();
        say_rounding();
        say_kinks();
      }
    }
    compare_with_cvodes();
    result_.wrong_terms = wrong_user_terms(scene_, objectives_, options_.user_forces, options_.simulation_progress);
    result_.simulations += adjoint_.simulations() + tlm_.simulations();
    return std::move(result_);
  }

 private:
  Evaluator evaluator(GradientMethod method) const { return evaluator(scene_, method); }
  Evaluator evaluator(Scene scene, GradientMethod method) const {
    EvaluatorOptions options;
    options.method = method;
    options.user_forces = options_.user_forces;
    options.progress = options_.simulation_progress;
    return Evaluator(std::move(scene), objectives_, {}, options);
  }

  bool base_runs() {
    for (Evaluator* e : {&tlm_, &adjoint_}) {
      const Evaluation& base = e->gradients(rho_);
      result_.statistics = base.statistics, result_.warnings = base.warnings;
      if (!base.ok) {
        result_.message = base.message;
        return false;
      }
      (e == &tlm_ ? result_.tlm : result_.adjoint) = base.psi_rho;
      result_.psi = base.psi;
      steps_ = base.steps;
    }
    return true;
  }

  // Steps that end at kinks lose them as a parameter moves these: differences need steps of their own then.
  void set_what_moves_kinks() {
    const Mechanism mechanism(scene_, rho_, {}, options_.user_forces);
    std::vector<Cost> costs;
    for (const Objective& objective : objectives_)
      if (objective.needs_simulation()) costs.push_back(objective.cost(mechanism));
    std::set<int> moving;
    for (const KinkedSignal& kinks : kinks_of(mechanism, costs))
      moving.insert(kinks.moved_by.begin(), kinks.moved_by.end());
    on_frozen_steps_.setConstant(rho_.size(), result_.discrete);
    std::string names;
    for (const int k : moving) {
      on_frozen_steps_(k) = false;
      names += (names.empty() ? "'" : ", '") + result_.parameters[static_cast<std::size_t>(k)] + "'";
    }
    if (!names.empty() && result_.discrete)
      result_.warnings.push_back(fmt::format(
          "{} moves kinks of laws, at which steps end: compared with differences on free steps only", names));
  }

  void measure_times() {
    GradientTimingOptions timing_options = options_.timing;
    timing_options.user_forces = options_.user_forces;
    timing_options.progress = options_.simulation_progress;
    const GradientTiming timing = time_gradients(scene_, objectives_, timing_options);
    result_.simulation = timing.simulation, result_.tlm_cost = timing.tlm, result_.adjoint_cost = timing.adjoint;
    result_.timing_rounds = timing.rounds;
    result_.simulations += timing.simulations;
  }

  void set_ratio(MethodCost& cost) const {
    const double one = result_.simulation.wall_seconds;
    cost.ratio = one > 0 ? cost.wall_seconds / one : 0;
  }

  Evaluation run_at(const VectorXd& rho, bool frozen) {
    Evaluation e;
    if (frozen) {
      e = tlm_.values_on(steps_, rho);
    } else {
      Evaluator fresh = evaluator(GradientMethod::automatic);
      e = fresh.values(rho);
    }
    result_.simulations += e.simulations;
    return e;
  }

  std::optional<VectorXd> psi_at(const VectorXd& rho, bool frozen) {
    Evaluation e = run_at(rho, frozen);
    if (!e.ok) return std::nullopt;
    return std::move(e.psi);
  }

  void difference() {
    const Index m = result_.psi.size(), P = rho_.size();
    for (MatrixXd* x :
         {&result_.frozen, &result_.free, &frozen_error_, &free_error_, &frozen_step_, &free_step_, &rounding_.psi_rho})
      x->setZero(m, P);
    rounding_.psi.setZero(m);
    jump_.setZero(m, P);
    on_base_steps_.setConstant(m, P, false);
    for (Index k = 0; k < P; ++k) {
      if (result_.discrete && !on_frozen_steps_(k)) result_.frozen.col(k).setConstant(kNaN);
      for (const bool frozen : {true, false}) {
        if (frozen ? !on_frozen_steps_(k) : !options_.free_steps) continue;
        const Stopwatch stopwatch;
        const Ladder ladder = ladder_of(k, frozen, options_.relative_step * size_(k));
        const LadderDerivative& d = ladder.d;
        if (d.derivative.hasNaN() && !ladder.failure.empty())
          result_.warnings.push_back(fmt::format("differences in '{}' could not be evaluated{}: {}",
                                                 result_.parameters[static_cast<std::size_t>(k)],
                                                 frozen ? " on the steps of the base run" : "", ladder.failure));
        for (Index i = 0; i < m; ++i) take(ladder, i, k, frozen);
        (frozen ? result_.frozen_cost : result_.free_cost).wall_seconds += stopwatch.seconds();
      }
      if (options_.progress) options_.progress(static_cast<int>(k) + 1, static_cast<int>(P));
    }
    set_ratio(result_.frozen_cost), set_ratio(result_.free_cost);
  }

  struct Ladder {
    LadderDerivative d;
    std::string failure;             // of a run
    double other_steps = kInfinity;  // the smallest |h| at which a run took others than the base run
  };

  // Differences in parameter k, by steps of `largest` and below.
  Ladder ladder_of(Index k, bool frozen, double largest) {
    Ladder ladder;
    const double near = largest * std::pow(0.5, options_.rungs - kJumpRungs);
    const auto f = [&](double h) -> std::optional<VectorXd> {
      VectorXd rho = rho_;
      rho(k) += h;
      Evaluation e = run_at(rho, frozen);
      if (!e.ok) ladder.failure = e.message;
      if (!e.ok) return std::nullopt;
      if (e.steps.sizes != steps_.sizes) ladder.other_steps = std::min(ladder.other_steps, std::abs(h));
      if (std::abs(h) < 1.5 * near) note_jump(k, h, frozen, e.psi);
      note_rung(k, h, frozen, e.psi);
      return std::move(e.psi);
    };
    ladder.d = difference_ladder(f, result_.psi.size(), {largest, options_.rungs, kPsiRounding});
    for (Index i = 0; i < result_.psi.size(); ++i)
      if (!ladder.d.has_estimate(i)) ladder.d.derivative(i) = kNaN, ladder.d.error(i) = kInfinity;
    return ladder;
  }

  void take(const Ladder& ladder, Index i, Index k, bool frozen) {
    const LadderDerivative& d = ladder.d;
    (frozen ? result_.frozen : result_.free)(i, k) = d.derivative(i);
    (frozen ? frozen_error_ : free_error_)(i, k) = d.error(i);
    (frozen ? frozen_step_ : free_step_)(i, k) = d.step(i);
    if (!frozen && result_.discrete) on_base_steps_(i, k) = on_base_steps(ladder, i);
  }

  // Whether all runs that the difference is made of took the steps of the base run.
  static bool on_base_steps(const Ladder& ladder, Index i) { return ladder.d.largest(i) < 0.75 * ladder.other_steps; }

  // The error of a difference: of its ladder, of psi's rounding, and on steps of its own of the integration.
  double own_error(const Ladder& ladder, Index i, Index k, bool frozen) const {
    const LadderDerivative& d = ladder.d;
    if (!(d.step(i) > 0)) return kInfinity;
    const double integration = frozen || on_base_steps(ladder, i) ? 0 : integration_error_of(i, k, d.step(i));
    return d.error(i) + rounding_.psi(i) / d.step(i) + integration;
  }

  // Steps that are coarse for psi may show a plateau that is no derivative (a coordinate of kilometres, of which
  // metres matter). Where a difference disagrees, a ladder that begins below the first holds, if it contradicts it by
  // more than its own error: smaller steps magnify rounding and jumps, which must not excuse a wrong gradient.
  bool difference_finer() {
    const Index m = result_.psi.size(), P = rho_.size();
    const double finer = std::pow(0.5, options_.rungs);
    bool found = false;
    for (Index k = 0; k < P; ++k) {
      for (const bool frozen : {true, false}) {
        const auto disagrees = [&](Index i) {
          const CheckedEntry& e = result_.entries[static_cast<std::size_t>(i * P + k)];
          const std::optional<Verdict>& verdict = frozen ? e.frozen_verdict : e.free_verdict;
          return verdict && !passes(*verdict);
        };
        std::optional<Ladder> ladder;
        for (Index i = 0; i < m; ++i) {
          if (!disagrees(i)) continue;
          if (!ladder) ladder = ladder_of(k, frozen, options_.relative_step * size_(k) * finer);
          const double coarse = (frozen ? result_.frozen : result_.free)(i, k);
          if (!(std::abs(ladder->d.derivative(i) - coarse) > kEstimateTrust * own_error(*ladder, i, k, frozen)))
            continue;
          take(*ladder, i, k, frozen);
          if (!frozen) add_integration_error(i, k);
          taylor_size_(k) = std::min(taylor_size_(k), ladder->d.largest(i) / options_.relative_step);
          found = true;
        }
      }
    }
    return found;
  }

  // The difference of the values at h and -h, once both are known.
  void note_rung(Index k, double h, bool frozen, const VectorXd& psi) {
    auto& values = rungs_[{k, std::abs(h)}][frozen ? 0 : 1];
    values[h > 0 ? 0 : 1] = psi;
  }

  std::vector<LadderRung> rungs_of(Index i, Index k) const {
    std::vector<LadderRung> rungs;
    for (const auto& [at, values] : rungs_) {
      if (at.first != k) continue;
      const auto slope = [&, h = at.second](const std::array<VectorXd, 2>& psi) {
        return psi[0].size() == 0 || psi[1].size() == 0 ? kNaN : (psi[0](i) - psi[1](i)) / (2 * h);
      };
      rungs.push_back({at.second, slope(values[0]), slope(values[1])});
    }
    std::reverse(rungs.begin(), rungs.end());
    return rungs;
  }

  // Both ladders take the same steps h, halved exactly.
  void note_jump(Index k, double h, bool frozen, const VectorXd& psi) {
    if (frozen) return;
    const auto rung = rungs_.find({k, std::abs(h)});
    if (rung == rungs_.end()) return;
    const VectorXd& values = rung->second[0][h > 0 ? 0 : 1];
    if (values.size() > 0 && psi.allFinite() && values.allFinite())
      jump_.col(k) = jump_.col(k).cwiseMax((psi - values).cwiseAbs());
  }

  // Free differences differ from the derivatives of the numbers on frozen steps by the derivative of the integration
  // error, and carry its jumps from step sequence to step sequence, divided by the step. How large these are the
  // smallest steps show, too, where both differences were taken. Where all runs that an entry is made of took the steps
  // of the base run, as rounded ones often do (step_control.hpp), it is as good as one on frozen steps.
  void estimate_integration_error() {
    if (!options_.free_steps && result_.discrete) return;
    const auto error_of = [&](GradientMethod method, const MatrixXd& psi_rho) {
      IntegrationError e = integration_error(scene_, objectives_, result_.psi, psi_rho,
                                             {.user_forces = options_.user_forces,
                                              .progress = options_.simulation_progress,
                                              .method = method,
                                              .steps = result_.statistics.steps});
      result_.simulations += e.simulations;
      return e;
    };
    IntegrationError e = error_of(result_.discrete ? GradientMethod::automatic : GradientMethod::tlm, result_.tlm);
    for (std::string& doubt : unresolved_gradients(scene_, objectives_, result_.psi, result_.tlm, e))
      result_.warnings.push_back(std::move(doubt));
    if (!result_.discrete) {  // forward and backward have errors of their own
      e.psi_rho += error_of(GradientMethod::adjoint, result_.adjoint).psi_rho;
    }
    integration_ = std::move(e);
    if (!options_.free_steps) return;
    for (Index k = 0; k < rho_.size(); ++k)
      for (Index i = 0; i < result_.psi.size(); ++i) add_integration_error(i, k);
  }
  void add_integration_error(Index i, Index k) {
    if (!on_base_steps_(i, k) && std::isfinite(free_error_(i, k)))
      free_error_(i, k) += integration_error_of(i, k, free_step_(i, k));
  }
  // The error that the integration adds to a free difference over `step`.
  double integration_error_of(Index i, Index k, double step) const {
    return integration_.psi_rho(i, k) + std::max(integration_.psi(i), jump_(i, k)) / step;
  }

  // Runs only if something disagrees.
  void measure_rounding() {
    const RoundingRuns runs{
        [&](const VectorXd& rho, GradientMethod method) { return tlm_.gradients_on(steps_, rho, method); },
        [&](const Scene& scene, GradientMethod method) {
          return evaluator(scene, method).gradients_on(steps_, rho_, method);
        }};
    rounding_ = rounding_scatter({scene_, rho_, size_, result_.psi, kPsiRounding, options_.seed}, runs);
    result_.simulations += rounding_.simulations;
    rounding_known_ = true;
  }

  // Entries that CVODES disagrees with, within the rounding of the discrete ones, which parts TLM and adjoint, too.
  void excuse_rounding(ContinuousCheck& check) {
    if (check.passed() || !result_.discrete) return;
    if (!rounding_known_) measure_rounding();
    const MatrixXd rounding = rounding_.psi_rho.cwiseMax((result_.tlm - result_.adjoint).cwiseAbs());
    for (std::size_t n = 0; n < check.entries.size(); ++n) {
      ContinuousEntry& e = check.entries[n];
      const Index at = static_cast<Index>(n), P = rho_.size();
      const double entry = std::max(std::abs(e.discrete), std::abs(e.continuous));
      if (!passes(e.verdict))
        e.verdict =
            verdict_of(e.continuous, rounding(at / P, at % P), e.discrete, entry, options_.thresholds.continuous);
    }
  }

  // Where rounding is what methods differ by, and the formulation is why there is so much.
  void say_rounding() {
    const FormulationSettings& f = scene_.simulation.formulation;
    if (f.type != FormulationType::penalty || f.linear_solver != LinearSolver::cholesky) return;
    double worst = 0;
    for (Index i = 0; i < rounding_.psi_rho.rows(); ++i)
      for (Index k = 0; k < rounding_.psi_rho.cols(); ++k)
        if (const double entry = std::abs(result_.tlm(i, k)); entry > 0)
          worst = std::max(worst, rounding_.psi_rho(i, k) / std::max(entry, floor_of(i, k)));
    if (!(worst > options_.thresholds.tlm_adjoint)) return;
    result_.warnings.push_back(
        fmt::format("simulation.formulation: penalty with alpha {:.3g} by cholesky rounds derivatives by up to {:.1g} "
                    "of them, which is more than methods may differ by; \"linear_solver\": \"quasidefinite\" has no "
                    "such rounding",
                    f.alpha, worst));
  }

  // psi(+-h) = psi + s h +- b h + O(h^2) beside a kink: the slopes s - b and s + b differ at its two sides.
  // b(h) = (psi(h) + psi(-h) - 2 psi)/(2h) falls as h where psi is smooth, and not at all at a kink.
  void say_kinks() {
    for (std::size_t n = 0; n < result_.entries.size(); ++n) {
      const CheckedEntry& e = result_.entries[n];
      const Index i = static_cast<Index>(n) / rho_.size(), k = static_cast<Index>(n) % rho_.size();
      const auto failed = [](const std::optional<Verdict>& v) { return v && !passes(*v); };
      const bool frozen = failed(e.frozen_verdict);
      if (!frozen && !failed(e.free_verdict)) continue;
      double b = kNaN, wider = kNaN;  // at h and 2h, the smallest steps at which psi's rounding does not count
      for (auto rung = rungs_.rbegin(); rung != rungs_.rend(); ++rung) {
        const auto& [plus, minus] = rung->second[frozen ? 0 : 1];
        if (rung->first.first != k || plus.size() == 0 || minus.size() == 0) continue;
        const double bend = plus(i) + minus(i) - 2 * result_.psi(i);
        if (!(std::abs(bend) > kEstimateTrust * rounding_.psi(i))) break;
        wider = b, b = bend / (2 * rung->first.second);
      }
      constexpr double kFalls = 0.75;  // between 1/2 of a smooth psi and 1 of a kink
      const double s = frozen ? e.frozen : e.free;
      if (!(b / wider > kFalls) || std::abs(e.tlm - s) > std::abs(b) / kFalls) continue;
      result_.warnings.push_back(fmt::format(
          "{} is not smooth in {}: its slope is {:.6g} below the value and {:.6g} above it, as at a norm or "
          "an absolute value that is zero. There is no derivative",
          e.objective, e.parameter, s - b, s + b));
    }
  }

  // Entries of an objective below this size are compared with it.
  double floor_of(Index objective, Index k) const {
    return options_.thresholds.rounding_floor *
           result_.tlm.row(objective).cwiseAbs().cwiseProduct(size_.transpose()).maxCoeff() / size_(k);
  }

  void compare() {
    result_.entries.clear();
    const CheckThresholds& limits = options_.thresholds;
    for (Index i = 0; i < result_.psi.size(); ++i) {
      for (Index k = 0; k < rho_.size(); ++k) {
        CheckedEntry e;
        e.objective = result_.objectives[static_cast<std::size_t>(i)];
        e.parameter = result_.parameters[static_cast<std::size_t>(k)];
        e.tlm = result_.tlm(i, k), e.adjoint = result_.adjoint(i, k);
        e.frozen = result_.frozen(i, k), e.frozen_error = frozen_error_(i, k);
        e.free = result_.free(i, k), e.free_error = free_error_(i, k);
        const double entry = std::max(std::abs(e.tlm), std::abs(e.adjoint));
        const double floor = floor_of(i, k);
        // Differences carry the rounding of psi, divided by their step, too.
        const auto rounding = [&](const MatrixXd& step) {
          return rounding_.psi_rho(i, k) + (step(i, k) > 0 ? rounding_.psi(i) / step(i, k) : 0);
        };
        auto relative = [](double difference, double to) { return difference == 0 ? 0 : std::abs(difference) / to; };
        e.tlm_adjoint = relative(e.tlm - e.adjoint, std::max(entry, floor));
        e.frozen_difference = relative(e.frozen - e.tlm, entry);
        e.free_difference = relative(e.free - e.tlm, entry);
        if (result_.discrete) {
          e.exact = entry == 0 ? Verdict::zero
                               : verdict_of(e.adjoint, rounding_.psi_rho(i, k), e.tlm, std::max(entry, floor),
                                            limits.tlm_adjoint);
          e.frozen_error += rounding(frozen_step_);
          if (on_frozen_steps_(k)) e.frozen_verdict = verdict_of(e.frozen, e.frozen_error, e.tlm, entry, limits.frozen);
        } else {
          e.exact = verdict_of(e.adjoint, integration_.psi_rho(i, k), e.tlm, std::max(entry, floor), limits.continuous);
        }
        e.free_error += rounding(free_step_);
        if (options_.free_steps) e.free_verdict = verdict_of(e.free, e.free_error, e.tlm, entry, limits.free);
        e.rungs = rungs_of(i, k);
        result_.entries.push_back(std::move(e));
      }
    }
  }

  void compare_with_cvodes() {
    if (!options_.continuous) return;
    ContinuousCheckOptions options;
    options.threshold = options_.thresholds.continuous, options.floor = options_.thresholds.rounding_floor;
    options.typical_steps = result_.statistics.steps;
    options.user_forces = options_.user_forces;
    options.progress = options_.simulation_progress;
    result_.continuous = check_continuous(scene_, objectives_, options);
    result_.simulations += result_.continuous->simulations;
    excuse_rounding(*result_.continuous);
  }

  VectorXd random_direction(Index n) {
    std::normal_distribution<double> normal;
    VectorXd d(n);
    for (Index k = 0; k < n; ++k) d(k) = normal(generator_);
    return d;
  }

  void check_identity() {
    constexpr int kDirections = 3;
    result_.identities.clear();
    for (int i = 0; i < kDirections; ++i) {
      const VectorXd d = random_direction(rho_.size()).cwiseProduct(size_);
      const VectorXd w = random_direction(result_.psi.size());
      IdentityCheck check;
      check.d = d, check.w = w;
      check.tlm = w.dot(result_.tlm * d);
      check.adjoint = (result_.adjoint.transpose() * w).dot(d);
      const double terms = w.cwiseAbs().dot(result_.tlm.cwiseAbs() * d.cwiseAbs());
      check.relative_defect = terms > 0 ? std::abs(check.tlm - check.adjoint) / terms : 0;
      const double rounding = w.cwiseAbs().dot(rounding_.psi_rho * d.cwiseAbs());
      check.passed = check.relative_defect <= options_.thresholds.identity ||
                     std::abs(check.tlm - check.adjoint) <= kEstimateTrust * rounding;
      result_.identities.push_back(check);
    }
  }

  void check_taylor() {
    const double allowed = options_.thresholds.frozen / kTaylorClear;  // of a derivative, as in differences
    const VectorXd d = random_direction(rho_.size())
                           .cwiseProduct(taylor_size_)
                           .cwiseProduct(on_frozen_steps_.cast<double>().matrix()) /
                       std::sqrt(static_cast<double>(rho_.size()));
    const auto psi_there = [&](double h) { return psi_at(rho_ + h * d, true); };
    const auto rounding = [&](double h, const VectorXd& psi) -> VectorXd {
      return (kPsiRounding * psi.cwiseAbs().cwiseMax(result_.psi.cwiseAbs())).cwiseMax(rounding_.psi) +
             h * (rounding_.psi_rho + allowed * result_.tlm.cwiseAbs()) * d.cwiseAbs();
    };
    result_.taylor = check_taylor_remainders(result_.objectives, result_.psi, {psi_there, rounding, result_.tlm * d},
                                             options_.thresholds.taylor_slope);
  }

  const Scene& scene_;
  const std::vector<Objective>& objectives_;
  const GradientCheckOptions& options_;
  Evaluator adjoint_, tlm_;
  VectorXd rho_, size_;
  VectorXd taylor_size_;  // smaller where finer differences hold: the steps that they come from are its largest
  StepSequence steps_;
  MatrixXd frozen_error_, free_error_, frozen_step_, free_step_;
  IntegrationError integration_;
  RoundingScatter rounding_;  // where it was measured; else 0
  bool rounding_known_ = false;
  Eigen::Array<bool, Eigen::Dynamic, 1> on_frozen_steps_;             // parameters whose differences they serve
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> on_base_steps_;  // a free difference
  // psi at h and -h on frozen and free steps, by the parameter and |h|.
  std::map<std::pair<Index, double>, std::array<std::array<VectorXd, 2>, 2>> rungs_;
  MatrixXd jump_;  // of psi, between the steps of the base run and those chosen anew
  std::mt19937 generator_{options_.seed};
  GradientCheck result_;
};

}  // namespace

bool GradientCheck::passed() const { return agree(*this) && wrong_terms.empty(); }

GradientCheck check_gradients(const Problem& problem, const GradientCheckOptions& options) {
  return check_gradients(problem.scene, objectives_of(problem), options);
}

GradientCheck check_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                              const GradientCheckOptions& options) {
  return Check(scene, objectives, options).run();
}

}  // namespace mbsopt
