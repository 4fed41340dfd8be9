// The cheapest setting for an accuracy: in single quantities, or for the task of a file. A design needs exact
// objectives and exact gradients of all that it minimises and bounds. An identification needs an exact sum of squares
// with its gradient. An exact value does not imply an exact gradient.
//
//   const Recommendation r = recommend(tradeoff, {quantity}, 1e-4);
//   if (r.row) tradeoff.rows[*r.row].setting ...
//
//   FitErrors fit(problem, data);
//   TaskAdviser adviser(problem, tradeoff, &fit, 10);
//   adviser.at(1e-4).fit->cost
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "optim/machine/stopwatch.hpp"
#include "optim/problem/problem.hpp"
#include "optim/tradeoff/fit_errors.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline optim {

struct Recommendation {
  std::vector<std::size_t> quantities;  // indices; all of them within the accuracy
  double accuracy = 0;
  std::optional<std::size_t> row;  // absent: none
  std::string why_not = {};
  std::optional<FitErrors::Error> fit = {};  // of the row, if the file has an identification
};

// The fastest row whose bounds in these quantities are within the accuracy. A bound excludes errors that pass through
// zero by chance. Of rows that are equally fast to a tenth, it takes the one with the lowest bound, where bounds below
// the certainty of the reference are equal. There is none if the reference is not three times as exact as requested. If
// gradients and other quantities are requested, it takes rows of exact gradients, with the bounds of their simulations.
// `also` is a further condition, tested for the fastest rows first until it holds.
Recommendation recommend(const Tradeoff& tradeoff, std::vector<std::size_t> quantities, double accuracy,
                         const std::function<bool(std::size_t row)>& also = {});

// The row that holds a quantity at the settings of `row`: itself, or for a value of a gradient's row its simulation. A
// looser simulation may replace it if it is already as exact as the reference. There is none if none was measured.
std::optional<std::size_t> row_with(const Tradeoff& tradeoff, std::size_t row, QuantityKind kind);

class TaskAdviser {
 public:
  // fit is null if nothing is fitted. seconds is the total for simulations of the fit. All must outlive this.
  TaskAdviser(const Problem& problem, const Tradeoff& tradeoff, const FitErrors* fit, double seconds);

  Recommendation at(double accuracy);
  const FitErrors* fit() const { return fit_; }

 private:
  bool fits(std::size_t row, double accuracy);
  std::string lacking_reference(double accuracy) const;

  const Tradeoff& tradeoff_;
  const FitErrors* fit_;
  const double seconds_;
  Stopwatch stopwatch_;
  bool out_of_time_ = false;
  std::vector<std::size_t> quantities_;
  bool gradients_are_missing_ = false;
  std::map<std::size_t, FitErrors::Error> measured_;  // by row
};

}  // namespace mbsopt::inline optim
