#include "core/watch/weak_joints.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/dynamics/spatial_dynamics.hpp"

namespace mbsopt {

using Eigen::VectorXd;

double error_of_weak_joints(const Mechanism& mechanism, const FormulationSettings& settings, double worst_residual,
                            double t, const VectorXd& y, const VectorXd& angles) {
  constexpr double kRounding = 10;  // times the tolerance
  if (settings.type != FormulationType::augmented_lagrangian || !(worst_residual > kRounding * settings.tolerance)) {
    return 0;
  }
  constexpr double kLarger = 1e4;  // up to 1e12 of the default: beyond, rounding shows (docs/formulations.md)
  FormulationSettings larger = settings;
  larger.alpha *= kLarger;
  VectorXd ydot(y.size()), firm(y.size());
  if (!SpatialDynamics(mechanism, settings).evaluate(t, y, angles, ydot)) return 0;
  if (!SpatialDynamics(mechanism, larger).evaluate(t, y, angles, firm)) return 0;
  const Eigen::Index half = y.size() / 2;
  const double size = std::max({ydot.tail(half).lpNorm<Eigen::Infinity>(), firm.tail(half).lpNorm<Eigen::Infinity>(),
                                mechanism.data().gravity.norm()});
  return size > 0 ? (ydot - firm).tail(half).lpNorm<Eigen::Infinity>() / size : 0;
}

void add_residuals(const Mechanism& mechanism, const FormulationSettings& settings, double worst_residual,
                   const StatePoint& end, SimulationStatistics& s) {
  s.weak_joints_error = error_of_weak_joints(mechanism, settings, worst_residual, end.t, end.y, end.angles);
  s.max_acceleration_residual = std::max({s.max_acceleration_residual, worst_residual, s.weak_joints_error});
}

std::string weak_joints_objection(double error) {
  constexpr double kRough = 1e-2;
  if (!(error > kRough)) return {};
  return fmt::format(
      "the accelerations there have a relative error of {:.1e}, since joints lock only by a small angle between their "
      "axes, or the position is nearly singular. Make the axes exactly parallel, or raise "
      "simulation.formulation.alpha (relative; 1e8 is the default, 1e12 holds angles of 1e-6)",
      error);
}

}  // namespace mbsopt
