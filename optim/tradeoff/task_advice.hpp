// Settings for the task of a file. A design needs exact objectives and exact gradients of all that it minimises and
// bounds. An identification needs an exact sum of squares with its gradient. An exact value does not imply an exact
// gradient.
//
//   FitErrorMeasure fit(problem, data);
//   TaskAdviser adviser(problem, tradeoff, &fit, 10);
//   const TaskAdvice advice = adviser.at(1e-4);
//   if (advice.recommendation.row) tradeoff.rows[*advice.recommendation.row].setting ...
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "optim/machine/stopwatch.hpp"
#include "optim/tradeoff/fit_errors.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt {

struct TaskAdvice {
  Recommendation recommendation;
  std::optional<FitErrors::Apart> fit;  // of the recommended row, if the file has an identification
  FitErrors::Apart fit_certificate = {};
};

class TaskAdviser {
 public:
  // fit is null if nothing is fitted. seconds is the total for simulations of the fit. All must outlive this.
  TaskAdviser(const Problem& problem, const Tradeoff& tradeoff, const FitErrorMeasure* fit, double seconds);

  TaskAdvice at(double accuracy);

 private:
  bool is_exact(const TradeoffRow& row, double accuracy);

  const Tradeoff& tradeoff_;
  const FitErrorMeasure* fit_;
  const double seconds_;
  Stopwatch stopwatch_;
  bool out_of_time_ = false;
  std::vector<std::size_t> quantities_;
  bool gradients_are_missing_ = false;
  std::map<const TradeoffRow*, FitErrors::Setting> fits_;  // measured
};

}  // namespace mbsopt
