#include "optim/tradeoff/task_advice.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace mbsopt {

TaskAdviser::TaskAdviser(const Problem& problem, const Tradeoff& tradeoff, const FitErrorMeasure* fit, double seconds)
    : tradeoff_(tradeoff), fit_(fit), seconds_(seconds) {
  const std::vector<Quantity>& all = tradeoff.reference.errors->quantities();
  quantities_ = main_quantities(all);
  if (!problem.design) return;
  std::vector<std::string> names{problem.design->minimize};
  for (const ObjectiveBound& bound : problem.design->subject_to) names.push_back(bound.objective);
  std::size_t values = 0, gradients = 0;
  for (const std::size_t q : design_quantities(all, names)) {
    const bool is_gradient = all[q].kind == QuantityKind::gradient;
    ++(is_gradient ? gradients : values);
    if (is_gradient) quantities_.push_back(q);
  }
  gradients_are_missing_ = gradients < values;
}

bool TaskAdviser::is_exact(const TradeoffRow& row, double accuracy) {
  auto found = fits_.find(&row);
  if (found == fits_.end()) {
    out_of_time_ = out_of_time_ || stopwatch_.seconds() > seconds_;
    if (out_of_time_) return false;
    found = fits_.emplace(&row, fit_->at({in_words(row.setting), row.setting.simulation})).first;
  }
  return found->second.message.empty() && found->second.error.largest() <= accuracy;
}

TaskAdvice TaskAdviser::at(double accuracy) {
  TaskAdvice advice;
  advice.recommendation = {quantities_, accuracy, {}, {}};
  std::string& why_not = advice.recommendation.why_not;
  if (gradients_are_missing_) {
    why_not = "the gradients have no reference";
  } else if (fit_ && !fit_->found().ok()) {
    why_not = "the sum of squares of identify has no reference: " + fit_->found().message;
  } else if (fit_ && 3 * fit_->found().certificate.largest() > accuracy) {
    why_not = fmt::format("the reference of the sum of squares of identify is certain to {:.1e} only",
                          fit_->found().certificate.largest());
  } else {
    const auto exact = [&](const TradeoffRow& row) { return is_exact(row, accuracy); };
    advice.recommendation =
        recommend(tradeoff_, quantities_, accuracy, fit_ ? exact : std::function<bool(const TradeoffRow&)>());
    const std::optional<std::size_t> row = advice.recommendation.row;
    if (fit_ && row) {
      advice.fit = fits_.at(&tradeoff_.rows[*row]).error;
      advice.fit_certificate = fit_->found().certificate;
    }
    if (!row && out_of_time_) why_not += fmt::format("; the {:.3g} s for fits are over", seconds_);
  }
  return advice;
}

}  // namespace mbsopt
