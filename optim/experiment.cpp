#include "optim/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"
#include "core/mechanism/mechanism.hpp"
#include "optim/expression_cost.hpp"
#include "optim/parameter_values.hpp"

namespace mbsopt {
namespace {

Program compiled(const Field& field, const Symbols& symbols, const std::string& place) {
  try {
    return Program(field, symbols);
  } catch (const UnknownName& error) {
    throw std::invalid_argument(place + ": " + error.what());
  }
}

// Value of a field of a channel, with its gradient in all parameters.
struct Differentiated {
  double value = 0;
  Eigen::VectorXd rho_bar;
};

Differentiated evaluated(const Program& program, const Eigen::VectorXd& rho, Program::Scratch& scratch) {
  Differentiated d;
  d.rho_bar.setZero(rho.size());
  const std::size_t P = static_cast<std::size_t>(rho.size());
  program.grow(scratch);
  d.value = program.add_gradient(std::span(rho.data(), P), 1, std::span(d.rho_bar.data(), P), scratch);
  return d;
}

}  // namespace

Experiment::Experiment(const Scene& scene, const ExperimentSpec& spec, std::string place, const CsvTable& data,
                       const Eigen::VectorXd& rho, std::vector<Unknown> unknowns,
                       std::vector<std::shared_ptr<const UserForce>> user_forces)
    : scene_(scene),
      settings_(scene.simulation),
      rho_(rho),
      unknowns_(std::move(unknowns)),
      active_(scene.parameters.size(), false),
      user_forces_(std::move(user_forces)) {
  for (const auto& [name, value] : spec.overrides) {
    if (!std::isfinite(value)) throw std::invalid_argument(fmt::format("{}.overrides.{}: is not finite", place, name));
    rho_(parameter_indices(scene, {name}).front()) = value;
  }
  for (const Unknown& unknown : unknowns_) active_[static_cast<std::size_t>(unknown.parameter)] = true;
  compile_channels(spec, place);
  take_samples(spec, place, data);
}

void Experiment::compile_channels(const ExperimentSpec& spec, const std::string& place) {
  if (spec.channels.empty()) throw std::invalid_argument(place + ".channels: is empty; give what was measured");
  std::vector<std::string> sensors;
  for (const Sensor& s : scene_.sensors) sensors.push_back(s.name);
  const Symbols symbols = parameter_symbols(scene_);
  for (std::size_t c = 0; c < spec.channels.size(); ++c) {
    const ChannelSpec& channel = spec.channels[c];
    const std::string at = fmt::format("{}.channels[{}]", place, c);
    const auto sensor = std::find(sensors.begin(), sensors.end(), channel.sensor);
    if (sensor == sensors.end())
      throw std::invalid_argument(fmt::format("{}.sensor: there is no sensor '{}'{}; known: {}", at, channel.sensor,
                                              did_you_mean(channel.sensor, sensors), joined(sensors)));
    Channel result;
    result.sensor = static_cast<int>(sensor - sensors.begin());
    result.gain = compiled(channel.gain, symbols, at + ".gain");
    result.bias = compiled(channel.bias, symbols, at + ".bias");
    const Program sigma = compiled(channel.sigma, symbols, at + ".sigma");
    for (const Unknown& unknown : unknowns_)
      if (sigma.uses(unknown.parameter))
        throw std::invalid_argument(
            fmt::format("{}.sigma: depends on '{}', which is fitted; a sigma that is fitted would grow until every "
                        "residual is small",
                        at, scene_.parameters[static_cast<std::size_t>(unknown.parameter)].name));
    Program::Scratch scratch;
    result.sigma = evaluated(sigma, rho_, scratch).value;
    if (!(result.sigma > 0 && std::isfinite(result.sigma)))
      throw std::invalid_argument(fmt::format("{}.sigma: is {}, must be above 0", at, result.sigma));
    channels_.push_back(std::move(result));
  }
}

void Experiment::take_samples(const ExperimentSpec& spec, const std::string& place, const CsvTable& data) {
  if (spec.start_time) settings_.start_time = *spec.start_time;
  const double start = settings_.start_time, end = spec.end_time.value_or(std::numeric_limits<double>::infinity());
  if (!(end > start))
    throw std::invalid_argument(
        fmt::format("{}.end_time: is {} s, must be after the start at {} s", place, end, start));
  const std::vector<double>& t = ascending_times(data, spec.time);
  std::vector<const std::vector<double>*> columns;
  for (const ChannelSpec& channel : spec.channels) columns.push_back(&data.column(channel.column));
  for (std::size_t row = 0; row < t.size(); ++row) {
    if (t[row] < start || t[row] > end) continue;
    bool any = false;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double measured = (*columns[c])[row];
      if (std::isnan(measured)) {
        ++channels_[c].missing;
        continue;
      }
      if (!any) times_.push_back(t[row]);
      any = true;
      samples_.push_back({times_.size() - 1, c, measured});
    }
  }
  if (times_.empty() || !(times_.back() > start))
    throw std::invalid_argument(
        fmt::format("{}: {} has no sample after the start at {} s{}", place, data.name, start,
                    t.empty() ? "" : fmt::format("; its times run from {} to {} s", t.front(), t.back())));
  settings_.end_time = times_.back();
}

Experiment::Residuals Experiment::residuals(const Eigen::VectorXd& u, const Limits& limits) const {
  Residuals r;
  const Eigen::Index N = static_cast<Eigen::Index>(samples_.size());
  r.z.setZero(N), r.z_u.setZero(N, u.size());
  Eigen::VectorXd rho = rho_;
  for (const Unknown& unknown : unknowns_) rho(unknown.parameter) = u(unknown.at);

  struct ChannelNow {
    Differentiated gain, bias;
  };
  std::vector<ChannelNow> now;
  Program::Scratch scratch;
  for (const Channel& c : channels_) now.push_back({evaluated(c.gain, rho, scratch), evaluated(c.bias, rho, scratch)});

  try {
    const Mechanism mechanism(scene_, rho, active_, user_forces_);
    Eigen::VectorXd y_bar(mechanism.states()), rho_bar(rho.size());
    std::size_t next = 0;  // sample
    TangentSampling sampling;
    sampling.times = times_;
    sampling.observe = [&](std::size_t time, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
      for (; next < samples_.size() && samples_[next].time == time; ++next) {
        const Sample& sample = samples_[next];
        const ChannelNow& c = now[sample.channel];
        y_bar.setZero(), rho_bar.setZero();
        const double s = mechanism.add_sensor_gradient(channels_[sample.channel].sensor, at, 1, y_bar, rho_bar);
        const double sigma = channels_[sample.channel].sigma;
        const Eigen::Index i = static_cast<Eigen::Index>(next);
        r.z(i) = (sample.measured - c.gain.value * s - c.bias.value) / sigma;
        for (const Unknown& unknown : unknowns_) {
          const int k = unknown.parameter;
          const double s_u = y_bar.dot(y_rho.col(k)) + rho_bar(k);
          r.z_u(i, unknown.at) = -(c.gain.value * s_u + s * c.gain.rho_bar(k) + c.bias.rho_bar(k)) / sigma;
        }
      }
    };
    RunOptions options;
    options.progress = limits.progress;
    SimulationSettings settings = settings_;
    if (limits.max_steps) settings.integrator.max_steps = std::min(settings.integrator.max_steps, *limits.max_steps);
    const SimulationResult result = simulate_tlm(mechanism, settings, {}, sampling, options);
    r.steps = result.statistics.steps;
    r.ok = result.ok() && next == samples_.size();
    r.message = result.message;
  } catch (const SceneError& error) {  // a field that these values drive out of its range
    r.message = error.what();
  }
  return r;
}

}  // namespace mbsopt
