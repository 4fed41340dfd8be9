#include "optim/fit/fit_start.hpp"

#include <algorithm>
#include <atomic>

#include "core/simulate/simulation_warnings.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/fit/fit_assessment.hpp"
#include "optim/fit/fit_context.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;

// Moves one unknown by h. z: the residuals at u, which become those of the experiments that it acts in.
bool moved(const ExperimentStack& stack, Eigen::VectorXd u, Index k, double h, Experiment::Limits limits,
           Eigen::VectorXd& z) {
  limits.derivatives = false;
  u(k) += h;
  Index row = 0;
  for (const ExperimentStack::Member& m : stack.members()) {
    const Index n = static_cast<Index>(m.model.samples().size());
    if (std::ranges::find(m.model.unknowns(), k, &Experiment::Unknown::at) != m.model.unknowns().end()) {
      const Experiment::Residuals r = m.model.residuals(u, limits);
      if (!r.ok) return false;
      z.segment(row, n) = r.z;
    }
    row += n;
  }
  return true;
}

}  // namespace

FitStart start_of_fit(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options) {
  const IdentificationSpec& spec = *problem.identification;
  std::atomic<bool> abandoned = false;
  Experiment::Limits limits;
  if (options.simulation_progress)
    limits.progress = [&](double t) {
      if (!options.simulation_progress(t)) abandoned = true;
      return !abandoned;
    };
  FitContext fit{problem.scene, spec, data, options, limits.progress};
  ExperimentStack stack = fitted_stack(fit);
  const Eigen::VectorXd x = stack.start(), u = stack.scaling().to_rho(x);
  const std::vector<Experiment::Residuals> found = stack.residuals(u);

  SimulationStatistics statistics;
  name_experiments(fit);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].ok) score_experiment(fit, stack.members()[i], found[i].z, false);
    statistics.jumps.insert(statistics.jumps.end(), found[i].jumps.begin(), found[i].jumps.end());
  }
  FitStart start{std::move(fit.result), {}};
  if (!std::ranges::all_of(found, &Experiment::Residuals::ok)) return start;
  Scene scene = problem.scene;
  scene.simulation = {};  // whose other warnings are said elsewhere
  std::vector<std::string> said = simulation_warnings(scene, scene.simulation, statistics);

  DifferenceComparison comparison;
  const LeastSquaresPoint at = stack.collected(found, x);
  comparison.f = at.z.head(stack.samples());
  comparison.f_rho = stack.z_rho(at, x).topRows(stack.samples());
  for (const UnknownParameter& unknown : stack.unknowns())
    comparison.variables.push_back(compared_variable(name_of(unknown, spec), unknown.description));
  comparison.groups = {{"the residuals", 0, comparison.f.size()}};
  comparison.go_on = [&] { return !abandoned; };
  comparison.threads = options.threads;
  comparison.at = [&](std::size_t k, double h) -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd z = comparison.f;
    if (!moved(stack, u, static_cast<Index>(k), h, limits, z)) return std::nullopt;
    return z;
  };
  comparison.tighter = [&]() -> std::optional<Eigen::VectorXd> {
    const std::optional<Scene> tight = with_other_tolerances(problem.scene);
    if (!tight) return std::nullopt;
    const LeastSquaresPoint there = fitted_stack({*tight, spec, data, options, limits.progress}).at(x);
    if (!there.ok) return std::nullopt;
    return there.z.head(stack.samples());
  };
  const std::vector<std::string> differences = comparison.warnings();
  said.insert(said.end(), differences.begin(), differences.end());
  if (!abandoned) start.warnings = std::move(said);
  return start;
}

}  // namespace mbsopt::inline optim
