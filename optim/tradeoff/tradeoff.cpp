#include "optim/tradeoff/tradeoff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "core/cvodes/cvodes.hpp"
#include "core/scene/default_integrator.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/machine/median.hpp"
#include "optim/tradeoff/pareto.hpp"
#include "optim/tradeoff/tradeoff_curves.hpp"

namespace mbsopt {
namespace {

// Settings from loose to tight, and the number of those measured.
struct Curve {
  std::vector<TradeoffSetting> settings;
  std::size_t next = 0;
  double last_seconds = 0, growth = 1.5;  // of the cost, from one setting to the next
  bool done() const { return next >= settings.size(); }
  double expected() const { return last_seconds * growth; }  // of the next
};

// 10^-from, ..., 10^-to
std::vector<double> decades(int from, int to, int stride = 1) {
  std::vector<double> values;
  for (int k = from; k <= to; k += stride) values.push_back(std::pow(10.0, -k));
  return values;
}

// Returns whether runs of one scene are the same.
bool same(const SimulationSettings& a, const SimulationSettings& b) {
  return a.integrator == b.integrator && a.formulation == b.formulation;
}

class Sweep {
 public:
  Sweep(const Scene& scene, const std::vector<Objective>& objectives, const TradeoffOptions& options)
      : runs_(scene, objectives), options_(options), stopwatch_(options.clock) {}

  Tradeoff run() {
    find_reference();
    if (!result_.ok()) return finish();
    measure_given_settings();
    budget_.emplace(options_.clock);
    if (options_.budget_seconds > 0) {
      constexpr double kSimulations = 0.25, kGradients = 0.2, kFormulations = 0.1;  // of the budget; the rest: again
      stage("integrators", simulation_curves(), kSimulations);
      stage("gradients", gradient_curves(), kGradients);
      stage("formulations", formulation_curves(), kFormulations);
      time_again();
    }
    return finish();
  }

 private:
  static constexpr int kRounds = 5;

  const SimulationSettings& own() const { return runs_.scene().simulation; }
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }
  void say(const std::string& doing, double done) const {
    if (options_.progress) options_.progress(doing, std::clamp(done, 0.0, 1.0));
  }

  void find_reference() {
    say("reference", 0);
    ReferenceOptions options;
    options.seconds_per_run = std::max(10.0, options_.budget_seconds / 6);
    options.interrupted = options_.interrupted, options.clock = options_.clock;
    options.progress = [this](const std::string& doing, double done) { say("reference, " + doing, done); };
    result_.reference = converged_reference(runs_, options);
    result_.message = result_.reference.message;
  }

  Tradeoff finish() {
    result_.interrupted = interrupted() || result_.reference.interrupted;
    result_.wall_seconds = stopwatch_.seconds();
    bound_errors(result_.rows);
    if (result_.ok()) mark_fronts();
    return std::move(result_);
  }

  // Measures the settings of the file, and the defaults, with a gradient if there is one.
  void measure_given_settings() {
    SimulationSettings defaults = own();
    defaults.formulation = {}, defaults.integrator = default_integrator(own().start_time, own().end_time);
    const RunLimit limit = within(std::max(10.0, options_.budget_seconds / 3));
    const auto add = [&](const char* curve, const SimulationSettings& settings,
                         std::optional<GradientMethod> method) -> std::optional<std::size_t> {
      if (interrupted()) return {};
      return measure({curve, settings, method}, limit);
    };
    const bool is_default = same(own(), defaults);
    result_.own = add(kOwnSettings, own(), {});
    result_.defaults = is_default ? result_.own : add(kDefaults, defaults, {});
    if (!has_gradients()) return;
    const GradientCost cost = gradient_cost(runs_.scene().parameters.size(), runs_.objectives().size());
    const bool forward = cost.tlm <= cost.adjoint;
    const auto discrete = forward ? GradientMethod::tlm : GradientMethod::adjoint;
    const auto continuous = forward ? GradientMethod::cvodes_forward : GradientMethod::cvodes_adjoint;
    result_.own_gradient = add(kOwnSettings, own(), is_cvodes(own().integrator.type) ? continuous : discrete);
    result_.default_gradient = is_default ? result_.own_gradient : add(kDefaults, defaults, discrete);
  }

  bool has_gradients() const { return !result_.reference.gradients_by.empty(); }

  // The scene's settings without the default limit of the step size, which would hide the effect of loose tolerances.
  SimulationSettings swept() const {
    SimulationSettings settings = own();
    IntegratorSettings& s = settings.integrator;
    if (s.max_step == default_integrator(settings.start_time, settings.end_time).max_step) s.max_step.reset();
    return settings;
  }

  SimulationSettings constrained_settings() const {
    SimulationSettings settings = swept();
    settings.formulation = constrained(settings.formulation);
    return settings;
  }

  Curve curve_of(const std::string& name, const SimulationSettings& base, const std::string& integrator,
                 const std::vector<double>& rtols, std::optional<GradientMethod> method = {}) const {
    Curve curve;
    for (const double rtol : rtols) curve.settings.push_back({name, with_tolerance(base, integrator, rtol), method});
    return curve;
  }

  std::vector<Curve> simulation_curves() const {
    const SimulationSettings base = constrained_settings();
    const std::vector<double> rtols = decades(2, 11);
    std::vector<Curve> curves;
    for (const Method& method : runge_kutta_methods()) {
      const std::string name(method.name);
      if (method.adaptive) {
        curves.push_back(curve_of(name, base, name, rtols));
        continue;
      }
      Curve& steps = curves.emplace_back();
      const double span = base.end_time - base.start_time;
      for (double count = 32; count <= 1 << 15; count *= 2) {
        SimulationSettings settings = base;
        settings.integrator.type = name;
        settings.integrator.options = {};
        settings.integrator.step = span / count;
        steps.settings.push_back({name, settings, {}});
      }
    }
    if (!own().events.empty()) return curves;
    for (const char* name : {"cvodes_adams", "cvodes_bdf"}) curves.push_back(curve_of(name, base, name, rtols));
    return curves;
  }

  // Returns whether an implicit method needs far fewer right-hand sides at a usual tolerance. Their number does not
  // depend on chance, but the time does.
  bool stiff() const {
    const auto evaluations = [&](const char* integrator) {
      for (const TradeoffRow& row : result_.rows) {
        const IntegratorSettings& s = row.setting.simulation.integrator;
        if (row.setting.curve != integrator || row.setting.gradient || std::abs(s.rtol - 1e-4) > 1e-6) continue;
        if (row.status == RowStatus::ok) return static_cast<double>(row.statistics.rhs_evaluations);
      }
      return std::numeric_limits<double>::infinity();
    };
    return 2 * evaluations("radau5") < evaluations("dopri5");
  }

  std::vector<Curve> gradient_curves() const {
    if (!has_gradients()) return {};
    const bool is_stiff = stiff();
    const SimulationSettings base = constrained_settings();
    const std::vector<double> rtols = decades(3, 10);
    std::vector<Curve> curves;
    const auto add = [&](GradientMethod method, const std::string& integrator) {
      curves.push_back(curve_of(fmt::format("{}, {}", to_string(method), integrator), base, integrator, rtols, method));
    };
    for (const char* integrator : is_stiff ? std::array{"radau5", "sdirk4"} : std::array{"dopri5", "dopri853"}) {
      add(GradientMethod::adjoint, integrator);
      add(GradientMethod::tlm, integrator);
    }
    add(GradientMethod::differences, is_stiff ? "radau5" : "dopri5");
    if (!own().events.empty()) return curves;
    const char* multistep = is_stiff ? "cvodes_bdf" : "cvodes_adams";
    add(GradientMethod::cvodes_forward, multistep);
    add(GradientMethod::cvodes_adjoint, multistep);
    return curves;
  }

  // MBSVT's form at several alpha, without and with loss of digits, and the augmented Lagrangian without projection.
  std::vector<Curve> formulation_curves() const {
    const std::string integrator = stiff() ? "radau5" : "dopri5";
    const std::vector<double> rtols = decades(3, 9, 2);
    std::vector<Curve> curves;
    for (const LinearSolver solver : {LinearSolver::quasidefinite, LinearSolver::cholesky}) {
      for (const double alpha : {1e5, 1e7, 1e9}) {
        SimulationSettings settings = swept();
        settings.formulation = FormulationSettings::penalty();
        settings.formulation.alpha = alpha, settings.formulation.linear_solver = solver;
        curves.push_back(
            curve_of(fmt::format("penalty {:.0e}, {}: {}", alpha,
                                 solver == LinearSolver::cholesky ? "cholesky" : "quasidefinite", integrator),
                     settings, integrator, rtols));
      }
    }
    SimulationSettings drifting = constrained_settings();
    drifting.formulation.projection = Projection::none;
    curves.push_back(curve_of("not projected: " + integrator, drifting, integrator, rtols));
    return curves;
  }

  RunLimit within(double seconds) const { return {seconds, options_.interrupted, options_.clock}; }
  double budget_left() const { return options_.budget_seconds - budget_->seconds(); }
  double most_per_point() const { return options_.budget_seconds / 30; }

  // Advances the curve with the cheapest next point by one point, until each is complete or the stage's share is used
  // up. So cheap curves are always followed to the end.
  void stage(const char* name, std::vector<Curve> curves, double share) {
    const Stopwatch stopwatch(options_.clock);
    const double seconds = share * options_.budget_seconds;
    const double all = static_cast<double>(curves.size());
    const auto cheaper = [](const Curve& a, const Curve& b) {
      return a.done() != b.done() ? b.done() : a.expected() < b.expected();
    };
    while (!curves.empty() && !interrupted()) {
      Curve& curve = *std::min_element(curves.begin(), curves.end(), cheaper);
      if (curve.done()) break;
      advance(curve, stopwatch.seconds() > seconds || budget_left() < 0);
      const auto done = static_cast<double>(std::count_if(curves.begin(), curves.end(), std::mem_fn(&Curve::done)));
      say(name, std::max(done / all, stopwatch.seconds() / seconds));
    }
  }

  void advance(Curve& curve, bool spent) {
    const TradeoffSetting& setting = curve.settings[curve.next];
    const double expected = curve.expected();
    if (spent || expected > most_per_point()) {
      TradeoffRow row;
      row.setting = setting;
      row.status = RowStatus::skipped;
      row.message = spent ? fmt::format("the budget of {:g} s was spent", options_.budget_seconds)
                          : fmt::format("would take about {:.2g} s, more than its share of the budget", expected);
      if (curve.next + 1 < curve.settings.size()) row.message += "; so were the tighter ones";
      row.errors.setConstant(count(), kNaN), row.deviations = row.errors;
      result_.rows.push_back(std::move(row));
      curve.next = curve.settings.size();
      return;
    }
    ++curve.next;
    const TradeoffRow& row = result_.rows[measure(setting, within(most_per_point() * 2))];
    if (row.status == RowStatus::abandoned || row.within_floor) curve.next = curve.settings.size();
    if (row.status != RowStatus::ok) return;
    if (curve.last_seconds > 0) curve.growth = std::clamp(row.wall_seconds / curve.last_seconds, 1.3, 5.0);
    curve.last_seconds = row.wall_seconds;
  }

  Eigen::Index count() const { return static_cast<Eigen::Index>(result_.reference.errors->quantities().size()); }

  Answer timed(const TradeoffSetting& setting, const RunLimit& limit) const {
    return setting.gradient ? runs_.gradients(setting.simulation, *setting.gradient, limit)
                            : runs_.values(setting.simulation, limit);
  }

  // Returns the row's index.
  std::size_t measure(const TradeoffSetting& setting, const RunLimit& limit) {
    TradeoffRow row;
    row.setting = setting;
    Answer answer = timed(setting, limit);
    row.statistics = answer.statistics;
    row.wall_seconds = answer.wall_seconds;
    std::vector<double> seconds{answer.wall_seconds};
    if (answer.ok && !setting.gradient) {
      RunLimit longer = limit;
      longer.seconds *= 3;
      answer = runs_.motion(setting.simulation, longer);
    }
    row.status = answer.ok ? RowStatus::ok : answer.out_of_time ? RowStatus::abandoned : RowStatus::failed;
    row.message = answer.message;
    if (interrupted() && !answer.ok) row.status = RowStatus::abandoned, row.message = "interrupted";
    row.errors = result_.reference.errors->of(answer);
    row.deviations = result_.reference.errors->deviations(answer);
    if (row.status != RowStatus::ok) seconds.clear();
    row.repetitions = static_cast<int>(seconds.size());
    // The objectives of a gradient's row are those of the simulation, which has its own row.
    const std::vector<Quantity>& quantities = result_.reference.errors->quantities();
    row.within_floor = row.status == RowStatus::ok;
    for (std::size_t i = 0; i < quantities.size(); ++i) {
      const auto q = static_cast<Eigen::Index>(i);
      double& error = row.errors(q);
      if (setting.gradient.has_value() != (quantities[i].kind == QuantityKind::gradient))
        error = row.deviations(q) = kNaN;
      if (error > quantities[i].certificate) row.within_floor = false;
    }
    if (row.status == RowStatus::ok && row.errors.array().isInf().any()) {
      row.status = RowStatus::failed, row.message = "not finite";
    }
    result_.rows.push_back(std::move(row));
    seconds_.resize(result_.rows.size());
    seconds_.back() = std::move(seconds);
    return result_.rows.size() - 1;
  }

  void time_again() {
    seconds_.resize(result_.rows.size());
    for (int round = 1; round < kRounds; ++round) {
      for (std::size_t i = 0; i < result_.rows.size(); ++i) {
        TradeoffRow& row = result_.rows[i];
        if (interrupted()) return;
        if (row.status != RowStatus::ok || row.wall_seconds > budget_left()) continue;
        const Answer answer = timed(row.setting, within(10 * row.wall_seconds + 1));
        if (answer.ok) seconds_[i].push_back(answer.wall_seconds);
        row.wall_seconds = median(seconds_[i]);
        row.repetitions = static_cast<int>(seconds_[i].size());
      }
      say("timing again", static_cast<double>(round) / (kRounds - 1));
    }
  }

  void mark_fronts() {
    std::vector<double> cost, bound;
    for (const TradeoffRow& row : result_.rows) cost.push_back(row.status == RowStatus::ok ? row.wall_seconds : kNaN);
    for (TradeoffRow& row : result_.rows) row.pareto.clear();
    for (Eigen::Index q = 0; q < count(); ++q) {
      bound.clear();
      const double certain = result_.reference.errors->quantities()[static_cast<std::size_t>(q)].certificate;
      for (const TradeoffRow& row : result_.rows)
        bound.push_back(std::isfinite(row.bounds(q)) ? std::max(row.bounds(q), certain) : kNaN);
      const std::vector<bool> front = pareto_front(cost, bound);
      for (std::size_t i = 0; i < front.size(); ++i) result_.rows[i].pareto.push_back(front[i]);
    }
  }

  TradeoffRuns runs_;
  const TradeoffOptions& options_;
  Stopwatch stopwatch_;
  std::optional<Stopwatch> budget_;  // begins after the reference and the given settings
  Tradeoff result_;
  std::vector<std::vector<double>> seconds_;  // per row
};

}  // namespace

Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options) {
  return Sweep(scene, objectives, options).run();
}

std::vector<std::size_t> main_quantities(const std::vector<Quantity>& quantities) {
  for (const QuantityKind kind : {QuantityKind::objective, QuantityKind::sensors, QuantityKind::motion}) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < quantities.size(); ++i)
      if (quantities[i].kind == kind) found.push_back(i);
    if (!found.empty()) return found;
  }
  return {};
}

std::vector<std::size_t> design_quantities(const std::vector<Quantity>& quantities,
                                           const std::vector<std::string>& objectives) {
  std::vector<std::size_t> found;
  for (const QuantityKind kind : {QuantityKind::objective, QuantityKind::gradient})
    for (std::size_t i = 0; i < quantities.size(); ++i)
      if (quantities[i].kind == kind &&
          std::find(objectives.begin(), objectives.end(), quantities[i].objective_name) != objectives.end())
        found.push_back(i);
  return found;
}

std::optional<std::size_t> simulation_of(const Tradeoff& tradeoff, std::size_t row) {
  const TradeoffSetting& setting = tradeoff.rows[row].setting;
  if (!setting.gradient) return row;
  std::optional<std::size_t> looser;
  for (std::size_t i = 0; i < tradeoff.rows.size(); ++i) {
    const TradeoffRow& other = tradeoff.rows[i];
    if (other.setting.gradient || other.status != RowStatus::ok) continue;
    if (same(other.setting.simulation, setting.simulation)) return i;
    SimulationSettings tightened = other.setting.simulation;
    tightened.integrator.rtol = setting.simulation.integrator.rtol;
    tightened.integrator.atol = setting.simulation.integrator.atol;
    const bool is_looser = other.setting.simulation.integrator.rtol > setting.simulation.integrator.rtol;
    if (other.within_floor && is_looser && same(tightened, setting.simulation)) looser = i;
  }
  return looser;
}

Recommendation recommend(const Tradeoff& tradeoff, std::vector<std::size_t> quantities, double accuracy,
                         const std::function<bool(const TradeoffRow&)>& also) {
  Recommendation found{std::move(quantities), accuracy, {}, {}};
  const std::vector<Quantity>& all = tradeoff.reference.errors->quantities();
  double certificate = 0;
  bool gradients = false, values = false;
  for (const std::size_t q : found.quantities) {
    certificate = std::max(certificate, all[q].certificate);
    (all[q].kind == QuantityKind::gradient ? gradients : values) = true;
  }
  if (3 * certificate > accuracy) {
    found.why_not = fmt::format("the reference itself is certain to {:.1e} only", certificate);
    return found;
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto bound = [&](std::size_t i) {  // no less than the reference is certain of
    const TradeoffRow& row = tradeoff.rows[i];
    const bool both = gradients && values;
    if (both && (!row.setting.gradient || *row.setting.gradient == GradientMethod::differences)) return kInfinity;
    const std::optional<std::size_t> simulation = both ? simulation_of(tradeoff, i) : i;
    double largest = certificate;
    for (const std::size_t q : found.quantities) {
      const bool of_gradient = all[q].kind == QuantityKind::gradient;
      if (!of_gradient && !simulation) return kInfinity;
      const double b = tradeoff.rows[of_gradient ? i : *simulation].bounds(static_cast<Eigen::Index>(q));
      if (!std::isfinite(b)) return kInfinity;
      largest = std::max(largest, b);
    }
    return largest;
  };
  std::vector<std::size_t> candidates;
  double best = kInfinity;
  for (std::size_t i = 0; i < tradeoff.rows.size(); ++i) {
    const double b = bound(i);
    best = std::min(best, b);
    if (b <= accuracy) candidates.push_back(i);
  }
  std::stable_sort(candidates.begin(), candidates.end(), [&](std::size_t a, std::size_t b) {
    return tradeoff.rows[a].wall_seconds < tradeoff.rows[b].wall_seconds;
  });
  std::optional<double> fastest;
  for (const std::size_t i : candidates) {
    if (fastest && tradeoff.rows[i].wall_seconds > 1.1 * *fastest) break;
    if (found.row && bound(i) >= bound(*found.row)) continue;
    if (also && !also(tradeoff.rows[i])) continue;
    found.row = i;
    if (!fastest) fastest = tradeoff.rows[i].wall_seconds;
  }
  if (!found.row)
    found.why_not = !candidates.empty() ? "no setting that was measured is that exact in all of it"
                    : std::isfinite(best)
                        ? fmt::format("no setting that was measured gets there; the best has {:.1e}", best)
                        : "it was not measured";
  return found;
}

}  // namespace mbsopt
