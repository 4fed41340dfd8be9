#include "core/start/driven_path.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/body/state_layout.hpp"
#include "core/dynamics/planar_bodies.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/followed_angles.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;

constexpr double kLargestTurn = 0.1;         // of an Euler parameter in one step
constexpr double kRelativeCorrection = 0.2;  // of the predictor, against h v
constexpr double kSmallCorrection = 1e-6;    // always accepted
constexpr double kViolation = 1e-9;          // of the mechanism's length, or of 1
// Half of a singular window, relative to the time in which the regularity falls from its largest value to zero.
// Rounding grows there by 20^4, and 8 nodes continue a wave of that time to 1e-10.
constexpr double kHalf = 0.05;
constexpr int kHalvings = 4;  // of it, for motions with faster waves: rounding then grows by 160^4
// The error of states that are continued: the largest violation of the constraints or a part of the roughness of y. The
// width is halved until the error is as good as exact. One that is larger, as of a spline through data, is accepted.
constexpr double kExact = 1e-10, kAccepted = 1e-7, kPartOfRoughness = 1e-3;
constexpr double kNotZero = 0.1;  // of the rise over half a window: a least regularity above it is not zero

constexpr double kAlmostHalfTurn = 3.13;  // [rad]: nearer, the axis of the rotation may reverse within two hundredths

Vector3d rotation_vector(const Bushing& b, const Eigen::VectorXd& y) {
  const Eigen::AngleAxisd turn(Matrix3d(body_at(y, b.body1).A.transpose() * body_at(y, b.body2).A * b.R0.transpose()));
  return turn.angle() * turn.axis();
}

// No equation holds the rounding of an acceleration out of the plane, which the predictor would pass on for ever.
void keep_in_plane(const MechanismData& d, Eigen::VectorXd& a) {
  const PlanarBodies plane(*d.planar);
  for (int i = 1; i <= d.n; ++i) {
    const Index first = StateLayout{d.n}.q(i);
    const Plane r = plane.vector(a, first), P = plane.turn(at(i), a, first + 3);
    a.segment<7>(first).setZero();
    plane.add_vector(r, first, a);
    plane.add_turn(at(i), P, first + 3, a);
  }
}

}  // namespace

// Between two steps a rotation vector reverses through zero or, if zero is farther, through half a turn.
std::string past_half_turn(const MechanismData& d, const Eigen::VectorXd& before, double t, const Eigen::VectorXd& y) {
  for (const Bushing& b : d.forces->of<Bushing>()) {
    if (b.Kt.isZero(0) && b.Ct.isZero(0)) continue;
    const Vector3d from = rotation_vector(b, before), to = rotation_vector(b, y);
    const double angle = to.norm();
    if (angle < kAlmostHalfTurn && !(to.dot(from) < 0 && angle + from.norm() > std::numbers::pi)) continue;
    return fmt::format(
        "forces[{}], the bushing between '{}' and '{}', is turned by {:.4g} rad at t = {:.6g} s: at half a turn its "
        "torque jumps from one side to the other. Keep it below (a stop, stiffer or damped rubber, a slower start), or "
        "take a joint with an rsda, which counts turns",
        b.force, d.body_names[at(b.body1)], d.body_names[at(b.body2)], angle, t);
  }
  return {};
}

DrivenPath::DrivenPath(const Mechanism& mechanism, Model model)
    : mechanism_(mechanism),
      planar_(model == Model::planar),
      projector_(make_projector(mechanism, Projection::position_velocity, model, Free::nothing)) {
  y_hat_.setZero(mechanism.states());
  y_next_.setZero(mechanism.states());
}

void DrivenPath::start(double t, double end, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  state_.t = first_ = t;
  last_ = end;
  state_.y = y;
  state_.angles = angles;
  state_.a.setZero(mechanism_.states() / 2);
  state_.regularity = projector_->settle(t, angles, y, y_next_) ? regularity() : 0;
  most_regular_ = state_.regularity;
  windows_.clear();
  before_ = state_;  // looks ahead: the run may start next to a singular position
  const double h = std::min(step_limit(), (last_ - first_) / SingularWindow::kNodes);
  if (step(h, t + h)) {
    most_regular_ = std::max(most_regular_, state_.regularity);
    look_for_window();
  }
  const SingularWindow* const w = window_at(t);
  state_ = w ? w->state_at(t) : before_;
}

double DrivenPath::step_limit() const {
  double fastest = 0;
  const StateLayout layout{mechanism_.bodies()};
  for (int i = 1; i <= layout.n; ++i) {
    fastest = std::max(fastest, state_.y.segment<4>(layout.pdot(i)).lpNorm<Eigen::Infinity>());
  }
  return fastest > 0 ? kLargestTurn / fastest : INFINITY;
}

const SingularWindow* DrivenPath::window_at(double t) const {
  const auto next = std::ranges::upper_bound(windows_, t, {}, &SingularWindow::t);
  if (next != windows_.end() && next->contains(t)) return &*next;
  return next != windows_.begin() && std::prev(next)->contains(t) ? &*std::prev(next) : nullptr;
}

bool DrivenPath::advance(double h, double t1) {
  if (const SingularWindow* const w = window_at(t1)) return state_ = w->state_at(t1), true;
  if (const SingularWindow* const w = window_at(state_.t)) {  // goes on from the last node before t1
    for (const DrivenState& node : w->nodes)
      if (node.t <= t1) state_ = node;
    if (state_.t == t1) return true;
    h = t1 - state_.t;
  }
  before_ = state_;
  if (!step(h, t1)) return false;
  objection_ = watch_ ? watch_(before_, state_) : std::string();
  if (!objection_.empty()) return state_ = before_, false;
  most_regular_ = std::max(most_regular_, state_.regularity);
  look_for_window();
  if (const SingularWindow* const w = window_at(t1)) state_ = w->state_at(t1);
  return true;
}

// The response grows as 1/d^3 (projection.hpp).
double DrivenPath::regularity() {
  projector_->response(response_);
  return 1 / std::cbrt(std::max(response_.norm(), 1e-300));
}

bool DrivenPath::step(double h, double t1) {
  const Index half = mechanism_.states() / 2;
  y_hat_.head(half) = state_.y.head(half) + h * state_.y.tail(half) + (0.5 * h * h) * state_.a;
  y_hat_.tail(half) = state_.y.tail(half) + h * state_.a;
  if (!projector_->settle(t1, state_.angles, y_hat_, y_next_)) return false;
  if (!keeps_branch(h)) return false;
  double violation = 0;
  projector_->position_violation(t1, state_.angles, y_next_, &violation);
  if (violation > kViolation) return false;
  state_.regularity = regularity();
  state_.t = t1;
  state_.a = (y_next_.tail(half) - state_.y.tail(half)) / h;
  state_.y = y_next_;
  if (planar_) keep_in_plane(mechanism_.data(), state_.a);
  continue_angles(mechanism_.data(), state_.y, state_.angles);
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

// Looks for an instant without regularity near the lower end of the last step. `base` is its other end.
void DrivenPath::look_for_window() {
  if (std::min(before_.regularity, state_.regularity) >= kHalf * most_regular_) return;
  const DrivenState here = state_;
  const bool falls = here.regularity < before_.regularity;
  const DrivenState base = falls ? before_ : here;
  const double low = falls ? here.t : before_.t;
  SingularWindow w{low, 0, {}};    // without nodes it prevents another search
  constexpr double kLookedAt = 3;  // times the half width of a window: so near to it no other is searched
  for (const SingularWindow& known : windows_)
    if (std::abs(w.t - known.t) < kLookedAt * known.half) return;
  const double slope = std::abs((here.regularity - before_.regularity) / (here.t - before_.t));
  const double whole = std::min(kHalf * most_regular_ / slope, (last_ - first_) / SingularWindow::kNodes);
  w.half = whole;
  double error = kAccepted;
  for (int k = 0; k < kHalvings && error > kExact; ++k) {
    SingularWindow tried{w.nodes.empty() ? low : w.t, std::ldexp(whole, -k), {}};
    tried.t = locate(tried.t, tried.half, base);
    for (const double spacing : {0.1 * tried.half, 0.01 * tried.half})
      if (const double finer = locate(tried.t, spacing, base); std::abs(finer - tried.t) < spacing) tried.t = finer;
    if (const double now = fill(tried, base); now < error) {
      error = now;
      w = std::move(tried);
    }
  }
  state_ = here;
  windows_.insert(std::ranges::upper_bound(windows_, w.t, {}, &SingularWindow::t), std::move(w));
}

// The root t* of the regularity, which rises linearly on both sides: the vertex of the parabola through three squares.
// NaN if the least value is not zero.
double DrivenPath::locate(double near, double spacing, const DrivenState& base) {
  const double middle = std::clamp(near, first_ + spacing, last_ - spacing);
  if (!(std::abs(near - middle) <= spacing)) return near;  // beyond the run, or not found
  double square[3];
  for (int k = 0; k < 3; ++k) {
    state_ = base;
    const double t = middle + (k - 1) * spacing;
    const double r = t == base.t || step(t - base.t, t) ? state_.regularity : 0;
    square[k] = r * r;
  }
  const double bend = square[0] - 2 * square[1] + square[2], rise = (square[2] - square[0]) / 2;
  const double least = square[1] - rise * rise / (2 * bend);
  if (!(bend > 0) || std::abs(rise) > 2 * bend || least > kNotZero * bend / 2) return NAN;
  return middle - spacing * rise / bend;
}

// Solves the states at the nodes: those on the side of `base` from it outwards, then the others after one step past t*.
// Returns the error of states between them, which is infinite if a step is refused.
double DrivenPath::fill(SingularWindow& w, const DrivenState& base) {
  std::vector<double> times;
  for (int k = 1; times.size() < SingularWindow::kNodes && k <= SingularWindow::kNodes; ++k)
    for (const double t : {w.t - k * w.half, w.t + k * w.half})
      if (t >= first_ && t <= last_ && times.size() < SingularWindow::kNodes) times.push_back(t);
  if (times.size() < SingularWindow::kNodes) return INFINITY;
  const auto others =
      std::stable_partition(times.begin(), times.end(), [&](double t) { return (t < w.t) == (base.t < w.t); });
  state_ = base;
  for (auto t = times.begin(); t != times.end(); ++t) {
    if (t == others && t != times.begin()) state_ = w.nodes.front();
    if (!step(*t - state_.t, *t)) return INFINITY;
    w.nodes.push_back(state_);
  }
  std::ranges::sort(w.nodes, {}, &DrivenState::t);
  const Index half = mechanism_.states() / 2;
  Eigen::MatrixXd y(2 * half, SingularWindow::kNodes);
  for (Index k = 0; k < y.cols(); ++k) y.col(k) = w.nodes[static_cast<std::size_t>(k)].y;
  double error =
      kPartOfRoughness * std::max(w.roughness(y.topRows(half)).maxCoeff(), w.roughness(y.bottomRows(half)).maxCoeff());
  for (const double part : {-0.5, 0.0, 0.5}) {
    const DrivenState s = w.state_at(w.t + part * w.half);
    double violation = 0;
    projector_->position_violation(s.t, s.angles, s.y, &violation);
    error = std::max(error, violation);
  }
  return error;
}

// Each body's correction must be small against h v, and so must the difference from the trapezoidal rule. Near a dead
// point h^2 a/2 may reach the other branch, and the correction alone is small there. On that branch the velocity has
// the opposite sign, so the trapezoidal rule disagrees.
bool DrivenPath::keeps_branch(double h) const {
  const Index half = mechanism_.states() / 2;
  const auto keeps = [&](Index at, Index size) {
    const auto v0 = state_.y.segment(half + at, size), v1 = y_next_.segment(half + at, size);
    const double allowed =
        std::max(kSmallCorrection, kRelativeCorrection * std::abs(h) *
                                       std::max(v0.lpNorm<Eigen::Infinity>(), v1.lpNorm<Eigen::Infinity>()));
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
