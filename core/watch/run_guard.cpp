#include "core/watch/run_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/body/state_layout.hpp"
#include "core/force/forces.hpp"
#include "core/run/run_ends.hpp"
#include "core/sensor/body_at.hpp"
#include "core/start/driven_path.hpp"

namespace mbsopt {
namespace {

constexpr double kUnmetAcceleration = 1e-3;                 // relative, of accelerations
constexpr double kGrown = 0.5;                              // of the total energy
constexpr double kNoticeableChange = 1e-3;                  // of the natural energy: smaller changes are ignored
constexpr double kFastest = 299792458, kFastestTurn = 1e6;  // light [m/s]; ten times the fastest turbine [rad/s]
constexpr double kGrowth = 1e3;                             // of the largest speed at the start

// The natural size of the energy of a motion: of weights at their height, or at the radius of gyration of a body, and
// of springs. It is a scale for runs that begin at rest at zero potential.
double natural_energy(const MechanismData& d, const Eigen::VectorXd& y) {
  const StateLayout layout{d.n};
  double sum = 0;
  for (std::size_t k = 1; k < d.bodies.size(); ++k) {
    const double mass = d.bodies[k].mass, gyration = std::sqrt(mass * std::max(d.bodies[k].J.trace(), 0.0));  // m |i|
    sum += d.gravity.norm() * (mass * y.segment<3>(layout.q(k)).norm() + gyration);
  }
  d.forces->for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    sum += f.natural_energy(body_at(y, i), body_at(y, j));
  });
  return sum;
}

Eigen::Vector2d speeds(const Eigen::VectorXd& y, int i, int n) {
  const auto v = y.segment<7>(StateLayout{n}.v(i));
  return {v.head<3>().stableNorm(), 2 * v.tail<4>().stableNorm()};  // |omega| = 2 |pdot|
}

double size_of(const Energy& e) { return e.kinetic + std::abs(e.potential); }

}  // namespace

RunGuard::RunGuard(const MechanismData& data, Projector& projector, const SimulationSettings& settings,
                   SimulationStatistics& statistics, bool objects)
    : data_(data),
      projector_(projector),
      settings_(settings),
      statistics_(statistics),
      objects_(objects),
      conserves_energy_(conserves_energy(data)),
      law_jumps_(data) {}

std::string RunGuard::begin(const StatePoint& start) {
  const Eigen::VectorXd& y = start.y;
  before_t_ = last_t_ = start.t;
  const Energy e = energy(data_, y, start.angles);
  statistics_.energy_initial = statistics_.energy_final = e.kinetic + e.potential;
  if (!objects_) return {};
  energy_largest_ = size_of(e);
  bounds_ = {kFastest, kFastestTurn};
  for (int i = 1; i <= data_.n; ++i) bounds_ = bounds_.cwiseMax(kGrowth * speeds(y, i, data_.n));
  energy_natural_ = conserves_energy_ ? natural_energy(data_, y) : 0.0;
  const std::string words = about_turns(start);
  return words.empty() ? past_half_turn(data_, y, start.t, y) : words;
}

std::string RunGuard::about_turns(const StatePoint& start) const {
  for (int i = 1; i <= data_.n; ++i) {
    const double omega = speeds(start.y, i, data_.n)(1);
    const long most = settings_.integrator.max_steps;
    if (!(omega * (settings_.end_time - start.t) > std::numbers::pi * static_cast<double>(most))) continue;
    const std::string& body = data_.body_names[static_cast<std::size_t>(i)];
    if (!std::isfinite(omega))
      return fmt::format("body '{}' has an angular velocity at the start that is too large for a number", body);
    return fmt::format(
        "body '{}' turns at {:.3g} rad/s at the start. Each half turn takes a step at least, and until t = {:.6g} s "
        "there are more of them than simulation.integrator.max_steps, {}. Is the angular velocity in rad/s, and the "
        "end in s?",
        body, omega, settings_.end_time, most);
  }
  return {};
}

std::string RunGuard::about_energy(double t, const Energy& energy) {
  SimulationStatistics& s = statistics_;
  energy_largest_ = std::max(energy_largest_, size_of(energy));
  if (s.energy_drift > kNoticeableChange * energy_natural_) s.relative_energy_drift = s.energy_drift / energy_largest_;
  const double now = s.energy_final, grown = now - s.energy_initial;
  if (!(grown > kGrown * energy_largest_ && grown > kNoticeableChange * energy_natural_)) return {};
  return fmt::format(
      "the energy has grown from {:.3g} J to {:.3g} J at t = {:.6g} s, although nothing does work: the steps are too "
      "large for this motion. Use a smaller simulation.integrator.step, or an adaptive integrator with smaller rtol "
      "and atol",
      s.energy_initial, now, t);
}

std::string RunGuard::about_speed(double t, const Eigen::VectorXd& y) const {
  for (int i = 1; i <= data_.n; ++i) {
    const auto v = y.segment<7>(StateLayout{data_.n}.v(i));
    const double speed2 = v.head<3>().squaredNorm(), turn2 = 4 * v.tail<4>().squaredNorm();
    if (speed2 <= bounds_(0) * bounds_(0) && turn2 <= bounds_(1) * bounds_(1)) continue;
    const Eigen::Vector2d now = speeds(y, i, data_.n);
    return fmt::format(
        "body '{}' {} at t = {:.6g} s: the motion grows beyond all bounds. Look for a negative damping or stiffness, a "
        "law of a drive or force that grows without end, or a unit; where steps are fixed, use a smaller step",
        data_.body_names[static_cast<std::size_t>(i)],
        now(1) > bounds_(1) ? fmt::format("turns at {:.3g} rad/s", now(1)) : fmt::format("moves at {:.3g} m/s", now(0)),
        t);
  }
  return {};
}

std::string RunGuard::look_at(const SeenStep& step) {
  const auto& [t, y, angles, motion, ydot] = step.to;
  double relative = 0;
  const double position = projector_.position_violation(t, angles, y, &relative);
  const Energy e = energy(data_, y, angles);
  note_state(position, relative, projector_.velocity_violation(t, y), e, statistics_);
  if (!objects_) return {};
  std::string words = law_jumps_.between(before_t_, t);  // from one step before: this one may begin at a jump
  before_t_ = last_t_;
  last_t_ = t;
  if (words.empty() && step.worst_residual > kUnmetAcceleration) {
    words = fmt::format(
        "the accelerations of the constraints are met to {:.1e} only at t = {:.6g} s: the linkage locks there (a "
        "drive, or the motion itself, asks for more than it reaches), or its position is singular. If it should go "
        "on, look at lengths and laws; if masses differ by many orders, use a larger simulation.formulation.alpha "
        "(relative; 1e8 is the default) or more iterations",
        step.worst_residual, t);
  }
  if (words.empty() && conserves_energy_) words = about_energy(t, e);
  if (words.empty()) words = about_speed(t, y);
  if (words.empty()) words = past_half_turn(data_, step.from.y, t, y);
  return words;
}

}  // namespace mbsopt
