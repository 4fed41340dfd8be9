#include "optim/objective/gradient_doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/simulate/simulation_warnings.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/differences/verdict.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::VectorXd;

// Differences of free runs contradict gradients, in words. undecided is set if their own errors hide an answer.
std::vector<std::string> contradictions(const Evaluator& evaluator, const Evaluation& at, bool& undecided) {
  constexpr double kDigitsFewer = 1e4, kBest = 1e-6, kWorst = 1e-4;
  constexpr double kNothing = 1e-3;  // of psi: as unresolved_gradients() does
  const IntegratorSettings& given = evaluator.scene().simulation.integrator;
  const double asked = given.step ? kWorst : std::clamp(kDigitsFewer * given.rtol, kBest, kWorst);
  // Signs and sizes at random, so that no errors cancel.
  std::mt19937 generator{1};
  std::uniform_real_distribution<double> part(0.5, 1);
  const Scene& scene = evaluator.scene();
  VectorXd d = evaluator.sizes(at.rho);
  for (double& component : d) component = component * part(generator) * (generator() % 2 == 0 ? 1 : -1);
  const Scene tight = with_errors_times(0.1, scene, at.statistics.steps);
  Evaluator there = evaluator.in(tight, evaluator.options().method);
  const auto psi_at = [&](double h) -> std::optional<VectorXd> {
    VectorXd rho = at.rho;
    rho(evaluator.variables()) += h * d;
    const Evaluation e = there.values(rho);
    if (!e.ok) return std::nullopt;
    return e.psi;
  };
  const VectorXd slope = at.psi_rho * d, terms = at.psi_rho.cwiseAbs() * d.cwiseAbs();
  const VectorXd allowed = asked * terms.cwiseMax(kNothing * at.psi.cwiseAbs());
  const auto is_certain = [&](const LadderDerivative& best) {
    return (kEstimateTrust * best.error.array() <= allowed.array()).all();
  };
  const LadderDerivative found =
      difference_ladder(psi_at, at.psi.size(),
                        {.step = 4e-3, .rungs = 6, .noise = tight.simulation.integrator.rtol, .enough = is_certain});
  undecided = !is_certain(found);
  std::string kinks;
  for (const Jump& kink : at.statistics.jumps)
    if (kink.size == 0) kinks += in_words(scene, kink) + ". ";
  std::vector<std::string> said;
  for (Eigen::Index i = 0; i < slope.size(); ++i) {
    const double apart = std::abs(found.derivative(i) - slope(i));
    if (!(apart > std::max(allowed(i), kEstimateTrust * found.error(i)))) continue;
    said.push_back(fmt::format(
        "the gradient of objective '{}' is wrong: along a change of all variables its slope is {:.6g}, but differences "
        "of runs give {:.6g} ({:.2g} % of its terms apart). {}Tighten simulation.integrator.rtol and atol, or round "
        "the kink by smooth_max(x, 0, eps) or smooth_abs(x, eps)",
        evaluator.objectives()[static_cast<std::size_t>(i)].name(), slope(i), found.derivative(i),
        100 * apart / std::max(terms(i), kNothing * std::abs(at.psi(i))), kinks));
  }
  return said;
}

}  // namespace

std::vector<std::string> gradient_doubts(const Evaluator& evaluator, const Evaluation& at) {
  if (!at.ok || !at.has_gradients()) return {};
  bool undecided = false;
  std::vector<std::string> said;
  if (std::ranges::any_of(at.statistics.jumps, [](const Jump& jump) { return jump.size == 0; }))
    said = contradictions(evaluator, at, undecided);
  if (!said.empty()) return said;
  if (!undecided && !may_be_unresolved(evaluator, at)) return said;
  // TLM and adjoint differ in their rounding, too.
  GradientMethod method = evaluator.options().method;
  if (at.method == GradientMethod::tlm) method = GradientMethod::adjoint;
  if (at.method == GradientMethod::adjoint) method = GradientMethod::tlm;
  const long steps = at.statistics.steps;
  const Scene& scene = evaluator.scene();
  Evaluator other =
      evaluator.in(with_other_tolerances(scene, steps).value_or(with_errors_times(0.1, scene, steps)), method);
  const Evaluation e = other.gradients(at.rho);
  if (!e.ok)
    return {
        fmt::format("the steps may not resolve the gradients, which a run with other tolerances would show if it "
                    "did not fail: {}",
                    e.message)};
  return unresolved_gradients(evaluator, at, {(e.psi - at.psi).cwiseAbs(), (e.psi_rho - at.psi_rho).cwiseAbs()});
}

}  // namespace mbsopt::inline optim
