#include "optim/tradeoff/fit_errors.hpp"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <utility>

#include "optim/problem/parameter_values.hpp"
#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;

FitErrors::FitErrors(const Problem& problem, const std::vector<CsvTable>& data, std::function<bool()> interrupted)
    : problem_(problem), data_(data), interrupted_(std::move(interrupted)) {
  try {
    unknowns_ = unknowns_of_fit(problem.scene, *problem.identification);
  } catch (const std::exception& error) {
    certificate_.message = error.what();
    return;
  }
  size_.resize(static_cast<Index>(unknowns_.size()));
  for (Index k = 0; k < size_.size(); ++k) {
    const Parameter& p = unknowns_[static_cast<std::size_t>(k)].description;
    size_(k) = typical_size(p, p.value);
  }
  find_right();
}

FitErrors::Fit FitErrors::fit(const SimulationSettings& settings) const {
  const IdentificationSpec& spec = *problem_.identification;
  Fit fit{{}, 0, Eigen::VectorXd::Zero(size_.size())};
  Scene scene = problem_.scene;
  scene.simulation = settings;
  Experiment::Limits limits;
  limits.progress = [this](double) { return !(interrupted_ && interrupted_()); };
  try {
    for (std::size_t e = 0; e < spec.experiments.size() && fit.message.empty(); ++e) {
      if (spec.experiments[e].validate) continue;
      const Experiment experiment(scene, spec.experiments[e], place_of(spec, e), data_[e], parameter_values(scene),
                                  unknowns_in(scene, spec, e, unknowns_));
      const Experiment::Residuals r = experiment.residuals(start_of(unknowns_), limits);
      if (!r.ok) return {fmt::format("{}: {}", spec.experiments[e].name, r.message)};
      fit.cost += 0.5 * r.z.squaredNorm();
      fit.gradient += r.z_u.transpose() * r.z;
    }
  } catch (const std::exception& error) {
    fit.message = error.what();
  }
  return fit;
}

FitErrors::Error FitErrors::apart(const Fit& fit, const Fit& right) const {
  const auto relative = [](double change, double whole) { return whole > 0 ? change / whole : change; };
  return {
      {},
      relative(std::abs(fit.cost - right.cost), std::abs(right.cost)),
      relative((fit.gradient - right.gradient).cwiseProduct(size_).norm(), right.gradient.cwiseProduct(size_).norm())};
}

void FitErrors::find_right() {
  const SimulationSettings& own = problem_.scene.simulation;
  const auto tight = [&](const char* integrator, double rtol, double max_step) {
    SimulationSettings s = with_tolerance(own, integrator, rtol);
    s.formulation = constrained(s.formulation);
    s.integrator.max_step = max_step;
    return s;
  };
  constexpr double kSame = 1e-9, kShorter = 3, kShortest = 1e-4;  // steps: of the run
  for (double part = 1e-2; part > kShortest; part /= kShorter) {
    const double max_step = part * (own.end_time - own.start_time);
    Fit first = fit(tight("dopri853", 1e-12, max_step));
    const Fit second = fit(tight("gauss6", 1e-11, max_step));
    const bool have_one = right_.gradient.size() > 0;
    if (!first.message.empty() || !second.message.empty()) {
      if (!have_one) certificate_.message = first.message.empty() ? second.message : first.message;
      break;
    }
    Error certificate = apart(second, first);
    if (have_one && !(certificate.cost + certificate.gradient < certificate_.cost + certificate_.gradient)) break;
    right_ = std::move(first), certificate_ = std::move(certificate);
    if (certificate_.largest() < kSame) break;
  }
}

FitErrors::Error FitErrors::at(const SimulationSettings& settings) const {
  const Fit found = fit(settings);
  return found.message.empty() ? apart(found, right_) : Error{found.message};
}

}  // namespace mbsopt::inline optim
