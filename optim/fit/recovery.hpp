// Known-truth recovery: does the fit find parameters again that are known? Records are simulated at the parameters and
// with the noise of the fit. They are fitted from the start that the problem gives. Over many seeds this shows the bias
// of each parameter, its scatter, and how many of the intervals hold the truth.
//
// The noise of a channel consists of its residuals, centred, with a variance larger by N/(N - P). P counts parameters
// less the equations between them. White residuals are drawn one by one. Others are drawn in blocks of a tenth of the
// record, the lag of score_variance.hpp, so that they stay correlated. All windows of an experiment are one record: the
// moving blocks of Kuensch, Annals of Statistics 17 (1989) 1217, on a circle. Hence the scatter is a bootstrap of the
// standard errors.
//
//   const Recovery recovery = recover(problem, data, run_identification(problem, data), {.seeds = 100});
//   for (const RecoveredParameter& p : recovery.parameters) std::cout << p.name << ' ' << p.mean - p.truth;
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "optim/fit/identification.hpp"

namespace mbsopt::inline optim {

struct RecoveredParameter {
  std::string name, unit;
  double truth = 0, mean = 0;
  double scatter = 0;       // standard deviation over the fits
  double share = 0;         // of the 95 % intervals that hold the truth
  double ci95[2] = {0, 0};  // the percentiles 2.5 and 97.5 of the fits
  double bias() const { return mean - truth; }
};

struct Recovery {
  std::vector<RecoveredParameter> parameters;  // in the order of the fit's; empty without two fits
  int fits = 0, failed = 0;
};

struct RecoveryOptions {
  int seeds = 0;    // 1, 2, ..., seeds
  int threads = 1;  // fits at a time; results do not depend on it
  std::vector<std::shared_ptr<const UserForce>> user_forces = {};
  // Called from any thread, one at a time: after each fit, false stops; within a simulation, false abandons all.
  std::function<bool(int done)> progress = {};
  std::function<bool(double t)> simulation_progress = {};
};

// fit: of this problem and these data.
Recovery recover(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationResult& fit,
                 const RecoveryOptions& options);

}  // namespace mbsopt::inline optim
