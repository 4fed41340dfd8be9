#include "optim/fit/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>

#include "core/body/state_layout.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/linear/dense.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/scene/field_visitor.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/signals.hpp"
#include "core/start/assembly.hpp"
#include "optim/objective/expression_cost.hpp"
#include "optim/objective/obstructed_parameters.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

Program compiled(const Field& field, const Symbols& symbols, const std::string& place) {
  try {
    return Program(field, symbols);
  } catch (const UnknownName& error) {
    throw std::invalid_argument(place + ": " + error.what());
  }
}

// Returns whether time acts on the scene other than through its state.
bool depends_on_time(const Scene& scene) {
  bool found = !scene.drives.empty() || !scene.signals.empty();
  FieldVisitor visitor(
      [&](const FieldPlace&, const Expression& e, Scope) {
        const std::vector<std::string> names = e.names();
        found = found || std::ranges::find(names, "t") != names.end();
      },
      [](const std::string&, const std::string&) {});
  for (const Force& force : scene.forces) {
    found = found || std::holds_alternative<UserForceSpec>(force.kind);  // C++ may use t
    describe(visitor, force);
  }
  for (const Sensor& sensor : scene.sensors) describe(visitor, sensor);
  return found;
}

}  // namespace

StateChart::StateChart(const Eigen::VectorXd& y, const Eigen::MatrixXd& y_u)
    : y0_(y), W_(OrthogonalDecomposition(y_u).solve(Eigen::MatrixXd::Identity(y.size(), y.size()))) {}

void StateChart::read(const Eigen::VectorXd& y, const Eigen::MatrixXd& y_rho, Eigen::VectorXd& s,
                      Eigen::MatrixXd& s_rho) const {
  const StateLayout layout = StateLayout::of(y);
  Eigen::VectorXd sign = Eigen::VectorXd::Ones(y.size());
  for (int i = 1; i <= layout.n; ++i) {
    const Eigen::Index p = layout.p(i), pdot = layout.pdot(i);
    if (y.segment<4>(p).dot(y0_.segment<4>(p)) < 0)
      sign.segment<4>(p).setConstant(-1), sign.segment<4>(pdot).setConstant(-1);
  }
  s = W_ * (sign.cwiseProduct(y) - y0_);
  s_rho = W_ * (sign.asDiagonal() * y_rho);
}

Experiment::Differentiated Experiment::evaluated(const Program& program, const Eigen::VectorXd& rho, double t,
                                                 Program::Scratch& scratch) {
  Differentiated d;
  std::vector<double> inputs(rho.begin(), rho.end());
  inputs.push_back(t);
  d.rho_bar.setZero(rho.size() + 1);
  program.grow(scratch);
  d.value = program.add_gradient(inputs, 1, std::span(d.rho_bar.data(), inputs.size()), scratch);
  return d;
}

Experiment::Experiment(const Scene& scene, const ExperimentSpec& spec, std::string place, const CsvTable& data,
                       const Eigen::VectorXd& rho, std::vector<Unknown> unknowns)
    : scene_(scene),
      settings_(scene.simulation),
      rho_(rho),
      unknowns_(std::move(unknowns)),
      active_(scene.parameters.size(), false) {
  for (const auto& [name, value] : spec.overrides) {
    if (!std::isfinite(value)) throw std::invalid_argument(fmt::format("{}.overrides.{}: is not finite", place, name));
    rho_(parameter_indices(scene, {name}).front()) = value;
  }
  for (const Unknown& unknown : unknowns_) active_[static_cast<std::size_t>(unknown.parameter)] = true;
  replace_laws(spec, place);
  programs_ = std::make_shared<ScenePrograms>(scene_);
  compile_channels(spec, place);
  take_samples(spec, place, data);
  refuse_short_laws(spec, place);
  scene_.simulation = settings_;
  if (!unknowns_.empty()) require_unobstructed(simulated(), rho_, active_);
}

void Experiment::replace_laws(const ExperimentSpec& spec, const std::string& place) {
  for (const SignalSamples& samples : spec.signals) {
    const auto signal = std::ranges::find(scene_.signals, samples.name, &Signal::name);
    if (signal == scene_.signals.end())
      throw std::invalid_argument(fmt::format("{}.signals.{}: there is no such signal", place, samples.name));
    static_cast<SampleColumn&>(*signal) = samples;
  }
  for (std::size_t i = 0; i < spec.drives.size(); ++i) {
    const auto drive = std::ranges::find(scene_.drives, spec.drives[i].drive, &Drive::name);
    if (drive == scene_.drives.end())
      throw std::invalid_argument(
          fmt::format("{}.drives[{}].drive: there is no drive '{}'", place, i, spec.drives[i].drive));
    drive->law = spec.drives[i].law;
    drive->samples = spec.drives[i].samples;
  }
}

double Experiment::largest_delay(const Program& delay, const std::vector<double>& times) const {
  std::vector<const Unknown*> bounded;
  for (const Unknown& unknown : unknowns_) {
    const Parameter& p = scene_.parameters[static_cast<std::size_t>(unknown.parameter)];
    if (delay.uses(unknown.parameter) && (p.lower || p.upper)) bounded.push_back(&unknown);
  }
  Program::Scratch scratch;
  const auto largest_at = [&](const Eigen::VectorXd& rho) {
    double largest = evaluated(delay, rho, settings_.start_time, scratch).value;
    if (delay.uses(static_cast<int>(rho.size())))
      for (const double t : times) largest = std::max(largest, evaluated(delay, rho, t, scratch).value);
    return largest;
  };
  double largest = largest_at(rho_);
  if (bounded.size() > 10) return largest;
  for (std::size_t corner = 0; corner < (std::size_t{1} << bounded.size()); ++corner) {
    Eigen::VectorXd rho = rho_;
    for (std::size_t i = 0; i < bounded.size(); ++i) {
      const Parameter& p = scene_.parameters[static_cast<std::size_t>(bounded[i]->parameter)];
      const std::optional<double>& bound = corner >> i & 1 ? p.upper : p.lower;
      if (bound) rho(bounded[i]->parameter) = *bound;
    }
    largest = std::max(largest, largest_at(rho));
  }
  return largest;
}

// d s/dt along the dense output is s_y ydot only where s has no time of its own.
void Experiment::refuse_time_dependence(const Sensor& sensor, const Program& delay, const std::string& place) const {
  if (SceneFacts(scene_).reads_of(sensor) < Reads::time_and_state || !depends_on_time(scene_)) return;
  for (const Unknown& unknown : unknowns_)
    if (delay.uses(unknown.parameter))
      throw std::invalid_argument(fmt::format(
          "{}.delay: depends on '{}', which is fitted, and the sensor '{}' is of the quantity '{}', in a model whose "
          "drives, forces or sensors depend on time; such a delay must be known",
          place, scene_.parameters[static_cast<std::size_t>(unknown.parameter)].name, sensor.name, sensor.quantity));
}

void Experiment::compile_channels(const ExperimentSpec& spec, const std::string& place) {
  if (spec.channels.empty()) throw std::invalid_argument(place + ".channels: is empty; give what was measured");
  std::vector<std::string> sensors;
  for (const Sensor& s : scene_.sensors) sensors.push_back(s.name);
  const Symbols symbols = parameter_symbols(scene_), of_time = time_symbols(scene_);
  for (std::size_t c = 0; c < spec.channels.size(); ++c) {
    const ChannelSpec& channel = spec.channels[c];
    const std::string at = fmt::format("{}.channels[{}]", place, c);
    const auto sensor = std::ranges::find(sensors, channel.sensor);
    if (sensor == sensors.end())
      throw std::invalid_argument(fmt::format("{}.sensor: there is no sensor '{}'{}; known: {}", at, channel.sensor,
                                              did_you_mean(channel.sensor, sensors), joined(sensors)));
    Channel result;
    result.sensor = static_cast<int>(sensor - sensors.begin());
    result.gain = compiled(channel.gain, symbols, at + ".gain");
    result.bias = compiled(channel.bias, of_time, at + ".bias");
    result.delay = compiled(channel.delay, of_time, at + ".delay");
    delayed_ = delayed_ || !channel.delay.is_number() || channel.delay.number() != 0;
    refuse_time_dependence(scene_.sensors[static_cast<std::size_t>(result.sensor)], result.delay, at);
    const Program sigma = compiled(channel.sigma, symbols, at + ".sigma");
    for (const Unknown& unknown : unknowns_)
      if (sigma.uses(unknown.parameter))
        throw std::invalid_argument(
            fmt::format("{}.sigma: depends on '{}', which is fitted; a sigma that is fitted would grow until every "
                        "residual is small (\"estimate_sigma\": true estimates it from the residuals)",
                        at, scene_.parameters[static_cast<std::size_t>(unknown.parameter)].name));
    Program::Scratch scratch;
    result.sigma = result.given_sigma = evaluated(sigma, rho_, settings_.start_time, scratch).value;
    if (!(result.sigma > 0 && std::isfinite(result.sigma)))
      throw std::invalid_argument(fmt::format("{}.sigma: is {}, must be above 0", at, result.sigma));
    channels_.push_back(std::move(result));
  }
}

StateChart Experiment::chart_of_start(const std::vector<Unknown>& own) const {
  const Scene scene = simulated();
  const Assembly assembly(Mechanism(scene, rho_, active_), settings_.start_time);
  if (!assembly.result().ok)
    throw std::invalid_argument(fmt::format("the mechanism cannot be assembled at {:g} s: {}", settings_.start_time,
                                            assembly.result().message));
  std::vector<int> columns;
  for (const Unknown& unknown : own) columns.push_back(unknown.parameter);
  return {assembly.result().y, assembly.tangent()(Eigen::all, columns)};
}

Scene Experiment::simulated() const {
  Scene scene = scene_;
  scene.simulation = settings_;
  for (std::size_t k = 0; k < scene.parameters.size(); ++k)
    scene.parameters[k].value = rho_(static_cast<Eigen::Index>(k));
  return scene;
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
  for (Channel& channel : channels_) channel.first = start + std::max(0.0, largest_delay(channel.delay, t));
  for (std::size_t row = 0; row < t.size(); ++row) {
    if (t[row] < start || t[row] > end) continue;
    bool any = false;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double measured = (*columns[c])[row];
      if (t[row] < channels_[c].first) continue;
      if (std::isnan(measured)) {
        ++channels_[c].missing;
        continue;
      }
      if (!any) times_.push_back(t[row]);
      any = true;
      samples_.push_back({times_.size() - 1, c, measured, row});
    }
  }
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    if (std::ranges::find(samples_, c, &Sample::channel) == samples_.end() && channels_[c].first > start)
      throw std::invalid_argument(fmt::format(
          "{}.channels[{}].delay: is up to {:.6g} s within the bounds of its parameters; no sample of '{}' comes that "
          "long after the start at {} s, before which the model does not reach back",
          place, c, channels_[c].first - start, spec.channels[c].column, start));
  }
  if (times_.empty() || !(times_.back() > start))
    throw std::invalid_argument(
        fmt::format("{}: {} has no sample after the start at {} s{}", place, data.name, start,
                    t.empty() ? "" : fmt::format("; its times run from {} to {} s", t.front(), t.back())));
  settings_.end_time = spec.origin && spec.origin->continues ? end : times_.back();
  for (std::size_t i = 0; i < samples_.size(); ++i)
    if (samples_[i].time == first_.size()) first_.push_back(i);
  first_.push_back(samples_.size());
}

std::optional<Experiment::ShortSamples> Experiment::short_samples(const Eigen::VectorXd& rho, double end) const {
  for (std::size_t i = 0; i < scene_.drives.size(); ++i) {
    const std::optional<SampledLaw>& law = scene_.drives[i].samples;
    if (!law || !law->curve) continue;
    if (auto words = uncovered(covered_by(*law->curve), settings_.start_time, end)) return {{false, i, *words}};
  }
  Program::Scratch scratch;
  for (std::size_t i = 0; i < scene_.signals.size(); ++i) {
    const Signal& signal = scene_.signals[i];
    if (!signal.curve) continue;
    const double delay = signal.delay.is_number()
                             ? signal.delay.number()
                             : evaluated(*programs_->field(signal.delay), rho, settings_.start_time, scratch).value;
    if (auto words = uncovered(covered_by(*signal.curve, delay), settings_.start_time, end)) return {{true, i, *words}};
  }
  return std::nullopt;
}

void Experiment::refuse_short_laws(const ExperimentSpec& spec, const std::string& place) const {
  const std::optional<ShortSamples> found = short_samples(rho_, settings_.end_time);
  if (!found) return;
  std::string path;
  if (found->of_signal) {
    const std::string& name = scene_.signals[found->index].name;
    const bool own = std::ranges::find(spec.signals, name, &SignalSamples::name) != spec.signals.end();
    path = fmt::format("{}signals.{}", own ? place + "." : "", name);
  } else {
    path = fmt::format("drives[{}].law", found->index);
    for (std::size_t i = 0; i < spec.drives.size(); ++i)
      if (spec.drives[i].drive == scene_.drives[found->index].name) path = fmt::format("{}.drives[{}].law", place, i);
  }
  throw std::invalid_argument(fmt::format("{}: {}, in the experiment '{}'; give that an end_time, or {} of its own",
                                          path, found->words, spec.name, found->of_signal ? "samples" : "a law"));
}

// One run at given unknowns, and the residuals that are read along it.
class Experiment::Reading {
 public:
  Reading(const Experiment& experiment, const Eigen::VectorXd& u, const Limits& limits)
      : of_(experiment), limits_(limits), settings_(experiment.settings_), rho_(experiment.rho_), unknowns_(u.size()) {
    for (const Unknown& unknown : of_.unknowns_) rho_(unknown.parameter) = u(unknown.at);
    r_.z.setZero(static_cast<Eigen::Index>(of_.samples_.size()));
    r_.z_u.setZero(r_.z.size(), u.size());
    for (const Channel& c : of_.channels_) now_.push_back(at_time(c, settings_.start_time));
    if (limits.max_steps) settings_.integrator.max_steps = std::min(settings_.integrator.max_steps, *limits.max_steps);
  }

  Residuals residuals() {
    r_.message = set_times();
    if (!r_.message.empty()) return std::move(r_);
    if (const auto found = of_.short_samples(rho_, settings_.end_time)) {
      r_.message =
          fmt::format("the motion until {:.6g} s is beyond the samples of the {} '{}': {}", settings_.end_time,
                      found->of_signal ? "signal" : "drive",
                      found->of_signal ? of_.scene_.signals[found->index].name : of_.scene_.drives[found->index].name,
                      found->words);
      return std::move(r_);
    }
    try {
      run();
    } catch (const SceneError& error) {  // a field that these values drive out of its range
      r_.message = error.what();
    }
    return std::move(r_);
  }

 private:
  struct ChannelNow {
    Differentiated gain, bias, delay;
  };
  ChannelNow at_time(const Channel& c, double t) {
    return {evaluated(c.gain, rho_, t, scratch_), evaluated(c.bias, rho_, t, scratch_),
            evaluated(c.delay, rho_, t, scratch_)};
  }
  const ChannelNow& of_sample(const Sample& sample) {
    const Channel& c = of_.channels_[sample.channel];
    const int time = static_cast<int>(rho_.size());
    ChannelNow& values = now_[sample.channel];
    if (c.bias.uses(time) || c.delay.uses(time)) values = at_time(c, of_.times_[sample.time]);
    return values;
  }

  // Sets the times at which the run is read: those of the measurements, or with a delay one per sample; then its start
  // and end, whose states are read, too. Returns an error in words if a delay is no number.
  std::string set_times() {
    if (!of_.delayed_) times_ = of_.times_;
    for (const Sample& sample : of_.samples_) {
      if (!of_.delayed_) break;
      const double t = of_.times_[sample.time] - of_sample(sample).delay.value;
      if (!std::isfinite(t)) return fmt::format("the delay of channel {} is not finite", sample.channel);
      times_.push_back(std::max(t, settings_.start_time));
      settings_.end_time = std::max(settings_.end_time, t);
    }
    readings_ = times_.size();
    if (of_.start_chart_ && limits_.derivatives) times_.push_back(settings_.start_time);
    if (of_.end_chart_ && limits_.derivatives) times_.push_back(of_.settings_.end_time);
    return {};
  }

  void run() {
    const std::vector<bool> none(of_.active_.size(), false);
    const Mechanism mechanism(of_.scene_, rho_, limits_.derivatives ? of_.active_ : none, {}, of_.programs_);
    y_bar_.resize(mechanism.states());
    rho_bar_.resize(rho_.size());
    const auto read = [&](std::size_t k, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
      if (k == readings_ && of_.start_chart_) return take_end(*of_.start_chart_, at, y_rho, r_.start, r_.start_u);
      if (k >= readings_) return take_end(*of_.end_chart_, at, y_rho, r_.end, r_.end_u);
      if (of_.delayed_) return take(mechanism, k, at, y_rho);
      for (std::size_t i = of_.first_[k]; i < of_.first_[k + 1]; ++i) take(mechanism, i, at, y_rho);
    };
    RunOptions options;
    options.progress = limits_.progress;
    options.exact_stages = true;
    const SimulationResult result =
        limits_.derivatives
            ? simulate_tlm(mechanism, settings_, {}, {times_, read}, options)
            : simulate(mechanism, settings_, {},
                       {times_, [&](std::size_t k, const StatePoint& at) { read(k, at, {}); }}, options);
    r_.steps = result.statistics.steps;
    r_.jumps = result.statistics.jumps;
    r_.ok = result.ok() && seen_ == of_.samples_.size();
    r_.message = result.message;
  }

  void take(const Mechanism& mechanism, std::size_t i, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
    const Sample& sample = of_.samples_[i];
    const Channel& channel = of_.channels_[sample.channel];
    const ChannelNow& c = of_sample(sample);
    y_bar_.setZero();
    rho_bar_.setZero();
    const double s = limits_.derivatives ? mechanism.add_sensor_gradient(channel.sensor, at, 1, y_bar_, rho_bar_)
                                         : mechanism.sensor_value(channel.sensor, at);
    r_.z(static_cast<Eigen::Index>(i)) = (sample.measured - c.gain.value * s - c.bias.value) / channel.sigma;
    ++seen_;
    if (!limits_.derivatives) return;
    const bool held = of_.times_[sample.time] - c.delay.value < settings_.start_time;
    const double sdot = of_.delayed_ && !held && !of_.unknowns_.empty() ? y_bar_.dot(*at.ydot) : 0.0;
    for (const Unknown& unknown : of_.unknowns_) {
      const int k = unknown.parameter;
      const double s_u = y_bar_.dot(y_rho.col(k)) - sdot * c.delay.rho_bar(k) + rho_bar_(k);
      r_.z_u(static_cast<Eigen::Index>(i), unknown.at) =
          -(c.gain.value * s_u + s * c.gain.rho_bar(k) + c.bias.rho_bar(k)) / channel.sigma;
    }
  }

  void take_end(const StateChart& chart, const StatePoint& at, const Eigen::MatrixXd& y_rho, Eigen::VectorXd& s,
                Eigen::MatrixXd& s_u) const {
    Eigen::MatrixXd s_rho;
    chart.read(at.y, y_rho, s, s_rho);
    s_u.setZero(s.size(), unknowns_);
    for (const Unknown& unknown : of_.unknowns_) s_u.col(unknown.at) = s_rho.col(unknown.parameter);
  }

  const Experiment& of_;
  const Limits& limits_;
  SimulationSettings settings_;
  Eigen::VectorXd rho_;
  const Eigen::Index unknowns_;  // of the whole fit
  Program::Scratch scratch_;
  std::vector<ChannelNow> now_;  // values of the channels at the sample that is read
  std::vector<double> times_;
  std::size_t readings_ = 0, seen_ = 0;  // times of samples; samples read
  Eigen::VectorXd y_bar_, rho_bar_;
  Residuals r_;
};

Experiment::Residuals Experiment::residuals(const Eigen::VectorXd& u, const Limits& limits) const {
  return Reading(*this, u, limits).residuals();
}

}  // namespace mbsopt::inline optim
