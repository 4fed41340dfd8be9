#include "optim/tradeoff/tradeoff_measurement.hpp"

#include <algorithm>

#include "optim/machine/median.hpp"

namespace mbsopt::inline optim {

TradeoffMeasurement::TradeoffMeasurement(const Scene& scene, const std::vector<Objective>& objectives,
                                         const TradeoffOptions& options)
    : runs_(scene, objectives), options_(options), stopwatch_(options.clock) {}

void TradeoffMeasurement::report(const std::string& doing, double done) const {
  if (options_.progress) options_.progress(doing, std::clamp(done, 0.0, 1.0));
}

bool TradeoffMeasurement::find_reference(bool gradients) {
  report("reference", 0);
  ReferenceOptions options;
  options.seconds_per_run = std::max(10.0, options_.budget_seconds / 6);
  options.gradients = gradients;
  options.interrupted = options_.interrupted, options.clock = options_.clock;
  options.progress = [this](const std::string& doing, double done) { report("reference, " + doing, done); };
  result_.reference = converged_reference(runs_, options);
  result_.message = result_.reference.message;
  budget_.emplace(options_.clock);
  return result_.ok();
}

Answer TradeoffMeasurement::timed(const TradeoffSetting& setting, double seconds) const {
  return setting.gradient ? runs_.gradients(setting.simulation, *setting.gradient, within(seconds))
                          : runs_.values(setting.simulation, within(seconds));
}

Answer TradeoffMeasurement::measure(const TradeoffSetting& setting, double seconds) {
  TradeoffRow& row = result_.rows.emplace_back();
  row.setting = setting;
  Answer answer = timed(setting, seconds);
  row.statistics = answer.statistics;
  row.wall_seconds = answer.wall_seconds;
  if (answer.ok && !setting.gradient) answer = runs_.motion(setting.simulation, within(3 * seconds));
  row.status = answer.ok ? RowStatus::ok : answer.out_of_time ? RowStatus::abandoned : RowStatus::failed;
  row.message = answer.message;
  if (interrupted() && !answer.ok) row.status = RowStatus::abandoned, row.message = "interrupted";
  row.errors = result_.reference.errors->of(answer);
  row.deviations = result_.reference.errors->deviations(answer);
  row.within_floor = answer.ok;
  Eigen::Index q = 0;
  for (const Quantity& quantity : result_.quantities()) {
    // The objectives of a gradient's row are those of the simulation, which has its own row.
    if (setting.gradient.has_value() != (quantity.kind == QuantityKind::gradient))
      row.errors(q) = row.deviations(q) = kNaN;
    if (row.errors(q++) > quantity.certificate) row.within_floor = false;
  }
  if (answer.ok) row.runs = {row.wall_seconds};
  if (answer.ok && row.errors.array().isInf().any()) row.status = RowStatus::failed, row.message = "not finite";
  return answer;
}

void TradeoffMeasurement::time_again(int rounds) {
  for (int round = 1; round < rounds; ++round) {
    for (TradeoffRow& row : result_.rows) {
      if (interrupted()) return;
      if (!row.ok() || row.wall_seconds > budget_left()) continue;
      const Answer answer = timed(row.setting, 10 * row.wall_seconds + 1);
      if (answer.ok) row.runs.push_back(answer.wall_seconds);
      row.wall_seconds = median(row.runs);
    }
    report("timing again", static_cast<double>(round) / (rounds - 1));
  }
}

Tradeoff TradeoffMeasurement::finish() {
  result_.interrupted = interrupted() || result_.reference.interrupted;
  result_.wall_seconds = stopwatch_.seconds();
  bound_errors(result_.rows);
  if (result_.ok()) mark_fronts(result_.rows, result_.quantities());
  return std::move(result_);
}

}  // namespace mbsopt::inline optim
