// A setting that a trade-off measures, and its figures.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt {

// The curves of settings that stand alone.
inline constexpr const char *kOwnSettings = "as in the file", *kDefaults = "defaults";

struct TradeoffSetting {
  std::string curve;  // the common settings: "dopri5", "penalty 1e+07, cholesky: dopri5"
  SimulationSettings simulation;
  std::optional<GradientMethod> gradient;  // absent: a simulation
};
// "dopri5 at rtol 1e-06", "adjoint, rk4 with steps of 0.005 s"
std::string in_words(const TradeoffSetting& setting);
// Returns whether it belongs to no curve: the scene's own settings and the defaults.
bool stands_alone(const TradeoffSetting& setting);

enum class RowStatus {
  ok,
  failed,     // its own failure: a step too large, a method without the ability
  abandoned,  // took longer than its share, or the user ended it
  skipped,    // would have taken longer
};
std::string_view to_string(RowStatus status);

struct TradeoffRow {
  TradeoffSetting setting;
  RowStatus status = RowStatus::ok;
  std::string message;  // why it is not ok
  double wall_seconds = 0;
  int repetitions = 0;  // number of runs in this median
  SimulationStatistics statistics;
  Eigen::VectorXd errors;      // per quantity of the reference; NaN: not of this row
  Eigen::VectorXd deviations;  // likewise, with a sign
  Eigen::VectorXd bounds;      // likewise, the largest error from here on along the curve (tradeoff_curves.hpp)
  std::vector<bool> pareto;    // per quantity: nothing is faster and has a lower bound, as far as is certain
  bool within_floor = false;   // no error is larger than what the reference is certain of
};

}  // namespace mbsopt
