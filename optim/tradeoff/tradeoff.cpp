#include "optim/tradeoff/tradeoff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <map>

#include "core/cvodes/cvodes.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/machine/median.hpp"

namespace mbsopt::inline optim {
namespace {

// Settings from loose to tight, and the number of those measured.
struct Curve {
  std::vector<TradeoffSetting> settings;
  std::size_t next = 0;
  double last_seconds = 0, growth = 1.5;  // of the cost, from one setting to the next
  bool done() const { return next >= settings.size(); }
  double expected() const { return last_seconds * growth; }  // of the next
};

// rtol from 10^-first to 10^-last
Curve curve_of(const std::string& name, const SimulationSettings& base, const std::string& integrator, int first,
               int last, int stride = 1, std::optional<GradientMethod> method = {}) {
  Curve curve;
  for (int k = first; k <= last; k += stride)
    curve.settings.push_back({name, with_tolerance(base, integrator, std::pow(10.0, -k)), method});
  return curve;
}

// Finds the reference, measures rows, and times them again.
class Sweep {
 public:
  Sweep(const Scene& scene, const std::vector<Objective>& objectives, const TradeoffOptions& options)
      : runs_(scene, objectives), options_(options), stopwatch_(options.clock) {}

  Tradeoff run() {
    if (!find_reference()) return finish();
    measure_given_settings();
    budget_.emplace(options_.clock);
    if (options_.budget_seconds > 0) {
      constexpr double kSimulations = 0.25, kGradients = 0.2, kFormulations = 0.1;  // of the budget; the rest: again
      constexpr int kRounds = 5;
      stage("integrators", simulation_curves(), kSimulations);
      if (has_gradients()) stage("gradients", gradient_curves(), kGradients);
      stage("formulations", formulation_curves(), kFormulations);
      time_again(kRounds);
    }
    return finish();
  }

 private:
  const SimulationSettings& own() const { return runs_.scene().simulation; }
  bool has_gradients() const { return !result_.reference.gradients_by.empty(); }
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }
  double budget_left() const { return options_.budget_seconds - budget_->seconds(); }  // without the reference
  RunLimit within(double seconds) const { return {seconds, options_.interrupted, options_.clock}; }
  void report(const std::string& doing, double done) const {
    if (options_.progress) options_.progress(doing, std::clamp(done, 0.0, 1.0));
  }

  bool find_reference() {
    report("reference", 0);
    result_.reference = converged_reference(
        runs_, {.seconds_per_run = std::max(10.0, options_.budget_seconds / 6),
                .interrupted = options_.interrupted,
                .clock = options_.clock,
                .progress = [this](const std::string& doing, double done) { report("reference, " + doing, done); }});
    result_.message = result_.reference.message;
    budget_.emplace(options_.clock);
    return result_.ok();
  }

  Answer timed(const TradeoffSetting& setting, double seconds) const {
    return setting.gradient ? runs_.gradients(setting.simulation, *setting.gradient, within(seconds))
                            : runs_.values(setting.simulation, within(seconds));
  }

  TradeoffRow& add_row(const TradeoffSetting& setting, const Answer& answer, RowStatus status,
                       const std::string& message) {
    TradeoffRow& row = result_.rows.emplace_back();
    row.setting = setting;
    row.status = status;
    row.message = message;
    row.errors = result_.reference.errors->of(answer);
    row.deviations = result_.reference.errors->deviations(answer);
    return row;
  }

  // Adds a row. A simulation is timed by a run without samples.
  void measure(const TradeoffSetting& setting, double seconds) {
    Answer answer = timed(setting, seconds);
    const SimulationStatistics statistics = answer.statistics;
    const double wall_seconds = answer.wall_seconds;
    if (answer.ok && !setting.gradient) answer = runs_.motion(setting.simulation, within(3 * seconds));
    if (setting.gradient) answer.psi.resize(0);  // its objectives are those of the simulation, which has its own row
    const bool stopped = interrupted() && !answer.ok, abandoned = stopped || answer.out_of_time;
    TradeoffRow& row = add_row(setting, answer,
                               answer.ok   ? RowStatus::ok
                               : abandoned ? RowStatus::abandoned
                                           : RowStatus::failed,
                               stopped ? "interrupted" : answer.message);
    row.statistics = statistics;
    row.wall_seconds = wall_seconds;
    row.within_floor = answer.ok;
    for (std::size_t q = 0; q < result_.quantities().size(); ++q)
      if (row.error(q) > result_.quantities()[q].certificate) row.within_floor = false;
    if (answer.ok) row.runs = {row.wall_seconds};
    if (answer.ok && row.errors.array().isInf().any()) {
      row.status = RowStatus::failed;
      row.message = "not finite";
    }
  }

  void time_again(int rounds) {  // within the budget
    for (int round = 1; round < rounds; ++round) {
      for (TradeoffRow& row : result_.rows) {
        if (interrupted()) return;
        if (!row.ok() || row.wall_seconds > budget_left()) continue;
        const Answer answer = timed(row.setting, 10 * row.wall_seconds + 1);
        if (answer.ok) row.runs.push_back(answer.wall_seconds);
        row.wall_seconds = median(row.runs);
      }
      report("timing again", static_cast<double>(round) / (rounds - 1));
    }
  }

  Tradeoff finish() {
    result_.interrupted = interrupted() || result_.reference.interrupted;
    result_.wall_seconds = stopwatch_.seconds();
    bound_errors(result_.rows);
    if (result_.ok()) mark_fronts(result_.rows, result_.quantities());
    return std::move(result_);
  }

  // Measures the settings of the file, and the defaults, with a gradient if there is one.
  void measure_given_settings() {
    const SimulationSettings defaults = with_defaults(own());
    const auto add = [&](const char* curve, const SimulationSettings& settings,
                         std::optional<GradientMethod> method) -> std::optional<std::size_t> {
      if (interrupted()) return {};
      measure({curve, settings, method}, std::max(10.0, options_.budget_seconds / 3));
      return result_.rows.size() - 1;
    };
    const bool is_default = own().integrator == defaults.integrator && own().formulation == defaults.formulation;
    result_.own = add(kOwnSettings, own(), {});
    result_.defaults = is_default ? result_.own : add(kDefaults, defaults, {});
    if (!has_gradients()) return;
    const GradientMethod discrete = runs_.discrete_method();
    const auto continuous =
        discrete == GradientMethod::tlm ? GradientMethod::cvodes_forward : GradientMethod::cvodes_adjoint;
    result_.own_gradient = add(kOwnSettings, own(), is_cvodes(own().integrator.type) ? continuous : discrete);
    result_.default_gradient = is_default ? result_.own_gradient : add(kDefaults, defaults, discrete);
  }

  // The scene's settings without the default limit of the step size, which would hide the effect of loose tolerances.
  SimulationSettings swept(const FormulationSettings& formulation) const {
    SimulationSettings settings = own();
    settings.formulation = formulation;
    IntegratorSettings& s = settings.integrator;
    if (s.max_step == with_defaults(own()).integrator.max_step) s.max_step.reset();
    return settings;
  }

  std::vector<Curve> simulation_curves() const {
    const SimulationSettings base = swept(constrained(own().formulation));
    std::vector<Curve> curves;
    const auto add = [&](const std::string& name) { curves.push_back(curve_of(name, base, name, 2, 11)); };
    for (const Method& method : runge_kutta_methods()) {
      const std::string name(method.name);
      if (method.adaptive) {
        add(name);
        continue;
      }
      Curve& steps = curves.emplace_back();
      for (double count = 32; count <= 1 << 15; count *= 2) {
        SimulationSettings& settings = steps.settings.emplace_back(TradeoffSetting{name, base, {}}).simulation;
        settings.integrator.type = name;
        settings.integrator.options = {};
        settings.integrator.step = (own().end_time - own().start_time) / count;
      }
    }
    if (own().events.empty()) {
      add("cvodes_adams");
      add("cvodes_bdf");
    }
    return curves;
  }

  // Returns whether an implicit method needs far fewer right-hand sides at a usual tolerance. Their number does not
  // depend on chance, but the time does.
  bool stiff() const {
    const auto evaluations = [&](const char* integrator) {
      for (const TradeoffRow& r : result_.rows) {
        const bool is_usual = std::abs(r.setting.simulation.integrator.rtol - 1e-4) < 1e-6;
        if (r.ok() && r.setting.curve == integrator && is_usual)
          return static_cast<double>(r.statistics.rhs_evaluations);
      }
      return std::numeric_limits<double>::infinity();
    };
    return 2 * evaluations("radau5") < evaluations("dopri5");
  }

  std::vector<Curve> gradient_curves() const {
    const SimulationSettings base = swept(constrained(own().formulation));
    std::vector<Curve> curves;
    const auto add = [&](GradientMethod method, const std::string& integrator) {
      curves.push_back(
          curve_of(fmt::format("{}, {}", to_string(method), integrator), base, integrator, 3, 10, 1, method));
    };
    const bool is_stiff = stiff();
    const char *first = is_stiff ? "radau5" : "dopri5", *second = is_stiff ? "sdirk4" : "dopri853";
    for (const char* integrator : {first, second})
      for (const auto method : {GradientMethod::adjoint, GradientMethod::tlm}) add(method, integrator);
    add(GradientMethod::differences, first);
    if (own().events.empty())
      for (const GradientMethod method : {GradientMethod::cvodes_forward, GradientMethod::cvodes_adjoint})
        add(method, is_stiff ? "cvodes_bdf" : "cvodes_adams");
    return curves;
  }

  // MBSVT's form at several alpha, without and with loss of digits, and the augmented Lagrangian without projection.
  std::vector<Curve> formulation_curves() const {
    const std::string integrator = stiff() ? "radau5" : "dopri5";
    std::vector<Curve> curves;
    const auto add = [&](const std::string& name, const FormulationSettings& formulation) {
      curves.push_back(curve_of(name + ": " + integrator, swept(formulation), integrator, 3, 9, 2));
    };
    FormulationSettings penalty = FormulationSettings::penalty();
    for (const bool cholesky : {false, true}) {
      penalty.linear_solver = cholesky ? LinearSolver::cholesky : LinearSolver::quasidefinite;
      for (const double alpha : {1e5, 1e7, 1e9}) {
        penalty.alpha = alpha;
        add(fmt::format("penalty {:.0e}, {}", alpha, cholesky ? "cholesky" : "quasidefinite"), penalty);
      }
    }
    FormulationSettings drifting = constrained(own().formulation);
    drifting.projection = Projection::none;
    add("not projected", drifting);
    return curves;
  }

  // Advances the curve with the cheapest next point by one point, until each is complete or the stage's share is used
  // up. So cheap curves are always followed to the end.
  void stage(const char* name, std::vector<Curve> curves, double share) {
    const Stopwatch stopwatch(options_.clock);
    const double seconds = share * options_.budget_seconds;
    while (!interrupted()) {
      Curve& curve = *std::ranges::min_element(
          curves, {}, [](const Curve& c) { return c.done() ? std::numeric_limits<double>::infinity() : c.expected(); });
      if (curve.done()) break;
      advance(curve, stopwatch.seconds() > seconds || budget_left() < 0);
      const auto done = static_cast<double>(std::ranges::count_if(curves, std::mem_fn(&Curve::done)));
      report(name, std::max(done / static_cast<double>(curves.size()), stopwatch.seconds() / seconds));
    }
  }

  void advance(Curve& curve, bool spent) {
    const double most = options_.budget_seconds / 30, expected = curve.expected();
    if (spent || expected > most) {
      const bool is_last = curve.next + 1 == curve.settings.size();
      const std::string why =
          spent ? fmt::format("the budget of {:g} s was spent", options_.budget_seconds)
                : fmt::format("would take about {:.2g} s, more than its share of the budget", expected);
      add_row(curve.settings[curve.next], {}, RowStatus::skipped, why + (is_last ? "" : "; so were the tighter ones"));
      curve.next = curve.settings.size();
      return;
    }
    measure(curve.settings[curve.next++], 2 * most);
    const TradeoffRow& row = result_.rows.back();
    if (row.status == RowStatus::abandoned || row.within_floor) curve.next = curve.settings.size();
    if (!row.ok()) return;
    if (curve.last_seconds > 0) curve.growth = std::clamp(row.wall_seconds / curve.last_seconds, 1.3, 5.0);
    curve.last_seconds = row.wall_seconds;
  }

  const TradeoffRuns runs_;
  const TradeoffOptions& options_;
  const Stopwatch stopwatch_;
  std::optional<Stopwatch> budget_;
  Tradeoff result_;
};

// Returns the rows that cost less than every tighter one, in the same order. `some` goes from loose to tight.
template <typename Cost>
std::vector<std::size_t> not_dominated(const std::vector<std::size_t>& some, const Cost& cost_of) {
  std::vector<std::size_t> left;
  for (auto i = some.rbegin(); i != some.rend(); ++i)
    if (left.empty() || cost_of(*i) < cost_of(left.back())) left.push_back(*i);
  std::ranges::reverse(left);
  return left;
}

}  // namespace

std::string in_words(const TradeoffSetting& setting) {
  const IntegratorSettings& s = setting.simulation.integrator;
  std::string name = setting.curve;
  if (setting.stands_alone()) {  // for any method
    name = fmt::format("{} ({})", s.type, name);
    if (setting.gradient) name = fmt::format("{}, {}", to_string(*setting.gradient), name);
  }
  return in_words(ReferenceMethod{name, s.rtol, s.step});
}

std::string_view to_string(RowStatus status) {
  constexpr std::string_view kWords[] = {"ok", "failed", "abandoned", "skipped"};
  return kWords[static_cast<std::size_t>(status)];
}

void bound_errors(std::vector<TradeoffRow>& rows) {
  std::map<std::string, Eigen::VectorXd> largest_of;  // per curve, of the rows from the tightest on
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    row->bounds.setConstant(row->errors.size(), kNaN);
    if (!row->ok()) continue;
    Eigen::VectorXd& largest = largest_of[row->setting.curve];
    if (largest.size() == 0) largest.setZero(row->errors.size());
    for (Eigen::Index q = 0; q < row->errors.size(); ++q)
      if (std::isfinite(row->errors(q))) row->bounds(q) = largest(q) = std::max(largest(q), row->errors(q));
  }
}

std::vector<bool> pareto_front(const std::vector<double>& cost, const std::vector<double>& error) {
  std::vector<std::size_t> finite;
  for (std::size_t i = 0; i < cost.size(); ++i)
    if (std::isfinite(cost[i]) && std::isfinite(error[i])) finite.push_back(i);
  std::ranges::stable_sort(finite, {}, [&](std::size_t i) { return std::pair(cost[i], error[i]); });
  std::vector<bool> front(cost.size(), false);
  double least = std::numeric_limits<double>::infinity();  // error of what costs no more
  for (const std::size_t i : finite)
    if (error[i] < least) front[i] = true, least = error[i];
  return front;
}

void mark_fronts(std::vector<TradeoffRow>& rows, const std::vector<Quantity>& quantities) {
  for (TradeoffRow& row : rows) row.pareto.clear();
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    std::vector<double> cost, bound;
    for (const TradeoffRow& row : rows) {
      cost.push_back(row.ok() ? row.wall_seconds : kNaN);
      bound.push_back(std::isfinite(row.bound(q)) ? std::max(row.bound(q), quantities[q].certificate) : kNaN);
    }
    const std::vector<bool> front = pareto_front(cost, bound);
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].pareto.push_back(front[i]);
  }
}

bool better_than_zero(const Quantity& quantity, double error) {
  return std::isfinite(error) && (!quantity.relative || error < 1);
}

std::vector<WorkPrecisionCurve> work_precision_curves(const std::vector<TradeoffRow>& rows,
                                                      const std::vector<Quantity>& quantities, std::size_t quantity) {
  std::vector<WorkPrecisionCurve> curves;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TradeoffSetting& setting = rows[i].setting;
    if (setting.stands_alone() || !better_than_zero(quantities[quantity], rows[i].bound(quantity))) continue;
    auto curve = std::ranges::find(curves, setting.curve, &WorkPrecisionCurve::name);
    if (curve == curves.end()) curve = curves.insert(curve, WorkPrecisionCurve{setting.curve, {}});
    curve->line.push_back(i);
  }
  for (WorkPrecisionCurve& curve : curves)
    curve.line = not_dominated(curve.line, [&](std::size_t i) { return rows[i].statistics.rhs_evaluations; });
  return curves;
}

std::vector<std::size_t> slower_and_slower(const std::vector<TradeoffRow>& rows, const std::vector<std::size_t>& some) {
  return not_dominated(some, [&](std::size_t i) { return rows[i].wall_seconds; });
}

Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options) {
  return Sweep(scene, objectives, options).run();
}

}  // namespace mbsopt::inline optim
