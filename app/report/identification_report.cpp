#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

std::string interval_of(const Json& parameter) {
  const Json interval = parameter.value("ci95", Json());
  const bool known = interval.is_array() && std::all_of(interval.begin(), interval.end(), [](const Json& end) {
                       return end.is_number() && std::isfinite(end.get<double>());
                     });
  return known ? "[" + cell(interval) + "]" : "-";
}

void add_rows(std::vector<std::vector<std::string>>& rows, const Json& parameters) {
  for (const auto& [name, p] : parameters.items()) {
    rows.push_back({name, cell(p.at("initial")), cell(p.at("value"), 9), cell(p.value("std_error", Json()), 3),
                    interval_of(p), cell(p.value("unit", Json())), cell(p.value("at_bound", Json()))});
  }
}

// Those fitted, then what was refitted to score the experiments that validate.
void add_fitted_parameters(HtmlPage& page, const Json& result) {
  std::vector<std::vector<std::string>> rows;
  add_rows(rows, result.at("parameters"));
  for (const Json& experiment : result.value("experiments", Json::object()))
    add_rows(rows, experiment.value("refitted", Json::object()));
  page.table({"parameter", "initial", "value", "standard error", "95 % interval", "unit", "at bound"}, rows);
}

// How the fit ended, and how much there was to fit.
void add_fit_outcome(HtmlPage& page, const Json& result) {
  const Json& optimizer = result.at("optimizer");
  page.paragraph(fmt::format("{}: {}; {}, {}.", cell(optimizer.at("type")), cell(optimizer.at("message")),
                             counted(optimizer.at("iterations").get<long>(), "iteration"),
                             counted(optimizer.at("evaluations").get<long>(), "evaluation")));
  const Json& statistics = result.at("statistics");
  const Json& identifiability = result.at("identifiability");
  page.table({"", ""}, {{"samples", cell(statistics.at("samples"))},
                        {"degrees of freedom", cell(statistics.at("degrees_of_freedom"))},
                        {"standard errors", cell(statistics.at("covariance"))},
                        {"variance of the residuals, in sigma^2", cell(statistics.at("residual_variance"), 4)},
                        {"what is minimised, before", cell(optimizer.at("objective_initial"))},
                        {"after, with the same sigmas", cell(optimizer.at("objective_final"))},
                        {"condition number", cell(identifiability.at("condition_number"), 3)}});
  if (statistics.contains("no_standard_errors"))
    page.paragraph("There are no standard errors and intervals: " + cell(statistics.at("no_standard_errors")) + ".");
  for (const Json& words : identifiability.at("unidentifiable"))
    page.paragraph("Not determined by the data: " + cell(words));
}

// result["correlation"]: {"names": [...], "matrix": [[...], ...]}
void add_correlation(HtmlPage& page, const Json& result) {
  if (!result.contains("correlation")) return;
  page.heading("Correlation of the estimates");
  const Json& correlation = result.at("correlation");
  std::vector<std::string> header{""};
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < correlation.at("names").size(); ++i) {
    header.push_back(cell(correlation.at("names")[i]));
    rows.push_back({header.back()});
    for (const Json& entry : correlation.at("matrix")[i]) {
      rows.back().push_back(entry.is_number() ? fmt::format("{:.3f}", entry.get<double>()) : "-");
    }
  }
  page.table(header, rows);
}

void add_experiments(HtmlPage& page, const Json& result) {
  if (!result.contains("experiments")) return;
  std::vector<std::vector<std::string>> rows, tests;
  for (const auto& [name, experiment] : result.at("experiments").items()) {
    for (const auto& [channel, fit] : experiment.at("channels").items()) {
      rows.push_back({name, channel, cell(experiment.at("role")), cell(fit.at("samples")), cell(fit.at("rms"), 4),
                      cell(fit.at("sigma"), 4) + (fit.at("sigma_is_estimated").get<bool>() ? " (estimated)" : ""),
                      cell(fit.at("rms_scaled"), 4)});
      const Json& residuals = fit.at("residuals");
      tests.push_back({name, channel, cell(residuals.at("mean"), 3), cell(residuals.at("autocorrelation"), 3),
                       cell(residuals.at("ljung_box"), 3), cell(residuals.at("lags")),
                       cell(residuals.at("ljung_box_p"), 2), cell(residuals.at("runs")),
                       cell(residuals.at("runs_p"), 2), cell(residuals.at("in_words"))});
    }
  }
  page.table({"experiment", "channel", "role", "samples", "rms of measured - model", "sigma", "rms/sigma"}, rows);
  page.heading("Are the residuals noise?");
  page.paragraph(
      "Of white noise p is rarely below 0.01. Where it is, the model misses something, and the standard errors are too "
      "small.");
  page.table({"experiment", "channel", "mean", "lag-1 autocorrelation", "Ljung-Box", "lags", "its p", "runs of signs",
              "their p", "in words"},
             tests);
}

void add_profiles(HtmlPage& page, const Json& result) {
  if (!result.contains("profiles")) return;
  page.heading("Profile likelihood");
  page.paragraph(
      "The parameter is held, all others are fitted again. Where the model is linear in it, tau is a straight line.");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, profile] : result.at("profiles").items())
    rows.push_back({name, "[" + cell(profile.at("ci95")) + "]", cell(profile.value("no_lower_end", Json())),
                    cell(profile.value("no_upper_end", Json()))});
  page.table({"parameter", "95 % interval", "no lower end", "no upper end"}, rows);
  for (const auto& [name, profile] : result.at("profiles").items()) {
    if (!profile.contains("value")) continue;
    LinePlot plot{.title = "Profile of " + name, .x_label = name, .y_label = "tau [-]"};
    plot.series.push_back({"tau", profile.at("value").get<std::vector<double>>(),
                           profile.at("tau").get<std::vector<double>>(), Mark::line});
    page.plot(plot);
  }
}

void add_fit(HtmlPage& page, const FitPlot& fit) {
  LinePlot plot{.title = fmt::format("{}: {}", fit.experiment, fit.channel),
                .x_label = "t [s]",
                .y_label = fmt::format("{} [{}]", fit.channel, fit.unit)};
  plot.series.push_back({"measured", fit.times, fit.measured, Mark::points});
  plot.series.push_back({"model", fit.times, fit.model, Mark::line});
  page.plot(plot);
  LinePlot residual{.title = fmt::format("{}: residual of {}", fit.experiment, fit.channel),
                    .x_label = "t [s]",
                    .y_label = "(measured - model)/sigma [-]"};
  residual.series.push_back({"residual", fit.times, fit.residual, Mark::points});
  page.plot(residual);
}

}  // namespace

std::string identification_report(const Scene& scene, const Json& result, const Trajectory& history,
                                  const std::vector<FitPlot>& fits) {
  HtmlPage page(scene.name + ": identify");
  add_status(page, result);
  page.heading("Fit");
  add_fit_outcome(page, result);
  page.heading("Parameters");
  add_fitted_parameters(page, result);
  add_correlation(page, result);
  add_profiles(page, result);
  page.heading("Measured and model");
  add_experiments(page, result);
  for (const FitPlot& fit : fits) add_fit(page, fit);
  add_convergence(page, history);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
