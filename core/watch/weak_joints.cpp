#include "core/watch/weak_joints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
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

std::string PenaltyWatch::look_at(const SeenStep& seen) {
  const Step& step = *seen.stages;
  const StateLayout layout{data_.n};
  double projected = 0, moved = 0, mass = 0;
  for (int i = 1; i <= data_.n; ++i) {
    const BodyData& b = data_.bodies[static_cast<std::size_t>(i)];
    const Vector4d p = step.y1.segment<4>(layout.p(i));
    const auto energy_norm = [&](const Eigen::VectorXd& from) {
      const Vector3d r = step.y1.segment<3>(layout.v(i)) - from.segment<3>(layout.v(i));
      const Vector3d omega = omega_B(p, step.y1.segment<4>(layout.pdot(i)) - from.segment<4>(layout.pdot(i)));
      return b.mass * r.squaredNorm() + omega.dot(b.J * omega);
    };
    projected += energy_norm(step.y_hat);
    moved += energy_norm(step.y0);
    mass += b.mass;
  }
  projected_ += std::sqrt(projected);
  moved_ += std::sqrt(moved) + step.h * data_.gravity.norm() * std::sqrt(mass);
  return {};
}

}  // namespace mbsopt
