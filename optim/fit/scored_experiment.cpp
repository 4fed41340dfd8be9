#include "optim/fit/scored_experiment.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt {

void score_experiment(const ExperimentSpec& spec, const Experiment& model, const Loss& loss, const Eigen::VectorXd& z,
                      bool estimated, std::size_t experiment, ExperimentFit& fit, std::vector<ResidualRow>& residuals) {
  fit.name = spec.name, fit.window = spec.origin, fit.validate = spec.validate;
  fit.start_time = model.start_time(), fit.end_time = model.end_time();
  fit.samples = model.samples().size();
  fit.channels.resize(spec.channels.size());
  for (std::size_t c = 0; c < fit.channels.size(); ++c) {
    ChannelFit& channel = fit.channels[c];
    channel.column = spec.channels[c].column, channel.sensor = spec.channels[c].sensor;
    channel.missing = model.missing(c);
    channel.sigma = model.sigma(c),
    channel.sigma_is_estimated = estimated && spec.channels[c].estimate_sigma != SigmaEstimate::none;
  }
  double sum = 0;
  std::vector<std::vector<double>> scaled(fit.channels.size());
  for (std::size_t i = 0; i < fit.samples; ++i) {
    const Experiment::Sample& sample = model.samples()[i];
    const double z_i = z(static_cast<Eigen::Index>(i)), residual = z_i * model.sigma(sample.channel);
    ChannelFit& channel = fit.channels[sample.channel];
    ++channel.samples;
    channel.beyond_scale += std::abs(z_i) > loss.s();
    channel.rms += residual * residual, channel.rms_scaled += z_i * z_i;
    sum += residual * residual;
    scaled[sample.channel].push_back(z_i);
    residuals.push_back(
        {experiment, sample.channel, model.times()[sample.time], sample.measured, sample.measured - residual, z_i});
  }
  fit.rms = std::sqrt(sum / static_cast<double>(fit.samples));
  for (std::size_t c = 0; c < fit.channels.size(); ++c) {
    ChannelFit& channel = fit.channels[c];
    const double n = static_cast<double>(std::max<std::size_t>(channel.samples, 1));
    channel.rms = std::sqrt(channel.rms / n), channel.rms_scaled = std::sqrt(channel.rms_scaled / n);
    const Eigen::Map<const Eigen::VectorXd> z_c(scaled[c].data(), static_cast<Eigen::Index>(scaled[c].size()));
    channel.analysis = analyse_residuals(z_c);
  }
}

}  // namespace mbsopt
