#include "optim/tradeoff/fit_errors.hpp"

#include <cmath>
#include <exception>
#include <utility>

#include "optim/fit/fit_context.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt::inline optim {
namespace {

double relative(double change, double whole) { return whole > 0 ? change / whole : change; }

}  // namespace

FitErrors::FitErrors(const Problem& problem, const std::vector<CsvTable>& data, std::function<bool()> interrupted)
    : problem_(problem), data_(data), interrupted_(std::move(interrupted)) {
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
    const bool have_one = right_.gradient.size() > 0;
    const Fit first = std::exchange(right_, fit(tight("dopri853", 1e-12, max_step)));
    Error certificate{right_.message};
    if (right_.message.empty()) certificate = at(tight("gauss6", 1e-11, max_step));
    const double apart = certificate.cost + certificate.gradient;
    if (have_one && !(certificate.ok() && apart < certificate_.cost + certificate_.gradient)) {
      right_ = first;
      break;
    }
    certificate_ = std::move(certificate);
    if (!certificate_.ok() || certificate_.largest() < kSame) break;
  }
}

FitErrors::Fit FitErrors::fit(const SimulationSettings& settings) const {
  Scene scene = problem_.scene;
  scene.simulation = settings;
  try {
    const IdentificationOptions options;
    ExperimentStack stack = fitted_stack({scene, *problem_.identification, data_, options,
                                          [this](double) { return !(interrupted_ && interrupted_()); }});
    const Eigen::VectorXd x = stack.start();
    const LeastSquaresPoint point = stack.at(x);
    if (!point.ok) return {point.message};
    const Eigen::VectorXd z = point.z.head(stack.samples());
    Fit found{{}, 0.5 * z.squaredNorm(), stack.z_rho(point, x).topRows(z.size()).transpose() * z};
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const Parameter& p = stack.unknowns()[static_cast<std::size_t>(k)].description;
      found.gradient(k) *= typical_size(p, p.value);
    }
    return found;
  } catch (const std::exception& error) {
    return {error.what()};
  }
}

FitErrors::Error FitErrors::at(const SimulationSettings& settings) const {
  const Fit found = fit(settings);
  if (!found.message.empty()) return {found.message};
  return {{},
          relative(std::abs(found.cost - right_.cost), std::abs(right_.cost)),
          relative((found.gradient - right_.gradient).norm(), right_.gradient.norm())};
}

}  // namespace mbsopt::inline optim
