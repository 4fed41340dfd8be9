#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/report/mechanism_drawing.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {

namespace {

// "3 modes from 1.2 Hz to 8.4 Hz; the least damped has the damping ratio 0.012, all decay."
void add_modes_verdict(HtmlPage& page, const Json& modes) {
  if (modes.empty()) return;
  double slowest = INFINITY, fastest = 0, growth = -INFINITY, damping = INFINITY;
  for (const Json& m : modes) {
    const double f = m.at("frequency").get<double>();
    slowest = std::min(slowest, f), fastest = std::max(fastest, f);
    growth = std::max(growth, m.at("eigenvalue").at(0).get<double>());
    damping = std::min(damping, m.at("damping_ratio").get<double>());
  }
  page.verdict(
      fmt::format("{} from {:.4g} Hz to {:.4g} Hz; the least damping ratio is {:.3g} and the largest real part "
                  "of an eigenvalue {:.3g} 1/s.",
                  counted(static_cast<long>(modes.size()), "mode"), slowest, fastest, damping, growth));
}

// "rad/N", "m/(N/m)"
std::string per(const std::string& output, const std::string& input) {
  if (input.empty()) return output;
  const bool one = input.find_first_of(" /*") == std::string::npos;
  return output + (one ? "/" + input : "/(" + input + ")");
}

// The amplitude of each output for an input of amplitude 1, from a tenth of the slowest to ten times the fastest mode.
void add_responses(HtmlPage& page, const Scene& scene, const Json& result, const Linearisation& x) {
  constexpr int kFrequencies = 400;
  constexpr std::size_t kDrawn = 12;
  const auto inputs = result.at("inputs").get<std::vector<std::string>>(),
             outputs = result.at("outputs").get<std::vector<std::string>>();
  if (inputs.empty() || outputs.empty()) return;
  double slowest = INFINITY, fastest = 0;
  for (const std::complex<double>& e : x.eigenvalues)
    if (const double f = frequency(e); f > 0) slowest = std::min(slowest, f), fastest = std::max(fastest, f);
  page.heading("From inputs to outputs");
  page.paragraph(
      "Static: the change of the output by a constant input of 1. Below: the amplitude of the output when the input "
      "swings with amplitude 1.");
  const Eigen::MatrixXcd still = transfer(x, 0);
  std::vector<double> frequencies;
  std::vector<Eigen::MatrixXcd> swinging;
  for (int k = 0; k <= kFrequencies && fastest > 0; ++k) {
    frequencies.push_back(0.1 * slowest * std::pow(100 * fastest / slowest, static_cast<double>(k) / kFrequencies));
    swinging.push_back(transfer(x, {0, 2 * std::numbers::pi * frequencies.back()}));
  }
  std::vector<TableRow> rows;
  std::vector<LinePlot> plots;
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const auto parameter = std::ranges::find(scene.parameters, inputs[j], &Parameter::name);
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      const auto sensor = std::ranges::find(scene.sensors, outputs[i], &Sensor::name);
      const std::string unit = per(unit_in(scene, *sensor), parameter->unit);
      const double gain = still(row, column).real();
      rows.push_back({inputs[j], outputs[i], std::isfinite(gain) ? number_cell(gain, 6) : TableCell("-"), unit});
      std::vector<double> amplitudes;
      for (const Eigen::MatrixXcd& G : swinging) amplitudes.push_back(std::abs(G(row, column)));
      if (rows.size() <= kDrawn && std::ranges::any_of(amplitudes, [](double y) { return y > 0; }))
        plots.push_back({.title = fmt::format("{} by {}", outputs[i], inputs[j]),
                         .x_label = "frequency [Hz]",
                         .y_label = fmt::format("amplitude [{}]", unit),
                         .series = {{outputs[i], frequencies, amplitudes}},
                         .logarithmic_y = true,
                         .logarithmic_x = true});
    }
  }
  page.table({"input", "output", "static", "unit"}, rows);
  for (const LinePlot& plot : plots) page.plot(plot);
  if (rows.size() > kDrawn) page.note(fmt::format("The first {} of {} responses are drawn.", kDrawn, rows.size()));
}

}  // namespace

std::string linearisation_report(const Scene& scene, const Json& result, const Linearisation& x,
                                 const std::vector<double>& state, const std::vector<std::vector<double>>& shapes) {
  constexpr std::size_t kDrawn = 12;  // modes that a reader still tells apart
  HtmlPage page(report_title(result));
  const Json& modes = result.at("linearisation").at("modes");
  add_modes_verdict(page, modes);
  add_status(page, result);
  page.heading("Modes");
  std::vector<TableRow> rows;
  for (const Json& m : modes) {
    const Json& lambda = m.at("eigenvalue");
    rows.push_back({std::to_string(rows.size() + 1), cell(m.at("moves_most")), number_cell(m.at("frequency"), 6),
                    number_cell(m.at("damping_ratio"), 4), number_cell(lambda.at(0), 6), number_cell(lambda.at(1), 6)});
  }
  page.table({"mode", "moves most", "frequency [Hz]", "damping ratio", "Re lambda [1/s]", "Im lambda [1/s]"}, rows);
  for (std::size_t k = 0; k < std::min(shapes.size(), kDrawn); ++k) {
    const std::string title = fmt::format("Mode {}, {} Hz", k + 1, cell(modes[k].at("frequency"), 4));
    const std::array<int, 2> plane = plane_of_motion(scene, {trajectory_columns(scene), {state, shapes[k]}}).axes;
    page.drawing(mechanism_drawing(title, plane, {{"state", scene, state}, {"displaced", scene, shapes[k]}}));
  }
  if (shapes.size() > kDrawn) page.paragraph(fmt::format("The first {} of {} modes are drawn.", kDrawn, shapes.size()));
  add_responses(page, scene, result.at("linearisation"), x);
  return finished(page, result);
}

}  // namespace mbsopt::inline app
