#include "optim/tradeoff/fit_errors.hpp"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <utility>

#include "optim/fit/unknown_parameters.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt {

using Eigen::Index;

class FitErrorMeasure::Runs {
 public:
  Runs(const Problem& problem, const std::vector<CsvTable>& data, std::function<bool()> interrupted)
      : scene_(problem.scene),
        spec_(*problem.identification),
        data_(data),
        interrupted_(std::move(interrupted)),
        unknowns_(unknowns_of_fit(scene_, spec_)),
        size_(static_cast<Index>(unknowns_.size())) {
    for (Index k = 0; k < size_.size(); ++k) {
      const Parameter& p = unknowns_[static_cast<std::size_t>(k)].description;
      size_(k) = typical_size(p, p.value);
    }
  }

  const SimulationSettings& own() const { return scene_.simulation; }

  Fit at(const SimulationSettings& settings) const {
    Fit fit;
    fit.gradient.setZero(size_.size());
    Scene scene = scene_;
    scene.simulation = settings;
    Experiment::Limits limits;
    limits.progress = [this](double) { return !(interrupted_ && interrupted_()); };
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e) {
      if (spec_.experiments[e].validate) continue;
      const Experiment experiment(scene, spec_.experiments[e], place_of(spec_, e), data_[e], parameter_values(scene),
                                  unknowns_in(scene, spec_, e, unknowns_));
      const Experiment::Residuals r = experiment.residuals(start_of(unknowns_), limits);
      if (!r.ok) {
        fit.message = fmt::format("{}: {}", spec_.experiments[e].name, r.message);
        return fit;
      }
      fit.cost += 0.5 * r.z.squaredNorm();
      fit.gradient += r.z_u.transpose() * r.z;
    }
    return fit;
  }

  FitErrors::Apart apart(const Fit& fit, const Fit& right) const {
    const auto relative = [](double change, double whole) { return whole > 0 ? change / whole : change; };
    return {relative(std::abs(fit.cost - right.cost), std::abs(right.cost)),
            relative((fit.gradient - right.gradient).cwiseProduct(size_).norm(),
                     right.gradient.cwiseProduct(size_).norm())};
  }

 private:
  const Scene& scene_;
  const IdentificationSpec& spec_;
  const std::vector<CsvTable>& data_;
  const std::function<bool()> interrupted_;
  std::vector<UnknownParameter> unknowns_;
  Eigen::VectorXd size_;
};

FitErrorMeasure::FitErrorMeasure(const Problem& problem, const std::vector<CsvTable>& data,
                                 std::function<bool()> interrupted) {
  try {
    runs_ = std::make_unique<const Runs>(problem, data, std::move(interrupted));
    find_right();
  } catch (const std::exception& error) {
    right_.message = error.what();
  }
}

FitErrorMeasure::~FitErrorMeasure() = default;

void FitErrorMeasure::find_right() {
  const SimulationSettings& own = runs_->own();
  const auto tight = [&](const char* integrator, double rtol, double max_step) {
    SimulationSettings s = with_tolerance(own, integrator, rtol);
    s.formulation = constrained(s.formulation);
    s.integrator.max_step = max_step;
    return s;
  };
  constexpr double kSame = 1e-9, kShorter = 3, kShortest = 1e-4;  // steps: of the run
  for (double part = 1e-2; part > kShortest; part /= kShorter) {
    const double max_step = part * (own.end_time - own.start_time);
    Fit first = runs_->at(tight("dopri853", 1e-12, max_step));
    const Fit second = runs_->at(tight("gauss6", 1e-11, max_step));
    const bool have_one = right_.gradient.size() > 0;
    if (!first.ok() || !second.ok()) {
      if (!have_one) right_.message = first.ok() ? second.message : first.message;
      break;
    }
    const FitErrors::Apart certificate = runs_->apart(second, first);
    if (have_one && !(certificate.cost + certificate.gradient < certificate_.cost + certificate_.gradient)) break;
    right_ = std::move(first), certificate_ = certificate;
    if (certificate.largest() < kSame) break;
  }
}

FitErrors FitErrorMeasure::found() const { return {right_.message, right_.cost, certificate_, {}}; }

FitErrors::Setting FitErrorMeasure::at(const NamedSettings& named) const {
  FitErrors::Setting setting{named.name, {}, {}};
  try {
    const Fit fit = runs_->at(named.simulation);
    setting.message = fit.message;
    if (fit.ok()) setting.error = runs_->apart(fit, right_);
  } catch (const std::exception& error) {
    setting.message = error.what();
  }
  return setting;
}

FitErrors measure_fit_errors(const Problem& problem, const std::vector<CsvTable>& data,
                             const std::vector<NamedSettings>& settings, const std::function<bool()>& interrupted) {
  const FitErrorMeasure measure(problem, data, interrupted);
  FitErrors errors = measure.found();
  for (const NamedSettings& named : settings)
    if (errors.ok()) errors.settings.push_back(measure.at(named));
  return errors;
}

}  // namespace mbsopt
