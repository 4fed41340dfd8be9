#include "optim/fit/parameter_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"
#include "optim/fit/profile_likelihood.hpp"

namespace mbsopt {

std::vector<Eigen::Index> profiled_unknowns(const std::vector<std::string>& profiles,
                                            const std::vector<std::string>& names) {
  std::vector<Eigen::Index> indices;
  for (const std::string& name : profiles) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      throw std::invalid_argument(fmt::format("--profile: '{}' is not fitted{}; fitted are {}", name,
                                              did_you_mean(name, names), joined(names)));
    indices.push_back(found - names.begin());
  }
  return indices;
}

ParameterProfile profile_of(FitContext& fit, ExperimentStack& stack, Eigen::Index k, const Eigen::VectorXd& x) {
  const FitStatistics& s = fit.result.statistics;
  ProfileOptions options;
  options.variable = k;
  // If the linear model gives no standard error, the first step is a hundredth of the variable.
  const double std_error = s.std_error(k) / std::abs(stack.scaling().rho_x(x)(k));
  const bool sensible = std::isfinite(std_error) && std_error > 0;
  options.first_step = sensible ? 0.5 * std_error : 0.01 * std::max(1.0, std::abs(x(k)));
  // Correlated residuals: Chandler and Bate, Biometrika 94 (2007) 167, equation 6.
  options.likelihood_scale = s.likelihood_scale * s.inflation(k), options.quantile = s.quantile;
  options.solver = solver_options(fit);
  ParameterProfile profile{fit.result.parameters[static_cast<std::size_t>(k)].name, {}, {}, {}, "", ""};
  if (!(s.likelihood_scale > 0) || !std::isfinite(s.likelihood_scale) || !std::isfinite(s.quantile)) {
    profile.below = profile.above = "the residuals have no variance to measure it by";
    return profile;
  }
  const auto value_at = [&](double x_k) {
    Eigen::VectorXd at = x;
    at(k) = x_k;
    return stack.scaling().to_rho(at)(k);
  };
  options.progress = [&](const ProfilePoint& p) {
    if (fit.abandoned) return false;
    const bool go_on =
        !fit.options.profile_progress || fit.options.profile_progress(profile.name, value_at(p.x), p.tau);
    fit.abandoned = !go_on;
    return go_on;
  };
  const Profile found = profile_likelihood(stack, x, options);
  for (const ProfilePoint& p : found.points)
    profile.points.push_back({value_at(p.x), p.cost, p.tau, stack.scaling().to_rho(p.variables)});
  if (found.lower) profile.lower = value_at(*found.lower);
  if (found.upper) profile.upper = value_at(*found.upper);
  profile.below = found.below, profile.above = found.above;
  return profile;
}

}  // namespace mbsopt
