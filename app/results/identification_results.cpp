#include "app/results/identification_results.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

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
  if (e.influence) json["influence"] = {{"parameter", e.influence->parameter}, {"std_errors", e.influence->change}};
  for (const FittedParameter& p : e.refitted) json["refitted"][p.name] = to_json(p);
  if (e.rms_scaled_at_start) json["rms_scaled_at_start"] = *e.rms_scaled_at_start;
  if (!e.message.empty()) json["message"] = e.message;
  return json;
}

Json to_json(const ParameterProfile& p) {
  Json json{{"ci95", {or_null(p.lower), or_null(p.upper)}}};
  if (!p.lower) json["no_lower_end"] = p.below;
  if (!p.upper) json["no_upper_end"] = p.above;
  for (const ParameterProfile::Point& point : p.points) {
    json["value"].push_back(point.value);
    json["cost"].push_back(point.cost);
    json["tau"].push_back(point.tau);
  }
  return json;
}

}  // namespace

std::string determined_in_words(const IdentificationResult& fit) {
  constexpr Eigen::Index kMostValues = 6;  // singular values in a sentence
  constexpr double kCancelled = 0.1;       // effects of size 1 that cancel below this are reported
  constexpr double kPart = 0.2;            // of a direction of length 1, from which a parameter counts in it
  const FitStatistics& s = fit.statistics;
  const Eigen::Index all = s.singular_values.size();
  std::string values;
  for (Eigen::Index k = 0; k < all; ++k) {
    if (all > kMostValues && k == kMostValues / 2) values += ", ...", k = all - kMostValues / 2;
    values += (values.empty() ? "" : ", ") + significant(s.singular_values(k), 3);
  }
  const bool tied = all < static_cast<Eigen::Index>(fit.parameters.size());  // by equations between the parameters
  const std::string combinations =
      tied ? fmt::format("{} of the {} that continuity leaves", s.rank, counted(all, "combination"))
           : counted(s.rank, "combination");
  const std::string words = fmt::format("the data determine {} of {}: singular values {}", combinations,
                                        counted(fit.parameters.size(), "parameter"), values);
  std::vector<std::string> parts;
  for (Eigen::Index k = 0; k < s.weakest.size(); ++k)
    if (std::abs(s.weakest(k)) > kPart) parts.push_back(fit.parameters[static_cast<std::size_t>(k)].name);
  if (parts.size() < 2 || s.singular_values(s.rank - 1) > kCancelled) return words;
  const std::string last = parts.back();
  parts.pop_back();
  return words + fmt::format("; the effects of {} and {} cancel but for {:.2g}", fmt::join(parts, ", "), last,
                             s.singular_values(s.rank - 1));
}

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
  TextTable table({"recovery", "truth", "mean", "bias", "scatter", "95 % intervals that hold it", "unit"});
  Json& json = run.result["recovery"] = Json::object();
  for (const RecoveredParameter& p : recovery.parameters) {
    json[p.name] = {{"truth", p.truth},     {"mean", p.mean},   {"bias", p.bias()},
                    {"scatter", p.scatter}, {"share", p.share}, {"fits", recovery.fits}};
    table.add({p.name, significant(p.truth, 9), significant(p.mean, 9), significant(p.bias(), 3),
               significant(p.scatter, 3), fmt::format("{:.1f} %", 100 * p.share), p.unit.empty() ? "-" : p.unit});
  }
  run.context.out << '\n' << table.text() << counted(recovery.fits, "fit") << " of simulated records\n";
}

void show_bootstrap(Run& run, const IdentificationResult& fit, const Recovery& bootstrap) {
  TextTable table({"bootstrap", "value", "std error", "of the table", "95 % interval", "unit"});
  Json& json = run.result["bootstrap"] = Json::object();
  for (std::size_t k = 0; k < bootstrap.parameters.size(); ++k) {
    const RecoveredParameter& p = bootstrap.parameters[k];
    json[p.name] = {
        {"std_error", p.scatter}, {"ci95", {p.ci95[0], p.ci95[1]}}, {"bias", p.bias()}, {"fits", bootstrap.fits}};
    table.add({p.name, significant(p.truth, 9), significant(p.scatter, 3), significant(fit.parameters[k].std_error, 3),
               fmt::format("[{}, {}]", significant(p.ci95[0]), significant(p.ci95[1])), p.unit.empty() ? "-" : p.unit});
  }
  run.context.out << '\n' << table.text() << counted(bootstrap.fits, "fit") << " of resampled residuals\n";
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
  for (const ParameterProfile& p : fit.profiles) result["profiles"][p.name] = to_json(p);
  result["identifiability"] = identifiability_of(fit.statistics);
  if (const FitStatistics& s = fit.statistics; s.singular_values.size() > 0) {
    Json& determined = result["identifiability"];
    determined["singular_values"] = entries_of(s.singular_values);
    determined["rank"] = s.rank;
    if (fit.parameters.size() > 1) determined["in_words"] = determined_in_words(fit);
    for (Eigen::Index k = 0; k < s.weakest.size(); ++k)
      determined["weakest"][fit.parameters[static_cast<std::size_t>(k)].name] = s.weakest(k);
  }
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

std::string profile_csv(const IdentificationResult& fit) {
  std::string text = "profile,value,cost,tau";
  for (const FittedParameter& p : fit.parameters) text += "," + csv_cell(p.name);
  text += '\n';
  for (const ParameterProfile& profile : fit.profiles) {
    for (const ParameterProfile::Point& p : profile.points) {
      text += fmt::format("{},{:.17g},{:.17g},{:.17g}", csv_cell(profile.name), p.value, p.cost, p.tau);
      for (const double x : p.parameters) text += fmt::format(",{:.17g}", x);
      text += '\n';
    }
  }
  return text;
}

}  // namespace mbsopt::inline app
