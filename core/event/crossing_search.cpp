#include "core/event/crossing_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/body/hermite.hpp"

namespace mbsopt {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kParts[] = {0, 0.02, 0.25, 0.5, 0.75, 0.98, 1};  // of a step: short returns lie next to its ends
constexpr double kRounding = 8;        // times the rounding of each number that a function reads
constexpr double kOfTolerance = 1e-3;  // what an instant may add to the error of a step
constexpr double kLeastPart = 1e-13;   // of a step: its instants have digits for it
constexpr double kSlopePart = 1e-4;    // of a step: the root of the digits left by differences
constexpr double kNearStart = 0.125;   // the next part to look at between a start at zero and a point beyond
constexpr double kResidual = 4;        // times the value at an event: the next step begins so far on either side
constexpr double kJumped = 1e-6;       // of a value: what the motion changes at an instant is less
constexpr int kMostTries = 12;         // sizes for one event; Newton's method takes three
constexpr int kMostBisections = 60;
constexpr int kMostParabolas = 6;

}  // namespace

CrossingSearch::CrossingSearch(Switches& switches, const SimulationSettings& settings, MotionSource* motion)
    : switches_(switches),
      motion_(motion),
      least_part_(settings.integrator.step ? kLeastPart
                                           : std::max(kLeastPart, kOfTolerance * settings.integrator.rtol)),
      rtol_(settings.integrator.step ? 0 : settings.integrator.rtol),
      watched_(switches.count()) {
  const Eigen::Index states = switches.mechanism().states();
  y_.setZero(states);
  y_bar_.setZero(states);
  rho_bar_.setZero(switches.mechanism().parameters());
}

std::optional<std::size_t> CrossingSearch::begin(const StatePoint& start) {
  std::optional<std::size_t> passed;
  for (std::size_t k = 0; k < watched_.size(); ++k) {
    Watched& w = watched_[k];
    w = {};
    set_sizes(k, start);
    w.start = switches_.value(k, {start.t, start.y, start.angles, motion_});
    switches_.hold(k, switches_.is_limit(k) ? 1 : std::isnan(w.start) ? 0 : w.start < 0 ? -1 : 1);
    set_noise(w, start.y);
    if (switches_.is_limit(k) && w.start < -w.noise) passed = k;
  }
  target_ = {};
  root_ = {};
  return passed;
}

// The sums of the derivatives, whose products with the sizes of positions and velocities bound the rounding.
void CrossingSearch::set_sizes(std::size_t k, const StatePoint& at) {
  y_bar_.setZero();
  rho_bar_.setZero();
  double t_bar = 0;
  switches_.add_gradient(k, {at.t, at.y, at.angles, motion_}, 1, y_bar_, rho_bar_, t_bar);
  const Eigen::Index half = y_bar_.size() / 2;
  const Eigen::VectorXd& rho = switches_.mechanism().rho();
  Watched& w = watched_[k];
  w.of_positions = std::max(w.of_positions, y_bar_.head(half).lpNorm<1>());
  w.of_velocities = std::max(w.of_velocities, y_bar_.tail(half).lpNorm<1>());
  w.of_others = std::max(w.of_others, rho_bar_.cwiseAbs().dot(rho.cwiseAbs()) + std::abs(t_bar * at.t));
}

double CrossingSearch::value_at(const Step& step, std::size_t k, double part) {
  if (part == 1) return switches_.side(k) * switches_.value(k, {step.t1, step.y1, step.angles0, motion_});
  hermite(step.y0, step.y1, step.h, part, y_);
  return switches_.side(k) * switches_.value(k, {step.t + part * step.h, y_, step.angles0, motion_});
}

void CrossingSearch::set_noise(Watched& w, const Eigen::VectorXd& y) {
  const Eigen::Index half = y.size() / 2;
  w.noise = kRounding * kEpsilon *
            (w.of_positions * y.head(half).lpNorm<Eigen::Infinity>() +
             w.of_velocities * y.tail(half).lpNorm<Eigen::Infinity>() + w.of_others);
}

void CrossingSearch::evaluate(const Step& step) {
  for (std::size_t k = 0; k < watched_.size(); ++k) {
    Watched& w = watched_[k];
    w.values[0] = switches_.side(k) * w.start;
    set_noise(w, step.y1);
    if (w.changed == step.t) w.noise += kResidual * std::abs(w.start);
  }
  for (int p = 1; p < kPoints; ++p) {
    const bool at_end = p + 1 == kPoints;
    const double t = at_end ? step.t1 : step.t + kParts[p] * step.h;
    if (!at_end) hermite(step.y0, step.y1, step.h, kParts[p], y_);
    const StatePoint at{t, at_end ? step.y1 : y_, step.angles0, motion_};
    for (std::size_t k = 0; k < watched_.size(); ++k) {
      double* const v = watched_[k].values;
      const bool costs_much = switches_.reads_motion(k) && !at_end && 2 * p + 1 != kPoints;
      v[p] = switches_.side(k) == 0 ? 0 : costs_much ? v[p - 1] : switches_.side(k) * switches_.value(k, at);
    }
  }
}

// The part of the step at which the switch changes its sign between two parts, by the rule of Illinois.
double CrossingSearch::zero_between(const Step& step, std::size_t k, double from, double f_from, double to,
                                    double f_to) {
  int kept = 0;  // the end that stayed last: -1 the first one, 1 the second
  for (int i = 0; i < kMostBisections && to - from > kEpsilon; ++i) {
    const double part = std::clamp(to - f_to * (to - from) / (f_to - f_from), from, to);
    const double f = value_at(step, k, part);
    if (f == 0 || part == from || part == to) return part;
    if (f < 0) {
      to = part;
      f_to = f;
      if (kept == -1) f_from *= 0.5;
      kept = -1;
    } else {
      from = part;
      f_from = f;
      if (kept == 1) f_to *= 0.5;
      kept = 1;
    }
  }
  return to;
}

std::optional<double> CrossingSearch::first_zero(const Step& step, std::size_t k) {
  const Watched& w = watched_[k];
  for (int p = 1; p < kPoints; ++p) {
    double from = kParts[p - 1], f_from = w.values[p - 1], to = kParts[p], f_to = w.values[p];
    if (!(f_to < -w.noise)) {
      // A lowest point on this side may hide two zeros.
      if (p + 1 == kPoints || !(f_to <= f_from && f_to <= w.values[p + 1])) continue;
      const std::optional<double> beyond = lowest_below(step, k, p);
      if (!beyond) continue;
      to = *beyond;
      f_to = value_at(step, k, to);
      if (to < kParts[p]) return zero_between(step, k, from, f_from, to, f_to);
      from = kParts[p];
      f_from = w.values[p];
    }
    // From a start at zero it may first rise.
    while (!(f_from > w.noise) && from == 0 && to * step.h > shortest(step)) {
      const double part = kNearStart * to, f = value_at(step, k, part);
      (f > w.noise ? from : to) = part;
      (f > w.noise ? f_from : f_to) = f;
    }
    if (!(f_from > w.noise)) return from;
    return zero_between(step, k, from, f_from, to, f_to);
  }
  return {};
}

// A part near point p at which the switch has changed its sign, by parabolas through three points.
std::optional<double> CrossingSearch::lowest_below(const Step& step, std::size_t k, int p) {
  const Watched& w = watched_[k];
  double x[] = {kParts[p - 1], kParts[p], kParts[p + 1]}, f[] = {w.values[p - 1], w.values[p], w.values[p + 1]};
  for (int i = 0; i < kMostParabolas; ++i) {
    const double d0 = (f[1] - f[0]) / (x[1] - x[0]), d1 = (f[2] - f[1]) / (x[2] - x[1]);
    const double curvature = (d1 - d0) / (x[2] - x[0]);
    if (!(curvature > 0)) return {};
    const double at = 0.5 * (x[0] + x[1] - d0 / curvature);
    if (!(at > x[0] && at < x[2]) || at == x[1]) return {};
    const double lowest = f[0] + d0 * (at - x[0]) + curvature * (at - x[0]) * (at - x[1]);
    if (lowest > 0.5 * f[1]) return {};  // far from zero
    const double value = value_at(step, k, at);
    if (value < -w.noise) return at;
    const int replaced = at < x[1] ? (value < f[1] ? 2 : 0) : (value < f[1] ? 0 : 2);
    if (value < f[1]) {
      x[replaced] = x[1];
      f[replaced] = f[1];
      x[1] = at;
      f[1] = value;
    } else {
      x[replaced] = at;
      f[replaced] = value;
    }
  }
  return {};
}

double CrossingSearch::shortest(const Step& step) const {
  return kLeastPart * step.h + kRounding * kEpsilon * std::max(std::abs(step.t), std::abs(step.t1));
}

// The duration after the end of the step in which the switch comes to zero; negative: it has passed it.
double CrossingSearch::left(const Step& step, std::size_t k) {
  const double end = watched_[k].values[kPoints - 1];
  double slope = (end - value_at(step, k, 1 - kSlopePart)) / (kSlopePart * step.h);
  if (target_.k == k && target_.tries > 1 && step.h != target_.last_size) {
    const double secant = (end - target_.last_value) / (step.h - target_.last_size);
    if (secant < 0) slope = secant;
  }
  return slope < 0 ? -end / slope : INFINITY;
}

double CrossingSearch::with_derivatives(double t, double h, double error) {
  if (std::isinf(root_.since)) return error;
  if (t == root_.since) root_.T = time_of_state(h, error);
  return error * std::max(1.0, root_.T / (t + h - root_.since));
}

// Errors as h^(n+2), in tolerances of the state.
double CrossingSearch::time_of_state(double h, double error) const {
  return h * std::pow(std::max(error * rtol_, kEpsilon), -1 / (root_.n + 2));
}

// Returns whether a step up to the end of contact is too long for the derivatives.
bool CrossingSearch::is_too_long_before_end(const Step& step, std::size_t of, double error) {
  const double n = switches_.root(of);
  if (!(rtol_ > 0) || std::isinf(n)) return false;
  root_.n = n;
  if (root_.T == 0) root_.T = time_of_state(step.h, error);
  if (!(error * root_.T > step.h)) return false;
  root_.until = step.t1;
  root_.last = step.h;
  root_.error = error;
  target_ = {};
  verdict_.size = 0.5 * step.h;
  return true;
}

const CrossingSearch::Verdict& CrossingSearch::look_at(const Step& step, double error) {
  verdict_ = {};
  changes_.clear();
  if (const double ahead = root_.until - step.t; ahead > 0 && step.h > 0.5 * ahead) {
    const double expected = root_.error * std::pow(ahead / root_.last, root_.n + 2);
    if (expected * root_.T > ahead) {
      verdict_.size = 0.5 * ahead;
      return verdict_;
    }
  }
  if (step.t != target_.t) {
    target_ = {};
    target_.t = step.t;
  }
  evaluate(step);
  double first = INFINITY;
  std::size_t of = 0;
  for (std::size_t k = 0; k < watched_.size(); ++k) {
    if (switches_.side(k) == 0) continue;
    const std::optional<double> zero = first_zero(step, k);
    if (!zero || !(*zero < first)) continue;
    first = *zero;
    of = k;
  }
  const bool passed = first < INFINITY;
  if (!passed && target_.tries == 0) return verdict_;
  if (passed && first * step.h <= shortest(step)) {
    if (switches_.is_limit(of)) {
      verdict_.rests = of;
      return verdict_;
    }
    Watched& w = watched_[of];
    verdict_.at_start.push_back({0, of, switches_.side(of), w.changed == step.t ? 0 : -switches_.side(of)});
    w.changed = step.t;
    target_ = {};
    return verdict_;
  }
  if (!passed) of = target_.k;
  if (target_.tries == 0 || of != target_.k) {
    const double beyond = passed ? step.h : target_.beyond;
    target_ = {step.t, of, beyond, step.h, watched_[of].values[kPoints - 1], 0};
  }
  if (passed) target_.beyond = std::min(target_.beyond, step.h);
  const double distance = passed && target_.tries == 0 ? (first - 1) * step.h : left(step, of);
  const double near = least_part_ * step.h + kRounding * kEpsilon * std::abs(step.t1);
  if (std::abs(distance) <= near || (target_.tries >= kMostTries && passed)) {
    if (is_too_long_before_end(step, of, error)) return verdict_;
    set_changes(step, of, near);
    return verdict_;
  }
  if (target_.tries >= kMostTries) {
    target_ = {};
    return verdict_;
  }
  double size = step.h + distance;
  if (passed && !(size > 0 && size < step.h)) size = first * step.h;
  if (!passed && !(size < target_.beyond)) size = 0.5 * (step.h + target_.beyond);
  target_.last_size = step.h;
  target_.last_value = watched_[of].values[kPoints - 1];
  ++target_.tries;
  verdict_.size = size;
  return verdict_;
}

// All switches that are zero at the end and about to change.
void CrossingSearch::set_changes(const Step& step, std::size_t of, double near) {
  for (std::size_t k = 0; k < watched_.size(); ++k) {
    Watched& w = watched_[k];
    if (switches_.side(k) == 0) continue;
    const double end = w.values[kPoints - 1], change = end - value_at(step, k, 1 - kSlopePart);
    const bool is_zero = std::abs(end) <= w.noise + 2 * near / (kSlopePart * step.h) * std::abs(change);
    if (k != of && !(is_zero && change < -w.noise)) continue;
    changes_.push_back({0, k, switches_.side(k), switches_.is_limit(k) ? 1 : -switches_.side(k)});
    w.changed = step.t1;
  }
}

const std::vector<SwitchEvent>& CrossingSearch::advance(const Step& step, double next) {
  for (std::size_t k = 0; k < watched_.size(); ++k) {
    Watched& w = watched_[k];
    w.start = switches_.side(k) * w.values[kPoints - 1];
    if (w.changed == step.t1) set_sizes(k, {step.t1, step.y1, step.angles0});
    if (next == step.t1 || switches_.side(k) == 0 || !switches_.is_of_time(k)) continue;
    // The next step begins after a given instant.
    if (w.changed == step.t1 || !(switches_.side(k) * switches_.value(k, {next, step.y1, step.angles0}) < 0)) continue;
    changes_.push_back({0, k, switches_.side(k), -switches_.side(k)});
    w.changed = next;
  }
  target_ = {};
  return changes_;
}

std::optional<SwitchEvent> CrossingSearch::driven(const StatePoint& at) {
  for (std::size_t k = 0; k < watched_.size(); ++k) {
    Watched& w = watched_[k];
    const int side = switches_.side(k);
    if (side == 0 || switches_.is_limit(k) || w.changed == at.t) continue;
    if (!(side * switches_.value(k, {at.t, at.y, at.angles, motion_}) < -kJumped * std::abs(w.start) - w.noise))
      continue;
    w.changed = at.t;
    return SwitchEvent{0, k, side, -side};
  }
  return std::nullopt;
}

void CrossingSearch::restart(const StatePoint& at) {
  for (std::size_t k = 0; k < watched_.size(); ++k)
    watched_[k].start = switches_.value(k, {at.t, at.y, at.angles, motion_});
}

bool CrossingSearch::ends_at_time() const {
  return std::ranges::any_of(changes_, [&](const SwitchEvent& change) { return switches_.is_of_time(change.of); });
}

void CrossingSearch::changed(const SwitchEvent& event, double t) {
  const double n = switches_.root(event.of);
  const bool begins = rtol_ > 0 && std::isfinite(n);
  if (!begins && event.of != root_.of) return;  // contact goes on
  root_ = {};
  root_.of = event.of;
  if (!begins) return;
  root_.since = t;
  root_.n = n;
}

}  // namespace mbsopt
