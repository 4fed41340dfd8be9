#include "optim/objective/objective_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/objective/peaks.hpp"

namespace mbsopt::inline optim {
namespace {

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
  std::vector<Watched> watched;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < integrals.size(); ++i)
    if (const int side = integrals[i].part.side; side != 0) {
      watched.push_back({side, integrals[i].objective->expression(mechanism)});
      of.push_back(i);
    }
  const std::vector<std::vector<Peak>> found = peaks(watched, mechanism, settings, steps, progress);
  for (std::size_t k = 0; k < found.size(); ++k) values[of[k]] = found[k].front().value;
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
