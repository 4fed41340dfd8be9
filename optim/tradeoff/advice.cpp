#include "optim/tradeoff/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbsopt::inline optim {
namespace {

// Returns the objectives, or the sensors if there are none, or the motion.
std::vector<std::size_t> main_quantities(const std::vector<Quantity>& quantities) {
  std::vector<std::size_t> found;
  for (const QuantityKind kind : {QuantityKind::objective, QuantityKind::sensors, QuantityKind::motion}) {
    for (std::size_t i = 0; i < quantities.size(); ++i)
      if (quantities[i].kind == kind) found.push_back(i);
    if (!found.empty()) break;
  }
  return found;
}

}  // namespace

std::optional<std::size_t> row_with(const Tradeoff& tradeoff, std::size_t row, QuantityKind kind) {
  const TradeoffSetting& setting = tradeoff.rows[row].setting;
  if (!setting.gradient || kind == QuantityKind::gradient) return row;
  const auto same = [&](const SimulationSettings& s) {
    return s.integrator == setting.simulation.integrator && s.formulation == setting.simulation.formulation;
  };
  std::optional<std::size_t> looser;
  for (std::size_t i = 0; i < tradeoff.rows.size(); ++i) {
    const TradeoffRow& other = tradeoff.rows[i];
    if (other.setting.gradient || !other.ok()) continue;
    SimulationSettings s = other.setting.simulation;
    if (same(s)) return i;
    const bool is_looser = s.integrator.rtol > setting.simulation.integrator.rtol;
    s.integrator.rtol = setting.simulation.integrator.rtol;
    s.integrator.atol = setting.simulation.integrator.atol;
    if (other.within_floor && is_looser && same(s)) looser = i;
  }
  return looser;
}

Recommendation recommend(const Tradeoff& tradeoff, std::vector<std::size_t> quantities, double accuracy,
                         const std::function<bool(std::size_t row)>& also) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Recommendation advice{std::move(quantities), accuracy, {}};
  const std::vector<Quantity>& all = tradeoff.quantities();
  double certificate = 0;
  bool gradients = false, values = false;
  for (const std::size_t q : advice.quantities) {
    certificate = std::max(certificate, all[q].certificate);
    (all[q].kind == QuantityKind::gradient ? gradients : values) = true;
  }
  if (3 * certificate > accuracy) {
    advice.why_not = fmt::format("the reference itself is certain to {:.1e} only", certificate);
    return advice;
  }
  const auto bound_of = [&](std::size_t i) {  // no less than the reference is certain of
    const std::optional<GradientMethod> method = tradeoff.rows[i].setting.gradient;
    if (method.has_value() != gradients || (values && method == GradientMethod::differences)) return kInfinity;
    double largest = certificate;
    for (const std::size_t q : advice.quantities) {
      const std::optional<std::size_t> row = row_with(tradeoff, i, all[q].kind);
      const double b = row ? tradeoff.rows[*row].bound(q) : kNaN;
      largest = std::isfinite(b) ? std::max(largest, b) : kInfinity;
    }
    return largest;
  };
  std::vector<double> bound;
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < tradeoff.rows.size(); ++i) {
    bound.push_back(bound_of(i));
    if (bound[i] <= accuracy) candidates.push_back(i);
  }
  std::ranges::stable_sort(candidates, {}, [&](std::size_t i) { return tradeoff.rows[i].wall_seconds; });
  double slowest = kInfinity;
  for (const std::size_t i : candidates) {
    if (tradeoff.rows[i].wall_seconds > slowest) break;
    if (advice.row && bound[i] >= bound[*advice.row]) continue;
    if (also && !also(i)) continue;
    if (!advice.row) slowest = 1.1 * tradeoff.rows[i].wall_seconds;
    advice.row = i;
  }
  if (advice.row) return advice;
  const double best = bound.empty() ? kInfinity : std::ranges::min(bound);
  advice.why_not = !candidates.empty() ? "no setting that was measured is that exact in all of it"
                   : std::isfinite(best)
                       ? fmt::format("no setting that was measured gets there; the best has {:.1e}", best)
                       : "it was not measured";
  return advice;
}

TaskAdviser::TaskAdviser(const Problem& problem, const Tradeoff& tradeoff, const FitErrors* fit, double seconds)
    : tradeoff_(tradeoff), fit_(fit), seconds_(seconds), quantities_(main_quantities(tradeoff.quantities())) {
  if (!problem.design) return;
  const auto is_followed = [&](const Quantity& q) { return problem.design->uses(q.objective_name); };
  const std::vector<Quantity>& all = tradeoff.quantities();
  std::ptrdiff_t missing = 0;
  for (std::size_t q = 0; q < all.size(); ++q) {
    if (!is_followed(all[q])) continue;
    if (all[q].kind == QuantityKind::gradient) quantities_.push_back(q);
    missing += all[q].kind == QuantityKind::gradient ? -1 : 1;
  }
  gradients_are_missing_ = missing > 0;
}

bool TaskAdviser::fits(std::size_t row, double accuracy) {
  if (!measured_.contains(row)) {
    out_of_time_ = out_of_time_ || stopwatch_.seconds() > seconds_;
    if (out_of_time_) return false;
    measured_[row] = fit_->at(tradeoff_.rows[row].setting.simulation);
  }
  const FitErrors::Error& error = measured_.at(row);
  return error.ok() && error.largest() <= accuracy;
}

std::string TaskAdviser::lacking_reference(double accuracy) const {
  if (gradients_are_missing_) return "the gradients have no reference";
  if (!fit_) return "";
  if (!fit_->ok()) return "the sum of squares of identify has no reference: " + fit_->certificate().message;
  const double certain = fit_->certificate().largest();
  if (3 * certain <= accuracy) return "";
  return fmt::format("the reference of the sum of squares of identify is certain to {:.1e} only", certain);
}

Recommendation TaskAdviser::at(double accuracy) {
  if (const std::string why_not = lacking_reference(accuracy); !why_not.empty())
    return {quantities_, accuracy, {}, why_not};
  Recommendation advice =
      recommend(tradeoff_, quantities_, accuracy, [&](std::size_t row) { return !fit_ || fits(row, accuracy); });
  if (fit_ && advice.row) advice.fit = measured_.at(*advice.row);
  if (!advice.row && out_of_time_) advice.why_not += fmt::format("; the {:.3g} s for fits are over", seconds_);
  return advice;
}

}  // namespace mbsopt::inline optim
