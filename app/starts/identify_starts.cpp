#include "app/starts/identify_starts.hpp"

#include <cmath>

#include "app/results/objective_units.hpp"
#include "app/starts/multistart.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/fit/nearest_turn.hpp"
#include "optim/fit/sigma_estimation.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/problem/logged_columns.hpp"
#include "optim/problem/start_points.hpp"

namespace mbsopt::inline app {
namespace {

// The objective that ranks starts. With estimated sigmas, each start ends at a cost of half its degrees of freedom,
// even for a bad fit. Only with their logarithms is it the likelihood (sigma_estimation.hpp).
double objective_of(const IdentificationSpec& spec, const IdentificationResult& fit) {
  double objective = fit.cost_final;
  if (!estimates_sigma(spec)) return objective;
  for (const ExperimentFit& experiment : fit.experiments)
    for (const ChannelFit& channel : experiment.channels)
      if (!experiment.validate) objective += static_cast<double>(channel.samples) * std::log(channel.sigma);
  return objective;
}

Json record_of_start(const Problem& problem, const std::vector<CsvTable>& data, int start) {
  IdentificationOptions options;
  options.simulation_progress = [](double) { return !interrupted(); };
  options.tests_angles = false;
  options.progress = [](const FitRow&) { return !interrupted(); };
  const IdentificationResult fit = run_identification(problem, data, options);
  const double objective = objective_of(*problem.identification, fit);
  Json record{{"start", start},
              {"status", to_string(fit.status)},
              {"message", fit.message},
              {"objective", std::isfinite(objective) && !fit.history.empty() ? Json(objective) : Json()},
              {"iterations", fit.iterations},
              {"evaluations", fit.evaluations},
              {"simulations", fit.simulations},
              {"wall_seconds", fit.wall_seconds}};
  for (const FittedParameter& p : fit.parameters) {
    record[p.experiment.empty() ? "parameters" : "free"][p.name] = p.value;
    if (p.experiment.empty()) record["from"][p.name] = p.initial;
    if (!p.experiment.empty()) record["overrides"][p.experiment][p.parameter] = p.value;
  }
  return record;
}

Problem at_fit(const Problem& problem, const Json& record) {
  Problem fitted = with_values(problem, record.value("parameters", Json::object()));
  const Json overrides = record.value("overrides", Json::object());
  for (ExperimentSpec& experiment : fitted.identification->experiments) {
    if (!overrides.contains(experiment.name)) continue;
    for (const auto& [name, value] : overrides[experiment.name].items())
      set_override(experiment, name, value.get<double>());
  }
  return fitted;
}

StartWork start_work(const Problem& problem, const std::vector<CsvTable>& data, long seed) {
  const MultistartSpec& spec = *problem.identification->multistart;
  const std::vector<std::string>& shared = problem.identification->variables;
  return {{{"seed", seed}},
          [problem, data, starts = start_values(parameters_of(problem.scene, shared), spec, seed)](int start) {
            const Json named = by_name(problem.identification->variables, starts[static_cast<std::size_t>(start)]);
            return record_of_start(with_values(problem, named), data, start);
          }};
}

}  // namespace

std::vector<CsvTable> data_of(const Problem& problem, std::vector<std::string>* moved) {
  std::vector<CsvTable> data;
  for (const ExperimentSpec& experiment : problem.identification->experiments) data.push_back(read_record(experiment));
  const std::vector<std::string> words = move_to_nearest_turn(problem, data);
  if (moved) *moved = words;
  return data;
}

StartWork identify_start_work(const Problem& problem, const Json& task) {
  return start_work(problem, data_of(problem), task.at("seed").get<long>());
}

BestStart from_best_start(LongRun& long_run, const std::vector<CsvTable>& data) {
  const Problem& problem = long_run.run.problem;
  if (!problem.identification->multistart) return {problem};
  MultistartSpec spec = *problem.identification->multistart;
  spec.seed = long_run.seed("multistart", spec.seed);
  long_run.begin();
  const MultistartOutcome outcome = run_multistart(long_run, spec, start_work(problem, data, *spec.seed));
  return {outcome.best() ? at_fit(problem, *outcome.best()) : with_values(problem, Json::object()), outcome.simulations,
          outcome.wall_seconds};
}

void describe_given(const Problem& given, IdentificationResult& fit) {
  const std::vector<UnknownParameter> unknowns = unknowns_of_fit(given.scene, *given.identification);  // in this order
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) fit.parameters[k].initial = unknowns[k].description.value;
}

}  // namespace mbsopt::inline app
