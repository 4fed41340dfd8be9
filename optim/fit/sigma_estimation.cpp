#include "optim/fit/sigma_estimation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "optim/machine/median.hpp"

namespace mbsopt {
namespace {

constexpr double kNormalMedian = 1.4826;  // 1 over the median of |x|, x normal
constexpr double kLeast = 1e-12;          // of the largest measured value: an exact record has no noise

}  // namespace

bool estimates_sigma(const IdentificationSpec& spec) {
  return std::any_of(spec.experiments.begin(), spec.experiments.end(), [](const ExperimentSpec& e) {
    return !e.validate && std::any_of(e.channels.begin(), e.channels.end(),
                                      [](const ChannelSpec& c) { return c.estimate_sigma != SigmaEstimate::none; });
  });
}

SigmaEstimation::SigmaEstimation(ExperimentStack& stack, const IdentificationSpec& spec) : stack_(stack) {
  std::map<std::string, std::size_t> shared;  // group of a column
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < stack.members().size(); ++m) {
    const ExperimentStack::Member& member = stack.members()[m];
    const std::vector<ChannelSpec>& channels = spec.experiments[member.experiment].channels;
    std::vector<std::size_t> group_of(channels.size(), 0);
    for (std::size_t c = 0; c < channels.size(); ++c) {
      group_of[c] = groups_.size();
      if (channels[c].estimate_sigma == SigmaEstimate::none) continue;
      if (channels[c].estimate_sigma == SigmaEstimate::shared)
        group_of[c] = shared.try_emplace(channels[c].column, groups_.size()).first->second;
      if (group_of[c] == groups_.size()) groups_.emplace_back();
      groups_[group_of[c]].channels.emplace_back(m, c);
    }
    for (const Experiment::Sample& sample : member.model.samples()) {
      if (channels[sample.channel].estimate_sigma != SigmaEstimate::none) {
        Group& group = groups_[group_of[sample.channel]];
        group.rows.push_back(row), group.largest = std::max(group.largest, std::abs(sample.measured));
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
    for (const Eigen::Index row : group.rows) sizes.push_back(std::abs(z(row))), squares += z(row) * z(row);
    const double n = static_cast<double>(sizes.size());
    const double scale = stack_.loss.type == LossType::squared ? std::sqrt(squares / (n * freedom()))
                                                               : kNormalMedian * median(std::move(sizes));
    const double after = std::max(scale * before, least(group));
    change = std::max(change, std::abs(after - before) / before);
    set(group, after);
  }
  return change;
}

}  // namespace mbsopt
