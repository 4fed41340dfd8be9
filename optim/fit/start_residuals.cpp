#include "optim/fit/start_residuals.hpp"

#include <atomic>
#include <optional>

#include "optim/fit/scored_experiment.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/machine/on_threads.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt {

IdentificationResult residuals_at_start(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options) {
  const IdentificationSpec& spec = *problem.identification;
  const std::vector<UnknownParameter> unknowns = unknowns_of_fit(problem.scene, spec);
  std::atomic<bool> abandoned = false;
  Experiment::Limits limits;
  limits.derivatives = false;
  if (options.simulation_progress)
    limits.progress = [&](double t) {
      if (!options.simulation_progress(t)) abandoned = true;
      return !abandoned;
    };
  std::vector<std::optional<Experiment>> models(spec.experiments.size());
  std::vector<Experiment::Residuals> found(models.size());
  for (std::size_t e = 0; e < models.size(); ++e)
    if (!spec.experiments[e].validate)
      models[e].emplace(problem.scene, spec.experiments[e], place_of(spec, e), data[e], parameter_values(problem.scene),
                        unknowns_in(problem.scene, spec, e, unknowns), options.user_forces);
  const Eigen::VectorXd u = start_of(unknowns);
  on_threads(models.size(), options.threads, [&](std::size_t e) {
    if (models[e]) found[e] = models[e]->residuals(u, limits);
  });
  IdentificationResult start;
  start.experiments.resize(models.size());
  for (std::size_t e = 0; e < models.size(); ++e) {
    start.experiments[e].name = spec.experiments[e].name, start.experiments[e].validate = spec.experiments[e].validate;
    if (!models[e]) continue;
    if (found[e].ok)
      score_experiment(spec.experiments[e], *models[e], spec.loss, found[e].z, false, e, start.experiments[e],
                       start.residuals);
    else
      start.message = found[e].message;
  }
  return start;
}

}  // namespace mbsopt
