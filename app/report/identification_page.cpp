#include "app/report/identification_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/row_plot.hpp"
#include "app/results/channel_data.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"
#include "optim/fit/unknown_parameters.hpp"

namespace mbsopt::inline app {
namespace {

// A value with two digits more than its standard error justifies: 20.13 for 20.1273 +- 0.05.
std::string rounded(double value, double error) {
  constexpr double kMost = 12;  // digits
  if (!(error > 0) || !std::isfinite(error) || value == 0 || std::isnan(value)) return significant(value, 6);
  const double digits = std::floor(std::log10(std::abs(value))) - std::floor(std::log10(error)) + 2;
  return significant(value, static_cast<int>(std::clamp(digits, 2.0, kMost)));
}

// "4 parameters from 400 samples, residuals of 1.02 sigma: k = 20.13 +- 0.05 N/m, ..."
void add_verdict(RunPage& page, const IdentificationResult& fit) {
  constexpr std::size_t kMost = 4;  // parameters in a sentence
  std::string words =
      fmt::format("{} from {}", counted(fit.parameters.size(), "parameter"), counted(fit.samples, "sample"));
  if (fit.statistics.residual_variance >= 0)
    words += fmt::format(", residuals of {:.3g} sigma", std::sqrt(fit.statistics.residual_variance));
  for (std::size_t k = 0; k < std::min(kMost, fit.parameters.size()); ++k) {
    const FittedParameter& p = fit.parameters[k];
    words += fmt::format("{} {} = {}", k == 0 ? ":" : ",", p.name, rounded(p.value, p.std_error));
    if (std::isfinite(p.std_error)) words += " \u00b1 " + significant(p.std_error, 2);
    words += after_number({{"unit", p.unit}});
  }
  page.verdict(words + (fit.parameters.size() > kMost ? ", ..." : "."));
}

// The end of the fit, and the amount of data.
void add_outcome(RunPage& page, const IdentificationResult& fit) {
  const FitStatistics& s = fit.statistics;
  page.paragraph(fmt::format("trust_region: {}; {}, {}.", fit.message, counted(fit.iterations, "iteration"),
                             counted(fit.evaluations, "evaluation")));
  page.table({"", ""}, {{"samples", std::to_string(fit.samples)},
                        {"degrees of freedom", std::to_string(s.degrees_of_freedom)},
                        {"standard errors", s.covariance_in_words()},
                        {"variance of the residuals, in sigma^2", significant(s.residual_variance, 4)},
                        {"what is minimised, before", significant(fit.cost_initial)},
                        {"after, with the same sigmas", significant(fit.cost_final)},
                        {"condition number", significant(s.condition_number, 3)}});
  if (!s.none.empty()) page.paragraph(fmt::format("There are no standard errors and intervals: {}.", s.none));
  for (const std::string& words : s.unidentifiable) page.paragraph("Not determined by the data: " + words);
}

TableRow row_of(const FittedParameter& p) {
  TableCell value = number_cell(p.value, 9), error = number_cell(p.std_error, 3), interval = "-";
  value.brief = rounded(p.value, p.std_error);
  error.brief = significant(p.std_error, 2);
  if (!std::isfinite(p.std_error)) error = "-";
  if (std::isinf(p.std_error)) interval = "undetermined";
  if (std::isfinite(p.std_error)) {
    const auto& [low, high] = p.ci95;
    interval = fmt::format("[{}, {}]", significant(low), significant(high));
    interval.brief = fmt::format("[{}, {}]", rounded(low, p.std_error), rounded(high, p.std_error));
  }
  return {p.name,
          number_cell(p.initial, 7),
          value,
          error,
          interval,
          p.unit.empty() ? "-" : p.unit,
          bound_hit(p.at_lower, p.at_upper)};
}

RowPlot interval_plot(const IdentificationResult& fit) {
  RowPlot plot{.title = "95 % intervals (ring: initial value, red: bounds, thin: prior; where they are near)",
               .x_label = "deviation from the estimate [%]"};
  constexpr double kFar = 100;  // [%]: a wider interval, as of a value near 0, leaves the frame
  double widest = 0;
  for (const FittedParameter& p : fit.parameters) {
    const double half = 100 * 1.96 * p.std_error / std::abs(p.value);
    if (p.value == 0 || !std::isfinite(half)) continue;
    const auto percent = [&](double x) { return 100 * (x - p.value) / std::abs(p.value); };
    PlotRow row{.name = p.name,
                .low = percent(p.ci95[0]),
                .high = percent(p.ci95[1]),
                .dot = 0,
                .words = rounded(p.value, p.std_error) + " \u00b1 " + significant(p.std_error, 2) + " " + p.unit};
    for (const std::optional<double>& bound : {p.lower, p.upper})
      if (bound) row.bounds.push_back(percent(*bound));
    if (p.prior) {
      const double width = 1.96 * p.prior->sigma;
      row.prior = {percent(p.prior->mean - width), percent(p.prior->mean + width)};
    }
    row.ring = percent(p.initial);
    if (half <= kFar) widest = std::max(widest, half);
    plot.rows.push_back(std::move(row));
  }
  if (widest == 0) widest = kFar;
  plot.range = std::pair(-1.6 * widest, 1.6 * widest);
  for (PlotRow& row : plot.rows)
    if (std::abs(*row.ring) > std::min(1.6 * widest, kFar)) row.ring.reset();
  return plot;
}

// The fitted parameters, then those refitted to score the validation experiments.
void show_parameters(RunPage& page, const IdentificationResult& fit) {
  page.heading("Parameters");
  TextTable table({"parameter", "initial", "value", "std error", "95 % interval", "unit", "at bound"});
  for (const FittedParameter& p : fit.parameters) table.add(row_of(p));
  for (const ExperimentFit& e : fit.experiments)
    for (const FittedParameter& p : e.refitted) table.add(row_of(p));
  page.both(table);
  page.drawing(to_svg(interval_plot(fit)));
}

void show_channels(RunPage& page, const IdentificationResult& fit) {
  TextTable channels({"experiment", "role", "channel", "samples", "rms", "sigma", "unit", "rms/sigma", "lag-1",
                      "Ljung-Box p", "runs p", "residuals"});
  for (const ExperimentFit& e : fit.experiments) {
    for (const ChannelFit& c : e.channels) {
      const ResidualAnalysis& a = c.analysis;
      channels.add({e.name, e.validate ? "validate" : "fit", c.column, std::to_string(c.samples), significant(c.rms, 4),
                    significant(c.sigma, 4) + (c.sigma_is_estimated ? " (estimated)" : ""), c.unit,
                    significant(c.rms_scaled, 4), fmt::format("{:.2f}", a.autocorrelation),
                    significant(a.ljung_box_p, 2), significant(a.runs_p, 2), a.in_words()});
    }
  }
  page.heading("Measured and model");
  page.both(channels);
  page.heading("Are the residuals noise?");
  page.paragraph(
      fmt::format("For white noise p is below 0.01 in one of a hundred tests; here there are {}. Where p is far below, "
                  "the model misses something. {}",
                  2 * channels.rows().size(),
                  fit.statistics.covariance_type == CovarianceType::white
                      ? "Then the standard errors, which take the residuals for white, are too small."
                      : "The standard errors allow for residuals that are correlated in time, but not "
                        "for a wrong model."));
}

// The terminal shows the strong ones if there are many.
void show_correlation(RunPage& page, const IdentificationResult& fit) {
  const Eigen::MatrixXd& r = fit.statistics.correlation;
  if (r.rows() == 0) return;
  constexpr std::size_t kPrinted = 10, kMostNumbers = 12;  // columns that fit a terminal and a page; beyond, colours
  constexpr std::size_t kMost = 60;  // parameters of a page that stays below 400 kB; shared ones come first
  constexpr double kStrong = 0.9;
  const std::size_t all = fit.parameters.size(), shown = std::min(all, kMost);
  const bool dense = all > kMostNumbers;
  std::vector<std::string> header{"correlation"};
  for (std::size_t k = 0; k < shown; ++k) header.push_back(fit.parameters[k].name);
  TextTable matrix(header), strong({"correlated", "with", "correlation"});
  for (std::size_t i = 0; i < all; ++i) {
    TableRow row{fit.parameters[i].name};
    for (std::size_t k = 0; k <= i; ++k) {  // the matrix is symmetric
      const double entry = r(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      TableCell& cell = row.emplace_back(std::isfinite(entry) ? fmt::format("{:.3f}", entry) : "-");
      if (k < i && std::abs(entry) >= kStrong) strong.add({fit.parameters[k].name, row.front(), cell.text});
      if (!std::isfinite(entry)) continue;
      cell.brief = fmt::format("{:.2f}", entry);
      cell.full = fmt::format("{:.4f}", entry);
      cell.shade = entry;
      if (dense) cell.text = cell.brief = "";
    }
    if (i < shown) matrix.add(std::move(row));
  }
  if (all > 1 && all <= kPrinted) page.print(matrix);
  if (all > kPrinted && !strong.empty()) page.print(strong);
  page.heading("Correlation of the estimates");
  page.table(matrix.header(), matrix.rows(), dense);
  if (dense) page.note("Blue: positive, orange: negative, stronger: nearer to 1. The pointer shows the numbers.");
  if (shown < all) page.note(fmt::format("The first {} of {} parameters are drawn.", shown, all));
}

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

void show_fit(RunPage& page, const IdentificationResult& fit, const std::string& effort) {
  std::ostream& out = page.run.context.out;
  const FitStatistics& s = fit.statistics;
  add_verdict(page, fit);
  page.heading("Fit");
  add_outcome(page, fit);
  show_parameters(page, fit);
  show_channels(page, fit);
  show_correlation(page, fit);
  for (const std::string& words : s.unidentifiable) out << "not determined by the data: " << words << '\n';
  if (!s.none.empty()) out << fmt::format("no standard errors and intervals: {}\n", s.none);
  out << '\n';
  if (s.none.empty()) out << fmt::format("standard errors: {}\n", s.covariance_in_words());
  out << counted(fit.samples, "sample");
  if (s.std_error.size() > 0)
    out << fmt::format(", {}; condition number {}",
                       counted(s.degrees_of_freedom, "degree of freedom", "degrees of freedom"),
                       std::isinf(s.condition_number) ? "infinite" : significant(s.condition_number, 3));
  out << fmt::format("\n{}: {}, {}, {}\n", to_string(fit.status), counted(fit.iterations, "iteration"),
                     counted(fit.evaluations, "evaluation"), effort);
}

void add_fit_plots(RunPage& page, const Problem& problem, const std::vector<CsvTable>& data,
                   const IdentificationResult& fit, const IdentificationResult& start) {
  const std::vector<FitPlot> plots = fit_plots(problem, data, fit, start);
  if (!plots.empty()) page.heading("Measured and model over time");
  for (const FitPlot& plot : plots) add_fit(page, plot);
}

}  // namespace mbsopt::inline app
