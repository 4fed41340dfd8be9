// The studies of a trade-off share this: they find the reference, measure rows, and time them again. A study chooses
// the settings.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_table.hpp"

namespace mbsopt::inline optim {

struct TradeoffOptions {
  double budget_seconds = 60;  // 0: the reference, the scene's own settings and the defaults only
  std::function<bool()> interrupted = {};
  std::function<void(const std::string& doing, double done)> progress = {};  // done: 0..1
  Clock clock = {};                                                          // of the budget and of all times
};

class TradeoffMeasurement {
 public:
  TradeoffMeasurement(const Scene& scene, const std::vector<Objective>& objectives, const TradeoffOptions& options);

 protected:
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }
  void report(const std::string& doing, double done) const;
  double budget_left() const { return options_.budget_seconds - budget_->seconds(); }  // without the reference
  RunLimit within(double seconds) const { return {seconds, options_.interrupted, options_.clock}; }

  bool find_reference(bool gradients);
  // Adds a row and returns its answer. A simulation is timed by a run without samples.
  Answer measure(const TradeoffSetting& setting, double seconds);
  void time_again(int rounds);  // within the budget
  Tradeoff finish();

  const TradeoffRuns runs_;
  const TradeoffOptions& options_;
  const Stopwatch stopwatch_;
  std::optional<Stopwatch> budget_;
  Tradeoff result_;

 private:
  Answer timed(const TradeoffSetting& setting, double seconds) const;
};

}  // namespace mbsopt::inline optim
