#include "optim/fit_errors.hpp"

#include <fmt/format.h>

#include <cmath>
#include <exception>

#include "optim/parameter_values.hpp"
#include "optim/tradeoff_reference.hpp"
#include "optim/unknown_parameters.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;

struct Fit {
  std::string message;  // why there is none
  double cost = 0;
  Eigen::VectorXd gradient;
  bool ok() const { return message.empty(); }
};

class FitRuns {
 public:
  FitRuns(const Problem& problem, const std::vector<CsvTable>& data, const std::function<bool()>& interrupted)
      : scene_(problem.scene),
        spec_(*problem.identification),
        data_(data),
        interrupted_(interrupted),
        unknowns_(unknowns_of_fit(scene_, spec_)),
        size_(static_cast<Index>(unknowns_.size())) {
    for (Index k = 0; k < size_.size(); ++k) {
      const Parameter& p = unknowns_[static_cast<std::size_t>(k)].description;
      size_(k) = typical_size(p, p.value);
    }
  }

  Fit at(const SimulationSettings& settings) const {
    Fit fit;
    fit.gradient.setZero(size_.size());
    Scene scene = scene_;
    scene.simulation = settings;
    Experiment::Limits limits;
    limits.progress = [this](double) { return !(interrupted_ && interrupted_()); };
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e) {
      if (spec_.experiments[e].validate) continue;
      const Experiment experiment(scene, spec_.experiments[e], fmt::format("identification.experiments[{}]", e),
                                  data_[e], parameter_values(scene), unknowns_in(scene, spec_, e, unknowns_));
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
  const std::function<bool()>& interrupted_;
  std::vector<UnknownParameter> unknowns_;
  Eigen::VectorXd size_;
};

}  // namespace

FitErrors measure_fit_errors(const Problem& problem, const std::vector<CsvTable>& data,
                             const std::vector<NamedSettings>& settings, const std::function<bool()>& interrupted) {
  FitErrors errors;
  try {
    const FitRuns runs(problem, data, interrupted);
    const SimulationSettings& own = problem.scene.simulation;
    const auto tight = [&](const char* integrator, double rtol, double max_step) {
      SimulationSettings s = with_tolerance(own, integrator, rtol);
      s.formulation = constrained(s.formulation);
      s.integrator.max_step = max_step;
      return s;
    };
    constexpr double kSame = 1e-9, kShorter = 3, kShortest = 1e-4;  // steps: of the run
    Fit right;
    for (double part = 1e-2; part > kShortest; part /= kShorter) {
      const double max_step = part * (own.end_time - own.start_time);
      Fit first = runs.at(tight("dopri853", 1e-12, max_step));
      const Fit second = runs.at(tight("gauss6", 1e-11, max_step));
      if (!first.ok() || !second.ok()) {
        if (right.gradient.size() == 0) errors.message = first.ok() ? second.message : first.message;
        break;
      }
      const FitErrors::Apart certificate = runs.apart(second, first);
      const bool nearer =
          certificate.cost + certificate.gradient < errors.certificate.cost + errors.certificate.gradient;
      if (right.gradient.size() > 0 && !nearer) break;
      right = std::move(first), errors.certificate = certificate;
      if (certificate.cost < kSame && certificate.gradient < kSame) break;
    }
    errors.cost = right.cost;
    if (!errors.ok()) return errors;
    for (const NamedSettings& s : settings) {
      FitErrors::Setting& found = errors.settings.emplace_back();
      found.name = s.name;
      const Fit fit = runs.at(s.simulation);
      found.message = fit.message;
      if (fit.ok()) found.error = runs.apart(fit, right);
    }
  } catch (const std::exception& error) {
    errors.message = error.what();
  }
  return errors;
}

}  // namespace mbsopt
