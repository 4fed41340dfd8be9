#include "optim/check/continuous_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/cvodes/cvodes.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

class ContinuousComparison {
 public:
  ContinuousComparison(const Evaluator& evaluator, const ContinuousCheckOptions& options)
      : evaluator_(evaluator), scene_(evaluator.scene()), objectives_(evaluator.objectives()), options_(options) {}

  ContinuousCheck run() {
    const IntegratorSettings& given = scene_.simulation.integrator;
    result_.rtol = std::min(options_.rtol, given.rtol);
    const Method* method_of_file = runge_kutta_method(given.type);
    stiff_ = given.type == "cvodes_bdf" || (method_of_file && method_of_file->implicit());
    result_.discrete = method_of_file && method_of_file->adaptive ? given.type : stiff_ ? "radau5" : "dopri853";
    const auto count = static_cast<std::size_t>(std::ranges::count_if(objectives_, &Objective::needs_simulation));
    if (count == 0) result_.message = "nothing is simulated";
    if (!scene_.simulation.events.empty()) result_.message = "CVODES does not end steps at simulation.events";
    if (!result_.message.empty()) return std::move(result_);
    const GradientCost cost = gradient_cost(evaluator_.variables().size(), count);
    forward_ = cost.tlm <= cost.adjoint;
    Evaluation continuous;
    for (const char* const type : {"cvodes_adams", "cvodes_bdf"}) {
      result_.integrator = type;
      if (stiff_ && result_.integrator == "cvodes_adams") continue;
      continuous = by_cvodes(result_.rtol);
      if (continuous.ok) break;
      result_.message += fmt::format("{}{}: {}", result_.message.empty() ? "" : "; ", type, continuous.message);
    }
    if (!continuous.ok) return std::move(result_);
    result_.message.clear();
    const Evaluation discrete = by_steps(result_.rtol);
    if (!discrete.ok) {
      result_.message = fmt::format("{} at rtol {:g}: {}", result_.discrete, result_.rtol, discrete.message);
      return std::move(result_);
    }
    result_.ran = true;
    compare(continuous, discrete);
    return std::move(result_);
  }

 private:
  Evaluation by_cvodes(double rtol) {
    const GradientMethod method = forward_ ? GradientMethod::cvodes_forward : GradientMethod::cvodes_adjoint;
    result_.method = to_string(method);
    Evaluation e = gradients(result_.integrator, rtol, method);
    result_.wall_seconds = e.wall_seconds;
    return e;
  }
  Evaluation by_steps(double rtol) {
    return gradients(result_.discrete, rtol, forward_ ? GradientMethod::tlm : GradientMethod::adjoint);
  }

  Evaluation gradients(const std::string& type, double rtol, GradientMethod by) {
    constexpr long kManyTimes = 200, kAtLeast = 50'000;
    Scene scene = scene_;
    // CVODES has no projection, and the projection of a penalty formulation has a motion of its own. So neither side
    // projects.
    FormulationSettings& formulation = scene.simulation.formulation;
    if (formulation.type == FormulationType::penalty) formulation.projection = Projection::none;
    IntegratorSettings& s = scene.simulation.integrator;
    if (s.type != type) s.options = {};  // the other method's
    s.type = type;
    s.step.reset();
    // The number of CVODES' steps tells nothing about those of another method.
    const long steps = is_cvodes(scene_.simulation.integrator.type) ? 0 : options_.typical_steps;
    scene = with_errors_times(rtol / s.rtol, std::move(scene), steps);
    s.max_steps = std::min(s.max_steps, std::max(kAtLeast, kManyTimes * options_.typical_steps));
    Evaluation e = evaluator_.in(std::move(scene), by).gradients(evaluator_.start());
    result_.simulations += e.simulations;
    return e;
  }

  // If the two differ, a second pair of runs at ten times tighter tolerances decides (looser ones if those are out of
  // reach). Its change is the integrators' error.
  void compare(const Evaluation& continuous, const Evaluation& discrete) {
    set_entries(continuous.psi_rho, discrete, MatrixXd::Zero(continuous.psi_rho.rows(), continuous.psi_rho.cols()));
    if (result_.passed()) return;
    constexpr double kTightest = 1e-12;  // rounding starves the step-size control beyond
    const double seconds = result_.wall_seconds;
    const bool tighter = result_.rtol > 10 * kTightest;
    const double rtol = result_.rtol * (tighter ? 0.1 : 10);
    const Evaluation c = by_cvodes(rtol), d = c.ok ? by_steps(rtol) : Evaluation();
    if (!tighter || !d.ok) result_.wall_seconds = seconds;
    if (!d.ok) return;
    const MatrixXd error = (c.psi_rho - continuous.psi_rho).cwiseAbs() + (d.psi_rho - discrete.psi_rho).cwiseAbs();
    if (tighter) result_.rtol = rtol;
    set_entries(tighter ? c.psi_rho : continuous.psi_rho, tighter ? d : discrete, error);
  }

  void set_entries(const MatrixXd& continuous, const Evaluation& at, const MatrixXd& error) {
    const MatrixXd& discrete = at.psi_rho;
    result_.psi_rho = continuous;
    result_.entries.clear();
    const Eigen::VectorXd size = evaluator_.sizes(evaluator_.start());
    for (Index i = 0; i < discrete.rows(); ++i) {
      const double largest = discrete.row(i).cwiseAbs().cwiseProduct(size.transpose()).maxCoeff();
      for (Index k = 0; k < discrete.cols(); ++k) {
        ContinuousEntry e{objectives_[static_cast<std::size_t>(i)].name(),
                          evaluator_.variable(k).name,
                          i,
                          k,
                          discrete(i, k),
                          continuous(i, k)};
        const double entry =
            std::max({std::abs(e.discrete), std::abs(e.continuous), options_.floor * largest / size(k)});
        const double apart = std::abs(e.continuous - e.discrete);
        e.difference = apart == 0 ? 0 : apart / entry;
        // For the integrators an objective below atol is zero. A parameter has no effect if a change by its own size
        // changes the objective by less than its error.
        const double atol = scene_.simulation.integrator.atol * result_.rtol / scene_.simulation.integrator.rtol;
        const double psi = std::abs(at.psi(i)), nothing = (psi < atol ? atol : result_.rtol * psi) / size(k);
        e.verdict = verdict_of(e.continuous, error(i, k) + nothing, e.discrete, entry, options_.threshold);
        result_.entries.push_back(std::move(e));
      }
    }
  }

  const Evaluator& evaluator_;
  const Scene& scene_;
  const std::vector<Objective>& objectives_;
  const ContinuousCheckOptions& options_;
  bool stiff_ = false;  // CVODES: by BDF
  bool forward_ = true;
  ContinuousCheck result_;
};

}  // namespace

bool ContinuousCheck::passed() const { return std::ranges::all_of(entries, passes, &ContinuousEntry::verdict); }

double ContinuousCheck::worst_difference(const std::string& objective) const {
  double worst = 0;
  for (const ContinuousEntry& e : entries)
    if (e.objective == objective) worst = std::max(worst, e.difference);
  return worst;
}

Verdict ContinuousCheck::worst_verdict(const std::string& objective) const {
  Verdict worst = Verdict::zero;
  for (const ContinuousEntry& e : entries) {
    if (e.objective != objective || e.verdict == Verdict::zero) continue;
    if (!passes(e.verdict)) return e.verdict;
    if (worst != Verdict::buried) worst = e.verdict;
  }
  return worst;
}

ContinuousCheck check_continuous(const Evaluator& evaluator, const ContinuousCheckOptions& options) {
  return ContinuousComparison(evaluator, options).run();
}

}  // namespace mbsopt::inline optim
