#include "optim/check/gradient_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <set>

#include "core/cvodes/cvodes.hpp"
#include "core/run/timed_laws.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "optim/check/checked_run.hpp"
#include "optim/check/taylor_remainders.hpp"
#include "optim/check/user_terms.hpp"
#include "optim/machine/stopwatch.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool failed(const std::optional<Verdict>& verdict) { return verdict && !passes(*verdict); }

// Returns whether the methods agree. Wrong terms of a user do not count here.
bool agree(const GradientCheck& check) {
  const auto fine = [](const CheckedEntry& e) {
    return passes(e.exact) && !failed(e.frozen_verdict) && !failed(e.free_verdict);
  };
  return check.ran && std::ranges::all_of(check.entries, fine) &&
         std::ranges::all_of(check.taylor, &TaylorCheck::passed) &&
         std::ranges::all_of(check.identities, &IdentityCheck::passed) &&
         (!check.continuous || check.continuous->passed());
}

class Check {
 public:
  Check(const Scene& scene, const std::vector<Objective>& objectives, const GradientCheckOptions& options)
      : scene_(scene),
        objectives_(objectives),
        options_(options),
        run_{Evaluator(scene, objectives, {},
                       {.user_forces = options.user_forces, .progress = options.simulation_progress})} {
    for (const Objective& objective : objectives) result_.objectives.push_back(objective.name());
    for (const Parameter& p : scene.parameters) result_.parameters.push_back(p.name);
  }

  GradientCheck run() {
    if (!base_runs()) return std::move(result_);
    result_.ran = true;
    result_.discrete = run_.discrete = !is_cvodes(scene_.simulation.integrator.type);
    run_.on_frozen_steps = parameters_on_frozen_steps();
    differences_.emplace(run_,
                         GradientDifferences::Settings{options_.relative_step, options_.rungs, options_.free_steps});
    rounding_.psi.setZero(result_.psi.size());
    rounding_.psi_rho.setZero(result_.psi.size(), run_.rho.size());
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
        for (const Jump& kink : result_.statistics.jumps)
          if (kink.size == 0)
            result_.warnings.push_back(in_words(scene_, kink) +
                                       ". The derivatives of steps across it may be wrong; differences on free steps "
                                       "tell. Tighten simulation.integrator.rtol and atol, or round the kink");
      }
    }
    compare_with_cvodes();
    result_.wrong_terms = wrong_user_terms(scene_, objectives_, options_.user_forces, options_.simulation_progress);
    result_.simulations += run_.simulations;
    return std::move(result_);
  }

 private:
  bool base_runs() {
    for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
      Evaluation& e = method == GradientMethod::tlm ? tlm_ : adjoint_;
      e = run_.counted(run_.evaluator.in(scene_, method).gradients(run_.rho));
      result_.statistics = e.statistics;
      result_.warnings = e.warnings;
      result_.message = e.message;
      if (!e.ok) return false;
    }
    result_.tlm = tlm_.psi_rho;
    result_.adjoint = adjoint_.psi_rho;
    result_.psi = run_.psi = tlm_.psi = adjoint_.psi;
    run_.steps = adjoint_.steps;
    return true;
  }

  // Steps that end at kinks miss them when a parameter moves the kinks. Differences then need steps of their own.
  Eigen::Array<bool, Eigen::Dynamic, 1> parameters_on_frozen_steps() {
    const Mechanism mechanism = run_.evaluator.mechanism(run_.rho, true);
    std::vector<Cost> costs;
    for (const Objective& objective : objectives_)
      if (objective.needs_simulation()) costs.push_back(objective.cost(mechanism));
    std::set<int> moving;
    for (const KinkedSignal& kinks : kinks_of(mechanism, costs))
      moving.insert(kinks.moved_by.begin(), kinks.moved_by.end());
    const std::size_t events = run_.steps.events.size();
    if (events > 0 && result_.discrete)
      result_.warnings.push_back(
          fmt::format("steps end at {} events (kinks, jumps, impacts), which parameters move: compared with "
                      "differences on free steps only",
                      events));
    Eigen::Array<bool, Eigen::Dynamic, 1> frozen =
        Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(run_.rho.size(), result_.discrete && events == 0);
    if (events > 0) return frozen;
    std::string names;
    for (const int k : moving) {
      frozen(k) = false;
      names += (names.empty() ? "'" : ", '") + result_.parameters[static_cast<std::size_t>(k)] + "'";
    }
    if (!names.empty() && result_.discrete)
      result_.warnings.push_back(fmt::format(
          "{} moves kinks of laws, at which steps end: compared with differences on free steps only", names));
    return frozen;
  }

  void measure_times() {
    GradientTimingOptions timing_options = options_.timing;
    timing_options.user_forces = options_.user_forces;
    timing_options.progress = options_.simulation_progress;
    result_.timing = time_gradients(scene_, objectives_, timing_options);
    result_.simulations += result_.timing.simulations;
  }

  void set_ratio(MethodCost& cost) const {
    const double one = result_.timing.simulation.wall_seconds;
    cost.ratio = one > 0 ? cost.wall_seconds / one : 0;
  }

  void difference() {
    const Index P = run_.rho.size();
    for (Index k = 0; k < P; ++k) {
      for (const bool frozen : {true, false}) {
        if (!differences_->takes(k, frozen)) continue;
        const Stopwatch stopwatch;
        if (const std::string failure = differences_->take(k, frozen); !failure.empty())
          result_.warnings.push_back(fmt::format("differences in '{}' could not be evaluated{}: {}",
                                                 result_.parameters[static_cast<std::size_t>(k)],
                                                 frozen ? " on the steps of the base run" : "", failure));
        (frozen ? result_.frozen_cost : result_.free_cost).wall_seconds += stopwatch.seconds();
      }
      if (options_.progress) options_.progress(static_cast<int>(k) + 1, static_cast<int>(P));
    }
    set_ratio(result_.frozen_cost);
    set_ratio(result_.free_cost);
  }

  // Repeats differences that disagree with smaller steps. Returns whether one of them changed.
  bool difference_finer() {
    bool found = false;
    for (Index k = 0; k < run_.rho.size(); ++k) {
      for (const bool frozen : {true, false}) {
        std::vector<Index> disagreeing;
        for (const CheckedEntry& e : result_.entries)
          if (e.column == k && failed(frozen ? e.frozen_verdict : e.free_verdict)) disagreeing.push_back(e.row);
        if (differences_->take_finer(k, frozen, disagreeing, rounding_.psi)) found = true;
      }
    }
    return found;
  }

  void estimate_integration_error() {
    excused_.setZero(result_.psi.size(), run_.rho.size());
    if (!options_.free_steps && result_.discrete) return;
    const auto error_of = [&](const Evaluation& at, GradientMethod method) {
      const IntegrationError e = integration_error(run_.evaluator, at, method);
      result_.simulations += e.simulations;
      return e;
    };
    IntegrationError e = error_of(tlm_, result_.discrete ? GradientMethod::automatic : GradientMethod::tlm);
    for (std::string& doubt : unresolved_gradients(run_.evaluator, tlm_, e))
      result_.warnings.push_back(std::move(doubt));
    if (!result_.discrete)  // forward and backward have errors of their own
      e.psi_rho += error_of(adjoint_, GradientMethod::adjoint).psi_rho;
    // Unresolved derivatives change with the tolerances. That excuses them up to kExcused of the largest, or what the
    // tolerance leaves. Beyond it, differences decide.
    constexpr double kExcused = 1e-4, kDigitsFewer = 1e3;
    const double excused = std::max(kExcused, kDigitsFewer * scene_.simulation.integrator.rtol) / kEstimateTrust;
    const VectorXd largest = (result_.tlm.cwiseAbs() * run_.size.asDiagonal()).rowwise().maxCoeff();
    excused_ = excused * largest * run_.size.cwiseInverse().transpose();
    e.psi_rho = e.psi_rho.cwiseMin(excused_);
    differences_->add(std::move(e));
  }

  // Runs only if something disagrees.
  void measure_rounding() {
    rounding_ = rounding_scatter(run_, options_.seed);
    rounding_known_ = true;
  }

  // Excuses entries in which CVODES differs by no more than the rounding of the discrete ones, which separates TLM and
  // adjoint, too.
  void excuse_rounding(ContinuousCheck& check) {
    if (check.passed() || !result_.discrete) return;
    if (!rounding_known_) measure_rounding();
    const MatrixXd rounding = rounding_.psi_rho.cwiseMax((result_.tlm - result_.adjoint).cwiseAbs());
    for (ContinuousEntry& e : check.entries)
      if (!passes(e.verdict))
        e.verdict = verdict_of(e.continuous, rounding(e.row, e.column), e.discrete,
                               std::max(std::abs(e.discrete), std::abs(e.continuous)), options_.thresholds.continuous);
  }

  // Warns if rounding of the exact derivatives exceeds what methods may differ by.
  void say_rounding() {
    const FormulationSettings& f = scene_.simulation.formulation;
    const bool by_penalty = f.type == FormulationType::penalty && f.linear_solver == LinearSolver::cholesky;
    double worst = by_penalty ? options_.thresholds.tlm_adjoint : options_.thresholds.frozen;
    const CheckedEntry* of = nullptr;
    for (const CheckedEntry& e : result_.entries) {
      const double entry = std::abs(e.tlm);
      const double part = rounding_.psi_rho(e.row, e.column) / std::max(entry, floor_of(e.row, e.column));
      if (entry > 0 && part > worst) worst = part, of = &e;
    }
    if (!of) return;
    result_.warnings.push_back(
        by_penalty
            ? fmt::format("simulation.formulation: penalty with alpha {:.3g} by cholesky rounds derivatives by up to "
                          "{:.1g} of them, which is more than methods may differ by; \"linear_solver\": "
                          "\"quasidefinite\" has no such rounding",
                          f.alpha, worst)
            : fmt::format("rounding changes the exact derivative of {} in {} by about {:.1g} of it, which is more than "
                          "it may differ from differences: its terms differ by many powers of ten",
                          of->objective, of->parameter, worst));
  }

  void say_kinks() {
    for (const CheckedEntry& e : result_.entries) {
      const bool frozen = failed(e.frozen_verdict);
      if (!frozen && !failed(e.free_verdict)) continue;
      const double s = frozen ? e.frozen : e.free;
      const double b = differences_->kink(e.row, e.column, frozen, rounding_.psi(e.row));
      if (!(std::abs(e.tlm - s) <= std::abs(b) / kKinkFalls)) continue;
      result_.warnings.push_back(fmt::format(
          "{} is not smooth in {}: its slope is {:.6g} below the value and {:.6g} above it, as at a norm or "
          "an absolute value that is zero. There is no derivative",
          e.objective, e.parameter, s - b, s + b));
    }
  }

  // Entries of an objective below this size are compared with it.
  double floor_of(Index objective, Index k) const {
    return options_.thresholds.rounding_floor *
           result_.tlm.row(objective).cwiseAbs().cwiseProduct(run_.size.transpose()).maxCoeff() / run_.size(k);
  }

  void compare() {
    result_.entries.clear();
    const CheckThresholds& limits = options_.thresholds;
    const bool has_kinks =
        std::ranges::any_of(result_.statistics.jumps, [](const Jump& jump) { return jump.size == 0; });
    const GradientDifferences::Table &on_frozen = differences_->of(true), &on_free = differences_->of(false);
    result_.frozen = on_frozen.derivative;
    result_.free = on_free.derivative;
    for (Index i = 0; i < result_.psi.size(); ++i) {
      for (Index k = 0; k < run_.rho.size(); ++k) {
        CheckedEntry e{result_.objectives[static_cast<std::size_t>(i)], result_.parameters[static_cast<std::size_t>(k)],
                       i, k};
        e.tlm = result_.tlm(i, k);
        e.adjoint = result_.adjoint(i, k);
        e.frozen = result_.frozen(i, k);
        e.frozen_error = on_frozen.error(i, k);
        e.free = result_.free(i, k);
        e.free_error = on_free.error(i, k);
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
          e.frozen_error += rounding(on_frozen.step);
          if (run_.on_frozen_steps(k))
            e.frozen_verdict = verdict_of(e.frozen, e.frozen_error, e.tlm, entry, limits.frozen);
        } else {
          e.exact = verdict_of(e.adjoint, differences_->integration().psi_rho(i, k), e.tlm, std::max(entry, floor),
                               limits.continuous);
        }
        // Where steps cross kinks, rounding may take another branch; this is no error of differences.
        const double branch = has_kinks ? std::max(0.0, rounding_.psi_rho(i, k) - excused_(i, k)) : 0;
        e.free_error += rounding(on_free.step) - branch;
        if (options_.free_steps) e.free_verdict = verdict_of(e.free, e.free_error, e.tlm, entry, limits.free);
        e.rungs = differences_->rungs(i, k);
        result_.entries.push_back(std::move(e));
      }
    }
  }

  void compare_with_cvodes() {
    if (!options_.continuous) return;
    result_.continuous = check_continuous(run_.evaluator, {.threshold = options_.thresholds.continuous,
                                                           .floor = options_.thresholds.rounding_floor,
                                                           .typical_steps = result_.statistics.steps});
    result_.simulations += result_.continuous->simulations;
    excuse_rounding(*result_.continuous);
    outvote(*result_.continuous);
  }

  // CVODES may pass over what all other methods see. Differences decide: where they are nearer to the discrete
  // derivatives by far, their own errors included, CVODES is wrong by all that separates it from these.
  void outvote(ContinuousCheck& check) {
    std::string names;
    for (std::size_t n = 0; n < check.entries.size(); ++n) {
      ContinuousEntry& c = check.entries[n];
      const CheckedEntry& e = result_.entries[n];
      const double apart = std::abs(c.continuous - e.tlm);
      const bool free = options_.free_steps && passes(e.exact) && passes(*e.free_verdict);
      if (passes(c.verdict) || !free || kEstimateTrust * (std::abs(e.free - e.tlm) + e.free_error) > apart) continue;
      c.verdict = Verdict::buried;
      names += fmt::format("{}d {}/d {} ({:.6g} instead of {:.6g})", names.empty() ? "" : ", ", e.objective,
                           e.parameter, c.continuous, e.tlm);
    }
    if (!names.empty())
      result_.warnings.push_back(
          fmt::format("{} is wrong: {}. The other methods and differences agree", check.method, names));
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
      IdentityCheck check;
      const VectorXd& d = check.d = random_direction(run_.rho.size()).cwiseProduct(run_.size);
      const VectorXd& w = check.w = random_direction(result_.psi.size());
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
    VectorXd d = random_direction(run_.rho.size()).cwiseProduct(differences_->size_of_steps()) /
                 std::sqrt(static_cast<double>(run_.rho.size()));
    for (Index k = 0; k < d.size(); ++k)
      if (!run_.on_frozen_steps(k)) d(k) = 0;
    const auto rounding = [&](double h, const VectorXd& psi) -> VectorXd {
      return (kPsiRounding * psi.cwiseAbs().cwiseMax(result_.psi.cwiseAbs())).cwiseMax(rounding_.psi) +
             h * (rounding_.psi_rho + allowed * result_.tlm.cwiseAbs()) * d.cwiseAbs();
    };
    result_.taylor = check_taylor_remainders(run_, d, result_.tlm * d, rounding, options_.thresholds.taylor_slope);
  }

  const Scene& scene_;
  const std::vector<Objective>& objectives_;
  const GradientCheckOptions& options_;
  CheckedRun run_;
  Evaluation tlm_, adjoint_;
  std::optional<GradientDifferences> differences_;
  RoundingScatter rounding_;  // 0 if it was not measured
  MatrixXd excused_;          // what the integration error of a derivative excuses at most
  bool rounding_known_ = false;
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

}  // namespace mbsopt::inline optim
