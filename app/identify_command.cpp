#include <fmt/format.h>

#include "app/command.hpp"
#include "app/identify_starts.hpp"
#include "app/interrupt.hpp"
#include "app/optimized_problem.hpp"
#include "app/report/motion_plots.hpp"
#include "app/report/run_report.hpp"
#include "app/run.hpp"
#include "app/text_table.hpp"
#include "core/dynamics/assembly.hpp"
#include "core/expression/counted.hpp"
#include "optim/identification.hpp"

namespace mbsopt {
namespace {

void add_rows(TextTable& table, const std::vector<FittedParameter>& parameters) {
  for (const FittedParameter& p : parameters) {
    table.add({p.name, significant(p.initial), significant(p.value, 9), significant(p.std_error, 3),
               fmt::format("[{}, {}]", significant(p.ci95[0]), significant(p.ci95[1])), p.unit.empty() ? "-" : p.unit,
               bound_hit(p.at_lower, p.at_upper)});
  }
}

void print_fit(std::ostream& out, const IdentificationResult& fit) {
  TextTable parameters({"parameter", "initial", "value", "std error", "95 % interval", "unit", "at bound"});
  add_rows(parameters, fit.parameters);
  TextTable channels({"experiment", "role", "channel", "samples", "rms", "rms/sigma"});
  for (const ExperimentFit& e : fit.experiments) {
    add_rows(parameters, e.refitted);
    for (const ChannelFit& c : e.channels) {
      channels.add({e.name, e.validate ? "validate" : "fit", c.column, std::to_string(c.samples), significant(c.rms, 4),
                    significant(c.rms_scaled, 4)});
    }
  }
  out << '\n' << parameters.text() << '\n' << channels.text();
  for (const std::string& words : fit.statistics.unidentifiable) out << "not determined by the data: " << words << '\n';
  out << fmt::format("\n{}, {}; condition number {:.3g}\n", counted(fit.samples, "sample"),
                     counted(fit.statistics.degrees_of_freedom, "degree of freedom", "degrees of freedom"),
                     fit.statistics.condition_number);
  out << fmt::format("{}: {}, {}, {}, {:.3g} s\n", to_string(fit.status), counted(fit.iterations, "iteration"),
                     counted(fit.evaluations, "evaluation"), counted(fit.simulations, "simulation"), fit.wall_seconds);
}

Json to_json(const FittedParameter& p) {
  return {{"initial", p.initial},
          {"value", p.value},
          {"std_error", p.std_error},
          {"ci95", {p.ci95[0], p.ci95[1]}},
          {"unit", p.unit},
          {"lower", or_null(p.lower)},
          {"upper", or_null(p.upper)},
          {"at_bound", bound_json(p.at_lower, p.at_upper)}};
}

Json to_json(const ExperimentFit& e) {
  Json json{{"role", e.validate ? "validate" : "fit"},
            {"start_time", e.start_time},
            {"end_time", e.end_time},
            {"samples", e.samples},
            {"rms", e.rms},
            {"channels", Json::object()}};
  for (const ChannelFit& c : e.channels) {
    json["channels"][c.column] = {{"sensor", c.sensor},
                                  {"samples", c.samples},
                                  {"missing", c.missing},
                                  {"rms", c.rms},
                                  {"rms_scaled", c.rms_scaled}};
  }
  for (const FittedParameter& p : e.refitted) json["refitted"][p.name] = to_json(p);
  if (!e.message.empty()) json["message"] = e.message;
  return json;
}

void add_to_result(Json& result, const IdentificationResult& fit) {
  result["parameters"] = Json::object();
  for (const FittedParameter& p : fit.parameters) {
    result["parameters"][p.name] = to_json(p);
    result["correlation"]["names"].push_back(p.name);
  }
  for (Eigen::Index i = 0; i < fit.statistics.correlation.rows(); ++i) {
    const Eigen::VectorXd row = fit.statistics.correlation.row(i);
    result["correlation"]["matrix"].push_back(std::vector<double>(row.begin(), row.end()));
  }
  for (const ExperimentFit& e : fit.experiments) result["experiments"][e.name] = to_json(e);
  result["optimizer"] = {{"type", "ceres"},
                         {"status", to_string(fit.status)},
                         {"message", fit.message},
                         {"iterations", fit.iterations},
                         {"evaluations", fit.evaluations},
                         {"failed_evaluations", fit.failed_evaluations},
                         {"simulations", fit.simulations},
                         {"samples", fit.samples},
                         {"wall_seconds", fit.wall_seconds},
                         {"objective_initial", fit.cost_initial},
                         {"objective_final", fit.cost_final}};
  result["statistics"] = {{"samples", fit.samples},
                          {"degrees_of_freedom", fit.statistics.degrees_of_freedom},
                          {"residual_variance", fit.statistics.residual_variance}};
  result["identifiability"] = {{"condition_number", fit.statistics.condition_number},
                               {"unidentifiable", fit.statistics.unidentifiable}};
}

Trajectory history_of(const IdentificationResult& fit) {
  Trajectory history{{"iteration", "cost", "gradient_norm", "step_norm"}, {}};
  for (const FittedParameter& p : fit.parameters) history.columns.push_back(p.name);
  for (const FitRow& row : fit.history) {
    history.rows.push_back({static_cast<double>(row.iteration), row.cost, row.gradient_norm, row.step_norm});
    history.rows.back().insert(history.rows.back().end(), row.parameters.begin(), row.parameters.end());
  }
  return history;
}

std::string residuals_csv(const IdentificationResult& fit) {
  std::string text = "experiment,channel,t,measured,model,residual\n";
  for (const ResidualRow& row : fit.residuals) {
    const ExperimentFit& experiment = fit.experiments[row.experiment];
    fmt::format_to(std::back_inserter(text), "{},{},{:.17g},{:.17g},{:.17g},{:.17g}\n", experiment.name,
                   experiment.channels[row.channel].column, row.t, row.measured, row.model, row.scaled);
  }
  return text;
}

// One plot per channel of each experiment.
std::vector<FitPlot> fit_plots(const Problem& problem, const IdentificationResult& fit) {
  std::vector<FitPlot> plots;
  std::vector<std::size_t> first;  // plot of each experiment's first channel
  for (const ExperimentFit& experiment : fit.experiments) {
    first.push_back(plots.size());
    for (const ChannelFit& channel : experiment.channels) {
      FitPlot plot{experiment.name, channel.column, "in the column's unit", {}, {}, {}, {}};
      for (const Sensor& sensor : problem.scene.sensors) {
        const ChannelSpec& spec =
            problem.identification->experiments[first.size() - 1].channels[plots.size() - first.back()];
        const bool same_unit = spec.gain.is_number() && spec.gain.number() == 1;
        if (sensor.name == channel.sensor && same_unit) plot.unit = unit_of(sensor);
      }
      plots.push_back(std::move(plot));
    }
  }
  for (const ResidualRow& row : fit.residuals) {
    FitPlot& plot = plots[first[row.experiment] + row.channel];
    plot.times.push_back(row.t);
    plot.measured.push_back(row.measured);
    plot.model.push_back(row.model);
    plot.residual.push_back(row.scaled);
  }
  return plots;
}

IdentificationResult fitted(Run& run, const Problem& problem, const std::vector<CsvTable>& data) {
  IdentificationOptions options;
  options.simulation_progress = [](double) { return !interrupted(); };
  options.progress = [&](const FitRow& row) {
    run.progress.iteration(fmt::format("iteration {:3d}   cost {:.9e}   gradient {:.1e}   step {:.1e}", row.iteration,
                                       row.cost, row.gradient_norm, row.step_norm));
    return !interrupted();
  };
  IdentificationResult fit = run_identification(problem, data, options);
  run.progress.finish();
  if (run.problem.identification->multistart) describe_given(run.problem, fit);
  return fit;
}

std::vector<NewValue> new_values(const IdentificationResult& fit) {
  std::vector<NewValue> values;
  for (const FittedParameter& p : fit.parameters) values.push_back({p.experiment, p.parameter, p.value});
  for (const ExperimentFit& e : fit.experiments) {
    for (const FittedParameter& p : e.refitted) values.push_back({p.experiment, p.parameter, p.value});
  }
  return values;
}

}  // namespace

int identify_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  if (!run.problem.identification) {
    throw std::invalid_argument("identification: missing; it says which measurements to explain and what may change");
  }
  std::vector<CsvTable> data;
  for (const ExperimentSpec& experiment : run.problem.identification->experiments) {
    data.push_back(read_csv(experiment.data));
  }
  const Mechanism mechanism(scene, parameter_values(scene));
  run.start();
  // Experiments have their own overrides: where the scene itself does not assemble, they still may.
  if (const Assembly assembly(mechanism, scene.simulation.start_time); assembly.result().ok) {
    run.result["model"] = to_json(assembly.summary());
    print_model(context.out, scene.name, assembly.summary());
  }
  LongRun long_run(run);
  const Problem problem = from_best_start(run, long_run, data);
  if (interrupted() && run.problem.identification->multistart) return stopped_within_starts(run, long_run, problem);
  long_run.begin();
  const IdentificationResult fit = fitted(run, problem, data);
  long_run.end(fit.status == SolverStatus::stopped ? "interrupted" : fit.ok() ? "ok" : "failed");
  add_to_result(run.result, fit);
  print_fit(context.out, fit);
  const Trajectory history = history_of(fit);
  if (fit.status == SolverStatus::stopped) {
    run.stopped("optimized.json holds the best fit so far");
  } else if (!fit.ok()) {
    run.failed(fit.message);
  }
  run.write("optimized.json", optimized_problem_text(run, new_values(fit)));
  run.write("history.csv", to_csv(history));
  run.write("residuals.csv", residuals_csv(fit));
  run.write("report.html", identification_report(scene, run.result, history, fit_plots(run.problem, fit)));
  return run.finish();
}

}  // namespace mbsopt
