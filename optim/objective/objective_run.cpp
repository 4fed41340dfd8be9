#include "optim/objective/objective_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/cvodes/cvodes.hpp"

namespace mbsopt {
namespace {

// Largest of values given one after another, and where parabolas through each three whose middle is the highest have
// their tops beyond it. Such a top is a place to look at, no value: between few points it may be anything.
class Peak {
 public:
  void add(double t, double x) {
    largest_ = std::max(largest_, x);
    t_[0] = t_[1], t_[1] = t_[2], t_[2] = t;
    x_[0] = x_[1], x_[1] = x_[2], x_[2] = x;
    if (++count_ < 3 || x_[1] < x_[0] || x_[1] < x_[2]) return;
    // x = x1 + b s + c s^2,  s = t - t1
    const double s0 = t_[0] - t_[1], s2 = t_[2] - t_[1];
    if (!(s0 < 0 && s2 > 0)) return;
    const double d0 = (x_[0] - x_[1]) / s0, d2 = (x_[2] - x_[1]) / s2;
    const double c = (d2 - d0) / (s2 - s0), b = d0 - c * s0;
    if (c < 0) tops_.push_back({t_[1] - b / (2 * c), x_[1] - b * b / (4 * c)});
  }
  double largest() const { return largest_; }
  void add_places(std::vector<double>& times) const {
    for (const Top& top : tops_)
      if (top.x > largest_) times.push_back(top.t);
  }

 private:
  struct Top {
    double t, x;
  };
  double largest_ = -std::numeric_limits<double>::infinity();
  double t_[3] = {}, x_[3] = {};
  int count_ = 0;
  std::vector<Top> tops_;
};

}  // namespace

ObjectiveRun::ObjectiveRun(std::vector<const Objective*> objectives, const Mechanism& mechanism,
                           const SimulationSettings& settings, std::function<bool(double t)> progress)
    : objectives_(std::move(objectives)), mechanism_(mechanism), settings_(settings), progress_(std::move(progress)) {}

SimulationResult ObjectiveRun::run(const Sweep& sweep) const {
  std::vector<double> x0(objectives_.size(), 0.0);
  SimulationResult result = run_with(x0, sweep);
  const bool integrated =
      result.ok() || (result.status == SimulationStatus::not_finite && result.last_good_time >= settings_.end_time);
  if (!integrated || in_range(result.psi)) {
    if (!result.ok()) return result;
  } else {
    const std::vector<std::optional<double>> extremes =
        true_extremes(objectives_, mechanism_, settings_, result.steps, progress_);
    for (std::size_t i = 0; i < x0.size(); ++i) x0[i] = extremes[i].value_or(0);
    result = run_with(x0, sweep);
    if (!result.ok()) return result;
  }
  for (std::size_t i = 0; i < objectives_.size(); ++i) {
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    const Jet psi = objectives_[i]->of_integral(result.psi(row), x0[i]);
    if (objectives_[i]->extreme() && !std::isfinite(psi.value)) {
      result.status = SimulationStatus::not_finite;
      result.message = fmt::format(
          "the steps do not resolve the peaks of objective '{}', whose exponentials integrate to {:.3g}: give it less "
          "sharpness, or set simulation.integrator.max_step",
          objectives_[i]->name(), result.psi(row));
      return result;
    }
    result.psi(row) = psi.value;
    if (result.psi_rho.rows() > row) result.psi_rho.row(row) *= psi.first;
  }
  return result;
}

SimulationResult ObjectiveRun::run_with(const std::vector<double>& x0, const Sweep& sweep) const {
  std::vector<Cost> costs;
  for (std::size_t i = 0; i < objectives_.size(); ++i) costs.push_back(objectives_[i]->cost(mechanism_, x0[i]));
  return sweep(costs);
}

bool ObjectiveRun::in_range(const Eigen::VectorXd& integrals) const {
  constexpr double kSmall = 1e-250, kLarge = 1e250;  // what exp and its sums can hold, with room for factors
  for (std::size_t i = 0; i < objectives_.size(); ++i) {
    const double I = std::abs(integrals(static_cast<Eigen::Index>(i)));
    if (objectives_[i]->extreme() && !(I > kSmall && I < kLarge)) return false;
  }
  return true;
}

std::vector<std::optional<double>> true_extremes(const std::vector<const Objective*>& objectives,
                                                 const Mechanism& mechanism, const SimulationSettings& settings,
                                                 const StepSequence& steps,
                                                 const std::function<bool(double t)>& progress) {
  std::vector<std::optional<double>> values(objectives.size());
  struct Tracked {
    std::size_t objective;
    double sign;
    std::shared_ptr<const PointCost> x;
    Peak peak;
  };
  std::vector<Tracked> tracked;
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    if (!objectives[i]->extreme()) continue;
    const double sign = objectives[i]->extreme();
    if (auto x = objectives[i]->expression(mechanism)) {
      tracked.push_back({i, sign, std::move(x), {}});
    } else {
      values[i] = 0;
    }
  }
  if (tracked.empty()) return values;
  constexpr int kPoints = 8;
  Sampling sampling;
  for (std::size_t i = 0; i < steps.times.size(); ++i) {
    for (int j = 0; j < kPoints; ++j) sampling.times.push_back(steps.times[i] + j * steps.sizes[i] / kPoints);
  }
  sampling.times.push_back(settings.end_time);
  sampling.observe = [&](std::size_t, const StatePoint& at) {
    for (Tracked& t : tracked) t.peak.add(at.t, t.sign * t.x->value(at));
  };
  // CVODES takes its own steps again.
  const RunOptions options{is_cvodes(settings.integrator.type) ? nullptr : &steps, progress};
  if (!simulate(mechanism, settings, {}, sampling, options).ok()) return values;
  sampling.times.clear();
  for (const Tracked& t : tracked) t.peak.add_places(sampling.times);
  std::sort(sampling.times.begin(), sampling.times.end());
  if (!sampling.times.empty() && !simulate(mechanism, settings, {}, sampling, options).ok()) return values;
  for (const Tracked& t : tracked) values[t.objective] = t.sign * t.peak.largest();
  return values;
}

}  // namespace mbsopt
