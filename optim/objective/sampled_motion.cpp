#include "optim/objective/sampled_motion.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/state_point.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;

std::vector<double> sample_times(const SimulationSettings& settings, int count) {
  std::vector<double> times;
  const double span = settings.end_time - settings.start_time;
  for (int i = 1; i < count; ++i) times.push_back(settings.start_time + span * i / count);
  times.push_back(settings.end_time);
  return times;
}

Sampling record_motion(const Mechanism& mechanism, SampledMotion& motion) {
  const Index count = static_cast<Index>(motion.times.size());
  motion.states.setZero(mechanism.states(), count);
  motion.angles.setZero(static_cast<Index>(mechanism.data().angles.size()), count);
  motion.sensors.setZero(mechanism.sensors(), count);
  Sampling sampling;
  sampling.times = motion.times;
  sampling.observe = [&mechanism, &motion](std::size_t index, const StatePoint& at) {
    const Index i = static_cast<Index>(index);
    motion.states.col(i) = at.y;
    if (motion.angles.rows() > 0) motion.angles.col(i) = at.angles;
    for (int s = 0; s < mechanism.sensors(); ++s) motion.sensors(s, i) = mechanism.sensor_value(s, at);
  };
  return sampling;
}

MotionDistance::MotionDistance(const Mechanism& mechanism) {
  const MechanismData& data = mechanism.data();
  for (int i = 1; i <= data.n; ++i) {
    const BodyData& b = data.bodies[static_cast<std::size_t>(i)];
    bodies_.push_back({b.mass, 0.5 * b.J.trace() * Matrix3d::Identity() - b.J});
    total_ += b.mass;
  }
  if (total_ > 0) return;
  for (Body& b : bodies_) b.mass = 1;
  total_ = std::max(1.0, static_cast<double>(bodies_.size()));
}

double MotionDistance::between(const Eigen::Ref<const Eigen::VectorXd>& y1,
                               const Eigen::Ref<const Eigen::VectorXd>& y2) const {
  const StateLayout layout = StateLayout::of(y1);
  double sum = 0;
  int body = 0;
  for (const Body& b : bodies_) {
    ++body;
    const Vector4d p1 = y1.segment<4>(layout.p(body)), p2 = y2.segment<4>(layout.p(body));
    const Matrix3d D = A(p1) - A(p2);
    sum += b.mass * (y1.segment<3>(layout.q(body)) - y2.segment<3>(layout.q(body))).squaredNorm();
    sum += std::max(0.0, (D * b.P * D.transpose()).trace());
  }
  return std::sqrt(sum / total_);
}

double MotionDistance::between(const SampledMotion& one, const SampledMotion& other) const {
  double largest = 0;
  for (Index i = 0; i < one.states.cols(); ++i) {
    const double here = between(one.states.col(i), other.states.col(i));
    if (!std::isfinite(here)) return here;
    largest = std::max(largest, here);
  }
  return largest;
}

double MotionDistance::extent(const SampledMotion& motion, const Eigen::VectorXd& y0) const {
  double largest = 0;
  for (Index i = 0; i < motion.states.cols(); ++i) largest = std::max(largest, between(motion.states.col(i), y0));
  return largest;
}

}  // namespace mbsopt::inline optim
