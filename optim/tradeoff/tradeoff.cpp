#include "optim/tradeoff/tradeoff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/cvodes/cvodes.hpp"
#include "core/tableau/tableaus.hpp"

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

// 10^-from, ..., 10^-to
std::vector<double> decades(int from, int to, int stride = 1) {
  std::vector<double> values;
  for (int k = from; k <= to; k += stride) values.push_back(std::pow(10.0, -k));
  return values;
}

class Sweep : TradeoffMeasurement {
 public:
  using TradeoffMeasurement::TradeoffMeasurement;

  Tradeoff run() {
    if (!find_reference(true)) return finish();
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
  SimulationSettings swept() const { return swept(constrained(own().formulation)); }

  Curve curve_of(const std::string& name, const SimulationSettings& base, const std::string& integrator,
                 const std::vector<double>& rtols, std::optional<GradientMethod> method = {}) const {
    Curve curve;
    for (const double rtol : rtols) curve.settings.push_back({name, with_tolerance(base, integrator, rtol), method});
    return curve;
  }

  std::vector<Curve> simulation_curves() const {
    std::vector<Curve> curves;
    const auto add = [&](const std::string& name) { curves.push_back(curve_of(name, swept(), name, decades(2, 11))); };
    for (const Method& method : runge_kutta_methods()) {
      const std::string name(method.name);
      if (method.adaptive) {
        add(name);
        continue;
      }
      Curve& steps = curves.emplace_back();
      for (double count = 32; count <= 1 << 15; count *= 2) {
        SimulationSettings settings = swept();
        settings.integrator.type = name;
        settings.integrator.options = {};
        settings.integrator.step = (own().end_time - own().start_time) / count;
        steps.settings.push_back({name, settings, {}});
      }
    }
    if (own().events.empty()) add("cvodes_adams"), add("cvodes_bdf");
    return curves;
  }

  // Returns whether an implicit method needs far fewer right-hand sides at a usual tolerance. Their number does not
  // depend on chance, but the time does.
  bool stiff() const {
    const auto evaluations = [&](const char* integrator) {
      const auto row = std::ranges::find_if(result_.rows, [&](const TradeoffRow& r) {
        return r.ok() && r.setting.curve == integrator &&
               std::abs(r.setting.simulation.integrator.rtol - 1e-4) < 1e-6;  // usual
      });
      return row == result_.rows.end() ? std::numeric_limits<double>::infinity()
                                       : static_cast<double>(row->statistics.rhs_evaluations);
    };
    return 2 * evaluations("radau5") < evaluations("dopri5");
  }

  std::vector<Curve> gradient_curves() const {
    std::vector<Curve> curves;
    const auto add = [&](GradientMethod method, const char* integrator) {
      curves.push_back(
          curve_of(fmt::format("{}, {}", to_string(method), integrator), swept(), integrator, decades(3, 10), method));
    };
    const bool is_stiff = stiff();
    const char *first = is_stiff ? "radau5" : "dopri5", *second = is_stiff ? "sdirk4" : "dopri853";
    for (const char* integrator : {first, second})
      add(GradientMethod::adjoint, integrator), add(GradientMethod::tlm, integrator);
    add(GradientMethod::differences, first);
    if (!own().events.empty()) return curves;
    for (const GradientMethod method : {GradientMethod::cvodes_forward, GradientMethod::cvodes_adjoint})
      add(method, is_stiff ? "cvodes_bdf" : "cvodes_adams");
    return curves;
  }

  // MBSVT's form at several alpha, without and with loss of digits, and the augmented Lagrangian without projection.
  std::vector<Curve> formulation_curves() const {
    const std::string integrator = stiff() ? "radau5" : "dopri5";
    std::vector<Curve> curves;
    const auto add = [&](const std::string& name, const FormulationSettings& formulation) {
      curves.push_back(curve_of(name + ": " + integrator, swept(formulation), integrator, decades(3, 9, 2)));
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
    if (spent || expected > most) return skip(curve, spent);
    measure(curve.settings[curve.next++], 2 * most);
    const TradeoffRow& row = result_.rows.back();
    if (row.status == RowStatus::abandoned || row.within_floor) curve.next = curve.settings.size();
    if (!row.ok()) return;
    if (curve.last_seconds > 0) curve.growth = std::clamp(row.wall_seconds / curve.last_seconds, 1.3, 5.0);
    curve.last_seconds = row.wall_seconds;
  }

  void skip(Curve& curve, bool spent) {
    TradeoffRow& row = result_.rows.emplace_back();
    row.setting = curve.settings[curve.next];
    row.status = RowStatus::skipped;
    row.message = spent ? fmt::format("the budget of {:g} s was spent", options_.budget_seconds)
                        : fmt::format("would take about {:.2g} s, more than its share of the budget", curve.expected());
    if (curve.next + 1 < curve.settings.size()) row.message += "; so were the tighter ones";
    row.errors.setConstant(static_cast<Eigen::Index>(result_.quantities().size()), kNaN), row.deviations = row.errors;
    curve.next = curve.settings.size();
  }
};

}  // namespace

Tradeoff measure_tradeoff(const Scene& scene, const std::vector<Objective>& objectives,
                          const TradeoffOptions& options) {
  return Sweep(scene, objectives, options).run();
}

}  // namespace mbsopt::inline optim
