#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

#include "app/report/identification_page.hpp"
#include "app/report/line_plot.hpp"
#include "app/results/channel_data.hpp"
#include "optim/fit/unknown_parameters.hpp"

namespace mbsopt::inline app {
namespace {

// The measurements of one channel of one record, and the fitted model at the same times. Values are in SI units. NaN
// separates the windows of an experiment.
struct FitPlot {
  std::string experiment, channel, unit;  // channel: its column without the unit
  bool validates = false;                 // its experiment is scored, not fitted
  std::vector<double> times = {}, measured = {}, model = {};
  std::vector<double> residual = {};                     // weighted, (measured - model)/sigma
  std::vector<double> prediction = {};                   // half of the 95 % interval of a measurement; nan: not known
  std::vector<double> initial_times = {}, initial = {};  // the model before the fit; empty: not known
};

std::string without_unit(const std::string& column) { return column.substr(0, column.find(" [")); }

std::vector<FitPlot> fit_plots(const Problem& problem, const std::vector<CsvTable>& data,
                               const IdentificationResult& fit, const IdentificationResult& start) {
  std::vector<FitPlot> plots;
  const RecordChannels channels = record_channels(*problem.identification);
  for (const auto& [e, c] : channels.all) {
    const ExperimentSpec& experiment = problem.identification->experiments[e];
    plots.push_back({.experiment = record_name(experiment),
                     .channel = without_unit(experiment.channels[c].column),
                     .unit = unit_of_channel(problem.scene, experiment.channels[c], data[e]),
                     .validates = experiment.validate});
  }
  // Between the windows of a record lies a gap: neither a curve nor a correlation continues across it.
  using Column = std::pair<std::vector<double> FitPlot::*, double ResidualRow::*>;
  const auto add_rows = [&](const IdentificationResult& of, std::vector<double> FitPlot::*times,
                            std::initializer_list<Column> columns) {
    std::vector<std::optional<std::size_t>> last(plots.size());  // experiment of a plot
    for (const ResidualRow& row : of.residuals) {
      const std::size_t k = channels.first[row.experiment] + row.channel;
      std::vector<double>& t = plots[k].*times;
      const bool is_next = last[k] && last[k] != row.experiment;
      if (is_next) t.push_back((t.back() + row.t) / 2);
      t.push_back(row.t);
      for (const auto& [column, value] : columns) {
        if (is_next) (plots[k].*column).push_back(std::numeric_limits<double>::quiet_NaN());
        (plots[k].*column).push_back(row.*value);
      }
      last[k] = row.experiment;
    }
  };
  add_rows(fit, &FitPlot::times,
           {{&FitPlot::measured, &ResidualRow::measured},
            {&FitPlot::model, &ResidualRow::model},
            {&FitPlot::residual, &ResidualRow::scaled},
            {&FitPlot::prediction, &ResidualRow::prediction}});
  add_rows(start, &FitPlot::initial_times, {{&FitPlot::initial, &ResidualRow::model}});
  // A fit that ended within its first evaluation has no residuals.
  std::erase_if(plots, [](const FitPlot& plot) { return plot.times.empty(); });
  return plots;
}

constexpr std::size_t kFewest = 20;  // samples, below which an autocorrelation says nothing

constexpr std::size_t kInitialColour = 5, kBandColour = 4;

// Validation experiments have other colours than fitted ones.
std::size_t data_colour(const FitPlot& fit) { return fit.validates ? 3 : 0; }

// An initial model that is far from the data would flatten all other curves.
bool is_comparable(const std::vector<double>& initial, const std::vector<double>& measured) {
  constexpr double kFar = 3;  // times the size of the measurements
  const auto size = [](const std::vector<double>& values) {
    double largest = 0;
    for (const double x : values)
      if (std::isfinite(x)) largest = std::max(largest, std::abs(x));
    return largest;
  };
  return !initial.empty() && size(initial) < kFar * size(measured);
}

// r_k = sum_i z_i z_{i+k} / sum_i z_i^2 about the mean, without pairs across a gap. White noise has 95 % within
// +-1.96/sqrt(n).
LinePlot autocorrelation(const FitPlot& fit) {
  constexpr std::size_t kMostLags = 40;
  std::vector<std::size_t> part, lengths{0};  // of each residual: its part without gaps; samples of each part
  std::size_t samples = 0;
  double mean = 0, power = 0;
  for (const double z : fit.residual) {
    part.push_back(lengths.size());
    if (std::isfinite(z))
      ++samples, ++lengths.back(), mean += z;
    else
      lengths.push_back(0);
  }
  mean /= static_cast<double>(samples);
  std::vector<double> e = fit.residual;  // about the mean, 0 in a gap
  for (double& z : e) {
    z = std::isfinite(z) ? z - mean : 0;
    power += z * z;
  }
  PlotSeries r{"autocorrelation", {}, {}, Mark::bars, {}, data_colour(fit)};
  for (std::size_t lag = 1; lag <= std::min(kMostLags, std::ranges::max(lengths) / 4); ++lag) {
    double sum = 0;
    for (std::size_t i = 0; i + lag < e.size(); ++i) sum += part[i] == part[i + lag] ? e[i] * e[i + lag] : 0;
    r.x.push_back(static_cast<double>(lag));
    r.y.push_back(power > 0 ? sum / power : 0);
  }
  const double limit = 1.96 / std::sqrt(static_cast<double>(samples));
  return {.title = fmt::format("{}: autocorrelation of the residuals of {}", fit.experiment, fit.channel),
          .x_label = "lag [samples]",
          .y_label = "autocorrelation [-]",
          .series = {r},
          .whole_x = true,
          .limits = {{"95 % of white noise", limit, true}, {"", -limit, false}}};
}

void add_fit(RunPage& page, const FitPlot& fit) {
  const std::size_t data = data_colour(fit), model = fit.validates ? 2 : 1;
  const char* const role = fit.validates ? " (validation)" : "";
  LinePlot plot{.title = fmt::format("{}: {}{}", fit.experiment, fit.channel, role),
                .x_label = "t [s]",
                .y_label = fmt::format("{} [{}]", fit.channel, fit.unit)};
  plot.series.push_back({"measured", fit.times, fit.measured, Mark::points, {}, data});
  plot.series.push_back({"model", fit.times, fit.model, Mark::line, {}, model});
  if (std::ranges::any_of(fit.prediction, [](double width) { return std::isfinite(width); }))
    for (const double side : {1.0, -1.0}) {
      PlotSeries band{"95 % of measurements", fit.times, fit.model, Mark::line, {}, kBandColour};
      for (std::size_t i = 0; i < band.y.size(); ++i) band.y[i] += side * fit.prediction[i];
      if (side < 0) band.part_of = plot.series.size() - 1;
      plot.series.push_back(std::move(band));
    }
  if (is_comparable(fit.initial, fit.measured))
    plot.series.push_back({"initial model", fit.initial_times, fit.initial, Mark::dashed, {}, kInitialColour});
  page.plot(plot);
  LinePlot residual{.title = fmt::format("{}: residual of {}{}", fit.experiment, fit.channel, role),
                    .x_label = "t [s]",
                    .y_label = "(measured - model)/sigma [-]"};
  residual.series.push_back({"residual", fit.times, fit.residual, Mark::points, {}, data});
  page.plot(residual);
  if (fit.residual.size() >= kFewest) page.plot(autocorrelation(fit));
}

}  // namespace

void add_fit_plots(RunPage& page, const Problem& problem, const std::vector<CsvTable>& data,
                   const IdentificationResult& fit, const IdentificationResult& start) {
  const std::vector<FitPlot> plots = fit_plots(problem, data, fit, start);
  if (!plots.empty()) page.heading("Measured and model over time");
  for (const FitPlot& plot : plots) add_fit(page, plot);
}

}  // namespace mbsopt::inline app
