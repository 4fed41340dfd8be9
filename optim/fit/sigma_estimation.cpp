#include "optim/fit/sigma_estimation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "optim/machine/median.hpp"

namespace mbsopt {
namespace {

constexpr double kNormalMedian = 1.4826;  // 1 over the median of |x|, x normal
constexpr double kLeast = 1e-12;          // of the largest measured value: an exact record has no noise

double estimated(const Experiment& model, std::size_t channel, const Eigen::VectorXd& z, const Loss& loss,
                 double freedom) {
  std::vector<double> sizes;
  double squares = 0, largest = 0;
  for (std::size_t i = 0; i < model.samples().size(); ++i) {
    if (model.samples()[i].channel != channel) continue;
    const double r = std::abs(z(static_cast<Eigen::Index>(i)) * model.sigma(channel));
    sizes.push_back(r);
    squares += r * r, largest = std::max(largest, std::abs(model.samples()[i].measured));
  }
  if (sizes.empty()) return model.sigma(channel);
  const double n = static_cast<double>(sizes.size());
  const double sigma =
      loss.type == LossType::squared ? std::sqrt(squares / (n * freedom)) : kNormalMedian * median(std::move(sizes));
  return std::max({sigma, kLeast * largest, 1e-300});
}

}  // namespace

bool estimates_sigma(const IdentificationSpec& spec) {
  return std::any_of(spec.experiments.begin(), spec.experiments.end(), [](const ExperimentSpec& e) {
    return !e.validate &&
           std::any_of(e.channels.begin(), e.channels.end(), [](const ChannelSpec& c) { return c.estimate_sigma; });
  });
}

SigmaEstimates estimated_sigmas(ExperimentStack& stack, const IdentificationSpec& spec, const Eigen::VectorXd& z) {
  const double N = static_cast<double>(stack.samples()), P = static_cast<double>(stack.variables());
  const double freedom = N > P ? (N - P) / N : 1;
  SigmaEstimates found;
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < stack.members().size(); ++i) {
    const ExperimentStack::Member& m = stack.members()[i];
    const Eigen::Index n = static_cast<Eigen::Index>(m.model.samples().size());
    const std::vector<ChannelSpec>& channels = spec.experiments[m.experiment].channels;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (!channels[c].estimate_sigma) continue;
      const double before = m.model.sigma(c), sigma = estimated(m.model, c, z.segment(row, n), stack.loss, freedom);
      found.change = std::max(found.change, std::abs(sigma - before) / before);
      found.all.push_back({i, c, sigma});
    }
    row += n;
  }
  return found;
}

void use_sigmas(ExperimentStack& stack, const SigmaEstimates& sigmas) {
  for (const SigmaEstimates::One& s : sigmas.all) stack.members()[s.member].model.set_sigma(s.channel, s.sigma);
}

}  // namespace mbsopt
