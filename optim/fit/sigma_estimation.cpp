#include "optim/fit/sigma_estimation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "optim/machine/median.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kNormalMedian = 1.4826;  // 1 over the median of |x|, x normal
constexpr double kLeast = 1e-12;          // of the largest measured value: an exact record has no noise

}  // namespace

bool has_sigma(const ChannelSpec& channel) {
  return !channel.sigma.is_number() || channel.sigma.number() != ChannelSpec().sigma.number();
}

bool estimates_sigma(const IdentificationSpec& spec) {
  return std::ranges::any_of(spec.experiments, [](const ExperimentSpec& e) {
    const auto estimated = [](const ChannelSpec& c) { return c.estimate_sigma != SigmaEstimate::none; };
    return !e.validate && std::ranges::any_of(e.channels, estimated);
  });
}

double differenced_noise(const Eigen::VectorXd& m) {
  const Eigen::Index n = m.size() - 2;
  if (n < 1) return 0;
  const Eigen::VectorXd sizes = (m.head(n) - 2 * m.segment(1, n) + m.tail(n)).cwiseAbs();
  return kNormalMedian * median({sizes.begin(), sizes.end()}) / std::sqrt(6.0);
}

SigmaEstimation::SigmaEstimation(ExperimentStack& stack, const IdentificationSpec& spec) : stack_(stack) {
  std::map<std::pair<std::string, std::string>, std::size_t> group_at;  // of a record, "" where shared, and a column
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < stack.members().size(); ++m) {
    const ExperimentStack::Member& member = stack.members()[m];
    const std::vector<ChannelSpec>& channels = spec.experiments[member.experiment].channels;
    std::vector<std::size_t> group_of(channels.size(), 0);
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (channels[c].estimate_sigma == SigmaEstimate::none) continue;
      const bool own = channels[c].estimate_sigma == SigmaEstimate::own;
      const std::string record = own ? record_name(spec.experiments[member.experiment]) : "";
      group_of[c] = group_at.try_emplace({record, channels[c].column}, groups_.size()).first->second;
      if (group_of[c] == groups_.size()) groups_.emplace_back();
      groups_[group_of[c]].channels.emplace_back(m, c);
      groups_[group_of[c]].is_given = has_sigma(channels[c]);
    }
    for (const Experiment::Sample& sample : member.model.samples()) {
      if (channels[sample.channel].estimate_sigma != SigmaEstimate::none) {
        Group& group = groups_[group_of[sample.channel]];
        group.rows.push_back(row);
        group.largest = std::max(group.largest, std::abs(sample.measured));
      }
      ++row;
    }
  }
  std::erase_if(groups_, [](const Group& group) { return group.rows.empty(); });
  for (const Group& group : groups_) set(group, sigma(group));
}

double SigmaEstimation::sigma(const Group& group) const {
  const auto [member, channel] = group.channels.front();
  return stack_.members()[member].model.sigma(channel);
}

double SigmaEstimation::least(const Group& group) const { return std::max(kLeast * group.largest, 1e-150); }

double SigmaEstimation::freedom() const {
  const double N = static_cast<double>(stack_.samples()), P = static_cast<double>(stack_.freedom_of_variables());
  return N > P ? (N - P) / N : 1;
}

void SigmaEstimation::set(const Group& group, double sigma) {
  for (const auto& [member, channel] : group.channels) stack_.members()[member].model.set_sigma(channel, sigma);
}

std::vector<double> SigmaEstimation::sigmas() const {
  std::vector<double> all;
  for (const Group& group : groups_) all.push_back(sigma(group));
  return all;
}

void SigmaEstimation::set(const std::vector<double>& sigmas) {
  for (std::size_t g = 0; g < groups_.size(); ++g) set(groups_[g], sigmas[g]);
}

std::vector<double> SigmaEstimation::noise() const {
  std::vector<double> all;
  const Eigen::VectorXd measured = stack_.measured();
  for (const Group& group : groups_) {
    const double noise = differenced_noise(measured(group.rows));
    all.push_back(noise > least(group) ? noise : sigma(group));
  }
  return all;
}

double SigmaEstimation::likelihood(const Eigen::VectorXd& z) const {
  return stack_.cost(z) + freedom() * stack_.sigma().array().log().sum();
}

std::vector<ScaleGroup> SigmaEstimation::scale_groups() const {
  std::vector<ScaleGroup> scales;
  for (const Group& group : groups_)
    scales.push_back(
        {group.rows, static_cast<double>(group.rows.size()) * freedom(), std::pow(least(group) / sigma(group), 2)});
  return scales;
}

double SigmaEstimation::take(const Eigen::VectorXd& z) {
  double change = 0;
  for (const Group& group : groups_) {
    const double before = sigma(group);
    std::vector<double> sizes;
    double squares = 0;
    for (const Eigen::Index row : group.rows) {
      sizes.push_back(std::abs(z(row)));
      squares += z(row) * z(row);
    }
    const double n = static_cast<double>(sizes.size());
    const double scale = stack_.loss.type == LossType::squared ? std::sqrt(squares / (n * freedom()))
                                                               : kNormalMedian * median(std::move(sizes));
    const double after = std::max(scale * before, least(group));
    change = std::max(change, std::abs(after - before) / before);
    set(group, after);
  }
  return change;
}

}  // namespace mbsopt::inline optim
