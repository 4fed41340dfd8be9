#include "optim/objective/objective_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/cvodes/cvodes.hpp"
#include "core/driven/driven_simulation.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using Sweep = std::function<SimulationResult(std::span<const Cost>)>;
using Progress = std::function<bool(double t)>;

// The parts of the objectives that need a simulation.
std::vector<ObjectiveMean> means_of(const std::vector<Objective>& objectives, bool extremes, bool others) {
  std::vector<ObjectiveMean> means;
  for (std::size_t i = 0; i < objectives.size(); ++i)
    if (objectives[i].needs_simulation() && (objectives[i].is_extreme() ? extremes : others))
      for (const ObjectivePart& part : objectives[i].parts())
        means.push_back({&objectives[i], static_cast<Index>(i), part});
  return means;
}

std::vector<Watched> watched_in(const std::vector<ObjectiveMean>& extremes, const Mechanism& mechanism) {
  std::vector<Watched> watched;
  for (const auto& [objective, row, part, x0] : extremes)
    watched.push_back({part.side, objective->expression(mechanism)});
  return watched;
}

// Sets x0 of each smooth extreme to the true one, or to 0 if the run fails.
void set_x0(std::vector<ObjectiveMean>& means, const Mechanism& mechanism, const SimulationSettings& settings,
            const StepSequence& steps, const Progress& progress) {
  std::vector<ObjectiveMean> extremes;
  std::ranges::copy_if(means, std::back_inserter(extremes), [](const ObjectiveMean& m) { return m.part.side != 0; });
  const std::vector<std::vector<Peak>> found =
      peaks(watched_in(extremes, mechanism), mechanism, settings, steps, progress);
  std::size_t k = 0;
  for (ObjectiveMean& mean : means) mean.x0 = mean.part.side != 0 && k < found.size() ? found[k++].front().value : 0;
}

// Whether the exponentials of smooth extremes stayed in the range of numbers.
bool in_range(const std::vector<ObjectiveMean>& means, const VectorXd& values) {
  constexpr double kSmall = 1e-250, kLarge = 1e250;  // the range of exp and its sums, with room for factors
  for (std::size_t k = 0; k < means.size(); ++k) {
    const double I = std::abs(values(static_cast<Index>(k)));
    if (means[k].part.side != 0 && !(I > kSmall && I < kLarge)) return false;
  }
  return true;
}

// Makes extremes softer whose exponentials the steps do not resolve, unless the file gives their sharpness. Of large
// values the default is far too much. Returns whether there is one.
bool soften(std::vector<ObjectiveMean>& means, const SimulationResult& run) {
  constexpr double kUnresolved = 0.3;  // of an exponential's integral: beyond it, there is a warning
  const bool unresolved = run.statistics.extreme_quadrature.error > kUnresolved;
  bool found = false;
  for (std::size_t k = 0; k < means.size(); ++k) {
    auto& [objective, row, part, x0] = means[k];
    const double size = std::abs(objective->exponent(part) * x0);
    if (part.side == 0 || objective->is_written_in_cpp() || objective->spec().sharpness) continue;
    const double value = objective->of_integral(run.psi(static_cast<Index>(k)), part, x0).value;
    if ((std::isfinite(value) && !unresolved) || !(size > ObjectiveSpec::kSharpness)) continue;
    part.softness = ObjectiveSpec::kSharpness / size;
    found = true;
  }
  return found;
}

std::vector<Cost> together(std::span<const Cost> costs, const std::vector<Cost>& others) {
  std::vector<Cost> all(costs.begin(), costs.end());
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

// A part of a cost.
struct Share final : PointCost {
  Share(std::shared_ptr<const PointCost> of, double part) : x(std::move(of)), factor(part) {}
  double value(const StatePoint& at) const override { return factor * x->value(at); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    return factor * x->add_gradient(at, factor * scale, y_bar, rho_bar);
  }
  bool reads_positions() const override { return x->reads_positions(); }
  std::shared_ptr<const PointCost> x;
  double factor;
};

// The pieces of one side. values: of each peak, from `first` on, which goes on to the next side.
std::vector<ExtremePiece> pieces_of(const ObjectiveMean& side, const std::vector<Peak>& peaks, const VectorXd& values,
                                    const MatrixXd& values_rho, Index& first) {
  const int sign = side.part.side;
  const double factor = side.part.factor;
  std::vector<ExtremePiece> found;
  for (const Peak& peak : peaks) {
    const double value = peak.apart > 0 ? peak.value : values(first);
    found.push_back({side.row, static_cast<int>(sign * factor), factor * value,
                     factor * values_rho.row(first).transpose(), peak.t});
    ++first;
  }
  return found;
}

// max a + max b is the largest of all a + b: the highest of these pairs.
std::vector<ExtremePiece> pairs_of(const std::vector<ExtremePiece>& some, const std::vector<ExtremePiece>& others) {
  const double apart = std::numbers::sqrt2;  // no two pairs of instants have the same sum then
  std::vector<ExtremePiece> pairs;
  for (const ExtremePiece& a : some)
    for (const ExtremePiece& b : others)
      pairs.push_back({a.row, a.side, a.value + b.value, a.gradient + b.gradient, a.t + apart * b.t});
  std::ranges::stable_sort(pairs, std::greater(), &ExtremePiece::value);
  pairs.resize(std::min(pairs.size(), 2 * kMostPeaks));
  return pairs;
}

}  // namespace

SimulationResult run_objectives(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                const SimulationSettings& settings, const Sweep& sweep, const Progress& progress,
                                bool smooth_extremes) {
  std::vector<ObjectiveMean> means = means_of(objectives, smooth_extremes, true);
  const auto costs = [&] {
    std::vector<Cost> all;
    for (const ObjectiveMean& m : means) all.push_back(m.objective->cost(mechanism, m.part, m.x0, progress));
    return all;
  };
  SimulationResult result = sweep(costs());
  const bool complete =
      result.ok() || (result.status == SimulationStatus::not_finite && result.last_good_time >= settings.end_time);
  if (complete && !in_range(means, result.psi)) {
    set_x0(means, mechanism, settings, result.steps, progress);
    result = sweep(costs());
    if (result.ok() && soften(means, result)) result = sweep(costs());
  }
  if (!result.ok()) return result;
  const VectorXd I = result.psi;
  const MatrixXd I_rho = result.psi_rho;
  result.psi.setZero(static_cast<Index>(objectives.size()));
  if (I_rho.size() > 0) result.psi_rho.setZero(result.psi.size(), I_rho.cols());
  Index k = 0;
  for (const auto& [objective, row, part, x0] : means) {
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

ExtremeRun::ExtremeRun(const std::vector<Objective>& objectives, const SimulationSettings& settings,
                       const RunOptions& options)
    : objectives_(objectives), settings_(settings), options_(options), sides_(means_of(objectives, true, false)) {}

bool ExtremeRun::find(const Mechanism& mechanism) {
  constexpr double kRtolOfShapes = 1e-4;  // panels that integrate a peak so well have nodes on both sides of it
  const std::vector<Watched> watched = watched_in(sides_, mechanism);
  std::vector<Cost> shapes;  // of the extremes, which panels of a solved run resolve
  for (std::size_t k = 0; k < sides_.size() && may_be_solved(mechanism, settings_); ++k) {
    Cost& shape = shapes.emplace_back();
    shape.name = sides_[k].objective->name();
    shape.running = watched[k].x;
    shape.rtol = kRtolOfShapes;
  }
  PeakWatch watch(watched, settings_);
  const auto simulated = [&](std::span<const Cost> costs) {
    ++simulations;
    return simulate(mechanism, settings_, together(costs, shapes), watch.sampling(), options_);
  };
  result = run_objectives(objectives_, mechanism, settings_, simulated, options_.progress, false);
  if (!result.ok()) return false;
  peaks_ = watch.peaks();
  for (std::size_t k = 0; k < sides_.size(); ++k)
    result.psi(sides_[k].row) += sides_[k].part.factor * peaks_[k].front().value;
  return true;
}

bool ExtremeRun::differentiate(const Mechanism& mechanism, bool backward, const std::vector<int>& variables) {
  RunOptions on_steps = options_;
  if (!is_cvodes(settings_.integrator.type)) on_steps.frozen = &result.steps;
  std::vector<Cost> tops;
  for (std::size_t k = 0; k < sides_.size(); ++k) {
    const std::shared_ptr<const PointCost> x = sides_[k].objective->expression(mechanism);
    for (const Peak& peak : peaks_[k]) {
      Cost& cost = tops.emplace_back();
      cost.name = sides_[k].objective->name();
      if (peak.apart == 0) {
        cost.samples.push_back({peak.t, x});
        continue;
      }
      cost.samples.push_back({peak.t - peak.apart, std::make_shared<Share>(x, 1 - peak.behind)});
      cost.samples.push_back({peak.t + peak.apart, std::make_shared<Share>(x, peak.behind)});
    }
  }
  VectorXd values;  // of the tops
  MatrixXd values_rho;
  const auto swept = [&](std::span<const Cost> costs) {
    ++simulations;
    const std::vector<Cost> all = together(costs, tops);
    SimulationResult r = backward ? simulate_adjoint(mechanism, settings_, all, on_steps)
                                  : simulate_tlm(mechanism, settings_, all, {}, on_steps);
    const Index n = static_cast<Index>(tops.size());
    if (r.ok()) values = r.psi.tail(n), values_rho = r.psi_rho.bottomRows(n)(Eigen::all, variables);
    return r;
  };
  const SimulationResult run = run_objectives(objectives_, mechanism, settings_, swept, options_.progress, false);
  result.status = run.status;
  result.message = run.message;
  if (!run.ok()) return false;
  result.statistics.jumps = run.statistics.jumps;
  result.statistics.gradient_quadrature = run.statistics.gradient_quadrature;
  result.psi = run.psi;
  result.psi_rho = run.psi_rho(Eigen::all, variables);
  set_extremes(values, values_rho);
  return true;
}

void ExtremeRun::set_extremes(const VectorXd& values, const MatrixXd& values_rho) {
  Index first = 0;
  for (std::size_t k = 0; k < sides_.size(); ++k) {
    const Index row = sides_[k].row;
    std::vector<ExtremePiece> found = pieces_of(sides_[k], peaks_[k], values, values_rho, first);
    if (k + 1 < sides_.size() && sides_[k + 1].row == row) {  // peak to peak
      ++k;
      found = pairs_of(found, pieces_of(sides_[k], peaks_[k], values, values_rho, first));
    }
    std::ranges::stable_sort(found, std::greater(), [](const ExtremePiece& p) { return p.side * p.value; });
    result.psi(row) = found.front().value;
    result.psi_rho.row(row) = found.front().gradient.transpose();
    std::ranges::move(found, std::back_inserter(pieces));
  }
}

std::vector<std::optional<double>> true_extremes(const std::vector<Objective>& objectives, const Mechanism& mechanism,
                                                 const SimulationSettings& settings, const StepSequence& steps,
                                                 const Progress& progress) {
  const std::vector<ObjectiveMean> sides = means_of(objectives, true, false);
  const std::vector<std::vector<Peak>> found =
      peaks(watched_in(sides, mechanism), mechanism, settings, steps, progress);
  std::vector<std::optional<double>> values(objectives.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    std::optional<double>& value = values[static_cast<std::size_t>(sides[k].row)];
    value = value.value_or(0) + sides[k].part.factor * found[k].front().value;
  }
  return values;
}

std::vector<std::string> missed_peaks(const std::vector<Objective>& objectives, const VectorXd& psi,
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
