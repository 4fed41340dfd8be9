#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "app/report/line_plot.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/row_plot.hpp"
#include "app/report/run_report.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

std::string interval_of(const Json& parameter) {
  const Json interval = parameter.value("ci95", Json());
  const bool known = interval.is_array() && std::all_of(interval.begin(), interval.end(), [](const Json& end) {
                       return end.is_number() && std::isfinite(end.get<double>());
                     });
  if (!known) return "-";
  const Json error = parameter.value("std_error", Json());
  return "[" + rounded_cell(interval[0], error).text + ", " + rounded_cell(interval[1], error).text + "]";
}

// "4 parameters from 400 samples, rms of residuals 1.02 sigma: k = 20.13 +- 0.05 N/m, ..."
void add_fit_verdict(HtmlPage& page, const Json& result) {
  constexpr std::size_t kMost = 4;  // parameters in a sentence
  const Json& parameters = result.at("parameters");
  const Json& statistics = result.at("statistics");
  std::string words = fmt::format("{} from {}", counted(static_cast<long>(parameters.size()), "parameter"),
                                  counted(statistics.at("samples").get<long>(), "sample"));
  const Json& variance = statistics.at("residual_variance");
  if (variance.is_number() && variance.get<double>() >= 0)
    words += fmt::format(", residuals of {:.3g} sigma", std::sqrt(variance.get<double>()));
  std::size_t k = 0;
  for (const auto& [name, p] : parameters.items()) {
    if (k == kMost) break;
    const Json error = p.value("std_error", Json());
    words += fmt::format("{} {} = {}", k++ == 0 ? ":" : ",", name, rounded_cell(p.at("value"), error).text);
    if (error.is_number() && std::isfinite(error.get<double>())) words += " \u00b1 " + cell(error, 2);
    words += after_number(p);
  }
  page.verdict(words + (parameters.size() > kMost ? ", ..." : "."));
}

void add_rows(std::vector<TableRow>& rows, const Json& parameters) {
  for (const auto& [name, p] : parameters.items()) {
    rows.push_back({name, number_cell(p.at("initial")), rounded_cell(p.at("value"), p.value("std_error", Json())),
                    number_cell(p.value("std_error", Json()), 2), interval_of(p), cell(p.value("unit", Json())),
                    cell(p.value("at_bound", Json()))});
  }
}

// Adds the fitted parameters, then those refitted to score the validation experiments.
void add_fitted_parameters(HtmlPage& page, const Json& result) {
  std::vector<TableRow> rows;
  add_rows(rows, result.at("parameters"));
  for (const Json& experiment : result.value("experiments", Json::object()))
    add_rows(rows, experiment.value("refitted", Json::object()));
  page.table({"parameter", "initial", "value", "standard error", "95 % interval", "unit", "at bound"}, rows);
  RowPlot plot{.title = "95 % intervals (ring: initial value, red: bounds, thin: prior; where they are near)",
               .x_label = "deviation from the estimate [%]"};
  constexpr double kFar = 100;  // [%]: a wider interval, as of a value near 0, leaves the frame
  double widest = 0;
  for (const auto& [name, p] : result.at("parameters").items()) {
    const double value = p.at("value").get<double>(),
                 half = 100 * 1.96 * p.at("std_error").get<double>() / std::abs(value);
    if (value == 0 || !std::isfinite(half)) continue;
    const Json& ends = p.at("ci95");
    const auto percent = [&](double x) { return 100 * (x - value) / std::abs(value); };
    PlotRow row{.name = name,
                .low = percent(ends[0].get<double>()),
                .high = percent(ends[1].get<double>()),
                .dot = 0,
                .words = rounded_cell(p.at("value"), p.at("std_error")).text + " \u00b1 " + cell(p.at("std_error"), 2) +
                         " " + p.value("unit", "")};
    for (const char* bound : {"lower", "upper"})
      if (p.value(bound, Json()).is_number()) row.bounds.push_back(percent(p.at(bound).get<double>()));
    if (p.contains("prior")) {
      const double mean = p.at("prior").at("mean").get<double>(),
                   width = 1.96 * p.at("prior").at("sigma").get<double>();
      row.prior = {percent(mean - width), percent(mean + width)};
    }
    const double start = percent(p.at("initial").get<double>());
    if (std::abs(start) < kFar) row.ring = start;
    if (half <= kFar) widest = std::max(widest, half);
    plot.rows.push_back(std::move(row));
  }
  if (widest == 0) widest = kFar;
  plot.range = std::pair(-1.6 * widest, 1.6 * widest);
  for (PlotRow& row : plot.rows)
    if (row.ring && std::abs(*row.ring) > 1.6 * widest) row.ring.reset();
  page.drawing(to_svg(plot));
}

// Adds the end of the fit, and the amount of data.
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
  if (std::string words = identifiability.value("in_words", ""); !words.empty()) {
    words.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(words.front())));
    page.paragraph(words + ".");
    page.note(
        "Singular values of the sensitivities, with the effect of each parameter scaled to 1: the nearer to 0, the "
        "less a combination of parameters shows in the data.");
  }
  for (const Json& words : identifiability.at("unidentifiable"))
    page.paragraph("Not determined by the data: " + cell(words));
}

// result["correlation"]: {"names": [...], "matrix": [[...], ...]}
void add_correlation(HtmlPage& page, const Json& result) {
  if (!result.contains("correlation")) return;
  page.heading("Correlation of the estimates");
  constexpr std::size_t kMostNumbers = 12;  // columns of numbers that fit a page; with more, cells are colours alone
  constexpr std::size_t kMost = 60;         // parameters of a page that stays below 400 kB; shared ones come first
  const Json& correlation = result.at("correlation");
  const std::size_t all = correlation.at("names").size(), shown = std::min(all, kMost);
  const bool dense = all > kMostNumbers;
  std::vector<std::string> header{""};
  std::vector<TableRow> rows;
  for (std::size_t i = 0; i < shown; ++i) {
    header.push_back(cell(correlation.at("names")[i]));
    rows.push_back({header.back()});
    for (std::size_t k = 0; k <= i; ++k) {  // the matrix is symmetric
      const Json& entry = correlation.at("matrix")[i][k];
      if (!entry.is_number()) {
        rows.back().push_back("-");
        continue;
      }
      const double r = entry.get<double>();
      rows.back().push_back({dense ? std::string() : fmt::format("{:.2f}", r), fmt::format("{:.4f}", r)});
      rows.back().back().shade = r;
    }
  }
  page.table(header, rows, dense);
  if (dense) page.note("Blue: positive, orange: negative, stronger: nearer to 1. The pointer shows the numbers.");
  if (shown < all) page.note(fmt::format("The first {} of {} parameters are drawn.", shown, all));
}

void add_experiments(HtmlPage& page, const Json& result) {
  if (!result.contains("experiments")) return;
  std::vector<TableRow> rows, tests;
  for (const auto& [name, experiment] : result.at("experiments").items()) {
    for (const auto& [channel, fit] : experiment.at("channels").items()) {
      rows.push_back({name, channel, cell(experiment.at("role")), cell(fit.at("samples")), cell(fit.at("rms"), 4),
                      cell(fit.at("sigma"), 4) + (fit.at("sigma_is_estimated").get<bool>() ? " (estimated)" : ""),
                      cell(fit.at("unit")), cell(fit.at("rms_scaled"), 4)});
      const Json& residuals = fit.at("residuals");
      tests.push_back({name, channel, cell(residuals.at("mean"), 3), cell(residuals.at("autocorrelation"), 3),
                       cell(residuals.at("ljung_box"), 3), cell(residuals.at("lags")),
                       cell(residuals.at("ljung_box_p"), 2), cell(residuals.at("runs")),
                       cell(residuals.at("runs_p"), 2), cell(residuals.at("in_words"))});
    }
  }
  page.table({"experiment", "channel", "role", "samples", "rms of measured - model", "sigma", "unit", "rms/sigma"},
             rows);
  page.heading("Are the residuals noise?");
  page.paragraph(
      fmt::format("For white noise p is below 0.01 in one of a hundred tests; here there are {}. Where p is far below, "
                  "the model misses something. {}",
                  2 * tests.size(),
                  result.at("covariance") == "white"
                      ? "Then the standard errors, which take the residuals for white, are too small."
                      : "The standard errors allow for residuals that are correlated in time, but not "
                        "for a wrong model."));
  page.table({"experiment", "channel", "mean", "lag-1 autocorrelation", "Ljung-Box", "lags", "its p", "runs of signs",
              "their p", "in words"},
             tests);
}

void add_profiles(HtmlPage& page, const Json& result) {
  if (!result.contains("profiles")) return;
  page.heading("Profile likelihood");
  page.paragraph(
      "The parameter is held, all others are fitted again. Where the model is linear in it, tau is a straight line.");
  std::vector<TableRow> rows;
  for (const auto& [name, profile] : result.at("profiles").items())
    rows.push_back({name, "[" + cell(profile.at("ci95")) + "]", cell(profile.value("no_lower_end", Json())),
                    cell(profile.value("no_upper_end", Json()))});
  page.table({"parameter", "95 % interval", "no lower end", "no upper end"}, rows);
  for (const auto& [name, profile] : result.at("profiles").items()) {
    if (!profile.contains("value")) continue;
    const std::string unit = result.at("parameters").value(name, Json::object()).value("unit", "");
    LinePlot plot{.title = "Profile of " + name,
                  .x_label = unit.empty() ? name : fmt::format("{} [{}]", name, unit),
                  .y_label = "tau [-]"};
    plot.series.push_back({"tau", profile.at("value").get<std::vector<double>>(),
                           profile.at("tau").get<std::vector<double>>(), Mark::line});
    // Marks the place where tau reaches an end of the interval.
    for (std::size_t end = 0; end < 2; ++end) {
      const Json& values = profile.at("value");
      const auto at = std::find(values.begin(), values.end(), profile.at("ci95")[end]);
      if (at == values.end()) continue;
      const double tau = profile.at("tau")[static_cast<std::size_t>(at - values.begin())].get<double>();
      plot.limits.push_back({end == 0 ? "" : "95 %", tau, tau > 0});
    }
    page.plot(plot);
  }
}

constexpr std::size_t kFewest = 20;  // samples, below which a histogram says nothing

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

// The shares of the residuals in bins of half a sigma within four; the outermost bins count those beyond. The curve is
// the normal distribution.
LinePlot histogram(const FitPlot& fit) {
  constexpr double kWidth = 0.5, kEnd = 4;
  constexpr int kBins = 16;
  PlotSeries found{"share of the residuals", {}, {}, Mark::bars, {}, data_colour(fit)},
      normal{"normal distribution", {}, {}, Mark::line};
  std::vector<double> share(kBins, 0.0);
  const auto samples =
      static_cast<double>(std::ranges::count_if(fit.residual, [](double z) { return std::isfinite(z); }));
  for (const double z : fit.residual) {
    if (!std::isfinite(z)) continue;
    const double bin = std::clamp(std::floor((z + kEnd) / kWidth), 0.0, kBins - 1.0);
    share[static_cast<std::size_t>(bin)] += 1 / samples;
  }
  for (int k = 0; k < kBins; ++k) {
    const double z = -kEnd + (k + 0.5) * kWidth;
    found.x.push_back(z), found.y.push_back(share[static_cast<std::size_t>(k)]);
    const auto below = [](double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); };
    normal.x.push_back(z), normal.y.push_back(below(z + kWidth / 2) - below(z - kWidth / 2));
  }
  return {.title = fmt::format("{}: histogram of the residuals of {}", fit.experiment, fit.channel),
          .x_label = "(measured - model)/sigma [-]",
          .y_label = "share per half sigma [-]",
          .series = {found, normal}};
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
  for (double& z : e) z = std::isfinite(z) ? z - mean : 0, power += z * z;
  PlotSeries r{"autocorrelation", {}, {}, Mark::bars, {}, data_colour(fit)};
  for (std::size_t lag = 1; lag <= std::min(kMostLags, std::ranges::max(lengths) / 4); ++lag) {
    double sum = 0;
    for (std::size_t i = 0; i + lag < e.size(); ++i) sum += part[i] == part[i + lag] ? e[i] * e[i + lag] : 0;
    r.x.push_back(static_cast<double>(lag)), r.y.push_back(power > 0 ? sum / power : 0);
  }
  const double limit = 1.96 / std::sqrt(static_cast<double>(samples));
  return {.title = fmt::format("{}: autocorrelation of the residuals of {}", fit.experiment, fit.channel),
          .x_label = "lag [samples]",
          .y_label = "autocorrelation [-]",
          .series = {r},
          .whole_x = true,
          .limits = {{"95 % of white noise", limit, true}, {"", -limit, false}}};
}

void add_fit(HtmlPage& page, const FitPlot& fit) {
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
  if (fit.residual.size() < kFewest) return;
  page.plot(histogram(fit));
  page.plot(autocorrelation(fit));
}

}  // namespace

std::string identification_report(const Scene& scene, const Json& result, const Trajectory& history,
                                  const std::vector<FitPlot>& fits, const std::vector<MovingState>& motion) {
  HtmlPage page(scene.name + ": identify");
  add_fit_verdict(page, result);
  add_status(page, result);
  page.heading("Fit");
  add_fit_outcome(page, result);
  page.heading("Parameters");
  add_fitted_parameters(page, result);
  add_correlation(page, result);
  add_profiles(page, result);
  if (!motion.empty()) {
    page.heading("Motion of the first experiment");
    add_motion(page, motion);
  }
  page.heading("Measured and model");
  add_experiments(page, result);
  for (const FitPlot& fit : fits) add_fit(page, fit);
  add_convergence(page, scene, history, result.at("parameters"));
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt::inline app
