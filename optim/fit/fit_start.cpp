#include "optim/fit/fit_start.hpp"

#include <algorithm>
#include <atomic>

#include "core/simulate/simulation_warnings.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/fit/fit_assessment.hpp"
#include "optim/fit/fit_context.hpp"
#include "optim/machine/on_threads.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;

using Members = std::vector<ExperimentStack::Member>;

// Residuals at u with one unknown moved. z: at u, those of the experiments that it does not act in.
bool moved(const Members& members, const Eigen::VectorXd& u, Index k, double h, Experiment::Limits limits,
           Eigen::VectorXd& z) {
  limits.derivatives = false;
  Eigen::VectorXd at = u;
  at(k) += h;
  Index row = 0;
  for (const ExperimentStack::Member& m : members) {
    const Index n = static_cast<Index>(m.model.samples().size());
    if (std::ranges::find(m.model.unknowns(), k, &Experiment::Unknown::at) != m.model.unknowns().end()) {
      const Experiment::Residuals r = m.model.residuals(at, limits);
      if (!r.ok) return false;
      z.segment(row, n) = r.z;
    }
    row += n;
  }
  return true;
}

std::vector<Experiment::Residuals> simulated(const Members& members, const Eigen::VectorXd& u,
                                             const Experiment::Limits& limits, int threads) {
  std::vector<Experiment::Residuals> found(members.size());
  on_threads(found.size(), threads, [&](std::size_t i) { found[i] = members[i].model.residuals(u, limits); });
  return found;
}

// All residuals, one experiment below the other, and their derivatives.
bool stacked(const std::vector<Experiment::Residuals>& found, Eigen::VectorXd& z, Eigen::MatrixXd& z_u) {
  if (!std::ranges::all_of(found, &Experiment::Residuals::ok)) return false;
  Index rows = 0, row = 0;
  for (const Experiment::Residuals& r : found) rows += r.z.size();
  z.resize(rows);
  z_u.resize(rows, found.front().z_u.cols());
  for (const Experiment::Residuals& r : found) {
    z.segment(row, r.z.size()) = r.z;
    z_u.middleRows(row, r.z.size()) = r.z_u;
    row += r.z.size();
  }
  return true;
}

}  // namespace

FitStart start_of_fit(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options) {
  const IdentificationSpec& spec = *problem.identification;
  const std::vector<UnknownParameter> unknowns = unknowns_of_fit(problem.scene, spec);
  const std::vector<std::string> names = names_of(unknowns, spec);
  FitContext fit{problem.scene, spec, data, options};
  const Members members = fitted_members(fit, unknowns);
  std::atomic<bool> abandoned = false;
  Experiment::Limits limits;
  if (options.simulation_progress)
    limits.progress = [&](double t) {
      if (!options.simulation_progress(t)) abandoned = true;
      return !abandoned;
    };
  const Eigen::VectorXd u = start_of(unknowns);
  const std::vector<Experiment::Residuals> found = simulated(members, u, limits, options.threads);

  SimulationStatistics statistics;
  name_experiments(fit);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].ok) score_experiment(fit, members[i], found[i].z, false);
    statistics.jumps.insert(statistics.jumps.end(), found[i].jumps.begin(), found[i].jumps.end());
  }
  FitStart start{std::move(fit.result), {}};
  DifferenceComparison comparison;
  if (!stacked(found, comparison.f, comparison.f_rho)) return start;
  Scene scene = problem.scene;
  scene.simulation = {};  // whose other warnings are said elsewhere
  std::vector<std::string> said = simulation_warnings(scene, scene.simulation, statistics);

  for (std::size_t k = 0; k < unknowns.size(); ++k)
    comparison.variables.push_back(compared_variable(names[k], unknowns[k].description));
  comparison.groups = {{"the residuals", 0, comparison.f.size()}};
  comparison.go_on = [&] { return !abandoned; };
  comparison.threads = options.threads;
  comparison.at = [&](std::size_t k, double h) -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd z = comparison.f;
    if (!moved(members, u, static_cast<Index>(k), h, limits, z)) return std::nullopt;
    return z;
  };
  comparison.tighter = [&](Eigen::VectorXd& z, Eigen::MatrixXd& z_u) {
    const std::optional<Scene> tight = with_other_tolerances(problem.scene);
    if (!tight) return false;
    const FitContext tighter{*tight, spec, data, options};
    return stacked(simulated(fitted_members(tighter, unknowns), u, limits, options.threads), z, z_u);
  };
  const std::vector<std::string> differences = comparison.warnings();
  said.insert(said.end(), differences.begin(), differences.end());
  if (!abandoned) start.doubts = std::move(said);
  return start;
}

}  // namespace mbsopt::inline optim
