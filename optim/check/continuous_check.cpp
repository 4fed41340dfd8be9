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
    if (!scene_.simulation.events.empty()) {
      result_.message = "CVODES does not end steps at simulation.events";
      return std::move(result_);
    }
    const auto simulated = [](const Objective& o) { return o.needs_simulation(); };
    const auto count = static_cast<std::size_t>(std::count_if(objectives_.begin(), objectives_.end(), simulated));
    if (count == 0) {
      result_.message = "nothing is simulated";
      return std::move(result_);
    }
    const GradientCost cost = gradient_cost(evaluator_.variables().size(), count);
    forward_ = cost.tlm <= cost.adjoint;
    const std::optional<MatrixXd> continuous = by_cvodes();
    if (!continuous) return std::move(result_);
    const std::optional<MatrixXd> discrete = by_steps(result_.rtol);
    if (!discrete) return std::move(result_);
    result_.ran = true;
    result_.psi_rho = *continuous;
    compare(*continuous, *discrete);
    return std::move(result_);
  }

 private:
  // Returns the derivatives by Adams' method, or by BDF if stiffness stops Adams' method.
  std::optional<MatrixXd> by_cvodes() {
    std::vector<std::string> types{"cvodes_adams", "cvodes_bdf"};
    if (stiff_) types.erase(types.begin());
    std::string message;
    for (const std::string& type : types) {
      result_.integrator = type;
      const std::optional<MatrixXd> psi_rho = gradients(type, result_.rtol, method(), &message);
      if (psi_rho) {
        result_.message.clear();
        return psi_rho;
      }
      result_.message += fmt::format("{}{}: {}", result_.message.empty() ? "" : "; ", type, message);
    }
    return std::nullopt;
  }
  std::optional<MatrixXd> by_steps(double rtol) {
    std::string message;
    const GradientMethod discrete = forward_ ? GradientMethod::tlm : GradientMethod::adjoint;
    std::optional<MatrixXd> psi_rho = gradients(result_.discrete, rtol, discrete, &message);
    if (!psi_rho) result_.message = fmt::format("{} at rtol {:g}: {}", result_.discrete, rtol, message);
    return psi_rho;
  }
  GradientMethod method() {
    const GradientMethod m = forward_ ? GradientMethod::cvodes_forward : GradientMethod::cvodes_adjoint;
    result_.method = to_string(m);
    return m;
  }

  std::optional<MatrixXd> gradients(const std::string& type, double rtol, GradientMethod by, std::string* message) {
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
    const Evaluation e = evaluator_.in(std::move(scene), by).gradients(evaluator_.start());
    result_.simulations += e.simulations;
    if (is_cvodes(type)) result_.wall_seconds = e.wall_seconds;
    *message = e.message;
    if (!e.ok) return std::nullopt;
    psi_ = e.psi;
    return e.psi_rho;
  }

  // If the two differ, a second pair of runs at ten times tighter tolerances decides (looser ones if those are out of
  // reach). Its change is the integrators' error.
  void compare(const MatrixXd& continuous, const MatrixXd& discrete) {
    set_entries(continuous, discrete, MatrixXd::Zero(continuous.rows(), continuous.cols()));
    if (result_.passed()) return;
    constexpr double kTightest = 1e-12;  // rounding starves the step-size control beyond
    const double seconds = result_.wall_seconds;
    const bool tighter = result_.rtol > 10 * kTightest;
    const double rtol = result_.rtol * (tighter ? 0.1 : 10);
    std::string message;
    const std::optional<MatrixXd> c = gradients(result_.integrator, rtol, method(), &message), d = by_steps(rtol);
    if (!c || !d) {
      result_.wall_seconds = seconds;
      result_.message.clear();
      return;
    }
    const MatrixXd error = (*c - continuous).cwiseAbs() + (*d - discrete).cwiseAbs();
    if (tighter) {
      result_.psi_rho = *c;
      result_.rtol = rtol;
    } else {
      result_.wall_seconds = seconds;
    }
    set_entries(tighter ? *c : continuous, tighter ? *d : discrete, error);
  }

  void set_entries(const MatrixXd& continuous, const MatrixXd& discrete, const MatrixXd& error) {
    result_.entries.clear();
    const Eigen::VectorXd size = evaluator_.sizes(evaluator_.start());
    for (Index i = 0; i < discrete.rows(); ++i) {
      const double largest = discrete.row(i).cwiseAbs().cwiseProduct(size.transpose()).maxCoeff();
      for (Index k = 0; k < discrete.cols(); ++k) {
        ContinuousEntry e;
        e.objective = objectives_[static_cast<std::size_t>(i)].name();
        e.parameter = evaluator_.variable(k).name;
        e.discrete = discrete(i, k), e.continuous = continuous(i, k);
        const double entry =
            std::max({std::abs(e.discrete), std::abs(e.continuous), options_.floor * largest / size(k)});
        const double apart = std::abs(e.continuous - e.discrete);
        e.difference = apart == 0 ? 0 : apart / entry;
        // For the integrators an objective below atol is zero. A parameter has no effect if a change by its own size
        // changes the objective by less than its error.
        const double atol = scene_.simulation.integrator.atol * result_.rtol / scene_.simulation.integrator.rtol;
        const double psi = std::abs(psi_(i)), nothing = (psi < atol ? atol : result_.rtol * psi) / size(k);
        e.verdict = verdict_of(e.continuous, error(i, k) + nothing, e.discrete, entry, options_.threshold);
        result_.entries.push_back(std::move(e));
      }
    }
  }

  const Evaluator& evaluator_;
  const Scene& scene_;
  const std::vector<Objective>& objectives_;
  const ContinuousCheckOptions& options_;
  Eigen::VectorXd psi_;  // of the last run
  bool stiff_ = false;   // CVODES: by BDF
  bool forward_ = true;
  ContinuousCheck result_;
};

}  // namespace

bool ContinuousCheck::passed() const {
  return std::all_of(entries.begin(), entries.end(), [](const ContinuousEntry& e) { return passes(e.verdict); });
}

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
