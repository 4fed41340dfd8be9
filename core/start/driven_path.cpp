#include "core/start/driven_path.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;

constexpr double kLargestTurn = 0.1;         // of an Euler parameter in one step
constexpr double kRelativeCorrection = 0.2;  // of the predictor, against h v
constexpr double kSmallCorrection = 1e-6;    // always accepted
constexpr double kViolation = 1e-9;          // of the mechanism's length, or of 1

}  // namespace

DrivenPath::DrivenPath(const Mechanism& mechanism, Model model)
    : mechanism_(mechanism),
      projector_(make_projector(mechanism, Projection::position_velocity, model, Free::nothing)) {
  y_hat_.setZero(mechanism.states()), y_next_.setZero(mechanism.states());
}

void DrivenPath::start(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  state_.t = t, state_.y = y, state_.angles = angles;
  state_.a.setZero(mechanism_.states() / 2);
}

void DrivenPath::improve(const Eigen::VectorXd& y) { state_.y = y; }

double DrivenPath::step_limit() const {
  double fastest = 0;
  const StateLayout layout{mechanism_.bodies()};
  for (int i = 1; i <= layout.n; ++i) {
    fastest = std::max(fastest, state_.y.segment<4>(layout.pdot(i)).lpNorm<Eigen::Infinity>());
  }
  return fastest > 0 ? kLargestTurn / fastest : INFINITY;
}

bool DrivenPath::advance(double h, double t1) {
  const Index half = mechanism_.states() / 2;
  y_hat_.head(half) = state_.y.head(half) + h * state_.y.tail(half) + (0.5 * h * h) * state_.a;
  y_hat_.tail(half) = state_.y.tail(half) + h * state_.a;
  if (!projector_->settle(t1, state_.angles, y_hat_, y_next_)) return false;
  if (!keeps_branch(h)) return false;
  double violation = 0;
  projector_->position_violation(t1, state_.angles, y_next_, &violation);
  if (violation > kViolation) return false;
  state_.t = t1;
  state_.a = (y_next_.tail(half) - state_.y.tail(half)) / h;
  state_.y = y_next_;
  const MechanismData& d = mechanism_.data();
  for (std::size_t k = 0; k < d.angles.size(); ++k) {
    const JointAngle& a = d.angles[k];
    double& angle = state_.angles(static_cast<Index>(k));
    angle = a.value_near(angle, body_at(state_.y, a.body1).frame, body_at(state_.y, a.body2).frame);
  }
  ++steps_;
  return true;
}

bool DrivenPath::go_to(double t1, double shortest, long most) {
  double h = t1 - state_.t;
  const long last_step = steps_ + most;
  while (state_.t < t1) {
    if (steps_ >= last_step) return false;
    const double left = t1 - state_.t;
    h = std::min({h, left, step_limit()});
    const bool last = h >= left * (1 - 1e-12);
    if (advance(h, last ? t1 : state_.t + h)) {
      h *= 2;
    } else {
      h /= 2;
      if (h < shortest) return false;
    }
  }
  return true;
}

// Each body's correction must be small against h v, and so must the difference from the trapezoidal rule. Near a dead
// point h^2 a/2 may reach the other branch, and the correction alone is small there. On that branch the velocity has
// the opposite sign, so the trapezoidal rule disagrees.
bool DrivenPath::keeps_branch(double h) const {
  const Index half = mechanism_.states() / 2;
  const auto keeps = [&](Index at, Index size) {
    const auto v0 = state_.y.segment(half + at, size), v1 = y_next_.segment(half + at, size);
    const double allowed =
        std::max(kSmallCorrection,
                 kRelativeCorrection * h * std::max(v0.lpNorm<Eigen::Infinity>(), v1.lpNorm<Eigen::Infinity>()));
    const auto q0 = state_.y.segment(at, size), q1 = y_next_.segment(at, size);
    return (q1 - y_hat_.segment(at, size)).lpNorm<Eigen::Infinity>() <= allowed &&
           (q1 - q0 - 0.5 * h * (v0 + v1)).lpNorm<Eigen::Infinity>() <= allowed;
  };
  const StateLayout layout{mechanism_.bodies()};
  for (int i = 1; i <= layout.n; ++i) {
    if (!keeps(layout.q(i), 3) || !keeps(layout.p(i), 4)) return false;
  }
  return true;
}

}  // namespace mbsopt
