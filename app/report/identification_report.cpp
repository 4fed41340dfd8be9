#include <fmt/format.h>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"

namespace mbsopt {
namespace {

void add_parameters(HtmlPage& page, const Json& result) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, p] : result.at("parameters").items()) {
    rows.push_back({name, cell(p.at("initial")), cell(p.at("value")), cell(p.value("std_error", Json())),
                    cell(p.value("ci95", Json())), cell(p.value("unit", Json())), cell(p.value("at_bound", Json()))});
  }
  page.table({"parameter", "initial", "value", "standard error", "95 % interval", "unit", "at bound"}, rows);
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
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, experiment] : result.at("experiments").items()) {
    for (const auto& [channel, fit] : experiment.at("channels").items()) {
      rows.push_back({name, channel, cell(experiment.at("role")), cell(fit.at("samples")), cell(fit.at("rms"))});
    }
  }
  page.table({"experiment", "channel", "role", "samples", "rms of measured - model"}, rows);
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
  page.heading("Parameters");
  add_parameters(page, result);
  add_correlation(page, result);
  page.heading("Measured and model");
  add_experiments(page, result);
  for (const FitPlot& fit : fits) add_fit(page, fit);
  add_convergence(page, history);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
