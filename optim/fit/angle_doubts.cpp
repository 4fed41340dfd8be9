#include "optim/fit/angle_doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/scene/scene_facts.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/problem/logged_columns.hpp"

namespace mbsopt {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
const double kNear = std::sqrt(kDegrees);  // ratios up to so far from kDegrees are nearer to it than to 1
constexpr double kUnexplained = 0.5;       // rms of the residuals over the deviation of the record

struct Series {
  std::vector<double> measured, start, end;  // the model at the start and at the end of the fit
};

double span_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

// Root mean square of a - b.
double apart(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

double deviation(const std::vector<double>& values) {
  double mean = 0;
  for (const double x : values) mean += x / static_cast<double>(values.size());
  return apart(values, std::vector<double>(values.size(), mean));
}

std::string unit_of_angles(const Scene& scene, const std::string& sensor) {
  const auto found =
      std::find_if(scene.sensors.begin(), scene.sensors.end(), [&](const Sensor& s) { return s.name == sensor; });
  if (found == scene.sensors.end()) return "";
  const std::string unit = unit_of(scene, *found);
  return unit == "rad" || unit == "rad/s" ? unit : "";
}

}  // namespace

std::vector<std::string> angle_doubts(const Scene& scene, const IdentificationSpec& spec,
                                      const std::vector<CsvTable>& data, const ExperimentStack& stack,
                                      const Eigen::VectorXd& z_start, const Eigen::VectorXd& z_end) {
  std::vector<std::string> doubts;
  Eigen::Index row = 0;
  for (const ExperimentStack::Member& m : stack.members()) {
    std::vector<Series> series(m.model.channels());
    for (const Experiment::Sample& sample : m.model.samples()) {
      Series& s = series[sample.channel];
      const double sigma = m.model.sigma(sample.channel);
      s.measured.push_back(sample.measured);
      s.start.push_back(sample.measured - z_start(row) * sigma), s.end.push_back(sample.measured - z_end(row) * sigma);
      ++row;
    }
    for (std::size_t c = 0; c < series.size(); ++c) {
      const Series& s = series[c];
      const ChannelSpec& channel = spec.experiments[m.experiment].channels[c];
      const std::string unit = unit_of_angles(scene, channel.sensor);
      if (unit.empty() || s.measured.size() < 2 || !stated_unit(channel, data[m.experiment]).empty()) continue;
      const double span = span_of(s.measured), start = span_of(s.start), end = span_of(s.end);
      const auto as_degrees = [&](double model) { return span > kNear * model && span < kNear * kDegrees * model; };
      const bool plausible = unit == "rad" && span <= std::numbers::pi;
      if (plausible || !(as_degrees(start) || as_degrees(end))) continue;
      if (apart(s.measured, s.end) <= kUnexplained * deviation(s.measured)) continue;
      doubts.push_back(
          fmt::format("{}.channels[{}].column: the values of '{}' span {:.3g}, those of "
                      "the model {:.3g} {} at the start of the fit and {:.3g} {} at its end: is the column in degrees? "
                      "\"unit\": \"{}\" converts it, while numbers of sigma and bias stay in {}",
                      place_of(spec, m.experiment), c, channel.column, span, start, unit, end, unit,
                      unit == "rad" ? "deg" : "deg/s", unit));
    }
  }
  return doubts;
}

}  // namespace mbsopt
