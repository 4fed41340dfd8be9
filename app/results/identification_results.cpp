#include "app/results/identification_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/results/trajectory_csv.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline app {
namespace {

Json identifiability_of(const FitStatistics& s) {
  return {{"condition_number", s.condition_number}, {"unidentifiable", s.unidentifiable}};
}

Json to_json(const FittedParameter& p) {
  Json json{{"initial", p.initial},
            {"value", p.value},
            {"std_error", p.std_error},
            {"ci95", {p.ci95[0], p.ci95[1]}},
            {"unit", p.unit},
            {"lower", or_null(p.lower)},
            {"upper", or_null(p.upper)},
            {"at_bound", bound_json(p.at_lower, p.at_upper)}};
  if (p.prior) json["prior"] = {{"mean", p.prior->mean}, {"sigma", p.prior->sigma}};
  return json;
}

Json to_json(const ResidualAnalysis& a) {
  return {{"mean", a.mean},
          {"autocorrelation", a.autocorrelation},
          {"lags", a.lags},
          {"ljung_box", a.ljung_box},
          {"ljung_box_p", a.ljung_box_p},
          {"runs", a.runs},
          {"runs_z", a.runs_z},
          {"runs_p", a.runs_p},
          {"in_words", a.in_words()}};
}

Json to_json(const ExperimentFit& e) {
  Json json{{"role", e.validate ? "validate" : "fit"},
            {"start_time", e.start_time},
            {"end_time", e.end_time},
            {"samples", e.samples},
            {"channels", Json::object()}};
  const bool one_unit =
      std::ranges::all_of(e.channels, [&](const ChannelFit& c) { return c.unit == e.channels.front().unit; });
  json["rms"] = one_unit ? Json(e.rms) : Json();  // no sum of rad^2 and rad^2/s^2
  if (e.window) json["window"] = {{"of", e.window->experiment}, {"number", e.window->number}};
  for (const ChannelFit& c : e.channels) {
    json["channels"][c.column] = {{"sensor", c.sensor},
                                  {"samples", c.samples},
                                  {"missing", c.missing},
                                  {"unit", c.unit},
                                  {"rms", c.rms},
                                  {"rms_scaled", c.rms_scaled},
                                  {"sigma", c.sigma},
                                  {"sigma_is_estimated", c.sigma_is_estimated},
                                  {"beyond_scale", c.beyond_scale},
                                  {"within_prediction", c.within_prediction},
                                  {"residuals", to_json(c.analysis)}};
  }
  for (const FittedParameter& p : e.refitted) json["refitted"][p.name] = to_json(p);
  if (!e.message.empty()) json["message"] = e.message;
  return json;
}

}  // namespace

void show_preflight(Run& run, const IdentificationResult& start) {
  TextTable table({"parameter", "start", "predicted std error", "unit"});
  for (const FittedParameter& p : start.parameters) {
    run.result["preflight"]["parameters"][p.name] = {{"start", p.initial}, {"predicted_std_error", p.std_error}};
    table.add({p.name, significant(p.initial), std::isfinite(p.std_error) ? significant(p.std_error, 3) : "-",
               p.unit.empty() ? "-" : p.unit});
  }
  run.result["identifiability"] = identifiability_of(start.statistics);
  run.context.out << '\n' << table.text();
  for (const std::string& words : start.statistics.unidentifiable)
    run.context.out << "not determined by the data: " << words << '\n';
  run.context.out << "\npredicted at the start, with the sigmas as given; nothing was fitted\n";
}

void show_recovery(Run& run, const Recovery& recovery) {
  TextTable table(
      {"recovery", "truth", "mean", "bias", "scatter", "95 % of the fits", "95 % intervals that hold it", "unit"});
  Json& json = run.result["recovery"] = Json::object();
  for (const RecoveredParameter& p : recovery.parameters) {
    json[p.name] = {{"truth", p.truth},     {"mean", p.mean},   {"bias", p.bias()},
                    {"scatter", p.scatter}, {"share", p.share}, {"ci95", {p.ci95[0], p.ci95[1]}},
                    {"fits", recovery.fits}};
    table.add({p.name, significant(p.truth, 9), significant(p.mean, 9), significant(p.bias(), 3),
               significant(p.scatter, 3), fmt::format("[{}, {}]", significant(p.ci95[0]), significant(p.ci95[1])),
               fmt::format("{:.1f} %", 100 * p.share), p.unit.empty() ? "-" : p.unit});
  }
  run.context.out << '\n' << table.text() << counted(recovery.fits, "fit") << " of simulated records\n";
}

void add_to_result(Json& result, const IdentificationResult& fit) {
  result["parameters"] = Json::object();
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    const FittedParameter& p = fit.parameters[k];
    result["parameters"][p.name] = to_json(p);
    if (const Eigen::VectorXd& inflation = fit.statistics.inflation; inflation.size() > 0)
      result["parameters"][p.name]["variance_inflation"] = inflation(static_cast<Eigen::Index>(k));
    if (fit.statistics.correlation.size() > 0) result["correlation"]["names"].push_back(p.name);
  }
  if (fit.statistics.correlation.size() > 0) result["correlation"]["matrix"] = rows_of(fit.statistics.correlation);
  for (const ExperimentFit& e : fit.experiments) result["experiments"][e.name] = to_json(e);
  result["optimizer"] = {{"type", "trust_region"},           {"status", to_string(fit.status)},
                         {"message", fit.message},           {"iterations", fit.iterations},
                         {"evaluations", fit.evaluations},   {"failed_evaluations", fit.failed_evaluations},
                         {"simulations", fit.simulations},   {"samples", fit.samples},
                         {"wall_seconds", fit.wall_seconds}, {"objective_initial", fit.cost_initial},
                         {"objective_final", fit.cost_final}};
  const auto type = std::ranges::find(kCovariances, fit.statistics.covariance_type, &Choice<CovarianceType>::value);
  result["covariance"] = type->word;
  result["statistics"] = {{"samples", fit.samples},
                          {"covariance", fit.statistics.covariance_in_words()},
                          {"degrees_of_freedom", fit.statistics.degrees_of_freedom},
                          {"residual_variance", fit.statistics.residual_variance},
                          {"variance", fit.statistics.variance},
                          {"aic", fit.aic},
                          {"bic", fit.bic}};
  result["identifiability"] = identifiability_of(fit.statistics);
  if (!fit.statistics.none.empty()) result["statistics"]["no_standard_errors"] = fit.statistics.none;
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
  std::string text = "experiment,channel,t,measured,model,residual,prediction\n";
  for (const ResidualRow& row : fit.residuals) {
    const ExperimentFit& experiment = fit.experiments[row.experiment];
    text += fmt::format("{},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", csv_cell(experiment.name),
                        csv_cell(experiment.channels[row.channel].column), row.t, row.measured, row.model, row.scaled,
                        row.prediction);
  }
  return text;
}

}  // namespace mbsopt::inline app
