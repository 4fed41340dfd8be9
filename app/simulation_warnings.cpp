#include "app/simulation_warnings.hpp"

#include <fmt/format.h>

namespace mbsopt {
namespace {

constexpr double kApart = 1e-3;            // [m, -]
constexpr double kUnmet = 1e-6;            // of the accelerations of the constraints
constexpr double kLargePenalty = 3e10;     // above it rounding by Cholesky passes 1e-5 of the accelerations
constexpr double kDigitsPerAlpha = 1e-16;  // docs/formulations.md, measured

}  // namespace

std::vector<std::string> simulation_warnings(const SimulationSettings& settings,
                                             const SimulationStatistics& statistics) {
  std::vector<std::string> warnings;
  const FormulationSettings& f = settings.formulation;
  const bool penalty = f.type == FormulationType::penalty;
  if (penalty && f.linear_solver == LinearSolver::cholesky && f.alpha > kLargePenalty) {
    warnings.push_back(
        fmt::format("simulation.formulation: penalty with alpha {:.3g} by cholesky leaves the accelerations with "
                    "relative errors of "
                    "about {:.0e}, from rounding; \"linear_solver\": \"quasidefinite\" has none of them",
                    f.alpha, 10 * kDigitsPerAlpha * f.alpha));
  }
  if (statistics.max_position_violation > kApart) {
    warnings.push_back(fmt::format(
        "the joints came apart: their equations are violated by up to {:.2g} [m, -]. {}",
        statistics.max_position_violation,
        penalty ? fmt::format("simulation.formulation.alpha is {:.3g}: raise it, it has to be large against the forces "
                              "in the joints over the violation that is allowed; or leave the formulation out, the "
                              "default has no such error",
                              f.alpha)
                : std::string("Tighten rtol and atol, or let simulation.formulation.projection be position_velocity")));
  }
  if (statistics.max_acceleration_residual > kUnmet) {
    warnings.push_back(
        fmt::format("the constraints' accelerations were met to {:.1e} only, so that digits, or the branch after a "
                    "singular position, "
                    "may be wrong: steps that come too close to a singular position (take a Runge-Kutta method, fewer "
                    "steps by larger "
                    "rtol and atol, and compare), or masses that differ too much for simulation.formulation (a larger "
                    "alpha or more "
                    "iterations)",
                    statistics.max_acceleration_residual));
  }
  return warnings;
}

}  // namespace mbsopt
