#include "core/cvodes/cvodes_flow.hpp"

#include <algorithm>
#include <limits>

#include "core/mechanism/followed_angles.hpp"

namespace mbsopt::cvodes {

Flow::Flow(const Mechanism& mechanism, const FormulationSettings& settings)
    : mechanism_(mechanism), dynamics_(mechanism, settings), t_(std::numeric_limits<double>::quiet_NaN()) {
  if (mechanism.data().needs_motion) motion_.emplace(mechanism, settings);
  for (Eigen::VectorXd* x : {&y_, &ydot_, &y_point_}) x->setZero(mechanism.states());
}

void Flow::start(double t, const Eigen::VectorXd& angles) {
  times_.assign(1, t);
  angles_.assign(1, angles);
}

void Flow::accept(double t, const Eigen::VectorXd& y) {
  if (data().angles.empty()) return;
  Eigen::VectorXd next = angles_.back();
  continue_angles(data(), y, next);
  times_.push_back(t);
  angles_.push_back(std::move(next));
}

const Eigen::VectorXd& Flow::angles_at(double t) const {
  const auto after = std::lower_bound(times_.begin(), times_.end(), t);
  const auto index = after == times_.begin() ? 0 : after - times_.begin() - 1;
  return angles_[static_cast<std::size_t>(index)];
}

std::size_t Flow::history_bytes() const {
  return times_.size() * (sizeof(double) + sizeof(Eigen::VectorXd) + sizeof(double) * data().angles.size());
}

bool Flow::evaluate(double t, const Numbers& y) {
  if (t == t_ && y == y_) return solved_;
  t_ = t;
  y_ = y;
  linearised_ = false;
  ++evaluations_;
  solved_ = dynamics_.evaluate(t, y_, angles_at(t), ydot_);
  return solved_;
}

bool Flow::linearise(double t, const Numbers& y) {
  if (!evaluate(t, y)) return false;
  if (!linearised_) dynamics().linearise_here();
  linearised_ = true;
  return true;
}

StatePoint Flow::point(double t, const Numbers& y) {
  y_point_ = y;
  return {t, y_point_, angles_at(t), motion()};
}

}  // namespace mbsopt::cvodes
