#include "optim/fit/fit_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>

#include "core/simulate/simulation_warnings.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/machine/on_threads.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;

struct Fitted {
  std::vector<Experiment> experiments;
  int threads;

  Fitted(const Scene& scene, const Problem& problem, const std::vector<CsvTable>& data,
         const std::vector<UnknownParameter>& unknowns, const FitComparisonOptions& options)
      : threads(options.threads) {
    const IdentificationSpec& spec = *problem.identification;
    for (std::size_t e = 0; e < spec.experiments.size(); ++e)
      if (!spec.experiments[e].validate)
        experiments.emplace_back(scene, spec.experiments[e], place_of(spec, e), data[e], parameter_values(scene),
                                 unknowns_in(scene, spec, e, unknowns), options.user_forces);
  }

  // Residuals at u with one unknown moved. z: at u, those of the experiments that it does not act in.
  bool moved(const Eigen::VectorXd& u, Index k, double h, Experiment::Limits limits, Eigen::VectorXd& z) const {
    limits.derivatives = false;
    Eigen::VectorXd at = u;
    at(k) += h;
    Index row = 0;
    for (const Experiment& experiment : experiments) {
      const Index n = static_cast<Index>(experiment.samples().size());
      if (std::ranges::find(experiment.unknowns(), k, &Experiment::Unknown::at) != experiment.unknowns().end()) {
        const Experiment::Residuals r = experiment.residuals(at, limits);
        if (!r.ok) return false;
        z.segment(row, n) = r.z;
      }
      row += n;
    }
    return true;
  }

  // All residuals, one experiment below the other, and their derivatives.
  bool residuals(const Eigen::VectorXd& u, const Experiment::Limits& limits, Eigen::VectorXd& z, Eigen::MatrixXd& z_u,
                 std::vector<Jump>* jumps = nullptr) const {
    std::vector<Experiment::Residuals> of(experiments.size());
    on_threads(of.size(), threads, [&](std::size_t e) { of[e] = experiments[e].residuals(u, limits); });
    Index rows = 0;
    for (const Experiment::Residuals& r : of) {
      if (!r.ok) return false;
      rows += r.z.size();
    }
    z.resize(rows);
    z_u.resize(rows, u.size());
    Index row = 0;
    for (const Experiment::Residuals& r : of) {
      z.segment(row, r.z.size()) = r.z;
      z_u.middleRows(row, r.z.size()) = r.z_u;
      if (jumps) jumps->insert(jumps->end(), r.jumps.begin(), r.jumps.end());
      row += r.z.size();
    }
    return true;
  }
};

}  // namespace

std::vector<std::string> doubts_about_fit(const Problem& problem, const std::vector<CsvTable>& data,
                                          const FitComparisonOptions& options) {
  const IdentificationSpec& spec = *problem.identification;
  const std::vector<UnknownParameter> unknowns = unknowns_of_fit(problem.scene, spec);
  const std::vector<std::string> names = names_of(unknowns, spec);
  const Fitted fitted(problem.scene, problem, data, unknowns, options);
  std::atomic<bool> abandoned = false;
  Experiment::Limits limits;
  if (options.progress)
    limits.progress = [&](double t) {
      if (!options.progress(t)) abandoned = true;
      return !abandoned;
    };
  const Eigen::VectorXd u = start_of(unknowns);

  DifferenceComparison comparison;
  SimulationStatistics statistics;
  if (!fitted.residuals(u, limits, comparison.f, comparison.f_rho, &statistics.jumps)) return {};
  Scene scene = problem.scene;
  scene.simulation = {};  // whose other warnings are said elsewhere
  std::vector<std::string> said = simulation_warnings(scene, statistics);

  for (std::size_t k = 0; k < unknowns.size(); ++k)
    comparison.variables.push_back(compared_variable(names[k], unknowns[k].description));
  comparison.groups = {{"the residuals", 0, comparison.f.size()}};
  comparison.go_on = [&] { return !abandoned; };
  comparison.threads = options.threads;
  comparison.at = [&](std::size_t k, double h) -> std::optional<Eigen::VectorXd> {
    Eigen::VectorXd z = comparison.f;
    if (!fitted.moved(u, static_cast<Index>(k), h, limits, z)) return std::nullopt;
    return z;
  };
  comparison.tighter = [&](Eigen::VectorXd& z, Eigen::MatrixXd& z_u) {
    const std::optional<Scene> tight = with_other_tolerances(problem.scene);
    return tight && Fitted(*tight, problem, data, unknowns, options).residuals(u, limits, z, z_u);
  };
  const std::vector<std::string> differences = comparison.warnings();
  said.insert(said.end(), differences.begin(), differences.end());
  return abandoned ? std::vector<std::string>{} : said;
}

}  // namespace mbsopt
