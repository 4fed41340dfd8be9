#include "app/starts/design_starts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/results/case_results.hpp"
#include "app/results/objective_units.hpp"
#include "app/starts/multistart.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/problem/start_points.hpp"
#include "optim/solver/nlopt_methods.hpp"

namespace mbsopt::inline app {
namespace {

std::string progress_line(const DesignRow& row) {
  return fmt::format("iteration {:3d}   objective {:.6e}   infeasibility {:.1e}{}{}", row.iteration, row.objective,
                     row.violation,
                     std::isfinite(row.optimality) ? fmt::format("   optimality {:.1e}", row.optimality) : "",
                     row.simulations > 0 ? "   " + counted(row.simulations, "simulation") : "");
}

// All runs draw random numbers from seeds that are known before they begin.
Problem with_seeds(Problem problem, LongRun& long_run) {
  OptimizerSpec& optimizer = problem.design->optimizer;
  const NloptMethod* const method = find_nlopt_method(optimizer.type);
  if (method && method->random) optimizer.seed = long_run.seed("optimizer", optimizer.seed);
  if (problem.design->multistart)
    problem.design->multistart->seed = long_run.seed("multistart", problem.design->multistart->seed);
  return problem;
}

DesignResult single_run(LongRun& long_run, const Problem& problem) {
  Run& run = long_run.run;
  DesignOptions options;
  options.threads = case_threads(run);
  options.simulation_progress = run.watched("simulating");
  options.progress = [&](const DesignRow& row) {
    run.progress.iteration(progress_line(row));
    long_run.add_iterate({{"iteration", row.iteration},
                          {"objective", row.objective},
                          {"infeasibility", row.violation},
                          {"parameters", by_name(problem.design->variables, row.parameters)}});
    return !interrupted();
  };
  return run_design(problem, options);
}

Problem at_start(Problem problem, int start, const Eigen::VectorXd& values) {
  problem = with_values(std::move(problem), by_name(problem.design->variables, values));
  if (problem.design->optimizer.seed) *problem.design->optimizer.seed += start;
  return problem;
}

// The problem of each start. With all branches, run k begins at start k / modes in mode k % modes.
std::function<Problem(int)> starts_of(const Problem& problem, int modes) {
  const MultistartSpec& spec = *problem.design->multistart;
  return [problem, modes,
          values = start_values(parameters_of(problem.scene, problem.design->variables), spec, *spec.seed)](int run) {
    return at_start(problem, run, values[static_cast<std::size_t>(run / modes)]);
  };
}

std::optional<int> mode_of(int run, const std::optional<int>& modes) {
  return modes ? std::optional(run % *modes) : std::nullopt;
}

// Runs in a worker process from one start.
Json record_of_start(const Problem& problem, const NlpScale& scale, std::optional<int> mode, int start) {
  DesignOptions options;
  options.simulation_progress = [](double) { return !interrupted(); };
  options.progress = [](const DesignRow&) { return !interrupted(); };
  options.scale = scale;
  options.mode = mode;
  options.compare_differences = false;  // once, at the best one's start
  options.evaluate_stopped = false;     // a worker that is stopped must reply soon
  const DesignResult design = run_design(problem, options);
  const bool evaluated = !design.history.empty();
  Json record{{"start", start},
              {"status", to_string(design.status)},
              {"message", design.message},
              {"objective", evaluated ? Json(design.objective_final) : Json()},
              {"infeasibility", design.true_violation},
              {"optimality", std::isfinite(design.optimality) ? Json(design.optimality) : Json()},
              {"iterations", design.iterations},
              {"evaluations", design.evaluations},
              {"simulations", design.simulations},
              {"wall_seconds", design.wall_seconds}};
  add_kind_of_end(record, design);
  for (const DesignVariable& v : design.variables) {
    record["from"][v.name] = v.initial;
    record["parameters"][v.name] = v.value;
  }
  return record;
}

// The result of the best start, whose record holds only its end. Its run is repeated. After an interrupt there is no
// time for that: then its end is evaluated. Only the run knows the poses of an assembly mode, so it is repeated up to
// its end there, too; it is solved, not integrated, and takes a moment.
DesignResult result_of_best(Run& run, const Problem& problem, DesignOptions options, const Json& record) {
  options.simulation_progress = run.watched("repeating the best start");
  options.progress = [](const DesignRow&) { return !interrupted(); };
  if (!interrupted()) {
    DesignResult repeated = run_design(problem, options);
    if (!interrupted()) return repeated;
  }
  const bool in_mode = options.mode.has_value();
  options.simulation_progress = {};
  options.progress = [&](const DesignRow& row) {
    return in_mode && by_name(problem.design->variables, row.parameters) != record.at("parameters");
  };
  options.compare_differences = false;
  DesignResult end = run_design(in_mode ? problem : with_values(problem, record.at("parameters")), options);
  for (DesignVariable& v : end.variables) v.value = record.at("parameters").at(v.name).get<double>();
  end.objective_final = record.at("objective").get<double>();
  return end;
}

// Describes the best run, but with the given problem before it.
void describe_given(const Problem& problem, DesignResult& design) {
  const DesignResult given = given_design(problem);
  const auto take_initial = [](auto& list, const auto& from) {
    for (std::size_t k = 0; k < list.size(); ++k) list[k].initial = from[k].initial;
  };
  design.objective_initial = given.objective_initial;
  take_initial(design.variables, given.variables);
  take_initial(design.constraints, given.constraints);
  take_initial(design.cases, given.cases);
  take_initial(design.terms, given.terms);
}

// Describes a design that ended before its first evaluation.
void describe_unmoved(const Problem& problem, DesignResult& design) {
  describe_given(problem, design);
  design.objective_final = design.objective_initial;
  for (DesignConstraint& c : design.constraints) c.value = c.initial;
  for (DesignCase& c : design.cases) c.value = c.initial;
}

// The problem must have its seeds.
Json task_of(const Problem& problem, const NlpScale& scale, const std::optional<int>& modes) {
  Json task{{"seed", *problem.design->multistart->seed}, {"scale", {{"f", scale.f}, {"c", entries_of(scale.c)}}}};
  if (problem.design->optimizer.seed) task["optimizer_seed"] = *problem.design->optimizer.seed;
  if (modes) task["modes"] = *modes;
  if (problem.design->sharpness) task["sharpness"] = *problem.design->sharpness;
  return task;
}

DesignOutcome best_of_starts(LongRun& long_run, const Problem& seeded) {
  DesignOptions until_interrupted;
  until_interrupted.simulation_progress = long_run.run.watched("simulating");
  Problem problem = seeded;
  problem.design->sharpness = design_sharpness(seeded, until_interrupted);
  MultistartSpec spec = *problem.design->multistart;
  std::optional<int> modes;
  if (spec.all_branches) {
    modes = design_modes(problem, until_interrupted);
    if (*modes == 0)
      throw std::invalid_argument(
          "design.multistart.branches: 'all' needs drives that leave nothing free, and a start that closes");
    spec.starts *= *modes;
  }
  const auto from = starts_of(problem, modes.value_or(1));
  const NlpScale scale = design_scale(from(0), until_interrupted);
  const MultistartOutcome outcome =
      run_multistart(long_run, spec, design_start_work(problem, task_of(problem, scale, modes)));
  const Json* const best = outcome.best();
  DesignOutcome result;
  result.interrupted = outcome.interrupted;
  if (best) {
    const int start = (*best)["start"].get<int>();
    DesignOptions options;
    options.scale = scale;
    options.mode = mode_of(start, modes);
    result.design = result_of_best(long_run.run, from(start), options, *best);
    describe_given(problem, result.design);
  } else {
    result.design = run_design(from(0), until_interrupted);
  }
  // The repeated run is no further search.
  result.design.simulations = outcome.simulations;
  result.design.wall_seconds = outcome.wall_seconds;
  return result;
}

}  // namespace

void add_kind_of_end(Json& json, const DesignResult& design) {
  if (design.maximises) json["maximised"] = true;
  if (design.status == SolverStatus::converged) json["optimum"] = design.is_at_boundary() ? "boundary" : "interior";
  if (design.mode && design.mode->of > 0)
    json["assembly_mode"] = {{"mode", design.mode->mode}, {"of", design.mode->of}};
  if (design.closing_steps > 0) json["closing_steps"] = design.closing_steps;
}

StartWork design_start_work(Problem problem, const Json& task) {
  problem.design->multistart->seed = task.at("seed").get<long>();
  if (task.contains("sharpness")) problem.design->sharpness = task["sharpness"].get<double>();
  if (task.contains("optimizer_seed")) problem.design->optimizer.seed = task["optimizer_seed"].get<long>();
  const auto c = task.at("scale").at("c").get<std::vector<double>>();
  const NlpScale scale{task["scale"].at("f").get<double>(),
                       Eigen::Map<const Eigen::VectorXd>(c.data(), static_cast<Eigen::Index>(c.size()))};
  std::optional<int> modes;
  if (task.contains("modes")) modes = task["modes"].get<int>();
  return {task, [from = starts_of(problem, modes.value_or(1)), scale, modes](int start) {
            return record_of_start(from(start), scale, mode_of(start, modes), start);
          }};
}

DesignOutcome minimised(LongRun& long_run) {
  const Problem problem = with_seeds(long_run.run.problem, long_run);
  long_run.begin();
  DesignOutcome outcome =
      problem.design->multistart ? best_of_starts(long_run, problem) : DesignOutcome{single_run(long_run, problem)};
  if (outcome.design.evaluations == 0) describe_unmoved(problem, outcome.design);
  long_run.run.progress.finish();
  return outcome;
}

}  // namespace mbsopt::inline app
