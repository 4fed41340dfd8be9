#include "core/watch/penalty_watch.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

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

void PenaltyWatch::add_to(SimulationStatistics& s) {
  if (moved_ > 0) s.max_acceleration_residual = std::max(s.max_acceleration_residual, projected_ / moved_);
}

}  // namespace mbsopt
