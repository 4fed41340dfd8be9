#include "optim/fit/nearest_turn.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/expression/counted.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

// The columns of one experiment with "unwrap".
void move_columns(const Problem& problem, std::size_t e, CsvTable& table, std::vector<std::string>& moved) {
  ExperimentSpec spec = problem.identification->experiments[e];
  spec.windows.reset();
  std::erase_if(spec.channels, [](const ChannelSpec& channel) { return !channel.unwrap; });
  if (spec.channels.empty()) return;
  Experiment::Limits limits;
  limits.derivatives = false;
  const Experiment model(problem.scene, spec, place_of(*problem.identification, e), table,
                         parameter_values(problem.scene), {});
  const Experiment::Residuals found = model.residuals(Eigen::VectorXd(), limits);
  if (!found.ok) return;
  std::vector<bool> seen(spec.channels.size(), false);
  for (std::size_t i = 0; i < model.samples().size(); ++i) {
    const std::size_t c = model.samples()[i].channel;
    const ChannelSpec& channel = spec.channels[c];
    if (seen[c]) continue;
    seen[c] = true;
    const double turn = 2 * std::numbers::pi * (channel.gain.is_number() ? std::abs(channel.gain.number()) : 1);
    const double turns = std::round(found.z(static_cast<Eigen::Index>(i)) * model.sigma(c) / turn);
    if (turns == 0) continue;
    for (double& x : table.columns[table.find_column(channel.column)]) x -= turns * turn;
    moved.push_back(fmt::format("{}: column '{}' moved {} by {}, to the turn nearest to the model", table.name,
                                channel.column, turns > 0 ? "down" : "up",
                                counted(static_cast<long>(std::abs(turns)), "turn")));
  }
}

}  // namespace

std::vector<std::string> move_to_nearest_turn(const Problem& problem, std::vector<CsvTable>& data) {
  std::vector<std::string> moved;
  for (std::size_t e = 0; e < data.size(); ++e) move_columns(problem, e, data[e], moved);
  return moved;
}

}  // namespace mbsopt::inline optim
