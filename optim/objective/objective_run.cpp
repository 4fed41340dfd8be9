#include "optim/objective/objective_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/cvodes/cvodes.hpp"
#include "core/run/output_times.hpp"

namespace mbsopt::inline optim {
namespace {

// The largest of successive values, and places where the value may be larger. Tops of parabolas through each three
// values whose middle is highest are such places: between few points the value may be anything.
class Peak {
 public:
  void add(double t, double x) {
    largest_ = std::max(largest_, x);
    t_[0] = t_[1];
    t_[1] = t_[2];
    t_[2] = t;
    x_[0] = x_[1];
    x_[1] = x_[2];
    x_[2] = x;
    if (++count_ < 3 || x_[1] < x_[0] || x_[1] < x_[2]) return;
    // x = x1 + b s + c s^2,  s = t - t1
    const double s0 = t_[0] - t_[1], s2 = t_[2] - t_[1];
    if (!(s0 < 0 && s2 > 0)) return;
    const double d0 = (x_[0] - x_[1]) / s0, d2 = (x_[2] - x_[1]) / s2;
    const double c = (d2 - d0) / (s2 - s0), b = d0 - c * s0;
    if (!(c < 0)) return;
    const double rise = kRise * (x_[1] - std::min(x_[0], x_[2]));
    tops_.push_back({t_[0], t_[1] - b / (2 * c), t_[2], x_[1] - b * b / (4 * c), x_[1] + rise, t_[1]});
  }
  double largest() const { return largest_; }
  void add_places(std::vector<double>& times) const {
    for (const Top& top : tops_)
      if (top.x > largest_) times.push_back(top.t);
  }
  // Takes the brackets of tops that may exceed the largest value by the part rtol of it, and halves their sides.
  void refine(double rtol, std::vector<double>& times) {
    for (const Top& top : tops_) {
      if (!(std::max(top.x, top.bound) > largest_ + rtol * std::abs(largest_))) continue;
      for (const double t : {top.t0, (top.t0 + top.t1) / 2, top.t1, (top.t1 + top.t2) / 2, top.t2, top.t})
        times.push_back(t);
    }
    tops_.clear();
    count_ = 0;
  }

 private:
  // A peak that three values do not resolve may rise above the middle one by a multiple of the rise to it.
  static constexpr double kRise = 4;
  struct Top {
    double t0, t, t2, x, bound, t1;
  };
  double largest_ = -std::numeric_limits<double>::infinity();
  double t_[3] = {}, x_[3] = {};
  int count_ = 0;
  std::vector<Top> tops_;
};

// The integral of one part of an objective.
struct Integral {
  const Objective* objective;
  Eigen::Index row;  // of the objective
  ObjectivePart part;
  double x0 = 0;
};

std::vector<Integral> integrals_of(const std::vector<Objective>& objectives) {
  std::vector<Integral> integrals;
  for (std::size_t i = 0; i < objectives.size(); ++i)
    if (objectives[i].needs_simulation())
      for (const ObjectivePart& part : objectives[i].parts())
        integrals.push_back({&objectives[i], static_cast<Eigen::Index>(i), part});
  return integrals;
}

// The extreme of each objective's expression on the side of its part. There is none for side 0, or if the run fails.
std::vector<std::optional<double>> extremes_of(const std::vector<Integral>& integrals, const Mechanism& mechanism,
                                               const SimulationSettings& settings, const StepSequence& steps,
                                               const std::function<bool(double t)>& progress) {
  std::vector<std::optional<double>> values(integrals.size());
  struct Tracked {
    std::size_t index;
    double side;
    std::shared_ptr<const PointCost> x;
    Peak peak;
  };
  std::vector<Tracked> tracked;
  for (std::size_t i = 0; i < integrals.size(); ++i)
    if (const int side = integrals[i].part.side; side != 0)
      tracked.push_back({i, static_cast<double>(side), integrals[i].objective->expression(mechanism), {}});
  if (tracked.empty()) return values;
  Sampling sampling;
  sampling.times = output_times(settings);  // no row of a trajectory exceeds a true extreme
  for (std::size_t i = 0; i < steps.times.size(); ++i) {
    const double points = std::max(8.0, std::ceil(steps.sizes[i] / settings.integrator.max_step.value_or(INFINITY)));
    for (double j = 0; j < points; ++j) sampling.times.push_back(steps.times[i] + j * steps.sizes[i] / points);
  }
  sampling.observe = [&](std::size_t, const StatePoint& at) {
    for (Tracked& t : tracked) t.peak.add(at.t, t.side * t.x->value(at));
  };
  // CVODES takes its own steps again.
  const RunOptions options{is_cvodes(settings.integrator.type) ? nullptr : &steps, progress};
  // Integrated runs have dense output that their steps resolve. Solved ones may have narrow peaks: their brackets are
  // halved as often as a hundredth of the run needs for 1e-4 of itself.
  constexpr int kHalvings = 14;
  for (int halvings = 0;; ++halvings) {
    std::sort(sampling.times.begin(), sampling.times.end());
    sampling.times.erase(std::unique(sampling.times.begin(), sampling.times.end()), sampling.times.end());
    const SimulationResult run = simulate(mechanism, settings, {}, sampling, options);
    if (!run.ok()) return values;
    sampling.times.clear();
    const bool last = halvings == (run.statistics.solved ? kHalvings : 1);
    for (Tracked& t : tracked) {
      if (last) continue;
      run.statistics.solved ? t.peak.refine(settings.integrator.rtol, sampling.times)
                            : t.peak.add_places(sampling.times);
    }
    if (sampling.times.empty()) break;
  }
  for (const Tracked& t : tracked) values[t.index] = t.side * t.peak.largest();
  return values;
}

// Whether the exponentials of smooth extremes stayed in the range of numbers.
bool in_range(const std::vector<Integral>& integrals, const Eigen::VectorXd& values) {
  constexpr double kSmall = 1e-250, kLarge = 1e250;  // the range of exp and its sums, with room for factors
  for (std::size_t k = 0; k < integrals.size(); ++k) {
    const double I = std::abs(values(static_cast<Eigen::Index>(k)));
    if (integrals[k].part.side != 0 && !(I > kSmall && I < kLarge)) return false;
  }
  return true;
}

}  // namespace

SimulationResult run_objectives(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                const SimulationSettings& settings,
                                const std::function<SimulationResult(std::span<const Cost>)>& sweep,
                                const std::function<bool(double t)>& progress) {
  std::vector<Integral> integrals = integrals_of(objectives);
  const auto costs = [&] {
    std::vector<Cost> all;
    for (const Integral& i : integrals) all.push_back(i.objective->cost(mechanism, i.part, i.x0, progress));
    return all;
  };
  SimulationResult result = sweep(costs());
  const bool complete =
      result.ok() || (result.status == SimulationStatus::not_finite && result.last_good_time >= settings.end_time);
  if (complete && !in_range(integrals, result.psi)) {
    const std::vector<std::optional<double>> extremes =
        extremes_of(integrals, mechanism, settings, result.steps, progress);
    for (std::size_t k = 0; k < integrals.size(); ++k) integrals[k].x0 = extremes[k].value_or(0);
    result = sweep(costs());
  }
  if (!result.ok()) return result;
  const Eigen::VectorXd I = result.psi;
  const Eigen::MatrixXd I_rho = result.psi_rho;
  result.psi.setZero(static_cast<Eigen::Index>(objectives.size()));
  if (I_rho.size() > 0) result.psi_rho.setZero(result.psi.size(), I_rho.cols());
  Eigen::Index k = 0;
  for (const auto& [objective, row, part, x0] : integrals) {
    const Derivatives mean = objective->of_integral(I(k), part, x0);
    if (part.side != 0 && !std::isfinite(mean.value)) {
      result.status = SimulationStatus::not_finite;
      result.message = fmt::format(
          "the steps do not resolve the peaks of objective '{}', whose exponentials integrate to {:.3g}: give it less "
          "sharpness, or set simulation.integrator.max_step",
          objective->name(), I(k));
      return result;
    }
    result.psi(row) += part.factor * mean.value;
    if (I_rho.size() > 0) result.psi_rho.row(row) += part.factor * mean.first * I_rho.row(k);
    ++k;
  }
  return result;
}

std::vector<std::optional<double>> true_extremes(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                                 const SimulationSettings& settings, const StepSequence& steps,
                                                 const std::function<bool(double t)>& progress) {
  const std::vector<Integral> integrals = integrals_of(objectives);
  const std::vector<std::optional<double>> extremes = extremes_of(integrals, mechanism, settings, steps, progress);
  std::vector<std::optional<double>> values(objectives.size());
  for (std::size_t k = 0; k < integrals.size(); ++k) {
    std::optional<double>& value = values[static_cast<std::size_t>(integrals[k].row)];
    if (extremes[k]) value = value.value_or(0) + integrals[k].part.factor * *extremes[k];
  }
  return values;
}

std::vector<std::string> missed_peaks(const std::vector<Objective>& objectives, const Eigen::VectorXd& psi,
                                      const std::vector<std::optional<double>>& true_values) {
  constexpr double kShortest = 25;  // d: a peak of 1e-11 of the run is none
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    if (!true_values[i]) continue;
    const double value = psi(static_cast<Eigen::Index>(i)), k = std::abs(objectives[i].exponent({1}));
    if (!(k * std::abs(*true_values[i] - value) > kShortest)) continue;
    sentences.push_back(fmt::format(
        "the value of objective '{}', {:.6g}, and its gradient leave out a peak: the true extreme is {:.6g}. The "
        "instants at which the run is looked at pass over it: set simulation.integrator.max_step to a part of its "
        "duration",
        objectives[i].name(), value, *true_values[i]));
  }
  return sentences;
}

}  // namespace mbsopt::inline optim
