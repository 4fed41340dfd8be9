#include "app/report/identification_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/row_plot.hpp"
#include "app/results/identification_results.hpp"
#include "core/expression/counted.hpp"

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

}  // namespace mbsopt::inline app
